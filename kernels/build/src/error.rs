//! What can go wrong while building kernels.

use std::path::PathBuf;
use thiserror::Error;

/// A failed build, audit or comparison.
#[derive(Debug, Error)]
pub enum Error {
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// No kernel toolchain.
    #[error(
        "no kernel toolchain: {} is missing. kernels/README.md says how to get one; TRISECT_KERNEL_TOOLCHAIN names its folder",
        missing.display()
    )]
    NoToolchain {
        /// The file looked for.
        missing: PathBuf,
    },
    /// No optimiser for SPIR-V.
    #[error("spirv-opt is not installed (Debian: spirv-tools); it makes kernels/prebuilt/spirv")]
    NoSpirvOpt,
    /// A tool failed.
    #[error("{tool} failed:\n{output}")]
    Tool {
        /// Its name.
        tool: String,
        /// What it printed.
        output: String,
    },
    /// rust-gpu failed.
    #[error("rust-gpu: {0}")]
    Spirv(#[from] spirv_builder::SpirvBuilderError),
    /// What rust-gpu wrote is no module.
    #[error("{}: not a SPIR-V module", path.display())]
    Module {
        /// The file.
        path: PathBuf,
    },
    /// A kernel holds an instruction that it must not.
    #[error("{artifact}, line {line}: `{text}`: {reason}")]
    Audit {
        /// The artifact.
        artifact: String,
        /// Counted from 1.
        line: usize,
        /// The line's text.
        text: String,
        /// Why it must not be there.
        reason: &'static str,
    },
    /// The manifest cannot be understood.
    #[error("{}: {message}", path.display())]
    Manifest {
        /// The manifest or lock file.
        path: PathBuf,
        /// Why.
        message: String,
    },
    /// The prebuilt kernels are not what the sources give.
    #[error("the prebuilt kernels are out of date; run `cargo kernels`:\n{}", differences.join("\n"))]
    Stale {
        /// What differs.
        differences: Vec<String>,
    },
}
