//! BSDFs: a material with its textures read, in the frame of the shading normal. [`crate::path`]
//! evaluates and samples them.
//!
//! Each material is a file that implements `book::BookLobe` or `microfacets::MicrofacetLobe`.
//! Code that several materials share stands outside of them: lanes of a warp that meet different
//! materials run it together, and a kernel has it once.
//!
//! Radiance is transported without the factor eta² between media, as in "Ray Tracing in One
//! Weekend" (the book): it cancels between a camera and lights outside of glass.

mod book;
mod boundary;
mod coat;
mod conductor;
mod dielectric;
mod frame;
mod lambertian;
mod layered;
mod metal;
mod metallic_roughness;
mod microfacets;
mod normal_map;
mod rough_dielectric;
mod sample;
mod sheen;
mod textures;
mod thin_film;

use self::layered::LayeredLobes;
use self::microfacets::Prepared;
use crate::features::{
    BOOK, FeatureSet, Features, LAYERS, MICROFACETS, NEE, NORMAL_MAPS, PANES, of_material,
};
use crate::layers::MaterialLayers;
use crate::material::Material;
use crate::math::{basis, max, normalize};
use crate::rng::Words;
use glam::Vec3;

/// Kind of a diffuse material.
pub const LAMBERTIAN: u32 = 0;
/// Kind of the book's metal.
pub const METAL: u32 = 1;
/// Kind of smooth clear glass.
pub const DIELECTRIC: u32 = 2;
/// First kind of the microfacet materials; kinds below are of the book.
pub const MICROFACET_KINDS: u32 = 5;
/// Kind of a rough metal.
pub const CONDUCTOR: u32 = 5;
/// Kind of clear glass with a rough boundary.
pub const ROUGH_DIELECTRIC: u32 = 6;
/// Kind of glTF's material.
pub const METALLIC_ROUGHNESS: u32 = 7;

/// Kind of glTF's material with layers and further lobes.
pub const LAYERED: u32 = 8;

/// Kinds with the names of their features.
pub const NAMES: [(u32, &str); 7] = [
    (LAMBERTIAN, "lambertian"),
    (METAL, "metal"),
    (DIELECTRIC, "dielectric"),
    (CONDUCTOR, "conductor"),
    (ROUGH_DIELECTRIC, "rough-dielectric"),
    (METALLIC_ROUGHNESS, "metallic-roughness"),
    (LAYERED, "layered"),
];

const _: () = assert!(
    of_material(MICROFACET_KINDS) & MICROFACETS != 0
        && of_material(DIELECTRIC) & BOOK != 0
        && of_material(MICROFACET_KINDS - 1) & (BOOK | MICROFACETS) == 0
        && of_material(LAYERED) == LAYERS
);

/// Evaluates an item of the `book::BookLobe` of a kind, among those that `$features` has.
macro_rules! of_book {
    ($features:expr, $kind:expr, $($item:tt)+) => {{
        use $crate::bsdf::{DIELECTRIC, METAL, book::BookLobe, dielectric, lambertian, metal};
        use $crate::features::of_material;
        if $features.has::<{ of_material(METAL) }>() && $kind == METAL {
            metal::Metal::$($item)+
        } else if $features.has::<{ of_material(DIELECTRIC) }>() && $kind == DIELECTRIC {
            dielectric::Dielectric::$($item)+
        } else {
            lambertian::Lambertian::$($item)+
        }
    }};
}

