//! Files of the repository and of the page.

use crate::{PageError, at};
use std::path::{Path, PathBuf};

/// Repository.
pub fn root() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../.."))
}

/// Copies a file, and makes the folder that it is to be in.
pub fn copy(from: &Path, to: &Path) -> Result<(), PageError> {
    let folder = to.parent().unwrap_or(to);
    std::fs::create_dir_all(folder).map_err(at(folder))?;
    std::fs::copy(from, to).map(drop).map_err(at(from))
}

/// Returns the paths of all files in a folder and below it, relative to it, in order.
pub fn list(folder: &Path) -> Result<Vec<PathBuf>, PageError> {
    let (mut found, mut left) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(inner) = left.pop() {
        for entry in std::fs::read_dir(&inner).map_err(at(&inner))? {
            let path = entry.map_err(at(&inner))?.path();
            if path.is_dir() {
                left.push(path);
            } else if let Ok(relative) = path.strip_prefix(folder) {
                found.push(relative.to_owned());
            }
        }
    }
    found.sort();
    Ok(found)
}
