//! Records that the view of a scene and the layout of buffers name: data, and what follows from it
//! alone. The modules of kernels that use them offer them, too.

pub mod aovs;
pub mod attributes;
pub mod denoise;
pub mod environment;
pub mod first_hit;
pub mod instance;
pub mod layers;
pub mod light;
pub mod light_node;
pub mod material;
pub mod medium;
pub mod texture;
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
pub mod wide;