/// Evaluates an item of the `microfacets::MicrofacetLobe` of a kind, among those that `$features`
/// has. The arms are in the order of the kinds.
macro_rules! of_microfacets {
    ($features:expr, $kind:expr, $($item:tt)+) => {{
        use $crate::bsdf::microfacets::MicrofacetLobe;
        use $crate::bsdf::{CONDUCTOR, METALLIC_ROUGHNESS, ROUGH_DIELECTRIC};
        use $crate::bsdf::{conductor, layered, metallic_roughness, rough_dielectric};
        use $crate::features::{of_greater_kinds, of_material};
        if $features.is_kind::<{ of_material(CONDUCTOR) }, { of_greater_kinds(CONDUCTOR) }>($kind, CONDUCTOR) {
            conductor::Conductor::$($item)+
        } else if $features.is_kind::<{ of_material(ROUGH_DIELECTRIC) }, { of_greater_kinds(ROUGH_DIELECTRIC) }>($kind, ROUGH_DIELECTRIC) {
            rough_dielectric::RoughDielectric::$($item)+
        } else if $features.is_kind::<{ of_material(METALLIC_ROUGHNESS) }, { of_greater_kinds(METALLIC_ROUGHNESS) }>($kind, METALLIC_ROUGHNESS) {
            metallic_roughness::MetallicRoughness::$($item)+
        } else {
            layered::Layered::$($item)+
        }
    }};
}

use {of_book, of_microfacets};

pub use book::{Scatter, scatter};
pub use normal_map::BsdfNormals;
use sample::ZERO_EVAL;
pub use sample::{BsdfEval, BsdfSample};
pub use textures::{Slots, TexturePoint, TexturedMaterial, load_material, opacity};
/// Slots of a material's textures.
pub mod slots {
    pub use super::textures::{ALBEDO, ALL, EMISSION, METALLIC_ROUGHNESS, NORMAL, PASSING, TRANSMISSION};
}

/// Returns whether a material of this kind is a microfacet material, not one of the book.
#[inline(always)]
pub const fn is_microfacet(kind: u32) -> bool {
    kind >= MICROFACET_KINDS
}

/// Returns whether a material of this kind is layered, in a kernel with `features`.
#[inline(always)]
pub fn is_layered<const POSSIBLE: Features>(features: FeatureSet<POSSIBLE>, kind: u32) -> bool {
    features.has::<LAYERS>() && kind == LAYERED
}

/// Returns whether a material is a thin wall of clear glass without roughness, which light passes
/// straight.
#[inline(always)]
pub(crate) fn is_pane<const POSSIBLE: Features>(features: FeatureSet<POSSIBLE>, m: &Material) -> bool {
    features.has::<PANES>() && m.kind == METALLIC_ROUGHNESS && metallic_roughness::is_pane(m)
}

/// Returns the part of the light by channel that passes straight through a [pane](is_pane), which
/// it meets at cosine `cos`; zero for other materials.
#[inline(always)]
pub(crate) fn straight_transmittance<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    m: &Material,
    cos: f32,
) -> Vec3 {
    if is_pane(features, m) { metallic_roughness::straight_transmittance(m, cos) } else { Vec3::ZERO }
}

/// Returns whether a material of this kind is a microfacet material, in a kernel with `features`.
#[inline(always)]
fn uses_microfacets<const POSSIBLE: Features>(features: FeatureSet<POSSIBLE>, kind: u32) -> bool {
    features.has::<MICROFACETS>() && (!features.has::<BOOK>() || is_microfacet(kind))
}

/// BSDF of a material at a point, seen from a given direction.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    material: Material,
    /// Unit shading normal on the viewer's side.
    normal: Vec3,
    /// Axes of the shading frame beside the normal.
    x: Vec3,
    y: Vec3,
    /// Unit vector to the viewer, in world coordinates.
    viewer: Vec3,
    /// Unit vector to the viewer, in the shading frame.
    local_viewer: Vec3,
    /// Roughness parameter of GGX: the square of the roughness.
    alpha: f32,
    /// Roughness parameter along x, for layered materials.
    alpha_x: f32,
    /// Roughness parameter along y.
    alpha_y: f32,
    /// Layers of a layered material.
    layers: MaterialLayers,
    /// Numbers that the lobes of a layered material share.
    lobes: LayeredLobes,
    /// Numbers that the lobes of another microfacet material share.
    prepared: Prepared,
    /// Factor of refracted light: that of the colour for which a dispersive surface is sampled.
    dispersed: Vec3,
    /// Normal of the normal map in the shading frame, which the microfacets' normal is bent from;
    /// only used if `is_mapped`.
    local_mapped: Vec3,
    /// Interpolated normal in the shading frame; only used if `is_mapped`.
    local_smooth: Vec3,
    /// True if a normal map bends the shading normal.
    is_mapped: bool,
    /// True if the viewer is outside.
    front: bool,
}

