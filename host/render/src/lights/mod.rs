//! Light table of a scene: the emitting primitives and the point, spot and directional lights that
//! next-event estimation chooses from, with probabilities by power, or with a light tree. The
//! renderer builds it from the scene, and uploads it with its BVH.

mod bounds;
mod glass;
mod members;
#[cfg(test)]
mod tests;
mod tree;

use glam::Vec3;
use std::f64::consts::PI;
use trisect_scene::Scene;
use trisect_scene::alias;
use trisect_shared::light::{AREA, DIRECTIONAL, Light};
use trisect_shared::material::Material;
use trisect_shared::math::{luminance, max_component};
use trisect_shared::planar::{DISC, Planar};

/// The light table of a scene.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// Emitting primitives, then point, spot and directional lights, each with its row of the alias
    /// table or, if there is a light tree, its pdf; then the nodes of the tree, and the pieces of
    /// smooth glass. Empty if no light has power.
    pub lights: Vec<Light>,
    /// Number of lights.
    pub count: u32,
    /// Number of lights that are primitives, the first.
    pub area_count: u32,
    /// Index of the first piece of smooth glass.
    pub first_glass: u32,
    /// Number of pieces of smooth glass through which point, spot and directional lights may shine;
    /// 0 without such lights.
    pub glass_count: u32,
    /// Materials of the scene, with `light_pdf` set to the pdf, by area, of a point on an emitting
    /// primitive.
    pub materials: Vec<Material>,
    /// Index in `materials` of the first medium, which follow the layers of materials.
    pub first_medium: u32,
    /// Probability, from 0 to 1, of choosing the sky instead of an entry of `lights`. Beside a tree
    /// it only says whether the sky is sampled: each point decides how often.
    pub environment_probability: f32,
    /// Mean luminance of the sky over all directions, in the unit of the tree's strengths; 0
    /// without a tree.
    pub sky_strength: f32,
}

/// Minimum radius of the discs that stand for planes. A plane keeps at least this radius in every
/// scene space; any disc as large counts as a plane.
const PLANE_RADIUS: f32 = 1e11;

/// Number of lights from which on they have a tree: two triangles may be one lamp
/// (docs/notebook/light-tree.md).
const FIRST_TREE: u32 = 3;

impl Lights {
    /// Returns whether there is a light tree.
    pub fn has_tree(&self) -> bool {
        self.first_glass > self.count
    }

    /// Builds the table for `scene`, with a tree if there are many lights, or one that is
    /// infinitely far beside one that is not. Otherwise probabilities are proportional to power: π
    /// × area × luminance of the emitted radiance for primitives, and the power sent into the scene
    /// for point, spot and directional lights. A sky that connections find has probability 1/2, or
    /// 1 if there are no other lights.
    pub fn new(scene: &Scene) -> Self {
        let emitted = |material: u32| f64::from(scene.materials[material as usize].light_pdf);
        let areas = areas(scene);
        let mut lights = Vec::new();
        let (mut powers, mut areas_of_lights) = (Vec::new(), Vec::new());
        for (primitive, (area, material)) in areas.enumerate() {
            let power = PI * emitted(material) * area;
            if power > 0.0 {
                let mut light: Light = bytemuck::Zeroable::zeroed();
                light.kind = AREA;
                light.primitive = primitive as u32;
                lights.push(light);
                powers.push(power);
                areas_of_lights.push(area);
            }
        }
        let area_count = lights.len() as u32;
        let radius = radius(scene);
        for light in &scene.lights {
            let power = power(light, radius);
            if power > 0.0 {
                lights.push(*light);
                powers.push(power);
            }
        }
        // Each is divided by the largest, because f64 might not hold the sum of the powers.
        let greatest = powers.iter().copied().fold(0.0, f64::max);
        powers.iter_mut().for_each(|power| *power /= greatest);
        let rows = alias::table(&powers).unwrap_or_default();
        let sum: f64 = powers.iter().sum();

        let environment_probability = match (samples_sky(scene), rows.is_empty()) {
            (false, _) => 0.0,
            (true, true) => 1.0,
            (true, false) => 0.5,
        };
        let share = 1.0 - f64::from(environment_probability);
        if rows.is_empty() {
            lights.clear();
        }
        for ((light, row), power) in lights.iter_mut().zip(&rows).zip(&powers) {
            (light.threshold, light.alias) = (row.threshold, row.alias);
            light.probability = (share * power / sum) as f32;
        }
        let mut materials = scene.materials.clone();
        for material in &mut materials {
            let power = PI * f64::from(material.light_pdf) / greatest;
            let density = if rows.is_empty() { 0.0 } else { share * power / sum };
            material.light_pdf = density as f32;
        }
        append_layers(&mut materials, scene);
        let first_medium = materials.len() as u32;
        materials.extend(scene.media.iter().map(|medium| bytemuck::cast::<_, Material>(*medium)));
        let count = lights.len() as u32;
        let area_count = area_count.min(count);
        let distant = lights.iter().filter(|light| light.kind == DIRECTIONAL).count() as u32;
        let before_portals = count > 0 && environment_probability > 0.0 && !scene.portals.is_empty();
        let mut sky_strength = 0.0;
        let has_tree = count >= FIRST_TREE || (1..count).contains(&distant) || before_portals;
        if has_tree && count <= tree::MAX_LIGHTS {
            let members = members::of(scene, &lights);
            for (light, area) in lights.iter_mut().zip(areas_of_lights) {
                light.intensity.x = (1.0 / area) as f32;
            }
            let unit = tree::append(&mut lights, members);
            sky_strength = (sky_luminance(scene) / unit).min(1e30) as f32;
        }
        let first_glass = lights.len() as u32;
        if count > area_count {
            lights.extend(glass::pieces(scene));
        }
        let glass_count = lights.len() as u32 - first_glass;
        Self {
            lights,
            count,
            area_count,
            first_glass,
            glass_count,
            materials,
            first_medium,
            environment_probability,
            sky_strength,
        }
    }
}

