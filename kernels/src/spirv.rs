//! Entry points for SPIR-V.

use spirv_std::glam::UVec3;
use spirv_std::spirv;
use trisect_shared::buffer::{load, store};
use trisect_shared::bvh::BvhNode;
use trisect_shared::features::{ROULETTE, SCHLICK};
use trisect_shared::film::PixelSums;
use trisect_shared::material::Material;
use trisect_shared::params::RenderParams;
use trisect_shared::path::{self, FirstHit};
use trisect_shared::scene::Scene;
use trisect_shared::sphere::Sphere;

macro_rules! entry_points {
    ($($name:ident $text:tt: $features:expr,)*) => {$(
        /// Adds samples to each pixel's sums.
        #[spirv(compute(threads(8, 8), entry_point_name = $text))]
        pub fn $name(
            #[spirv(global_invocation_id)] id: UVec3,
            #[spirv(uniform, descriptor_set = 0, binding = 0)] params: &RenderParams,
            #[spirv(storage_buffer, descriptor_set = 0, binding = 1)] spheres: &[Sphere],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 2)] nodes: &[BvhNode],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 3)] materials: &[Material],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 4)] film: &mut [PixelSums],
        ) {
            if id.x >= params.width || id.y >= params.rows {
                return;
            }
            let (x, y) = (id.x, params.first_row + id.y);
            let pixel = y * params.width + x;
            let mut sums = PixelSums::ZERO;
            // SAFETY: the guard, and the host's proof of the scene and its film of width * height pixels.
            #[allow(unsafe_code, reason = "see buffer")]
            unsafe {
                if params.resume != 0 {
                    sums = load(film, pixel);
                }
                path::render_pixel::<{ $features }>(params, Scene { spheres, nodes, materials }, x, y, &mut sums);
                store(film, pixel, sums);
            }
        }
    )*};
}

for_each_variant!(entry_points);

/// Writes each pixel's first hit.
#[spirv(compute(threads(8, 8), entry_point_name = "first_hit"))]
pub fn first_hit(
    #[spirv(global_invocation_id)] id: UVec3,
    #[spirv(uniform, descriptor_set = 0, binding = 0)] params: &RenderParams,
    #[spirv(storage_buffer, descriptor_set = 0, binding = 1)] spheres: &[Sphere],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 2)] nodes: &[BvhNode],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 3)] materials: &[Material],
    #[spirv(storage_buffer, descriptor_set = 0, binding = 4)] hits: &mut [FirstHit],
) {
    if id.x >= params.width || id.y >= params.rows {
        return;
    }
    let (x, y) = (id.x, params.first_row + id.y);
    // SAFETY: the guard, and the host's proof of the scene and its buffer of width * height records.
    #[allow(unsafe_code, reason = "see buffer")]
    unsafe {
        let hit = path::first_hit(params, Scene { spheres, nodes, materials }, x, y);
        store(hits, y * params.width + x, hit);
    }
}
