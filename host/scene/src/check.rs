//! Validation of a description, whatever made it: a reader, an importer or a builder.
//!
//! Readers check each number where they read it, so that an error names its place in the file. This
//! is the check that all of them share; it names the part of the scene.

use super::description::{
    Alpha, ConductorFresnel, Description, Instance, Material, Mesh, PunctualLight, ShapeKind, Sky, Surface,
    Texels, TextureImage, TextureUse,
};
use super::values::{Absorption, Coordinate, Eta, Gain, Ior, Length, MAX_MAGNITUDE, Radiance, Share};
use super::{limits, part_names as names};
use glam::DVec3;

/// Maximum length of an edge: from one end of the world to the other.
const MAX_EDGE: f64 = 2.0 * MAX_MAGNITUDE;

/// Maximum intensity: the square of the maximum length, because a change of space scales it so.
const MAX_INTENSITY: f64 = MAX_MAGNITUDE * MAX_MAGNITUDE;

/// Checks numbers by the type that a scene file reads them with.
fn all<T: TryFrom<f64, Error = String>>(what: &str, numbers: &[f64]) -> Result<(), String> {
    numbers
        .iter()
        .try_for_each(|&number| T::try_from(number).map(drop).map_err(|fault| format!("{what}: {fault}")))
}

fn vector<T: TryFrom<f64, Error = String>>(what: &str, vector: DVec3) -> Result<(), String> {
    all::<T>(what, &vector.to_array())
}

fn at_most(what: &str, vector: DVec3, limit: f64) -> Result<(), String> {
    match vector.abs().cmple(DVec3::splat(limit)).all() {
        true => Ok(()),
        false => Err(format!("{what}: {vector} is not a finite vector within {limit:e}")),
    }
}

fn direction(what: &str, vector: DVec3) -> Result<(), String> {
    at_most(what, vector, MAX_MAGNITUDE)?;
    if vector == DVec3::ZERO { Err(format!("{what}: (0, 0, 0) is not a direction")) } else { Ok(()) }
}

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
        for material in &self.materials {
            let fault = |fault| format!("{}: {fault}", names::material(&material.name));
            check_material(material, self.images.len()).map_err(fault)?;
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
            check_light(light).map_err(|fault| format!("{}: {fault}", names::light(index)))?;
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

fn check_texture(what: &str, texture: Option<&TextureUse>, images: usize) -> Result<(), String> {
    let Some(texture) = texture else { return Ok(()) };
    if texture.image >= images {
        return Err(format!("{what}: image {} of {images}", texture.image));
    }
    match texture.transform.to_cols_array().iter().all(|number| number.is_finite()) {
        true => Ok(()),
        false => Err(format!("{what}: its transform is not finite")),
    }
}

fn check_material(material: &Material, images: usize) -> Result<(), String> {
    vector::<Share>("reflected fraction", material.base_color)?;
    vector::<Radiance>("emission", material.emission)?;
    all::<Share>("opacity", &[material.opacity])?;
    if let Alpha::Mask { cutoff } = material.alpha {
        all::<Share>("alpha cutoff", &[cutoff])?;
    }
    check_texture("texture", material.base_color_texture.as_ref(), images)?;
    check_texture("texture of the emission", material.emission_texture.as_ref(), images)?;
    match &material.surface {
        Surface::Lambertian => Ok(()),
        Surface::Metal { fuzz } => all::<Share>("fuzz", &[*fuzz]),
        Surface::Dielectric { ior } => all::<Ior>("ior", &[*ior]),
        Surface::RoughDielectric { ior, roughness } => {
            all::<Ior>("ior", &[*ior])?;
            all::<Share>("roughness", &[*roughness])
        }
        Surface::Conductor { fresnel, roughness } => {
            if let ConductorFresnel::Ior { eta, k } = fresnel {
                vector::<Eta>("eta", *eta)?;
                vector::<Absorption>("k", *k)?;
            }
            all::<Share>("roughness", &[*roughness])
        }
        Surface::MetallicRoughness {
            metallic,
            roughness,
            metallic_roughness_texture,
            ior,
            transmission,
            transmission_texture,
        } => {
            all::<Share>("metallic", &[*metallic])?;
            all::<Share>("roughness", &[*roughness])?;
            all::<Share>("transmission", &[*transmission])?;
            all::<Ior>("ior", &[*ior])?;
            check_texture("texture of the roughness", metallic_roughness_texture.as_ref(), images)?;
            check_texture("texture of the transmission", transmission_texture.as_ref(), images)
        }
    }
}

fn check_shape(shape: &ShapeKind) -> Result<(), String> {
    match shape {
        ShapeKind::Sphere { center, radius } => {
            vector::<Coordinate>("centre", *center)?;
            all::<Length>("radius", &[*radius])
        }
        ShapeKind::Quad { corner, u, v } => {
            vector::<Coordinate>("corner", *corner)?;
            at_most("u", *u, MAX_EDGE)?;
            at_most("v", *v, MAX_EDGE)?;
            limits::has_area(*u, *v)
        }
        ShapeKind::Disc { center, normal, radius } => {
            vector::<Coordinate>("centre", *center)?;
            direction("normal", *normal)?;
            all::<Length>("radius", &[*radius])
        }
    }
}

fn check_mesh(mesh: &Mesh) -> Result<(), String> {
    let vertices = mesh.positions.len();
    for (what, given) in [("normals", mesh.normals.len()), ("texture coordinates", mesh.uvs.len())] {
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
    match mesh.uvs.as_flattened().iter().find(|number| !number.is_finite()) {
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

fn check_light(light: &PunctualLight) -> Result<(), String> {
    let strength = light.strength();
    at_most("strength", strength, MAX_INTENSITY)?;
    if strength.min_element() < 0.0 {
        return Err(format!("strength: {strength} is below 0"));
    }
    match *light {
        PunctualLight::Point { position, .. } => vector::<Coordinate>("position", position),
        PunctualLight::Directional { direction: along, .. } => direction("direction", along),
        PunctualLight::Spot { position, direction: along, inner, outer, .. } => {
            vector::<Coordinate>("position", position)?;
            direction("direction", along)?;
            match 0.0 <= inner && inner < outer && outer <= std::f64::consts::FRAC_PI_2 {
                true => Ok(()),
                false => Err(format!(
                    "angles: from {inner} to {outer} radians is no cone; both must be from 0 to π / 2, in order"
                )),
            }
        }
    }
}

fn check_sky(sky: &Sky) -> Result<(), String> {
    match sky {
        Sky::Gradient { bottom, top } => {
            vector::<Radiance>("radiance", *bottom)?;
            vector::<Radiance>("radiance", *top)
        }
        Sky::Image { scale, rotation, .. } => {
            all::<Gain>("scale", &[*scale])?;
            match rotation.is_finite() {
                true => Ok(()),
                false => Err(format!("rotation: {rotation} is not finite")),
            }
        }
    }
}
