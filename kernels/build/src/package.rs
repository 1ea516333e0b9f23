//! Crates with entry points, and their files.

use crate::error::Error;
use std::fs;
use std::path::Path;

/// Crate with entry points: the render kernels, or the probes of the tests.
pub(crate) struct Package {
    pub name: &'static str,
    /// Folder of the crate, from the workspace.
    pub folder: &'static str,
}

impl Package {
    /// Returns the folder of its SPIR-V, from the workspace: a file for each entry point, and
    /// nothing else.
    pub fn spirv_folder(&self) -> String {
        format!("{}/prebuilt/spirv", self.folder)
    }

    /// Returns the folder of its PTX, from the workspace: a file for each entry point, and nothing
    /// else.
    pub fn ptx_folder(&self) -> String {
        format!("{}/prebuilt/ptx", self.folder)
    }
}

/// Returns the content of a file.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, Error> {
    fs::read(path).map_err(|source| Error::Io { path: path.to_owned(), source })
}
