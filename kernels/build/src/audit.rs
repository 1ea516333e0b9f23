//! Audit of compiled kernels: forbidden instructions, and the verdicts of SPIR-V validator and PTX
//! assembler.

use crate::compile::{Artifact, Kind};
use crate::error::Error;
use crate::toolchain::output_of;
use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Validates one artifact. Names on standard error each tool that is not installed.
pub fn audit(artifact: &Artifact) -> Result<(), Error> {
    let file = TemporaryFile::new(artifact)?;
    match artifact.kind {
        Kind::Spirv => match find(None, "spirv-val") {
            Some(tool) => {
                output_of(Command::new(tool).args(["--target-env", "vulkan1.2"]).arg(&file.0))?;
                eprintln!("spirv-val: {} is valid for Vulkan 1.2", artifact.name);
            }
            None => eprintln!(
                "SKIPPED: spirv-val is not installed (Debian: spirv-tools); {} is not validated",
                artifact.name
            ),
        },
        Kind::Ptx => {
            check_instructions(artifact)?;
            match find(env::var_os("TRISECT_PTXAS"), "ptxas") {
                Some(tool) => {
                    let mut command = Command::new(tool);
                    command.args(["-arch=sm_90", "-o", "/dev/null"]).arg(&file.0);
                    output_of(&mut command)?;
                    eprintln!("ptxas: {} assembles for sm_90", artifact.name);
                }
                None => eprintln!(
                    "SKIPPED: ptxas is not installed (PyPI: nvidia-cuda-nvcc; TRISECT_PTXAS names it); {} is not assembled",
                    artifact.name
                ),
            }
        }
    }
    Ok(())
}

/// Instructions of box tests, and of nothing else: `trisect_shared::math::{fused, reciprocal}`.
/// They decide which boxes a ray visits, not what it hits. No compiler contracts to the first one,
/// because it flushes denormals, which nothing else does.
const BOX_TEST_INSTRUCTIONS: [&str; 2] = ["fma.rn.ftz.f32", "rcp.approx.ftz.f32"];

/// Finds instructions that break a promise of the build.
///
/// A missing function would only show when a driver loads the module. A `trap` is a panic that the
/// optimiser could not rule out. The others would give other bits than the CPU.
pub fn check_instructions(artifact: &Artifact) -> Result<(), Error> {
    let everywhere =
        [(".extern .func", "a function that no driver provides"), ("trap;", "a panic is reachable")];
    let precise = [
        ("fma.", "contraction rounds once where the CPU rounds twice"),
        ("mad.f32", "contraction rounds once where the CPU rounds twice"),
        ("mad.rn.f32", "contraction rounds once where the CPU rounds twice"),
        (".approx", "an approximation, not the correctly rounded result"),
        (".full", "division within 2 ULP, not the correctly rounded result"),
        (".ftz", "flushes denormals"),
    ];
    let text = String::from_utf8_lossy(&artifact.bytes);
    for (index, line) in text.lines().enumerate() {
        let of_box_test =
            BOX_TEST_INSTRUCTIONS.iter().any(|&operation| line.trim_start().starts_with(operation));
        let mut rules = everywhere.into_iter().chain(precise.into_iter().filter(|_| !of_box_test));
        if let Some((_, reason)) = rules.find(|(pattern, _)| line.contains(pattern)) {
            return Err(Error::Audit {
                artifact: artifact.name.clone(),
                line: index + 1,
                text: line.trim().to_owned(),
                reason,
            });
        }
    }
    Ok(())
}

fn find(named: Option<std::ffi::OsString>, tool: &str) -> Option<PathBuf> {
    if let Some(path) = named {
        return Some(path.into());
    }
    let path = env::var_os("PATH")?;
    env::split_paths(&path).map(|folder| folder.join(tool)).find(|file| file.is_file())
}

/// Temporary file, removed when dropped.
struct TemporaryFile(PathBuf);

impl TemporaryFile {
    fn new(artifact: &Artifact) -> Result<Self, Error> {
        let name = artifact.name.replace('/', "-");
        let path = env::temp_dir().join(format!("{}-{name}", std::process::id()));
        std::fs::write(&path, &artifact.bytes).map_err(|source| Error::Io { path: path.clone(), source })?;
        Ok(Self(path))
    }
}

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(Path::new(&self.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ptx(line: &str) -> Artifact {
        Artifact {
            name: "test.ptx".into(),
            kind: Kind::Ptx,
            bytes: format!(".version 6.0\n{line}\nret;\n").into_bytes(),
        }
    }

    #[test]
    fn accepts_what_is_allowed() {
        assert!(check_instructions(&ptx("div.rn.f32 %r1, %r2, %r3;")).is_ok());
        assert!(check_instructions(&ptx("\tfma.rn.ftz.f32 %r1, %r2, %r3, %r4;")).is_ok());
    }

    #[test]
    fn names_the_line_of_what_is_not() {
        for line in [
            "fma.rn.f32 %r1, %r2, %r3, %r4;",
            "mad.rn.f32 %r1, %r2, %r3, %r4;",
            "div.full.f32 %r1, %r2, %r3;",
            "rsqrt.approx.f32 %r1, %r2;",
            "add.ftz.f32 %r1, %r2, %r3;",
            ".extern .func sinf",
            "trap;",
        ] {
            let error = check_instructions(&ptx(line));
            assert!(matches!(error, Err(Error::Audit { line: 2, .. })), "{line}: {error:?}");
        }
    }
}
