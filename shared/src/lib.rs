//! Code of Trisect that runs on every target: natively on the CPU, as SPIR-V through rust-gpu, and
//! as PTX through rustc's NVPTX target.
//!
//! It renders, denoises and displays pixels, from records that the host (crate `trisect`) writes.
//! The host's CPU backend calls it directly; crate `trisect-kernels` wraps it in the entry points
//! of GPUs. It is `no_std`, allocates nothing, does not recurse, cannot panic on a device, and uses
//! no floating-point function that is not in [`math`].
//!
//! This page is the contract between host and kernels.
//!
//! # Units and axes
//!
//! * Coordinates are right-handed, y up. Distances are in scene units.
//! * Angles are in radians, or in turns of 2π where a name says so.
//! * Radiance is linear, with Rec. 709 primaries.
//! * Row 0 of an image is its top row. Pixels are numbered row by row.
//! * Directions and normals are unit vectors, unless their documentation says otherwise.
//! * A pdf of directions is per steradian; a pdf of points of a light is per unit of area.
//!
//! # Identical results
//!
//! In a precise build every operation is an IEEE 754 addition, subtraction, multiplication,
//! division or square root, rounded to nearest even, or an integer operation, and the source fixes
//! the order of operations. The CPU and PTX therefore give the same bits.
//!
//! * `mul_add`, libm, and glam's `length` and `normalize`, which call libm, are not used outside of
//!   [`math`].
//! * Only box tests fuse a product and a sum ([`math::fused`]) or approximate a reciprocal
//!   ([`math::reciprocal`]). They decide which boxes a ray visits, not what it hits.
//! * Vulkan promises less: division within 2.5 ULP, denormals that may be flushed, and
//!   reassociation of arithmetic that is not decorated `NoContraction`, which the build therefore
//!   adds. An image through SPIR-V agrees with the CPU's statistically.
//!
//! A sample does not depend on the device or process that renders it: a random number is a function
//! of seed, pixel, sample and dimension ([`rng`]), and a pixel's samples are summed in index order
//! ([`film`]).
//!
//! # Indices
//!
//! Kernels read arrays without bounds checks. The host proves the indices of a scene before a
//! launch; [`buffer`] lists what it proves. Primitives are numbered spheres first, then planar
//! shapes, then triangles: those in the world, then those of meshes that [instances](instance)
//! place. Instances have the numbers behind.
//!
//! These values stand for "none":
//!
//! | value | meaning |
//! |---|---|
//! | [`bvh::NO_PRIMITIVE`] | no primitive is hit |
//! | [`bvh::NO_INSTANCE`] | a hit in the world, not in an instance |
//! | [`bvh::Child::EMPTY`] | a scene without primitives, or an empty tile |
//! | [`sphere::MISS`] | distance of a ray that misses |
//! | [`texture::NO_TEXTURE`] | a material without a texture |
//! | [`tile_entry::NO_TILE_ENTRIES`] | camera rays start at the root of the BVH |
//! | [`params::NO_CLAMP`] | no maximum of a sample's radiance |
//!
//! # Records
//!
//! Records that cross to a device are `repr(C)` and [`bytemuck::Pod`], in rows of 16 bytes, and
//! aligned to 16 bytes, which PTX needs to read a row with one instruction. ([`texture::Texel`] has
//! 8 bytes.) Each record's size is asserted at compile time; `docs/reference/kernels.md` lists
//! sizes, alignments and bindings, and a test compares that page with the code. Unused fields
//! (`pad`) are ignored.
//!
//! Scene, read by render kernels:
//!
//! | record | one for each |
//! |---|---|
//! | [`sphere::Sphere`] | primitive: sphere |
//! | [`planar::Planar`] | primitive: quad or disc |
//! | [`triangle::Triangle`] | primitive: triangle |
//! | [`attributes::MeshVertex`] | vertex of a mesh instance |
//! | [`attributes::VertexAttributes`] | vertex with a tangent, a colour or second texture
//! coordinates |
//! | [`material::Material`] | material |
//! | [`medium::Medium`] | participating medium |
//! | [`light::Light`] | light that next-event estimation samples |
//! | [`texture::Texture`] | use of an image |
//! | [`texture::Texel`] | texel of an image |
//! | [`environment::EnvironmentTexel`] | texel of the environment map |
//! | [`bvh::BvhNode`] | inner node of the binary BVH, and tile entry |
//! | [`instance::InstanceEntry`], [`instance::InstancePlacement`] | instance of a mesh |
//! | `wide::WideNode` | node of the wide BVH, on the CPU only |
//! | `wide::TrianglePacket` | leaf of up to 8 triangles, on the CPU only |
//! | `wide::SpherePacket` | leaf of up to 8 spheres, on the CPU only |
//!
//! Film and images, written by kernels:
//!
//! | record | one for each |
//! |---|---|
//! | [`film::PixelSums`] | pixel: sums over its samples |
//! | [`film::Compensation`] | pixel: rounding errors of an unfinished chunk |
//! | [`aovs::AovSums`] | pixel: sums of AOVs at the camera ray's first hit |
//! | [`path::FirstHit`] | pixel: first hit of one sample |
//! | [`denoise::FilteredPixel`] | pixel: colour and variance between passes of a filter |
//! | [`denoise::GBufferTexel`] | pixel: normal and inverse depth |
//! | [`denoise::HistoryPixel`] | pixel of live frames: history for the next frame |
//!
//! Launch records:
//!
//! | record | one for each |
//! |---|---|
//! | [`params::RenderParams`] | launch of a render kernel |
//! | [`scene::SceneLengths`] | launch of a render kernel, PTX only: lengths of the scene's arrays |
//! | [`denoise::DenoiseParams`] | launch of a denoising pass |
//! | [`display::DisplayParams`] | launch of the display kernel |
//! | [`totals::TotalsParams`] | launch of a kernel of the film's totals |
#![no_std]
#![cfg_attr(target_arch = "nvptx64", feature(core_float_math, link_llvm_intrinsics))]

#[cfg(feature = "std")]
extern crate std;

pub mod aovs;
pub mod attributes;
pub mod bsdf;
pub mod buffer;
pub mod buffer_layout;
pub mod bvh;
pub mod camera;
mod curvature;
pub mod denoise;
pub mod display;
pub mod environment;
pub mod features;
pub mod film;
pub mod fresnel;
pub mod glass_albedo;
pub mod instance;
pub mod layers;
pub mod light;
pub mod math;
pub mod medium;
pub mod microfacet;
pub mod microfacet_albedo;
pub mod noise;
pub mod params;
pub mod path;
pub mod planar;
pub mod primitive;
pub mod ray;
pub mod records;
pub mod rng;
pub mod sampler;
pub mod scene;
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
pub mod simd;
pub mod sky;
pub mod slabs;
pub mod smooth_surface;
pub mod sphere;
pub mod stretched_albedo;
pub mod surface;
pub mod texture;
pub mod tile_entry;
pub mod totals;
pub mod traversal;
pub mod triangle;
pub mod warp;
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
pub mod wide;

pub use records::material;
