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
//! it) stay out; box tests alone fuse ([`math::fused`]), as they decide which boxes a ray visits, not what it hits. Vulkan promises less (division to 2.5 ULP, reassociation): SPIR-V agrees statistically.
//!
//! # Records
//!
//! What crosses to a device is `repr(C)`, [`bytemuck::Pod`], in rows of 16 bytes, and aligned to 16 bytes, which
//! PTX needs to read a row in one instruction. The sizes:
//!
//! | record | bytes | one per |
//! |---|---|---|
//! | [`params::RenderParams`] | 224 | launch |
//! | [`sphere::Sphere`] | 32 | primitive |
//! | [`planar::Planar`] | 96 | primitive |
//! | [`triangle::Triangle`] | 48 | primitive |
//! | [`triangle::TriangleShading`] | 64 | triangle |
//! | [`material::Material`] | 112 | material |
//! | [`light::Light`] | 64 | light |
//! | [`texture::Texture`] | 48 | use of an image |
//! | [`texture::Texel`] | 8 | texel |
//! | [`environment::EnvironmentTexel`] | 32 | texel of the panorama |
//! | [`bvh::BvhNode`] | 64 | inner node |
//! | `wide::WideNode` | 256 | wide node, on a CPU only |
//! | `wide::TrianglePacket` | 320 | up to 8 triangles, on a CPU only |
//! | `wide::SpherePacket` | 160 | up to 8 spheres, on a CPU only |
//! | [`film::PixelSums`] | 32 | pixel |
//! | [`aovs::AovSums`] | 64 | pixel |
//! | [`denoise::HistoryPixel`] | 48 | pixel, of live frames |
//! | [`display::DisplayParams`] | 16 | launch |
//! | [`denoise::DenoiseParams`] | 208 | pass of a filter |
//! | [`denoise::FilteredPixel`], [`denoise::GBufferTexel`] | 16 | pixel |
//! | [`path::FirstHit`] | 32 | pixel |
#![no_std]
#![cfg_attr(target_arch = "nvptx64", feature(core_float_math, link_llvm_intrinsics))]

#[cfg(feature = "std")]
extern crate std;

pub mod aovs;
pub mod bsdf;
pub mod buffer;
pub mod buffer_layout;
pub mod bvh;
pub mod camera;
pub mod denoise;
pub mod display;
pub mod environment;
pub mod features;
pub mod film;
pub mod fresnel;
pub mod light;
pub mod material;
pub mod math;
pub mod microfacet;
pub mod params;
pub mod path;
pub mod planar;
pub mod ray;
pub mod rng;
pub mod sampler;
pub mod scene;
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
pub mod simd;
pub mod sky;
pub mod slabs;
pub mod sphere;
pub mod surface;
pub mod texture;
pub mod tile_entry;
pub mod traversal;
pub mod triangle;
pub mod warp;
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
pub mod wide;