#[inline(always)]
fn reflect(v: Vec3, h: Vec3) -> Vec3 {
    h * (2.0 * v.dot(h)) - v
}

impl Bsdf {
    /// Creates the BSDF of `material`, whose textures were [read](load_material), seen along the
    /// unit vector `incoming`. `front` is true if the viewer's side is the outside.
    #[inline(always)]
    pub fn new<const POSSIBLE: Features>(
        features: FeatureSet<POSSIBLE>,
        material: Material,
        incoming: Vec3,
        normals: BsdfNormals,
        front: bool,
    ) -> Self {
        let normal = normals.shading;
        let (mut x, mut y, mut local) = (Vec3::X, Vec3::Y, Vec3::Z);
        if features.has::<MICROFACETS>() {
            (x, y) = basis(normal);
            local = -Vec3::new(incoming.dot(x), incoming.dot(y), incoming.dot(normal));
            local.z = max(local.z, 1e-6);
        }
        let alpha = material.roughness * material.roughness;
        let (mut mapped, mut smooth, mut is_mapped) = (Vec3::Z, Vec3::Z, false);
        if features.has::<NORMAL_MAPS>() && normals.is_mapped {
            if !features.has::<MICROFACETS>() {
                (x, y) = basis(normal);
            }
            let (m, n) = (normals.mapped, normals.smooth);
            mapped = Vec3::new(m.dot(x), m.dot(y), m.dot(normal));
            (smooth, is_mapped) = (Vec3::new(n.dot(x), n.dot(y), n.dot(normal)), true);
        }
        let mut bsdf = Self {
            material,
            normal,
            x,
            y,
            viewer: -incoming,
            local_viewer: local,
            alpha,
            alpha_x: alpha,
            alpha_y: alpha,
            layers: MaterialLayers::NONE,
            lobes: LayeredLobes::NONE,
            prepared: Prepared::FACETS,
            dispersed: Vec3::ONE,
            local_mapped: mapped,
            local_smooth: smooth,
            is_mapped,
            front,
        };
        if !is_layered(features, material.kind) {
            bsdf.prepare(features);
        }
        bsdf
    }

    /// Returns the colour of the surface, by which a denoiser divides: that of a diffuse surface,
    /// of the book's metal or of a texture; a conductor's reflectance at normal incidence; 1 for
    /// glass.
    #[inline(always)]
    pub fn albedo<const POSSIBLE: Features>(&self, features: FeatureSet<POSSIBLE>) -> Vec3 {
        let m = &self.material;
        if uses_microfacets(features, m.kind) {
            return of_microfacets!(features, m.kind, albedo(m));
        }
        m.albedo
    }

    /// Returns the diffuseness: how little the reflected light depends on the viewer's position, 0
    /// to 1. It is the fraction that a diffuse base scatters, and of the rest a part that grows
    /// with the width of the lobe.
    #[inline(always)]
    pub fn diffuseness<const POSSIBLE: Features>(&self, features: FeatureSet<POSSIBLE>) -> f32 {
        let m = &self.material;
        if uses_microfacets(features, m.kind) {
            return of_microfacets!(features, m.kind, diffuseness(self));
        }
        of_book!(features, m.kind, diffuseness(m))
    }

    /// Returns whether a lobe is not a delta, so that light sampling can find some directions that
    /// [`Bsdf::sample`] returns.
    #[inline(always)]
    pub fn has_non_delta_lobe<const POSSIBLE: Features>(&self, features: FeatureSet<POSSIBLE>) -> bool {
        let m = &self.material;
        if uses_microfacets(features, m.kind) {
            return of_microfacets!(features, m.kind, has_non_delta_lobe(self));
        }
        of_book!(features, m.kind, has_non_delta_lobe(m))
    }

