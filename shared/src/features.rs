//! Features of a kernel variant: a mask of bits, a const generic of the render kernels.
//!
//! A branch on a bit is decided at compile time, so a scene pays only for what it needs. Neither
//! PTX nor pass-through SPIR-V has specialisation constants, so each variant is compiled ahead
//! (`trisect_kernels::for_each_variant`) and the host chooses one by its mask.

/// Set of features.
pub type Features = u32;

/// Russian roulette: a path survives with the largest component of its throughput, at most 1, as
/// probability.
pub const ROULETTE: Features = 1 << 0;
/// Schlick's approximation as "Ray Tracing in One Weekend" (the book) has it, instead of Fresnel's
/// equations. With [`MICROFACETS`], [`FLAG_SCHLICK`](crate::params::FLAG_SCHLICK) chooses.
pub const SCHLICK: Features = 1 << 1;
/// Owen-scrambled Sobol sequence instead of independent random numbers.
pub const SOBOL: Features = 1 << 2;
/// Planar shapes: quads and discs.
pub const PLANAR: Features = 1 << 3;
/// Triangles.
pub const TRIANGLES: Features = 1 << 4;
/// Next-event estimation of emitting surfaces and of lights without extent.
pub const EMITTERS: Features = 1 << 5;
/// Environment map as the sky, with next-event estimation.
pub const ENVIRONMENT: Features = 1 << 6;
/// Image textures, and surfaces that are masked or blended.
pub const TEXTURES: Features = 1 << 7;
/// Microfacet materials.
pub const MICROFACETS: Features = 1 << 8;

/// Writing of [`AovSums`](crate::aovs::AovSums) at the camera ray's first hit.
pub const AOVS: Features = 1 << 13;

/// Traversal that tests each primitive, without a BVH; all other traversals must agree with it.
pub const LINEAR: Features = 1 << 9;
/// Traversal of the wide BVH.
pub const WIDE: Features = 1 << 10;
/// Schedule: a lane starts its next sample as soon as its path ends, not when all paths of its warp
/// have ended.
pub const REGENERATE: Features = 1 << 11;
/// Counting of the [`Visits`](crate::bvh::Visits) of a traversal. No render kernel has this.
pub const COUNTED: Features = 1 << 14;

/// Schedule: the device is filled once, and each lane takes pixels from a queue.
pub const PERSISTENT: Features = 1 << 12;
/// Features that choose traversal and schedule. They do not change the image.
pub const STRATEGY: Features = LINEAR | WIDE | REGENERATE | PERSISTENT;

/// Wide traversal by AVX2. The caller of a function with this feature promises that the CPU
/// supports it.
pub const AVX2: Features = 1 << 30;
/// Wide traversal by AVX-512. The caller of a function with this feature promises that the CPU
/// supports it.
pub const AVX512: Features = 1 << 31;

/// Returns whether `features` has every bit of `feature`.
#[inline(always)]
pub const fn has(features: Features, feature: Features) -> bool {
    features & feature == feature
}

/// Returns whether `features` has any bit of `some`.
#[inline(always)]
pub const fn has_any(features: Features, some: Features) -> bool {
    features & some != 0
}

/// Features that need shadow rays, for next-event estimation.
pub const NEE: Features = EMITTERS | ENVIRONMENT;

/// Features that make a kernel large: it takes many registers, and its lanes diverge.
pub const HEAVY: Features = PLANAR | TRIANGLES | NEE | TEXTURES;

/// All features that a render can need, except [`SOBOL`], [`AOVS`] and [`STRATEGY`].
pub const ALL: Features =
    ROULETTE | SCHLICK | PLANAR | TRIANGLES | EMITTERS | ENVIRONMENT | TEXTURES | MICROFACETS;
