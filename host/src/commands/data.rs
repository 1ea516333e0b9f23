//! Data that a command writes where its option says: a file, or standard output by the name `-`.

use std::path::Path;
use trisect::{Error, output};

/// Returns whether a path names standard output.
pub fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Finds out whether data can be written there, as [`output::probe`].
pub fn probe(path: &Path) -> Result<(), Error> {
    if is_stdout(path) { Ok(()) } else { Ok(output::probe(path)?) }
}

/// Writes data to the file or to standard output, with a line break after it.
pub fn write(path: &Path, data: &str) -> Result<(), Error> {
    let data = format!("{data}\n");
    if is_stdout(path) {
        return super::print(&data);
    }
    Ok(output::write_file(path, data.as_bytes())?)
}
