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
mod conductor;
mod dielectric;
mod lambertian;
mod metal;
mod metallic_roughness;
mod microfacets;
mod rough_dielectric;

use crate::features::{Features, MICROFACETS, TEXTURES, has};
use crate::material::{BLENDED, MASKED, Material};
use crate::math::{basis, max, normalize};
use crate::rng::Words;
use crate::scene::Scene;
use crate::texture::{NO_TEXTURE, color, sample};
use glam::Vec3;

/// Kind of a diffuse material.
pub const LAMBERTIAN: u32 = 0;
/// Kind of the book's metal.
pub const METAL: u32 = 1;
/// Kind of smooth clear glass; kinds above are microfacet materials.
pub const DIELECTRIC: u32 = 2;
/// Kind of a rough metal.
pub const CONDUCTOR: u32 = 3;
/// Kind of clear glass with a rough boundary.
pub const ROUGH_DIELECTRIC: u32 = 4;
/// Kind of glTF's material.
pub const METALLIC_ROUGHNESS: u32 = 5;

/// Evaluates an item of the `book::BookLobe` of a kind.
macro_rules! of_book {
    ($kind:expr, $($item:tt)+) => {{
        use $crate::bsdf::book::BookLobe;
        match $kind {
            $crate::bsdf::METAL => $crate::bsdf::metal::Metal::$($item)+,
            $crate::bsdf::DIELECTRIC => $crate::bsdf::dielectric::Dielectric::$($item)+,
            _ => $crate::bsdf::lambertian::Lambertian::$($item)+,
        }
    }};
}

/// Evaluates an item of the `microfacets::MicrofacetLobe` of a kind.
macro_rules! of_microfacets {
    ($kind:expr, $($item:tt)+) => {{
        use $crate::bsdf::microfacets::MicrofacetLobe;
        match $kind {
            $crate::bsdf::CONDUCTOR => $crate::bsdf::conductor::Conductor::$($item)+,
            $crate::bsdf::ROUGH_DIELECTRIC => $crate::bsdf::rough_dielectric::RoughDielectric::$($item)+,
            _ => $crate::bsdf::metallic_roughness::MetallicRoughness::$($item)+,
        }
    }};
}

use {of_book, of_microfacets};

pub use book::{Scatter, scatter};

/// Returns the opacity of `material` at texture coordinates (`u`, `v`), 0 to 1: the part of the
/// light that does not pass straight through.
///
/// # Safety
///
/// The scene's textures were proven as [`crate::buffer`] says.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn opacity(scene: Scene, material: &Material, u: f32, v: f32) -> f32 {
    if material.flags & (MASKED | BLENDED) == 0 {
        return 1.0;
    }
    let mut opacity = material.opacity;
    if material.albedo_texture != NO_TEXTURE {
        // SAFETY: the caller's promise.
        opacity *= unsafe { sample(scene, material.albedo_texture, u, v) }.w;
    }
    if material.flags & MASKED == 0 {
        opacity
    } else if opacity >= material.alpha_cutoff {
        1.0
    } else {
        0.0
    }
}

/// Direction in which the path continues.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Unit vector, in world coordinates.
    pub direction: Vec3,
    /// Value times |cosine| over pdf: factor on the throughput.
    pub weight: Vec3,
    /// pdf of the direction, per steradian; 0 for a delta lobe, which light sampling cannot find.
    pub pdf: f32,
    /// True if the direction is on the other side of the surface than the viewer.
    pub transmitted: bool,
    /// True if the path ends here.
    pub absorbed: bool,
}

/// Value of a BSDF for one direction, and pdf of sampling that direction.
#[derive(Clone, Copy, Debug)]
pub struct BsdfEval {
    /// Value times |cosine| by channel; zero where the surface does not scatter.
    pub value: Vec3,
    /// pdf of sampling this direction, per steradian.
    pub pdf: f32,
}

const ZERO_EVAL: BsdfEval = BsdfEval { value: Vec3::ZERO, pdf: 0.0 };

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
    /// True if the viewer is outside.
    front: bool,
}

#[inline(always)]
fn reflect(v: Vec3, h: Vec3) -> Vec3 {
    h * (2.0 * v.dot(h)) - v
}