/// Returns whether connections to the sky find light: by a panorama, or through portals.
fn samples_sky(scene: &Scene) -> bool {
    match &scene.environment {
        Some(environment) => !environment.is_black(),
        None => !scene.portals.is_empty() && max_component(scene.sky.bottom.max(scene.sky.top)) > 0.0,
    }
}

/// Returns the mean luminance of the sky over all directions.
fn sky_luminance(scene: &Scene) -> f64 {
    let Some(environment) = &scene.environment else {
        return f64::from(luminance(scene.sky.bottom) + luminance(scene.sky.top)) * 0.5;
    };
    let rows = environment.texels.chunks(environment.width.max(1) as usize).enumerate();
    let (mut sum, mut weights) = (0.0, 0.0);
    for (row, texels) in rows {
        let sine = (PI * (row as f64 + 0.5) / f64::from(environment.height)).sin();
        sum += sine * texels.iter().map(|texel| f64::from(luminance(texel.radiance))).sum::<f64>();
        weights += sine * texels.len() as f64;
    }
    sum / weights
}

/// Returns the power that a point, spot or directional light sends into a scene of this radius.
fn power(light: &Light, radius: f64) -> f64 {
    let strength = f64::from(luminance(light.intensity));
    if light.kind == DIRECTIONAL {
        strength * PI * radius * radius
    } else if light.cone_scale > 0.0 {
        // 2π (1 - cos) is the solid angle of a cone with the outer half angle.
        strength * 2.0 * PI * (1.0 + f64::from(light.cone_offset / light.cone_scale))
    } else {
        strength * 4.0 * PI
    }
}

/// Appends the layers of materials, each with its textures, to the materials.
fn append_layers(materials: &mut Vec<Material>, scene: &Scene) {
    let before = materials.len() as u32;
    for material in materials.iter_mut() {
        // The scene counts from 1.
        material.layers = material.layers.checked_sub(1).map_or(0, |index| before + 2 * index);
    }
    for (layers, textures) in &scene.layers {
        materials.extend([bytemuck::cast(*layers), bytemuck::cast::<_, Material>(*textures)]);
    }
}

/// Returns the area and the material index of each primitive, in primitive order.
fn areas(scene: &Scene) -> impl Iterator<Item = (f64, u32)> {
    let spheres = scene.spheres.iter().map(|s| (4.0 * PI * f64::from(s.radius).powi(2), s.material));
    let flats = scene.flats.iter().map(|f| (f64::from(f.area), f.material));
    let triangles = scene.triangles.iter().map(|t| {
        let (a, b, c) = (t.a.as_dvec3(), t.b.as_dvec3(), t.c.as_dvec3());
        (0.5 * (b - a).cross(c - a).length(), scene.vertices[t.vertex_a as usize].material)
    });
    spheres.chain(flats).chain(triangles)
}

/// Returns half the diagonal of the bounds of everything except planes; for planes alone, the
/// distance from the camera to the point it looks at. Both scale with the scene.
fn radius(scene: &Scene) -> f64 {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let mut add = |p: Vec3| (low, high) = (low.min(p), high.max(p));
    for s in &scene.spheres {
        add(s.center - s.radius);
        add(s.center + s.radius);
    }
    let is_plane = |f: &Planar| f.kind == DISC && f.edge_u.abs().max_element() >= 0.5 * PLANE_RADIUS;
    for f in scene.flats.iter().filter(|f| !is_plane(f)) {
        [f.origin, f.origin + f.edge_u, f.origin + f.edge_v].into_iter().for_each(&mut add);
    }
    for t in &scene.triangles {
        [t.a, t.b, t.c].into_iter().for_each(&mut add);
    }
    for instance in &scene.shared.instances {
        scene.shared.corners(instance).for_each(|corner| add(corner.as_vec3()));
    }
    let diagonal = (high.as_dvec3() - low.as_dvec3()).length();
    let view = || scene.camera.look_at.distance(scene.camera.look_from);
    if diagonal.is_finite() && diagonal > 0.0 { 0.5 * diagonal } else { view() }
}
