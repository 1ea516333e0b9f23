//! Shapes of Mitsuba.

use super::super::assembly::{Form, Item, Part, Value, surface_of_revolution, turned_inside_out};
use super::document::Element;
use super::texture::Quantity;
use super::{Reader, SceneError, address};
use crate::description::{Material, Mesh, Surface};
use crate::values::unit;
use glam::{DAffine3, DMat3, DVec3};
use std::f64::consts::TAU;
use std::rc::Rc;

/// Maximum number of groups of shapes within each other.
const MAX_NESTING: usize = 8;

/// Sides of the cube: where u, v and the normal point.
const SIDES: [[DVec3; 3]; 6] = [
    [DVec3::Z, DVec3::X, DVec3::NEG_Y],
    [DVec3::NEG_X, DVec3::NEG_Z, DVec3::Y],
    [DVec3::Y, DVec3::NEG_Z, DVec3::X],
    [DVec3::Y, DVec3::X, DVec3::Z],
    [DVec3::Y, DVec3::Z, DVec3::NEG_X],
    [DVec3::NEG_Y, DVec3::X, DVec3::NEG_Z],
];

impl Reader<'_, '_> {
    /// Returns the parts of a shape in the coordinates of the file's world.
    pub fn shape(&mut self, element: &Rc<Element>, depth: usize) -> Result<Rc<[Item]>, SceneError> {
        let document = self.document;
        let element = self.resolved(element)?;
        element.mark();
        if element.tag != "shape" {
            return Err(document.error(element, format!("{} is no <shape>", element.label())));
        }
        if depth > MAX_NESTING {
            return Err(
                document.error(element, "groups of shapes are nested too deeply, or contain themselves")
            );
        }
        match element.kind() {
            // A group is seen where an instance places it.
            "shapegroup" => return Ok(Rc::new([])),
            "instance" => return self.instance(element, depth),
            "merge" => return self.group(element, depth),
            "serialized" => {
                self.unsupported(
                    element,
                    "<shape type=\"serialized\">",
                    "left out; convert it to PLY (mi.Mesh.write_ply)",
                );
                return Ok(Rc::new([]));
            }
            "sphere" | "rectangle" | "cube" | "disk" | "cylinder" | "obj" | "ply" => {}
            _ => {
                self.unsupported(element, &element.label(), "this shape is left out");
                return Ok(Rc::new([]));
            }
        }
        let Some(material) = self.material(element)? else { return Ok(Rc::new([])) };
        let is_flipped = document.flag(element, "flip_normals", false)?;
        let map = document.transform(element, "to_world")?;
        let items = self.parts(element, &map, is_flipped, material)?;
        self.report_unused(element);
        Ok(items)
    }

    fn parts(
        &mut self,
        element: &Rc<Element>,
        map: &DAffine3,
        is_flipped: bool,
        material: usize,
    ) -> Result<Rc<[Item]>, SceneError> {
        let document = self.document;
        let form = |form: Form, transform: DAffine3| -> Rc<[Item]> {
            Rc::new([Item { part: Part::Form { form, is_flipped, material }, transform }])
        };
        Ok(match element.kind() {
            "sphere" => {
                let center = document.point(element, "center", DVec3::ZERO)?;
                let radius = document.number(element, "radius", 1.0)?;
                if radius <= 0.0 {
                    return Err(document.error(element, format!("radius is {radius}; it must be above 0")));
                }
                form(Form::Sphere { radius }, *map * DAffine3::from_translation(center))
            }
            "rectangle" => form(Form::Square, *map),
            "disk" => form(Form::Disc { radius: 1.0, is_radial_first: true }, *map),
            "cube" => {
                let side = |[u, v, n]: [DVec3; 3]| {
                    let place = DAffine3::from_mat3_translation(DMat3::from_cols(u, v, n), n);
                    Item {
                        part: Part::Form { form: Form::Square, is_flipped, material },
                        transform: *map * place,
                    }
                };
                SIDES.map(side).into()
            }
            "cylinder" => self.cylinder(element, map, is_flipped, material)?,
            _ => self.model(element, map, is_flipped, material)?,
        })
    }

    fn cylinder(
        &mut self,
        element: &Rc<Element>,
        map: &DAffine3,
        is_flipped: bool,
        material: usize,
    ) -> Result<Rc<[Item]>, SceneError> {
        let document = self.document;
        let (from, to) =
            (document.point(element, "p0", DVec3::ZERO)?, document.point(element, "p1", DVec3::Z)?);
        let radius = document.number(element, "radius", 1.0)?;
        let axis = unit(to - from).filter(|_| radius > 0.0).ok_or_else(|| {
            document.error(element, "p0 and p1 must differ, and the radius must be above 0")
        })?;
        let (across, _) = axis.any_orthonormal_pair();
        let columns = DMat3::from_cols(across * radius, axis.cross(across) * radius, to - from);
        let mesh = surface_of_revolution(1, TAU, |t| ([1.0, t], [1.0, 0.0]));
        let mesh = Mesh { name: "cylinder".to_owned(), material, ..mesh };
        let mesh = if is_flipped { turned_inside_out(mesh) } else { mesh };
        let mesh = self.assembly.add_mesh(mesh, &document.site(element))?;
        let transform = *map * DAffine3::from_mat3_translation(columns, from);
        Ok(mesh
            .map(|mesh| Item { part: Part::Mesh { mesh, origin: DVec3::ZERO }, transform })
            .into_iter()
            .collect())
    }

