//! `cargo kernels`: builds, audits and stamps the kernels.
//!
//! ```text
//! cargo kernels             build, audit, write kernels/prebuilt/ and tests/probes/prebuilt/
//! cargo kernels --check     build, audit, compare with the committed files, write nothing
//! cargo kernels --sources   compare the sources with the manifest; needs no kernel toolchain
//! ```
//!
//! `TRISECT_KERNEL_TOOLCHAIN` names the toolchain's folder, `TRISECT_PTXAS` the `ptxas` to use; see
//! `kernels/README.md`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trisect_kernels_build::error::Error;
use trisect_kernels_build::{audit, compile, manifest, toolchain};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let outcome = match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        [] => build(Mode::Write),
        ["--check"] => build(Mode::Check),
        ["--sources"] => {
            manifest::read(&root()).and_then(|manifest| manifest::check_sources(&root(), &manifest))
        }
        _ => {
            eprintln!("usage: cargo kernels [--check | --sources]");
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Mode {
    Write,
    Check,
}

/// Returns the workspace: two folders above this crate.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn build(mode: Mode) -> Result<(), Error> {
    let root = root().canonicalize().map_err(|source| Error::Io { path: root(), source })?;
    let toolchain = toolchain::find()?;
    eprintln!("toolchain: {} ({})", toolchain.rustc_version, toolchain.directory.display());

    let artifacts = compile::all(&root, &toolchain)?;
    for artifact in &artifacts {
        audit::audit(artifact)?;
    }
    let stamp = manifest::stamp(&root, &toolchain, &artifacts)?;
    match mode {
        Mode::Write => manifest::write(&root, &artifacts, &stamp)?,
        Mode::Check => manifest::compare(&root, &artifacts, &stamp)?,
    }
    for artifact in &artifacts {
        let verb = if mode == Mode::Write { "wrote" } else { "same bytes:" };
        eprintln!("{verb} {} ({} bytes)", artifact.name, artifact.bytes.len());
    }
    Ok(())
}
