//! Entry points of the probes for SPIR-V: an invocation serves one input.

use crate::record::{Input, Output, ProbeParams};
use spirv_std::glam::{UVec3, UVec4};
use spirv_std::spirv;
use trisect_shared::buffer::{RecordSlice, load, store};
use trisect_shared::buffer_layout::Packed;
use trisect_shared::bvh::BvhNode;
use trisect_shared::material::Material;
use trisect_shared::scene::Scene;
use trisect_shared::texture::Texel;

macro_rules! entry_points {
    ($($module:ident $text:tt,)*) => {$(
        /// Computes the output of one input per invocation.
        #[spirv(compute(threads(64), entry_point_name = $text))]
        #[allow(clippy::too_many_arguments, reason = "a binding each")]
        pub fn $module(
            #[spirv(global_invocation_id)] id: UVec3,
            #[spirv(uniform, descriptor_set = 0, binding = 0)] params: &ProbeParams,
            #[spirv(storage_buffer, descriptor_set = 0, binding = 1)] spheres: &[UVec4],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 2)] nodes: &[Packed<BvhNode>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 3)] materials: &[Packed<Material>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 4)] planars: &[UVec4],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 5)] triangles: &[UVec4],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 6)] vertices: &[UVec4],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 7)] lights: &[UVec4],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 8)] textures: &[UVec4],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 9)] texels: &[Packed<Texel>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 10)] environment: &[UVec4],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 11)] inputs: &[Packed<Input>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 12)] outputs: &mut [Packed<Output>],
        ) {
            if id.x >= params.count {
                return;
            }
            let scene = Scene {
                spheres: RecordSlice::new(spheres, 0),
                nodes,
                materials,
                planars: RecordSlice::new(planars, 0),
                triangles: RecordSlice::new(triangles, 0),
                vertices: RecordSlice::new(vertices, 0),
                lights: RecordSlice::new(lights, 0),
                textures: RecordSlice::new(textures, 0),
                texels,
                environment: RecordSlice::new(environment, 0),
            };
            // SAFETY: the index was checked; the caller validated the scene and provides
            // `params.count` records.
            #[allow(unsafe_code, unused_unsafe, reason = "see buffer; some probes are unsafe")]
            unsafe {
                let output = crate::$module::$module(params, scene, load::<Input>(inputs, id.x));
                store(outputs, id.x, output);
            }
        }
    )*};
}

crate::for_each_probe!(entry_points);
