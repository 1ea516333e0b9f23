//! Standard output and standard error. All printing except the progress bar goes through this
//! module: `println!` and `eprintln!` panic if nothing can be written, and clippy refuses them in
//! this crate.

mod escape;
mod options;

pub use escape::escaped;
pub use options::with_options;

use std::ffi::OsStr;
use std::io::{self, ErrorKind, Write};
use std::process::ExitCode;
use trisect::image::ImageError;
use trisect_lab::Error;

/// Writes a line for people to standard error, [escaped] and [`with_options`]. Errors such as a
/// full disk or a closed pipe are ignored, because a render does not depend on its messages.
pub fn eprint(text: &str) {
    // One write, so that lines of several processes do not mix.
    let _ = io::stderr().lock().write_all(format!("{}\n", escaped(&with_options(text))).as_bytes());
}

/// Writes a command's result to standard output, [`with_options`]. A closed pipe is not an error:
/// its reader wants no more.
///
/// # Errors
///
/// [`ImageError::Io`] if the system refuses for another reason, such as a full disk. Files are
/// therefore written before this is called.
pub fn print(text: &str) -> Result<(), Error> {
    let mut out = io::stdout().lock();
    written(out.write_all(with_options(text).as_bytes()).and_then(|()| out.flush()))
}

/// Prints clap's output instead of running a command: help to standard output, usage errors to
/// standard error. Returns the exit code.
pub fn print_usage(usage: &clap::Error) -> ExitCode {
    if usage.use_stderr() && std::env::args_os().any(|argument| !is_plain(&argument)) {
        // The message quotes the argument.
        eprint(usage.render().to_string().trim_end());
        return ExitCode::from(u8::try_from(usage.exit_code()).unwrap_or(1));
    }
    let printed = usage.print().and_then(|()| io::stdout().flush());
    // Errors of writing a usage error are ignored; the exit code stays.
    match if usage.use_stderr() { Ok(()) } else { written(printed) } {
        Ok(()) => ExitCode::from(u8::try_from(usage.exit_code()).unwrap_or(1)),
        Err(error) => {
            eprint(&format!("error: {error}"));
            ExitCode::from(error.exit_code())
        }
    }
}

/// Returns whether an argument may be quoted unchanged: it is short and has no control characters.
fn is_plain(argument: &OsStr) -> bool {
    argument.len() <= 200
        && argument.to_str().is_some_and(|text| text == escaped(text) && !text.contains('\n'))
}

fn written(result: io::Result<()>) -> Result<(), Error> {
    match result {
        Err(source) if source.kind() != ErrorKind::BrokenPipe => {
            Err(ImageError::Io { path: "standard output".into(), source }.into())
        }
        _ => Ok(()),
    }
}
