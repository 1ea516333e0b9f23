//! Compiles a crate to SPIR-V: rust-gpu, then [`contraction`], then spirv-opt.

use crate::contraction;
use crate::error::Error;
use crate::package::{Package, read};
use crate::toolchain::{SPIRV_OPT, Toolchain, output_of};
use spirv_builder::{SpirvBuilder, SpirvMetadata};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Target of rust-gpu: Vulkan 1.2, which wgpu requires of a device for SPIR-V 1.5.
pub const TARGET: &str = "spirv-unknown-vulkan1.2";

/// Compiles the crate to a module for each of its entry points; returns their names and files.
pub(crate) fn modules(
    root: &Path,
    toolchain: &Toolchain,
    package: &Package,
) -> Result<Vec<(String, PathBuf)>, Error> {
    let mut builder = SpirvBuilder::new(root.join(package.folder), TARGET);
    builder.rustc_codegen_spirv_location = Some(toolchain.codegen_spirv());
    builder.target_dir_path = Some(root.join("target/kernels-spirv"));
    builder.spirv_metadata = SpirvMetadata::None;
    builder.build_script.defaults = false;
    builder.multimodule = true;
    builder.extra_args = vec!["--no-spirv-opt".to_owned()];
    let modules = builder.build()?.module;
    Ok(modules.unwrap_multi().iter().map(|(name, path)| (name.clone(), path.clone())).collect())
}

/// Returns a module whose arithmetic no driver contracts, optimised.
pub(crate) fn optimised(path: &Path) -> Result<Vec<u8>, Error> {
    let module = contraction::forbid_contraction(&read(path)?)
        .ok_or_else(|| Error::Module { path: path.to_owned() })?;
    let exact = path.with_extension("exact.spv");
    let optimised = path.with_extension("optimised.spv");
    fs::write(&exact, &module).map_err(|source| Error::Io { path: exact.clone(), source })?;
    output_of(
        Command::new(SPIRV_OPT)
            .args(["--target-env=vulkan1.2", "--skip-validation", "--strip-debug", "-O"])
            .arg(&exact)
            .arg("-o")
            .arg(&optimised),
    )?;
    read(&optimised)
}
