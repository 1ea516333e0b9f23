//! Output of data to the file that an option names, or to standard output if it is `-`.

use crate::terminal::with_options;
use std::path::Path;
use trisect::output;
use trisect_lab::Error;

/// Returns whether a path names standard output.
pub fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Checks that data can be written to `path`, as [`output::probe`] does; standard output always
/// passes.
pub fn probe(path: &Path) -> Result<(), Error> {
    if is_stdout(path) { Ok(()) } else { Ok(output::probe(path)?) }
}

/// Writes data to the file or to standard output, with a line break after it.
pub fn write(path: &Path, data: &str) -> Result<(), Error> {
    let data = format!("{}\n", with_options(data));
    if is_stdout(path) {
        return super::print(&data);
    }
    Ok(output::write_file(path, data.as_bytes())?)
}
