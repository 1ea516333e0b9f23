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

/// LLVM options of the fast build: fused multiply-add; division by `div.full`, within 2 ULP;
/// approximate square root and reciprocal square root.
pub const FAST_MATH: [&str; 3] = ["-fp-contract=fast", "-nvptx-prec-divf32=1", "-nvptx-prec-sqrtf32=0"];

/// Instructions that [`FAST_MATH`] makes of division, square root and reciprocal square root.
const APPROXIMATE_INSTRUCTIONS: [&str; 3] = ["div.full", "rcp.approx", "sqrt.approx"]; // also matches rsqrt.approx

/// Compiles the crate to one module of all its entry points.
pub(crate) fn module(
    root: &Path,
    toolchain: &Toolchain,
    package: &Package,
    fast: bool,
) -> Result<Vec<u8>, Error> {
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
    for option in FAST_MATH.iter().filter(|_| fast) {
        command.arg(format!("-Cllvm-args={option}"));
    }
    output_of(&mut command)?;
    let file = format!("{}.s", package.name.replace('-', "_"));
    let ptx = read(&target.join("nvptx64-nvidia-cuda/kernels/deps").join(file))?;
    Ok(if fast { flush_denormals(&ptx) } else { ptx })
}

/// Returns fast PTX whose approximate operations treat denormal numbers as zero; otherwise each has
/// instructions around it that scale them.
fn flush_denormals(ptx: &[u8]) -> Vec<u8> {
    let mut text = String::from_utf8_lossy(ptx).into_owned();
    for operation in APPROXIMATE_INSTRUCTIONS {
        text = text.replace(&format!("{operation}.f32"), &format!("{operation}.ftz.f32"));
    }
    text.into_bytes()
}
