//! Output of data to the file that an option names, or to standard output if it is `-`.

use crate::terminal::with_options;
use std::path::Path;
use trisect::output;
use trisect_lab::Error;

pub use output::is_stdout;

/// Checks that data can be written to `path`, as [`output::probe`] does.
pub fn probe(path: &Path) -> Result<(), Error> {
    Ok(output::probe(path)?)
}

/// Prints a result as `text`, or as JSON, which `encode` returns, if `--json` names standard
/// output; another file gets the JSON beside the text.
pub fn print_result(
    json: Option<&Path>,
    encode: impl FnOnce() -> Result<String, Error>,
    text: impl FnOnce() -> String,
) -> Result<(), Error> {
    match json {
        None => super::print(&text()),
        Some(path) if is_stdout(path) => super::print(&encode()?),
        Some(path) => {
            output::write_file(path, with_options(&encode()?).as_bytes())?;
            super::print(&text())
        }
    }
}

/// Writes data to the file or to standard output as they are, with a line break after them.
pub fn write(path: &Path, data: &str) -> Result<(), Error> {
    Ok(output::write_file(path, format!("{data}\n").as_bytes())?)
}
