//! Standard output and standard error. All printing goes through here: `println!` and `eprintln!`
//! panic where nothing can be written, and clippy refuses them in this crate.

mod escape;

pub use escape::escaped;

use std::ffi::OsStr;
use std::io::{self, ErrorKind, Write};
use std::process::ExitCode;
use trisect::Error;
use trisect::image::ImageError;

/// Writes a line to standard error for people, [escaped]. A render does not depend
/// on whether that succeeds: a full disk, a closed pipe.
pub fn eprint(text: &str) {
    // One write, so that lines of several processes do not mix.
    let _ = io::stderr().lock().write_all(format!("{}\n", escaped(text)).as_bytes());
}

/// Writes a command's result to standard output. A reader that has closed the pipe wants no more,
/// which is no error.
///
/// # Errors
///
/// [`ImageError::Io`] if the system refuses for another reason, such as a full disk. Files are
/// therefore written before this is called.
pub fn print(text: &str) -> Result<(), Error> {
    let mut out = io::stdout().lock();
    written(out.write_all(text.as_bytes()).and_then(|()| out.flush()))
}

/// Prints what clap has to say instead of a command, the help to standard output and what is wrong
/// to standard error, and returns the exit code.
pub fn print_usage(usage: &clap::Error) -> ExitCode {
    if usage.use_stderr() && std::env::args_os().any(|argument| !is_plain(&argument)) {
        // It quotes the argument.
        eprint(usage.render().to_string().trim_end());
        return ExitCode::from(u8::try_from(usage.exit_code()).unwrap_or(1));
    }
    let printed = usage.print().and_then(|()| io::stdout().flush());
    // Who cannot be told what is wrong still gets the exit code.
    match if usage.use_stderr() { Ok(()) } else { written(printed) } {
        Ok(()) => ExitCode::from(u8::try_from(usage.exit_code()).unwrap_or(1)),
        Err(error) => {
            eprint(&format!("error: {error}"));
            ExitCode::from(error.exit_code())
        }
    }
}

/// Returns whether an argument may be quoted as it is: short, and without control characters.
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
