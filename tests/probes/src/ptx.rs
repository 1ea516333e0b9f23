//! Entry points of the probes for PTX: a thread serves one input.
#![allow(unsafe_code, reason = "kernels take raw pointers and export names")]

use crate::record::{Input, Output, ProbeParams};
use core::arch::nvptx::{_block_dim_x, _block_idx_x, _thread_idx_x, trap};
use core::slice::from_raw_parts;
use trisect_shared::attributes::MeshVertex;
use trisect_shared::bvh::BvhNode;
use trisect_shared::environment::EnvironmentTexel;
use trisect_shared::light::Light;
use trisect_shared::material::Material;
use trisect_shared::planar::Planar;
use trisect_shared::scene::{Scene, SceneLengths};
use trisect_shared::sphere::Sphere;
use trisect_shared::texture::{Texel, Texture};
use trisect_shared::triangle::Triangle;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    // SAFETY: stops the launch with an error.
    unsafe { trap() }
}

macro_rules! entry_points {
    ($($module:ident $text:tt,)*) => {$(
        /// Computes the output of one input per thread.
        ///
        /// # Safety
        ///
        /// The pointers must name device arrays of the given lengths; the last two arrays have
        /// `params.count` records.
        #[unsafe(export_name = $text)]
        #[allow(clippy::too_many_arguments, reason = "a pointer each")]
        pub unsafe extern "ptx-kernel" fn $module(
            params: ProbeParams,
            lengths: SceneLengths,
            spheres: *const Sphere,
            nodes: *const BvhNode,
            materials: *const Material,
            planars: *const Planar,
            triangles: *const Triangle,
            vertices: *const MeshVertex,
            lights: *const Light,
            textures: *const Texture,
            texels: *const Texel,
            environment: *const EnvironmentTexel,
            inputs: *const Input,
            outputs: *mut Output,
        ) {
            // SAFETY: these read special registers.
            let index = unsafe { _block_idx_x() * _block_dim_x() + _thread_idx_x() } as u32;
            if index >= params.count {
                return;
            }
            // SAFETY: the caller guarantees the arrays, and the index was checked.
            #[allow(unused_unsafe, reason = "some probes are unsafe")]
            unsafe {
                let scene = Scene {
                    spheres: from_raw_parts(spheres, lengths.spheres),
                    nodes: from_raw_parts(nodes, lengths.nodes),
                    materials: from_raw_parts(materials, lengths.materials),
                    planars: from_raw_parts(planars, lengths.planars),
                    triangles: from_raw_parts(triangles, lengths.triangles),
                    vertices: from_raw_parts(vertices, lengths.vertices),
                    lights: from_raw_parts(lights, lengths.lights),
                    textures: from_raw_parts(textures, lengths.textures),
                    texels: from_raw_parts(texels, lengths.texels),
                    environment: from_raw_parts(environment, lengths.environment),
                };
                *outputs.add(index as usize) =
                    crate::$module::$module(&params, scene, *inputs.add(index as usize));
            }
        }
    )*};
}

crate::for_each_probe!(entry_points);
