//! Output of data to the file that an option names, or to standard output if it is `-`.

use std::path::Path;
use trisect::output;
use trisect_lab::Error;

pub use output::is_stdout;

/// Checks that data can be written to `path`, as [`output::probe`] does; standard output always
/// passes.
pub fn probe(path: &Path) -> Result<(), Error> {
    if is_stdout(path) { Ok(()) } else { Ok(output::probe(path)?) }
}

/// Writes data to the file or to standard output as they are, with a line break after them.
pub fn write(path: &Path, data: &str) -> Result<(), Error> {
    let data = format!("{data}\n");
    if is_stdout(path) {
        return crate::terminal::print_data(&data);
    }
    Ok(output::write_file(path, data.as_bytes())?)
}
