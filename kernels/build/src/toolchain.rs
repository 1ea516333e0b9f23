//! Finds the compilers, and runs tools.

use crate::error::Error;
use std::env;
use std::path::PathBuf;
use std::process::Command;

/// Optimiser that runs once `NoContraction` is in place. (rust-gpu's own run would come before, and
/// turn x / c into x (1 / c).)
pub const SPIRV_OPT: &str = "spirv-opt";

/// Kernel toolchain: a folder with `bin/cargo`, `bin/rustc` and `lib/librustc_codegen_spirv.so`.
#[derive(Debug)]
pub struct Toolchain {
    /// Path of the folder.
    pub directory: PathBuf,
    /// First line of `rustc -V`.
    pub rustc_version: String,
    /// First line of `spirv-opt --version`; the tool comes with the system.
    pub spirv_opt_version: String,
}

impl Toolchain {
    /// Returns the path of the compiler, for SPIR-V (with the code generator) and for PTX.
    pub fn rustc(&self) -> PathBuf {
        self.directory.join("bin/rustc")
    }

    /// Returns the path of the toolchain's cargo.
    pub fn cargo(&self) -> PathBuf {
        self.directory.join("bin/cargo")
    }

    /// Returns the path of rust-gpu's code generator.
    pub fn codegen_spirv(&self) -> PathBuf {
        self.directory.join("lib/librustc_codegen_spirv.so")
    }
}

/// Returns the toolchain in `TRISECT_KERNEL_TOOLCHAIN`, or in `~/.cache/trisect/kernel-toolchain`.
pub fn find() -> Result<Toolchain, Error> {
    let directory = env::var_os("TRISECT_KERNEL_TOOLCHAIN").map_or_else(
        || {
            let home = env::var_os("HOME").map_or_else(|| PathBuf::from("."), PathBuf::from);
            home.join(".cache/trisect/kernel-toolchain")
        },
        PathBuf::from,
    );
    let mut toolchain =
        Toolchain { directory, rustc_version: String::new(), spirv_opt_version: String::new() };
    for file in [toolchain.rustc(), toolchain.cargo(), toolchain.codegen_spirv()] {
        if !file.exists() {
            return Err(Error::NoToolchain { missing: file });
        }
    }
    toolchain.rustc_version = output_of(Command::new(toolchain.rustc()).arg("-V"))?.trim().to_owned();
    let version = Command::new(SPIRV_OPT).arg("--version").output();
    let version = version.map_err(|_| Error::NoSpirvOpt)?;
    let text = String::from_utf8_lossy(&version.stdout);
    toolchain.spirv_opt_version = text.lines().next().unwrap_or_default().trim().to_owned();
    Ok(toolchain)
}

/// Runs a command to its end and returns what it wrote to standard output.
pub fn output_of(command: &mut Command) -> Result<String, Error> {
    let tool = command.get_program().to_string_lossy().into_owned();
    let output =
        command.output().map_err(|source| Error::Io { path: command.get_program().into(), source })?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let text = String::from_utf8_lossy(&output.stderr) + String::from_utf8_lossy(&output.stdout);
    Err(Error::Tool { tool, output: text.into_owned() })
}
