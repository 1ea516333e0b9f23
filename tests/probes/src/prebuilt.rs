//! The compiled probes, as `cargo kernels` left them in `prebuilt/`.

/// SPIR-V for Vulkan 1.2 with all entry points.
pub const SPIRV: &[u8] = include_bytes!("../prebuilt/probes.spv");

/// PTX that gives the CPU's bits.
pub const PTX_PRECISE: &str = include_str!("../prebuilt/probes.precise.ptx");

/// Threads of a work group.
pub const WORKGROUP: u32 = 64;

macro_rules! names {
    ($($module:ident $text:tt,)*) => {
        /// All entry points.
        pub const NAMES: &[&str] = &[$($text,)*];
    };
}

crate::for_each_probe!(names);
