//! Single functions of the shared crate as kernels: words in, words out.
//!
//! A probe is a function of an [`Input`](record::Input). It runs natively and, through the entry
//! points in `spirv` and `ptx`, on a device, like the render kernels. So a torture test can compare
//! the outputs of all backends for one input. Some operations are faulty on purpose: they are
//! negative controls of the tests.
//!
//! | binding | SPIR-V, set 0 | PTX argument | content |
//! |---|---|---|---|
//! | 0 | uniform | by value | [`ProbeParams`](record::ProbeParams) |
//! | 1 to 10 | storage, read | [`SceneLengths`] by value, then pointers | arrays of a scene |
//! | 11 | storage, read | pointer | `[Input]` |
//! | 12 | storage | pointer | `[Output]` |
//!
//! [`SceneLengths`]: trisect_shared::scene::SceneLengths
#![cfg_attr(any(target_arch = "spirv", target_arch = "nvptx64"), no_std)]
#![cfg_attr(target_arch = "nvptx64", feature(abi_ptx, stdarch_nvptx))]

/// Calls a macro with each probe: the name of its function and module, and the name of its entry
/// point (attributes take literals only).
#[macro_export]
macro_rules! for_each_probe {
    ($probe:ident) => {
        $probe! {
            arithmetic "probe_arithmetic",
            functions "probe_functions",
            sampling "probe_sampling",
            shapes "probe_shapes",
            fresnel "probe_fresnel",
            sums "probe_sums",
            scatter "probe_scatter",
            lights "probe_lights",
            trace "probe_trace",
            visits "probe_visits",
        }
    };
}

pub mod arithmetic;
pub mod fresnel;
pub mod functions;
pub mod lights;
pub mod record;
pub mod sampling;
pub mod scatter;
pub mod shapes;
pub mod sums;
pub mod trace;
pub mod visits;

#[cfg(target_arch = "nvptx64")]
pub mod ptx;
#[cfg(target_arch = "spirv")]
pub mod spirv;

#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
mod prebuilt;
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
pub use prebuilt::*;
