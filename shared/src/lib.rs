//! The code of Trisect that runs everywhere: natively on the CPU, as SPIR-V through rust-gpu, as PTX through
//! rustc's NVPTX target. No allocation, no recursion, no panic on a device, no floating-point function that is
//! not in [`math`].
//!
//! # Units and axes
//!
//! Right-handed, y up; distances in scene units; angles in radians; radiance linear with Rec. 709 primaries.
//! Row 0 of an image is its top row.
//!
//! # Same bits
//!
//! In a precise build every operation here is an IEEE 754 addition, subtraction, multiplication, division or
//! square root, rounded to nearest even, or an integer operation, and the order of operations is fixed by the
//! source. So the CPU and PTX give the same bits. `mul_add`, libm and glam's `length` and `normalize` (which call
//! it) stay out. Vulkan promises less (division to 2.5 ULP, reassociation): SPIR-V agrees statistically.
//!
//! # Records
//!
//! What crosses to a device is `repr(C)`, [`bytemuck::Pod`], in rows of 16 bytes, and aligned to 16 bytes, which
//! PTX needs to read a row in one instruction. The sizes:
//!
//! | record | bytes | one per |
//! |---|---|---|
//! | [`params::RenderParams`] | 176 | launch |
//! | [`sphere::Sphere`] | 32 | primitive |
//! | [`material::Material`] | 32 | material |
//! | [`bvh::BvhNode`] | 64 | inner node |
//! | [`film::PixelSums`] | 32 | pixel |
//! | [`path::FirstHit`] | 32 | pixel |
#![no_std]
#![cfg_attr(target_arch = "nvptx64", feature(core_float_math))]

#[cfg(feature = "std")]
extern crate std;

pub mod buffer;
pub mod bvh;
pub mod camera;
pub mod features;
pub mod film;
pub mod material;
pub mod math;
pub mod params;
pub mod path;
pub mod ray;
pub mod rng;
pub mod scene;
pub mod sky;
pub mod sphere;
