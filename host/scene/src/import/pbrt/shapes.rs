//! Shapes of pbrt.

use super::super::assembly::{Form, Item, Part, Value, oriented, surface_of_revolution, turned_inside_out};
use super::super::{gzip, ply};
use super::parameters::Parameters;
use super::tokens::At;
use super::{Reader, SceneError, shown};
use crate::description::{Material, Mesh, Surface};
use glam::{DAffine3, DVec3};
use std::f64::consts::TAU;

/// Rows of a part of a sphere.
const ROWS: u32 = 64;

impl Reader<'_> {
    /// Adds a shape to the object that is being defined, or to the world.
    pub fn shape(&mut self, kind: &str, parameters: &Parameters, at: At) -> Result<(), SceneError> {
        let what = format!("Shape \"{}\"", shown(kind));
        let Some(material) = self.material(parameters, at)? else { return Ok(()) };
        let items = match kind {
            "sphere" | "disk" | "cylinder" => self.quadric(kind, parameters, material, at)?,
            "trianglemesh" | "loopsubdiv" => {
                if kind == "loopsubdiv" {
                    self.unsupported(at, &what, "drawn without subdivision");
                    parameters.ignore(&["levels", "scheme"]);
                }
                let mesh = self.triangles(parameters, at)?;
                self.mesh(mesh, material, at)?
            }
            "bilinearmesh" => {
                let mesh = self.patches(parameters, at)?;
                self.mesh(mesh, material, at)?
            }
            "plymesh" => self.ply(parameters, material, at)?,
            _ => {
                self.unsupported(at, &what, "this shape is left out");
                return Ok(());
            }
        };
        self.report_unused(parameters, &what);
        let site = self.tokens.site(at, "Shape");
        for item in items {
            let item = Item { transform: self.state.map * item.transform, ..item };
            match &mut self.object {
                Some((_, items)) => {
                    self.assembly.budget.take(size_of::<Item>() as u64, &site)?;
                    items.push(item);
                }
                None => self.assembly.place(&item, &site)?,
            }
        }
        Ok(())
    }

    /// Returns the index of the current material with light, opacity and medium; `None` for a
    /// surface that nothing shows.
    fn material(&mut self, parameters: &Parameters, at: At) -> Result<Option<usize>, SceneError> {
        let mut light = self.state.light;
        if light.is_some() && self.object.is_some() {
            self.unsupported(at, "AreaLightSource within an object", "the shapes do not shine, as in pbrt");
            light = None;
        }
        let alpha = self.value(parameters, "alpha", 1.0, true)?;
        let alpha = match self.alphas.iter().rev().take(64).position(|known| *known == alpha) {
            _ if alpha == Value::number(1.0) => 0,
            Some(back) => self.alphas.len() - back,
            None => {
                self.assembly.budget.take(size_of::<Value>() as u64, &self.tokens.site(at, "Shape"))?;
                self.alphas.push(alpha);
                self.alphas.len()
            }
        };
        let (inside, outside) = (self.state.inside.clone(), self.state.outside.clone());
        let inside = self.medium(&inside, at)?;
        let outside = self.medium(&outside, at)?;
        if outside != self.assembly.scene.atmosphere {
            self.unsupported(
                at,
                "a medium outside of a surface",
                "only that of the camera is around all objects",
            );
        }
        let key =
            [self.state.material, light.map_or(0, |light| light + 1), alpha, inside.map_or(0, |i| i + 1)];
        if let Some(&known) = self.uses.get(&key) {
            return Ok(Some(known));
        }
        let Some(mut material) = self.materials.get(self.state.material).cloned() else { return Ok(None) };
        if let Some(light) = light.and_then(|light| self.lights.get(light)) {
            (material.emission, material.emits_both_sides) = (light.radiance, light.is_two_sided);
        }
        if let Some(alpha) = alpha.checked_sub(1).and_then(|index| self.alphas.get(index)).cloned() {
            let site = self.tokens.site(at, "Shape");
            self.assembly.set_opacity(&mut material, &alpha, &site)?;
        }
        self.finish_material(material, inside, light.is_some(), key, at)
    }

    fn finish_material(
        &mut self,
        mut material: Material,
        inside: Option<usize>,
        is_light: bool,
        key: super::MaterialKey,
        at: At,
    ) -> Result<Option<usize>, SceneError> {
        if inside.is_some() {
            match material.surface.transmits() || material.opacity < 1.0 {
                true => material.medium = inside,
                false => {
                    let what = "a medium behind a surface that no light passes";
                    self.unsupported(at, what, "left out");
                }
            }
        }
        if matches!(material.surface, Surface::Interface(_)) {
            if is_light {
                self.unsupported(at, "Material \"interface\" of a light", "drawn as black");
                material.surface = Value::number(0.0).into();
                material.medium = None;
            } else if material.medium.is_none() {
                return Ok(None);
            } else {
                (material.opacity, material.alpha) = (1.0, crate::description::Alpha::Opaque);
            }
        }
        let index = self.assembly.add_material(material, &self.tokens.site(at, "Shape"))?;
        self.uses.insert(key, index);
        Ok(Some(index))
    }

    fn quadric(
        &mut self,
        kind: &str,
        parameters: &Parameters,
        material: usize,
        at: At,
    ) -> Result<Vec<Item>, SceneError> {
        let tokens = &self.tokens;
        let radius = parameters.number(tokens, "radius", 1.0)?;
        let angle = parameters.number(tokens, "phimax", 360.0)?.clamp(0.0, 360.0).to_radians();
        if !(radius > 0.0 && angle > 0.0) {
            return self.error(at, format!("radius is {radius}; it and phimax must be above 0"));
        }
        let is_whole = angle >= TAU;
        let number = |name: &str, default: f64| parameters.number(tokens, name, default);
        let mesh = match kind {
            "sphere" => {
                let (low, high) = (number("zmin", -radius)?, number("zmax", radius)?);
                let (low, high) =
                    (low.min(high).clamp(-radius, radius), low.max(high).clamp(-radius, radius));
                if is_whole && low == -radius && high == radius {
                    return Ok(vec![self.form(Form::Sphere { radius }, DAffine3::IDENTITY, material)]);
                }
                let (from, to) = ((high / radius).acos(), (low / radius).acos());
                surface_of_revolution(ROWS, angle, |t| {
                    let (sine, cosine) = (from + (to - from) * t).sin_cos();
                    ([radius * sine, radius * cosine], [sine, cosine])
                })
            }
            "cylinder" => {
                let (low, high) = (number("zmin", -1.0)?, number("zmax", 1.0)?);
                surface_of_revolution(1, angle, |t| ([radius, high + (low - high) * t], [1.0, 0.0]))
            }
            _ => {
                let (height, inner) = (number("height", 0.0)?, number("innerradius", 0.0)?);
                if is_whole && inner == 0.0 {
                    let place = DAffine3::from_translation(DVec3::new(0.0, 0.0, height));
                    let form = Form::Disc { radius, is_radial_first: false };
                    return Ok(vec![self.form(form, place, material)]);
                }
                surface_of_revolution(1, angle, |t| ([inner + (radius - inner) * t, height], [0.0, 1.0]))
            }
        };
        self.mesh((mesh, DVec3::ZERO), material, at)
    }

    fn form(&self, form: Form, transform: DAffine3, material: usize) -> Item {
        Item { part: Part::Form { form, is_flipped: self.state.is_reversed, material }, transform }
    }

    /// Adds a mesh, whose positions are relative to a point, and returns the part that it is.
    fn mesh(
        &mut self,
        (mesh, origin): (Mesh, DVec3),
        material: usize,
        at: At,
    ) -> Result<Vec<Item>, SceneError> {
        let mesh = Mesh { material, ..oriented(mesh) };
        let mesh = if self.state.is_reversed { turned_inside_out(mesh) } else { mesh };
        let added = self.assembly.add_mesh(mesh, &self.tokens.site(at, "Shape"))?;
        let item = |mesh| Item { part: Part::Mesh { mesh, origin }, transform: DAffine3::IDENTITY };
        Ok(added.map(item).into_iter().collect())
    }

    /// Returns vertices with normals and texture coordinates, and the point they are relative to.
    pub fn vertices(&mut self, parameters: &Parameters, at: At) -> Result<(Mesh, DVec3), SceneError> {
        let exact = parameters.vectors(&self.tokens, "P")?;
        let normals = parameters.vectors(&self.tokens, "N")?;
        let name = if parameters.get("uv").is_some() { "uv" } else { "st" };
        let uvs = parameters.numbers(&self.tokens, name)?;
        if exact.is_empty() {
            return self.error(at, "the shape has no points; it needs the parameter P");
        }
        for (what, given) in [("normals N", normals.len()), ("texture coordinates uv", uvs.len() / 2)] {
            if given != 0 && given != exact.len() {
                return self
                    .error(at, format!("{given} {what} for {} points; there must be one each", exact.len()));
            }
        }
        let uvs = uvs.chunks_exact(2).map(|uv| [uv[0] as f32, (1.0 - uv[1]) as f32]).collect();
        let (positions, origin) = self.assembly.positions(&exact, &self.tokens.site(at, "Shape"))?;
        let normals = normals.iter().map(|normal| normal.as_vec3().into()).collect();
        parameters.ignore(&["S", "faceIndices"]);
        Ok((Mesh { name: "mesh".to_owned(), positions, normals, uvs, ..Mesh::default() }, origin))
    }

    /// Returns indices of vertices, `size` for each face.
    pub fn indices(
        &self,
        parameters: &Parameters,
        (count, size): (usize, usize),
        at: At,
    ) -> Result<Vec<u32>, SceneError> {
        let numbers = parameters.numbers(&self.tokens, "indices")?;
        if numbers.is_empty() && count == size {
            return Ok((0..size as u32).collect());
        }
        if numbers.is_empty() || !numbers.len().is_multiple_of(size) {
            return self.error(
                at,
                format!("{} indices are given; there must be {size} for each face", numbers.len()),
            );
        }
        let index = |&number: &f64| {
            let is_valid = number >= 0.0 && number < count as f64 && number.fract() == 0.0;
            is_valid.then_some(number as u32)
        };
        match numbers.iter().map(index).collect() {
            Some(indices) => Ok(indices),
            None => self.error(at, format!("an index is not a whole number from 0 to {}", count - 1)),
        }
    }

    fn triangles(&mut self, parameters: &Parameters, at: At) -> Result<(Mesh, DVec3), SceneError> {
        let (mut mesh, origin) = self.vertices(parameters, at)?;
        let indices = self.indices(parameters, (mesh.positions.len(), 3), at)?;
        mesh.triangles =
            indices.chunks_exact(3).map(|corners| [corners[0], corners[1], corners[2]]).collect();
        Ok((mesh, origin))
    }

    /// Returns the mesh of a PLY file, which may be compressed; a file is read once for each
    /// material.
    fn ply(&mut self, parameters: &Parameters, material: usize, at: At) -> Result<Vec<Item>, SceneError> {
        let Some(file) = parameters.text(&self.tokens, "filename")? else {
            return self.error(at, "a plymesh needs the parameter filename");
        };
        let key = (file.to_owned(), self.state.is_reversed, material);
        if let Some(known) = self.models.get(&key) {
            return Ok(known.clone());
        }
        let site = self.tokens.site(at, "Shape");
        let bytes = self.assembly.read(file, &site)?;
        self.assembly.extend_budget(file, bytes.len());
        let bytes = gzip::decompressed(bytes, &mut self.assembly.budget, &site)?;
        let read = ply::parse(&bytes, file)?;
        self.assembly.add_warnings(&read.warnings, file);
        let mut items = Vec::new();
        for (mesh, instance) in read.meshes.into_iter().zip(read.instances) {
            for item in self.mesh((mesh, DVec3::ZERO), material, at)? {
                items.push(Item { transform: instance.transform, ..item });
            }
        }
        self.models.insert(key, items.clone());
        Ok(items)
    }
}
