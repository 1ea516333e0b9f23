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

/// Whether `features` has every bit of `feature`.
#[inline(always)]
pub const fn has(features: Features, feature: Features) -> bool {
    features & feature == feature
}