    /// Returns the parts of the shapes within an element.
    fn group(&mut self, element: &Rc<Element>, depth: usize) -> Result<Rc<[Item]>, SceneError> {
        let key = address(element);
        if let Some(known) = self.groups.get(&key) {
            return Ok(Rc::clone(known));
        }
        let mut items = Vec::new();
        for child in &element.children {
            if self.resolved(child)?.tag == "shape" {
                child.mark();
                let parts = self.shape(child, depth + 1)?;
                self.assembly
                    .budget
                    .take((parts.len() * size_of::<Item>()) as u64, &self.document.site(child))?;
                items.extend_from_slice(&parts);
            }
        }
        self.report_unused(element);
        let items: Rc<[Item]> = items.into();
        self.groups.insert(key, Rc::clone(&items));
        Ok(items)
    }

    fn instance(&mut self, element: &Rc<Element>, depth: usize) -> Result<Rc<[Item]>, SceneError> {
        let document = self.document;
        let map = document.transform(element, "to_world")?;
        let mut items = Vec::new();
        for child in &element.children {
            let group = self.resolved(child)?;
            if group.tag != "shape" {
                continue;
            }
            if group.kind() != "shapegroup" {
                return Err(document.error(child, "an instance needs a <shape type=\"shapegroup\">"));
            }
            child.mark();
            group.mark();
            let parts = self.group(group, depth + 1)?;
            self.assembly.budget.take((parts.len() * size_of::<Item>()) as u64, &document.site(child))?;
            items.extend(parts.iter().map(|item| Item { transform: map * item.transform, ..item.clone() }));
        }
        self.report_unused(element);
        Ok(items.into())
    }

    /// Returns the index of a shape's material; `None` for a surface that nothing shows.
    fn material(&mut self, element: &Rc<Element>) -> Result<Option<usize>, SceneError> {
        let document = self.document;
        let (mut bsdf, mut emitter, mut interior) = (None, None, None);
        for child in &element.children {
            let object = self.resolved(child)?;
            let slot = match object.tag.as_str() {
                "bsdf" => &mut bsdf,
                "emitter" => &mut emitter,
                "medium" if child.attribute("name") == Some("interior") => &mut interior,
                "medium" => continue,
                _ => continue,
            };
            child.mark();
            *slot = Some(object);
        }
        let key = [bsdf, emitter, interior].map(|of| of.map_or(0, address));
        if let Some(&known) = self.materials.get(&key) {
            return Ok(Some(known));
        }
        let mut material = match bsdf {
            Some(bsdf) => self.bsdf(bsdf, 0)?,
            // A light without a material reflects nothing.
            None => {
                let reflectance = if emitter.is_some() { 0.0 } else { 0.5 };
                Material::new(Value::number(reflectance).into()).named("diffuse")
            }
        };
        if let Some(emitter) = emitter {
            self.area_light(emitter, &mut material)?;
        }
        if let Some(interior) = interior {
            let medium = self.medium(interior)?;
            let is_passable = material.surface.transmits() || material.opacity < 1.0;
            match is_passable {
                true => material.medium = medium,
                false => {
                    self.unsupported(element, "a medium behind a surface that no light passes", "left out")
                }
            }
        }
        if matches!(material.surface, Surface::Interface(_)) {
            if material.medium.is_none() && emitter.is_none() {
                return Ok(None);
            }
            if emitter.is_some() {
                self.unsupported(element, "<bsdf type=\"null\"> of a light", "drawn as black");
                material.surface = Value::number(0.0).into();
                material.medium = None;
            }
        }
        let index = self.assembly.add_material(material, &document.site(element))?;
        self.materials.insert(key, index);
        Ok(Some(index))
    }

    fn area_light(&mut self, emitter: &Rc<Element>, material: &mut Material) -> Result<(), SceneError> {
        let document = self.document;
        if emitter.kind() != "area" {
            self.unsupported(emitter, &emitter.label(), "the shape does not shine");
            return Ok(());
        }
        let radiance = self.value(emitter, "radiance", Quantity::Light)?.unwrap_or(Value::number(1.0));
        let _ = emitter.property("sampling_weight");
        match radiance {
            Value::Constant(color) => material.emission = color,
            Value::Image { texture, scale } => {
                (material.emission, material.emission_texture) = (scale, Some(texture));
            }
        }
        if !material.emission.is_finite() {
            return Err(document.error(emitter, "the radiance is not finite"));
        }
        self.report_unused(emitter);
        Ok(())
    }
}
