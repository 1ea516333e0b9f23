//! Compiles the crates with entry points for both targets.

use crate::contraction;
use crate::error::Error;
use crate::toolchain::{Toolchain, output_of};
use spirv_builder::{Capability, SpirvBuilder, SpirvMetadata};
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// The oldest NVIDIA architecture that the PTX runs on: Pascal (GTX 10, 2016). Newer drivers compile it for newer devices.
pub const PTX_ARCHITECTURE: &str = "sm_61";

/// The oldest version of PTX with votes that wait for all lanes of a warp: CUDA 9 (2017).
pub const PTX_VERSION: &str = "ptx60";

/// Vulkan 1.2 is what wgpu asks of a device for SPIR-V 1.5.
pub const SPIRV_TARGET: &str = "spirv-unknown-vulkan1.2";

/// LLVM's options of the fast build: fused multiply-add; division within 1 ULP-ish `div.full`; square root and its reciprocal
/// approximate.
pub const FAST_MATH: [&str; 3] = ["-fp-contract=fast", "-nvptx-prec-divf32=1", "-nvptx-prec-sqrtf32=0"];

/// Optimises SPIR-V once it says what may not be contracted. (rust-gpu runs its own before: there x / c becomes x (1 / c).)
pub const SPIRV_OPT: &str = "spirv-opt";

/// What an artifact is, and so what it must not hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// SPIR-V words, little endian.
    Spirv,
    /// PTX text with the CPU's rounding.
    PtxPrecise,
    /// PTX text with [`FAST_MATH`].
    PtxFast,
}

/// One compiled module with all entry points of a crate.
#[derive(Debug)]
pub struct Artifact {
    /// The file, from the workspace.
    pub name: &'static str,
    /// What it is.
    pub kind: Kind,
    /// The file's content.
    pub bytes: Vec<u8>,
}

/// A crate with entry points: what renders, and what the tests ask.
struct Package {
    name: &'static str,
    /// From the workspace.
    folder: &'static str,
}

const KERNELS: Package = Package { name: "trisect-kernels", folder: "kernels" };
const PROBES: Package = Package { name: "trisect-probes", folder: "tests/probes" };

/// Compiles SPIR-V, precise PTX and, of the kernels, fast PTX; SPIR-V, which takes longest, beside the rest.
pub fn all(root: &Path, toolchain: &Toolchain) -> Result<Vec<Artifact>, Error> {
    // spirv-builder runs the `cargo` and `rustc` that it finds first.
    let mut path = toolchain.directory.join("bin").into_os_string();
    path.push(":");
    path.push(std::env::var_os("PATH").unwrap_or_default());
    // SAFETY: this program has one thread as yet.
    #[allow(unsafe_code, reason = "spirv-builder takes its tools from the environment only")]
    unsafe {
        std::env::set_var("PATH", path);
        std::env::set_var("RUSTC_BOOTSTRAP", "1");
        std::env::set_var("CARGO_PROFILE_RELEASE_LTO", "off");
        std::env::remove_var("RUSTUP_TOOLCHAIN");
    }
    let timed = |name, kind, compile: &dyn Fn() -> Result<Vec<u8>, Error>| {
        let start = Instant::now();
        let bytes = compile()?;
        eprintln!("compiled {name} in {:.0} s", start.elapsed().as_secs_f64());
        Ok::<_, Error>(Artifact { name, kind, bytes })
    };
    let spirv = |name, package| timed(name, Kind::Spirv, &|| spirv(root, toolchain, package));
    let precise = |name, package| timed(name, Kind::PtxPrecise, &|| ptx(root, toolchain, package, &[]));
    let fast = |name, package| {
        timed(name, Kind::PtxFast, &|| ptx(root, toolchain, package, &FAST_MATH).map(|bytes| flush(&bytes)))
    };
    let (of_spirv, of_ptx) = std::thread::scope(|scope| {
        let of_ptx = scope.spawn(|| {
            Ok([
                precise("kernels/prebuilt/trisect.precise.ptx", &KERNELS)?,
                fast("kernels/prebuilt/trisect.fast.ptx", &KERNELS)?,
                precise("tests/probes/prebuilt/probes.precise.ptx", &PROBES)?,
            ])
        });
        let of_spirv = || {
            Ok([
                spirv("kernels/prebuilt/trisect.spv", &KERNELS)?,
                spirv("tests/probes/prebuilt/probes.spv", &PROBES)?,
            ])
        };
        let of_spirv: Result<_, Error> = of_spirv();
        let of_ptx: Result<_, Error> = of_ptx.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        (of_spirv, of_ptx)
    });
    let ([kernels_spirv, probes_spirv], [precise, fast, probes]) = (of_spirv?, of_ptx?);
    Ok(vec![kernels_spirv, probes_spirv, precise, fast, probes])
}

fn spirv(root: &Path, toolchain: &Toolchain, package: &Package) -> Result<Vec<u8>, Error> {
    // What persistent lanes tell each other. Vulkan 1.1 has it in compute shaders wherever a subgroup has more than one lane.
    let mut builder = SpirvBuilder::new(root.join(package.folder), SPIRV_TARGET)
        .capability(Capability::GroupNonUniform)
        .capability(Capability::GroupNonUniformBallot);
    builder.rustc_codegen_spirv_location = Some(toolchain.codegen_spirv());
    builder.target_dir_path = Some(root.join("target/kernels-spirv"));
    builder.spirv_metadata = SpirvMetadata::None;
    builder.build_script.defaults = false;
    builder.extra_args = vec!["--no-spirv-opt".to_owned()];
    let compiled = builder.build()?;
    let path = compiled.module.unwrap_single();
    let module = contraction::forbid(&read(path)?).ok_or_else(|| Error::Module { path: path.to_owned() })?;
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

/// Fast PTX whose approximate operations take denormal numbers for zero: else each has instructions around it that scale them.
fn flush(ptx: &[u8]) -> Vec<u8> {
    let mut text = String::from_utf8_lossy(ptx).into_owned();
    for operation in APPROXIMATE {
        text = text.replace(&format!("{operation}.f32"), &format!("{operation}.ftz.f32"));
    }
    text.into_bytes()
}

/// What [`FAST_MATH`] makes of division, square root and its reciprocal.
const APPROXIMATE: [&str; 3] = ["div.full", "rcp.approx", "sqrt.approx"]; // rsqrt.approx ends so, too

fn ptx(root: &Path, toolchain: &Toolchain, package: &Package, llvm: &[&str]) -> Result<Vec<u8>, Error> {
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
        // After fat LTO the assembly is the PTX of the whole program: nothing is left to link.
        .args(["--", "--emit=asm", "-Clinker=/bin/true", "-Zlocation-detail=none"])
        .arg(format!("-Ctarget-cpu={PTX_ARCHITECTURE}"))
        .arg(format!("-Ctarget-feature=+{PTX_VERSION}"));
    for option in llvm {
        command.arg(format!("-Cllvm-args={option}"));
    }
    output_of(&mut command)?;
    let file = format!("{}.s", package.name.replace('-', "_"));
    read(&target.join("nvptx64-nvidia-cuda/kernels/deps").join(file))
}

fn read(path: &Path) -> Result<Vec<u8>, Error> {
    fs::read(path).map_err(|source| Error::Io { path: path.to_owned(), source })
}
