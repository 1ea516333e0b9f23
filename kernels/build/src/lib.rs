//! Parts of `cargo kernels`, which builds the kernels' SPIR-V and PTX; see `main`.

pub mod audit;
pub mod compile;
pub mod contraction;
pub mod entries;
pub mod error;
pub mod manifest;
mod package;
pub mod ptx;
pub mod spirv;
pub mod toolchain;
