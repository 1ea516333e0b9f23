//! What a kernel variant can do: a mask of bits, a const generic of the render kernels.
//!
//! Branches on a bit vanish at compile time, so a scene pays only for what it has. Neither PTX nor pass-through SPIR-V has
//! specialisation constants, so each named variant is compiled ahead.

/// A set of features.
pub type Features = u32;

/// End paths at random, with the chance that their throughput has left.
pub const ROULETTE: Features = 1 << 0;
/// Reflect by Schlick's approximation as the book has it, instead of Fresnel's equations.
pub const SCHLICK: Features = 1 << 1;
/// Draw from the Owen-scrambled Sobol sequence, not independently.
pub const SOBOL: Features = 1 << 2;
/// Has quads or discs.
pub const PLANAR: Features = 1 << 3;
/// Has triangles.
pub const TRIANGLES: Features = 1 << 4;
/// Has emitting surfaces or lights without extent: next-event estimation.
pub const EMITTERS: Features = 1 << 5;
/// Has a panorama as its sky.
pub const ENVIRONMENT: Features = 1 << 6;
/// Has image textures or surfaces with holes.
pub const TEXTURES: Features = 1 << 7;
/// Has microfacet materials.
pub const MICROFACETS: Features = 1 << 8;

/// Write [`Guides`](crate::aovs::AovSums) of what camera rays meet first.
pub const AOVS: Features = 1 << 13;

/// Test each primitive, without a tree: what the trees must agree with.
pub const LINEAR: Features = 1 << 9;
/// Trace the wide tree.
pub const WIDE: Features = 1 << 10;
/// Start a lane's next sample as soon as its path ends, not when all paths of its warp have.
pub const REGENERATE: Features = 1 << 11;
/// Count the visits of a traversal: see [`Visits`](crate::bvh::Visits). No render kernel has this.
pub const COUNTED: Features = 1 << 14;

/// Fill the device once, and let each lane take pixels from a queue.
pub const PERSISTENT: Features = 1 << 12;
/// How a kernel works, not what a scene has: these do not change its image.
pub const STRATEGY: Features = LINEAR | WIDE | REGENERATE | PERSISTENT;

/// The wide tree by AVX2. Whoever calls a function with this bit promises that the CPU has it.
pub const AVX2: Features = 1 << 30;
/// The wide tree by AVX-512, promised likewise.
pub const AVX512: Features = 1 << 31;

/// Whether `features` has every bit of `feature`.
#[inline(always)]
pub const fn has(features: Features, feature: Features) -> bool {
    features & feature == feature
}

/// Whether `features` has a bit of `some`.
#[inline(always)]
pub const fn has_any(features: Features, some: Features) -> bool {
    features & some != 0
}

/// What needs a shadow ray.
pub const NEE: Features = EMITTERS | ENVIRONMENT;

/// What makes a kernel large: many registers, and lanes that do different things.
pub const HEAVY: Features = PLANAR | TRIANGLES | NEE | TEXTURES;

/// Everything that a scene can have.
pub const ALL: Features =
    ROULETTE | SCHLICK | PLANAR | TRIANGLES | EMITTERS | ENVIRONMENT | TEXTURES | MICROFACETS;
