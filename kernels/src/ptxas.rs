//! NVIDIA's assembler, for tests.

use std::path::PathBuf;
use std::process::Command;

/// The assembler that `TRISECT_PTXAS` names, with a folder for its files.
pub(crate) struct Ptxas {
    program: PathBuf,
    folder: tempfile::TempDir,
}

impl Ptxas {
    /// Returns the assembler; `None`, and a message, if the environment names none.
    pub fn find() -> Option<Self> {
        let program = std::env::var_os("TRISECT_PTXAS").map(PathBuf::from);
        if program.is_none() {
            eprintln!("SKIPPED: TRISECT_PTXAS names no ptxas");
        }
        program.map(|program| Self { program, folder: tempfile::tempdir().expect("a folder") })
    }

    /// Returns the bytes of the assembled module; `None` if it is refused.
    pub fn assemble(&self, module: &str) -> Option<u64> {
        let [from, to] = ["module.ptx", "module.cubin"].map(|name| self.folder.path().join(name));
        std::fs::write(&from, module).expect("the module is written");
        let mut command = Command::new(&self.program);
        let run = command.args(["-O1", "-arch=sm_90", "-o"]).arg(&to).arg(&from).output();
        let is_accepted = run.expect("ptxas runs").status.success();
        is_accepted.then(|| std::fs::metadata(&to).map_or(0, |file| file.len()))
    }
}
