//! Entry points: each unpacks its bindings, guards its index and calls the shared crate.
//!
//! Compiled for a device, this crate is the entry points in `spirv` or `ptx`. Compiled for the host, it is what they
//! became: the prebuilt artifacts and their names. Both come from one list, `for_each_variant`.
//!
//! # Bindings
//!
//! | binding | SPIR-V, set 0 | PTX argument | content |
//! |---|---|---|---|
//! | 0 | uniform | by value | [`RenderParams`](trisect_shared::params::RenderParams) |
//! | 1 | storage, read | pointer, length | `[Sphere]` |
//! | 2 | storage, read | pointer, length | `[BvhNode]` |
//! | 3 | storage, read | pointer, length | `[Material]` |
//! | 4 | storage | pointer | `[PixelSums]` (render) or `[FirstHit]`, a whole image |
//!
//! A thread serves pixel (x, `first_row` + y); work groups are 8 × 8.
#![cfg_attr(any(target_arch = "spirv", target_arch = "nvptx64"), no_std)]
#![cfg_attr(target_arch = "nvptx64", feature(abi_ptx, stdarch_nvptx))]

/// Calls a macro with each render variant: entry point, its name (attributes take literals only) and its feature mask.
#[macro_export]
macro_rules! for_each_variant {
    ($variant:ident) => {
        $variant! {
            render "render": 0,
            render_roulette "render_roulette": ROULETTE,
            render_schlick "render_schlick": SCHLICK,
            render_schlick_roulette "render_schlick_roulette": SCHLICK | ROULETTE,
        }
    };
}

#[cfg(target_arch = "nvptx64")]
pub mod ptx;
#[cfg(target_arch = "spirv")]
pub mod spirv;

#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
mod prebuilt;
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
pub use prebuilt::*;
