//! Compiles a crate to PTX, by rustc with LLVM.

use crate::error::Error;
use crate::package::{Package, read};
use crate::toolchain::{Toolchain, output_of};
use std::path::Path;
use std::process::Command;

/// Oldest NVIDIA architecture that the PTX runs on: Pascal (GTX 10, 2016). Newer drivers compile it
/// for newer devices.
pub const ARCHITECTURE: &str = "sm_61";

/// Oldest PTX version with votes that wait for all lanes of a warp: CUDA 9 (2017).
pub const VERSION: &str = "ptx60";

/// Compiles the crate to one module of all its entry points.
pub(crate) fn module(root: &Path, toolchain: &Toolchain, package: &Package) -> Result<Vec<u8>, Error> {
    let target = root.join("target/kernels-ptx");
    let mut command = Command::new(toolchain.cargo());
    command
        .current_dir(root)
        .env("RUSTC", toolchain.rustc())
        .env("RUSTC_BOOTSTRAP", "1")
        .env_remove("RUSTUP_TOOLCHAIN")
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .args(["rustc", "--quiet", "--package", package.name, "--lib", "--crate-type", "cdylib"])
        .args(["--profile", "kernels", "--target", "nvptx64-nvidia-cuda", "-Zbuild-std=core", "--target-dir"])
        .arg(&target)
        // After fat LTO the assembly is the PTX of the whole program: there is nothing left to
        // link.
        .args(["--", "--emit=asm", "-Clinker=/bin/true", "-Zlocation-detail=none"])
        .arg(format!("-Ctarget-cpu={ARCHITECTURE}"))
        .arg(format!("-Ctarget-feature=+{VERSION}"));
    output_of(&mut command)?;
    let file = format!("{}.s", package.name.replace('-', "_"));
    read(&target.join("nvptx64-nvidia-cuda/kernels/deps").join(file))
}

/// Returns a module without blanks that only people need, which are a tenth of it.
pub(crate) fn compact(module: &str) -> String {
    let mut text = String::with_capacity(module.len());
    for line in module.lines().map(str::trim).filter(|line| !line.is_empty()) {
        text.push_str(
            &line.replace(" \t", " ").replace('\t', " ").replace(", ", ",").replace("$L__BB", "$L"),
        );
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::compact;

    #[test]
    fn blanks_go() {
        let module = "{\n\t.reg .b32 \t%r<3>;\n\n$L__BB2_1:\n\tadd.rn.f32 \t%f1, %f2, %f3;\n\t@%p1 bra \t$L__BB2_1;\n}\n";
        let compacted = "{\n.reg .b32 %r<3>;\n$L2_1:\nadd.rn.f32 %f1,%f2,%f3;\n@%p1 bra $L2_1;\n}\n";
        assert_eq!(compact(module), compacted);
    }
}
