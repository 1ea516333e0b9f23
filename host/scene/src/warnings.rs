//! Warnings about scenes that are valid but probably not as intended: each once, with a remedy.

mod glass;
#[cfg(test)]
mod tests;
mod view;

use super::description::{Description, Material};
use crate::part_names as names;

/// Returns a line for each kind of mistake. The image's width is `aspect` times its height.
pub(super) fn warnings(scene: &Description, aspect: f64) -> Vec<String> {
    let lines = [
        no_light(scene),
        view::nothing(scene, aspect),
        idle_portals(scene),
        glass::in_the_way(scene),
        texture_on_plane(scene),
    ];
    lines.into_iter().flatten().collect()
}

/// Warns if nothing in the scene emits.
fn no_light(scene: &Description) -> Option<String> {
    let sky = sky_shines(scene);
    let emits = |material: usize| {
        scene.materials.get(material).is_some_and(|material| material.emission.max_element() > 0.0)
    };
    let meshes = scene.instances.iter().filter_map(|instance| scene.meshes.get(instance.mesh));
    let surfaces = || {
        scene.shapes.iter().any(|shape| emits(shape.material))
            || meshes.clone().any(|mesh| emits(mesh.material))
    };
    let lights = || scene.lights.iter().any(|light| light.strength().max_element() > 0.0);
    let media = || scene.media.iter().any(|medium| medium.emission.max_element() > 0.0);
    (!sky && !lights() && !surfaces() && !media()).then(|| {
        "no light: nothing in the scene emits, so the image is black; add a `sky`, an object that emits \
         or an entry of `lights`"
            .to_owned()
    })
}

fn sky_shines(scene: &Description) -> bool {
    scene.sky.as_ref().is_some_and(|sky| sky.max_radiance() > 0.0)
}

/// Warns of portals under a black sky.
fn idle_portals(scene: &Description) -> Option<String> {
    (!scene.portals.is_empty() && !sky_shines(scene)).then(|| {
        "portals: the sky is black, so nothing comes through them; set `sky`, or leave out `portals`"
            .to_owned()
    })
}

/// Warns of a texture on a plane, which has no border between which texture coordinates could go
/// from 0 to 1.
fn texture_on_plane(scene: &Description) -> Option<String> {
    let textured = |material: &Material| material.textures().next().is_some();
    let mut planes = scene.shapes.iter().enumerate().filter(|(_, shape)| {
        shape.kind.is_plane() && scene.materials.get(shape.material).is_some_and(textured)
    });
    let (index, shape) = planes.next()?;
    Some(format!(
        "{}: a plane has no end, so its texture is one colour; use a Quad as large as what is seen of it",
        names::shape(scene, index, shape)
    ))
}
