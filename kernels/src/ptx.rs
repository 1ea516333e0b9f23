//! Entry points for PTX.
//!
//! Parameters come by value: they lie in the constant bank then, and cost neither loads nor registers.
#![allow(unsafe_code, reason = "kernels take raw pointers and export names")]

use core::arch::nvptx::{
    _block_dim_x, _block_dim_y, _block_idx_x, _block_idx_y, _thread_idx_x, _thread_idx_y, trap,
};
use core::slice::from_raw_parts;
use trisect_shared::bvh::BvhNode;
use trisect_shared::features::{ROULETTE, SCHLICK};
use trisect_shared::film::PixelSums;
use trisect_shared::material::Material;
use trisect_shared::params::RenderParams;
use trisect_shared::path::{self, FirstHit};
use trisect_shared::scene::Scene;
use trisect_shared::sphere::Sphere;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    // SAFETY: stops the launch with an error.
    unsafe { trap() }
}

/// The pixel of this thread.
#[inline(always)]
fn pixel_of_thread(params: &RenderParams) -> (u32, u32) {
    // SAFETY: these read special registers.
    unsafe {
        let x = (_block_idx_x() * _block_dim_x() + _thread_idx_x()) as u32;
        let y = (_block_idx_y() * _block_dim_y() + _thread_idx_y()) as u32;
        (x, if y < params.rows { params.first_row + y } else { params.height })
    }
}

/// The scene behind an entry point's pointers.
///
/// # Safety
///
/// They name device arrays of the given lengths.
#[inline(always)]
unsafe fn scene<'a>(
    spheres: *const Sphere,
    sphere_count: usize,
    nodes: *const BvhNode,
    node_count: usize,
    materials: *const Material,
    material_count: usize,
) -> Scene<'a> {
    // SAFETY: the caller's promise.
    unsafe {
        Scene {
            spheres: from_raw_parts(spheres, sphere_count),
            nodes: from_raw_parts(nodes, node_count),
            materials: from_raw_parts(materials, material_count),
        }
    }
}

macro_rules! entry_points {
    ($($name:ident $text:tt: $features:expr,)*) => {$(
        /// Adds samples to each pixel's sums.
        ///
        /// # Safety
        ///
        /// The pointers name device arrays of the given lengths, and `film` one of width * height records.
        #[unsafe(no_mangle)]
        pub unsafe extern "ptx-kernel" fn $name(
            params: RenderParams,
            spheres: *const Sphere,
            sphere_count: usize,
            nodes: *const BvhNode,
            node_count: usize,
            materials: *const Material,
            material_count: usize,
            film: *mut PixelSums,
        ) {
            let (x, y) = pixel_of_thread(&params);
            if x >= params.width || y >= params.height {
                return;
            }
            // SAFETY: the caller's promise, and the guard.
            unsafe {
                let scene = scene(spheres, sphere_count, nodes, node_count, materials, material_count);
                let film = film.add((y * params.width + x) as usize);
                let mut sums = if params.resume != 0 { *film } else { PixelSums::ZERO };
                path::render_pixel::<{ $features }>(&params, scene, x, y, &mut sums);
                *film = sums;
            }
        }
    )*};
}

for_each_variant!(entry_points);

/// Writes each pixel's first hit.
///
/// # Safety
///
/// The pointers name device arrays of the given lengths, and `hits` one of width * height records.
#[unsafe(no_mangle)]
pub unsafe extern "ptx-kernel" fn first_hit(
    params: RenderParams,
    spheres: *const Sphere,
    sphere_count: usize,
    nodes: *const BvhNode,
    node_count: usize,
    materials: *const Material,
    material_count: usize,
    hits: *mut FirstHit,
) {
    let (x, y) = pixel_of_thread(&params);
    if x >= params.width || y >= params.height {
        return;
    }
    // SAFETY: the caller's promise, and the guard.
    unsafe {
        let scene = scene(spheres, sphere_count, nodes, node_count, materials, material_count);
        *hits.add((y * params.width + x) as usize) = path::first_hit(&params, scene, x, y);
    }
}
