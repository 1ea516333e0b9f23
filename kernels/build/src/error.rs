//! Errors of a build of the kernels.

use std::path::PathBuf;
use thiserror::Error;

/// Failed build, audit or comparison.
#[derive(Debug, Error)]
pub enum Error {
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Path of the file.
        path: PathBuf,
        /// Reason.
        source: std::io::Error,
    },
    /// The kernel toolchain was not found.
    #[error(
        "no kernel toolchain: {} is missing. kernels/README.md says how to get one; TRISECT_KERNEL_TOOLCHAIN names its folder",
        missing.display()
    )]
    NoToolchain {
        /// File that is missing.
        missing: PathBuf,
    },
    /// The optimiser for SPIR-V is not installed.
    #[error("spirv-opt is not installed (Debian: spirv-tools); it makes kernels/prebuilt/spirv")]
    NoSpirvOpt,
    /// A tool failed.
    #[error("{tool} failed:\n{output}")]
    Tool {
        /// Name of the tool.
        tool: String,
        /// Output of the tool.
        output: String,
    },
    /// rust-gpu failed.
    #[error("rust-gpu: {0}")]
    Spirv(#[from] spirv_builder::SpirvBuilderError),
    /// A file that rust-gpu wrote is not a SPIR-V module.
    #[error("{}: not a SPIR-V module", path.display())]
    Module {
        /// Path of the file.
        path: PathBuf,
    },
    /// A kernel contains a forbidden instruction.
    #[error("{artifact}, line {line}: `{text}`: {reason}")]
    Audit {
        /// Name of the artifact.
        artifact: String,
        /// Number of the line, counted from 1.
        line: usize,
        /// Text of the line.
        text: String,
        /// Reason why the instruction is forbidden.
        reason: &'static str,
    },
    /// The manifest or lock file cannot be parsed.
    #[error("{}: {message}", path.display())]
    Manifest {
        /// Path of the manifest or lock file.
        path: PathBuf,
        /// Reason.
        message: String,
    },
    /// The prebuilt kernels do not match the sources.
    #[error("the prebuilt kernels are out of date; run `cargo kernels`:\n{}", differences.join("\n"))]
    Stale {
        /// Differences, a line each.
        differences: Vec<String>,
    },
}
