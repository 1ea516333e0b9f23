//! The compiled probes, as `cargo kernels` stored them in `prebuilt/`.

/// PTX of all probes, precise build: gives the CPU's bits.
pub const PTX_PRECISE: &str = include_str!("../prebuilt/probes.precise.ptx");

/// Threads of a work group.
pub const WORKGROUP: u32 = 64;

macro_rules! names {
    ($($module:ident $text:tt,)*) => {
        /// Names of all entry points.
        pub const NAMES: &[&str] = &[$($text,)*];

        /// Returns the SPIR-V module for Vulkan 1.2 that has this entry point only; `None` if the
        /// name is unknown.
        pub fn spirv(entry_point: &str) -> Option<&'static [u8]> {
            match entry_point {
                $($text => Some(include_bytes!(concat!("../prebuilt/spirv/", $text, ".spv"))),)*
                _ => None,
            }
        }
    };
}

crate::for_each_probe!(names);
