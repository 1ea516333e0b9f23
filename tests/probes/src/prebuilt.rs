//! The compiled probes, as `cargo kernels` left them in `prebuilt/`.

/// PTX that gives the CPU's bits.
pub const PTX_PRECISE: &str = include_str!("../prebuilt/probes.precise.ptx");

/// Threads of a work group.
pub const WORKGROUP: u32 = 64;

macro_rules! names {
    ($($module:ident $text:tt,)*) => {
        /// All entry points.
        pub const NAMES: &[&str] = &[$($text,)*];

        /// SPIR-V for Vulkan 1.2: the module of an entry point, which it has alone. `None` where there is no such entry point.
        pub fn spirv(entry_point: &str) -> Option<&'static [u8]> {
            match entry_point {
                $($text => Some(include_bytes!(concat!("../prebuilt/spirv/", $text, ".spv"))),)*
                _ => None,
            }
        }
    };
}

crate::for_each_probe!(names);