    /// Returns the shading normal of a surface that reflects alone; zero for one that light passes.
    #[inline(always)]
    pub(crate) fn reflecting_normal<const POSSIBLE: Features>(&self, features: FeatureSet<POSSIBLE>) -> Vec3 {
        let m = &self.material;
        let is_opaque = if is_layered(features, m.kind) {
            m.transmission <= 0.0 && self.layers.diffuse_transmission <= 0.0
        } else {
            m.kind != DIELECTRIC && m.kind != ROUGH_DIELECTRIC && m.transmission <= 0.0
        };
        if is_opaque { self.normal } else { Vec3::ZERO }
    }

    #[inline(always)]
    fn local_to_world(&self, v: Vec3) -> Vec3 {
        normalize(self.x * v.x + self.y * v.y + self.normal * v.z)
    }

    /// Samples a direction: `random.x` and `random.y` choose it within a lobe, `random.z` chooses
    /// the lobe or, for the book's metal, the distance from the ball's centre.
    #[inline(always)]
    pub fn sample<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        random: Words,
    ) -> BsdfSample {
        self.sample_and_evaluate(features, random, Vec3::ZERO, false).0
    }

    /// Samples a direction as [`sample`](Self::sample) does; returns also what
    /// [`evaluate`](Self::evaluate) does for the unit vector `light`, or zero unless `evaluates`.
    ///
    /// The evaluations of a microfacet material are a loop, so that a kernel has their code once:
    /// large kernels do not fit a GPU's instruction cache.
    #[inline(always)]
    pub fn sample_and_evaluate<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        random: Words,
        light: Vec3,
        evaluates: bool,
    ) -> (BsdfSample, BsdfEval) {
        let mut of_light = ZERO_EVAL;
        if uses_microfacets(features, self.material.kind) {
            let (mut sample, local, is_pending) = self.propose_microfacets(features, random);
            let mut at_light = features.has::<NEE>() && evaluates;
            let mut remaining = at_light || is_pending;
            while remaining {
                let eval = self.evaluate_microfacets(
                    features,
                    if at_light { self.world_to_local(light) } else { local },
                );
                if at_light {
                    of_light = eval;
                } else {
                    sample.weigh(eval);
                }
                remaining = at_light && is_pending;
                at_light = false;
            }
            return (sample, of_light);
        }
        let scatter = scatter(features, &self.material, -self.viewer, self.normal, self.front, random);
        let mut sample = BsdfSample {
            direction: scatter.direction,
            weight: self.material.albedo,
            pdf: self.evaluate_book(features, scatter.direction).pdf,
            transmitted: scatter.transmitted,
            absorbed: scatter.absorbed,
        };
        if self.is_mapped_lambertian(features) {
            sample.weight *= self.bump_shadowing(self.world_to_local(scatter.direction));
        }
        if features.has::<NEE>() && evaluates {
            of_light = self.evaluate_book(features, light);
        }
        (sample, of_light)
    }

    /// Returns a vector of world coordinates in the shading frame.
    #[inline(always)]
    fn world_to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.normal))
    }

    /// Returns the cosine between `direction` and the shading normal.
    #[inline(always)]
    pub fn cosine(&self, direction: Vec3) -> f32 {
        direction.dot(self.normal)
    }

    /// Returns value and pdf for the unit vector `direction`.
    #[inline(always)]
    pub fn evaluate<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        direction: Vec3,
    ) -> BsdfEval {
        let kind = self.material.kind;
        if uses_microfacets(features, kind) {
            return self.evaluate_microfacets(features, self.world_to_local(direction));
        }
        self.evaluate_book(features, direction)
    }

    /// Returns value and pdf of the book's materials.
    #[inline(always)]
    fn evaluate_book<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        direction: Vec3,
    ) -> BsdfEval {
        let cos = direction.dot(self.normal);
        if cos <= 0.0 {
            return ZERO_EVAL;
        }
        let pdf = of_book!(features, self.material.kind, pdf(self, direction, cos));
        let mut value = self.material.albedo * pdf;
        if self.is_mapped_lambertian(features) {
            value *= self.bump_shadowing(self.world_to_local(direction));
        }
        BsdfEval { value, pdf }
    }
}