impl Bsdf {
    /// Creates the BSDF of `material` with its textures read at (`u`, `v`), seen along the unit
    /// vector `incoming`. `normal` is the unit shading normal on the viewer's side; `front` is true
    /// if that is the outside.
    ///
    /// # Safety
    ///
    /// The scene's textures were proven as [`crate::buffer`] says.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub unsafe fn new<const FEATURES: Features>(
        scene: Scene,
        mut material: Material,
        incoming: Vec3,
        normal: Vec3,
        front: bool,
        (u, v): (f32, f32),
    ) -> Self {
        if const { has(FEATURES, TEXTURES) } {
            // SAFETY: the caller's promise.
            unsafe {
                material.albedo *= color(scene, material.albedo_texture, u, v);
                if const { has(FEATURES, MICROFACETS) } && material.kind > DIELECTRIC {
                    of_microfacets!(material.kind, read_textures(scene, &mut material, u, v));
                }
            }
        }
        let (mut x, mut y, mut local) = (Vec3::X, Vec3::Y, Vec3::Z);
        if const { has(FEATURES, MICROFACETS) } {
            (x, y) = basis(normal);
            local = -Vec3::new(incoming.dot(x), incoming.dot(y), incoming.dot(normal));
            local.z = max(local.z, 1e-6);
        }
        let alpha = material.roughness * material.roughness;
        Self { material, normal, x, y, viewer: -incoming, local_viewer: local, alpha, front }
    }

    /// Returns the colour of the surface, by which a denoiser divides: that of a diffuse surface,
    /// of the book's metal or of a texture; a conductor's reflectance at normal incidence; 1 for
    /// glass.
    #[inline(always)]
    pub fn albedo<const FEATURES: Features>(&self) -> Vec3 {
        let m = &self.material;
        if const { has(FEATURES, MICROFACETS) } && m.kind > DIELECTRIC {
            return of_microfacets!(m.kind, albedo(m));
        }
        m.albedo
    }

    /// Returns the diffuseness: how little the reflected light depends on the viewer's position, 0
    /// to 1. It is the fraction that a diffuse base scatters, and of the rest a part that grows
    /// with the width of the lobe.
    #[inline(always)]
    pub fn diffuseness<const FEATURES: Features>(&self) -> f32 {
        let m = &self.material;
        if const { has(FEATURES, MICROFACETS) } && m.kind > DIELECTRIC {
            return of_microfacets!(m.kind, diffuseness(self));
        }
        of_book!(m.kind, diffuseness(m))
    }

    /// Returns whether a lobe is not a delta, so that light sampling can find some directions that
    /// [`Bsdf::sample`] returns.
    #[inline(always)]
    pub fn has_non_delta_lobe<const FEATURES: Features>(&self) -> bool {
        let m = &self.material;
        if const { has(FEATURES, MICROFACETS) } && m.kind > DIELECTRIC {
            return of_microfacets!(m.kind, has_non_delta_lobe(self));
        }
        of_book!(m.kind, has_non_delta_lobe(m))
    }

    #[inline(always)]
    fn local_to_world(&self, v: Vec3) -> Vec3 {
        normalize(self.x * v.x + self.y * v.y + self.normal * v.z)
    }

    /// Samples a direction: `random.x` and `random.y` choose it within a lobe, `random.z` chooses
    /// the lobe or, for the book's metal, the distance from the ball's centre. `schlick` chooses
    /// Schlick's approximation in kernels that can do both.
    #[inline(always)]
    pub fn sample<const FEATURES: Features>(&self, schlick: bool, random: Words) -> BsdfSample {
        let kind = self.material.kind;
        if const { has(FEATURES, MICROFACETS) } && kind > DIELECTRIC {
            return self.sample_microfacets(random);
        }
        let scatter =
            scatter::<FEATURES>(&self.material, -self.viewer, self.normal, self.front, schlick, random);
        BsdfSample {
            direction: scatter.direction,
            weight: self.material.albedo,
            pdf: self.evaluate_book(scatter.direction).pdf,
            transmitted: scatter.transmitted,
            absorbed: scatter.absorbed,
        }
    }

    /// Returns the cosine between `direction` and the shading normal.
    #[inline(always)]
    pub fn cosine(&self, direction: Vec3) -> f32 {
        direction.dot(self.normal)
    }

    /// Returns value and pdf for the unit vector `direction`.
    #[inline(always)]
    pub fn evaluate<const FEATURES: Features>(&self, direction: Vec3) -> BsdfEval {
        let kind = self.material.kind;
        if const { has(FEATURES, MICROFACETS) } && kind > DIELECTRIC {
            let to = Vec3::new(direction.dot(self.x), direction.dot(self.y), direction.dot(self.normal));
            return self.evaluate_microfacets(to);
        }
        self.evaluate_book(direction)
    }

    /// Returns value and pdf of the book's materials.
    #[inline(always)]
    fn evaluate_book(&self, direction: Vec3) -> BsdfEval {
        let cos = direction.dot(self.normal);
        if cos <= 0.0 {
            return ZERO_EVAL;
        }
        let pdf = of_book!(self.material.kind, pdf(self, direction, cos));
        BsdfEval { value: self.material.albedo * pdf, pdf }
    }
}
