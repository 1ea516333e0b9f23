//! Validation of a description, whatever made it: a reader, an importer or a builder.
//!
//! Readers check each number where they read it, so that an error names its place in the file. This
//! is the check that all of them share; it names the part of the scene.

use super::description::{Description, Instance, Mesh, ShapeKind, Sky, Texels, TextureImage};
use super::portal::check_count;
use super::ranges::{all, at_most, each, is_direction};
use super::values::{Coordinate, Gain, Length, MAX_MAGNITUDE, Radiance};
use super::{limits, part_names as names};

/// Maximum length of an edge: from one end of the world to the other.
const MAX_EDGE: f64 = 2.0 * MAX_MAGNITUDE;

impl Description {
    /// Checks that every number is finite and in range, and every index in range.
    ///
    /// # Errors
    ///
    /// A message that names the part of the scene, the number and its range.
    pub fn check(&self) -> Result<(), String> {
        for (name, camera) in &self.cameras {
            camera.check().map_err(|fault| format!("the camera \"{name}\": {fault}"))?;
        }
        for image in &self.images {
            check_image(image)?;
        }
        let media = self.media.len();
        for medium in &self.media {
            medium.check().map_err(|fault| format!("{}: {fault}", names::medium(&medium.name)))?;
        }
        let named = self.materials.iter().map(|material| material.medium);
        if let Some(index) = named.chain([self.atmosphere]).flatten().find(|&index| index >= media) {
            return Err(format!("medium {index} of {media} is used"));
        }
        for material in &self.materials {
            let fault = |fault| format!("{}: {fault}", names::material(&material.name));
            material.check(self.images.len()).map_err(fault)?;
        }
        let uses = |material: usize| match material < self.materials.len() {
            true => Ok(()),
            false => Err(format!("material {material} of {} is used", self.materials.len())),
        };
        for (index, shape) in self.shapes.iter().enumerate() {
            let checked = check_shape(&shape.kind).and_then(|()| uses(shape.material));
            checked.map_err(|fault| format!("{}: {fault}", names::shape(self, index, shape)))?;
        }
        for mesh in &self.meshes {
            let checked = check_mesh(mesh).and_then(|()| uses(mesh.material));
            checked.map_err(|fault| format!("mesh \"{}\": {fault}", mesh.name))?;
        }
        for (index, instance) in self.instances.iter().enumerate() {
            let checked = check_instance(instance, self.meshes.len());
            checked.map_err(|fault| format!("{}: {fault}", names::instance(self, index)))?;
        }
        for (index, light) in self.lights.iter().enumerate() {
            light.check().map_err(|fault| format!("{}: {fault}", names::light(index)))?;
        }
        check_count(self.portals.len())?;
        for (index, portal) in self.portals.iter().enumerate() {
            portal.check().map_err(|fault| format!("portals[{index}]: {fault}"))?;
        }
        if let Some(ground) = &self.ground {
            each::<Coordinate>("the ground: centre", ground.center)?;
            all::<Length>("the ground: size", &[ground.size])?;
        }
        self.sky.as_ref().map_or(Ok(()), |sky| check_sky(sky).map_err(|fault| format!("the sky: {fault}")))
    }
}

fn check_image(image: &TextureImage) -> Result<(), String> {
    let count = match &image.texels {
        Texels::Srgb8(texels) | Texels::Linear8(texels) => texels.len(),
        Texels::Float(texels) => texels.len(),
    };
    let size = u64::from(image.width) * u64::from(image.height);
    match size > 0 && size == count as u64 {
        true => Ok(()),
        false => Err(format!(
            "image \"{}\": {} x {} texels, but {count} are given; give at least one, row by row",
            image.name, image.width, image.height
        )),
    }
}

fn check_shape(shape: &ShapeKind) -> Result<(), String> {
    match shape {
        ShapeKind::Sphere { center, radius } => {
            each::<Coordinate>("centre", *center)?;
            all::<Length>("radius", &[*radius])
        }
        ShapeKind::Quad { corner, u, v } => {
            each::<Coordinate>("corner", *corner)?;
            at_most("u", *u, MAX_EDGE)?;
            at_most("v", *v, MAX_EDGE)?;
            limits::has_area(*u, *v)
        }
        ShapeKind::Disc { center, normal, radius } => {
            each::<Coordinate>("centre", *center)?;
            is_direction("normal", *normal)?;
            all::<Length>("radius", &[*radius])
        }
    }
}

fn check_mesh(mesh: &Mesh) -> Result<(), String> {
    let vertices = mesh.positions.len();
    for (what, given) in [
        ("normals", mesh.normals.len()),
        ("texture coordinates", mesh.uvs.len()),
        ("texture coordinates of the second set", mesh.second_uvs.len()),
        ("colours", mesh.colors.len()),
        ("tangents", mesh.tangents.len()),
    ] {
        if given != 0 && given != vertices {
            return Err(format!("{given} {what} for {vertices} vertices; give one each, or none"));
        }
    }
    if let Some(triangle) =
        mesh.triangles.iter().find(|triangle| triangle.iter().any(|&v| v as usize >= vertices))
    {
        return Err(format!("a triangle has the vertices {triangle:?}, but there are {vertices}"));
    }
    let far = |position: &&[f32; 3]| !position.iter().all(|x| f64::from(x.abs()) <= MAX_MAGNITUDE);
    if let Some([x, y, z]) = mesh.positions.iter().find(far) {
        return Err(format!("a vertex at ({x}, {y}, {z}) is not a finite point within 1e18"));
    }
    let unit = |normal: &[f32; 3]| normal.iter().all(|x| x.abs() <= 1.001);
    if let Some([x, y, z]) = mesh.normals.iter().find(|normal| !unit(normal)) {
        return Err(format!("the normal ({x}, {y}, {z}) is not a unit vector"));
    }
    if let Some(color) = mesh.colors.iter().find(|color| !color.iter().all(|x| (0.0..=65504.0).contains(x))) {
        return Err(format!("the colour {color:?} of a vertex is not within 0 to 65,504"));
    }
    let uvs = mesh.uvs.as_flattened().iter().chain(mesh.second_uvs.as_flattened());
    match uvs.into_iter().find(|number| !number.is_finite()) {
        Some(number) => Err(format!("the texture coordinate {number} is not finite")),
        None => Ok(()),
    }
}

fn check_instance(instance: &Instance, meshes: usize) -> Result<(), String> {
    if instance.mesh >= meshes {
        return Err(format!("mesh {} of {meshes}", instance.mesh));
    }
    if !limits::in_range(&instance.transform) {
        return Err("its transform goes beyond 1e18".to_owned());
    }
    match limits::is_singular(&instance.transform) {
        true => Err("its transform flattens it".to_owned()),
        false => Ok(()),
    }
}

fn check_sky(sky: &Sky) -> Result<(), String> {
    match sky {
        Sky::Gradient { bottom, top } => {
            each::<Radiance>("radiance", *bottom)?;
            each::<Radiance>("radiance", *top)
        }
        Sky::Image { scale, rotation, .. } | Sky::Studio { scale, rotation } => {
            all::<Gain>("scale", &[*scale])?;
            match rotation.is_finite() {
                true => Ok(()),
                false => Err(format!("rotation: {rotation} is not finite")),
            }
        }
        Sky::Sun(sky) => sky.parameters().check(),
    }
}
