//! `trisect render --watch`: renders again when a file of the scene is written.

use super::signals::{INTERRUPTED, interrupts};
use super::{eprint, scenes};
use crate::cli::RenderArgs;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;
use trisect::error::MotionError;
use trisect::input::{self, OpenedFiles};
use trisect::output::is_stdout;
use trisect_lab::Error;

/// Time between two looks at the files. A change counts once it is as old, because a program may
/// write a file in several steps.
const INTERVAL: Duration = Duration::from_millis(200);

/// Renders, and renders again after each change of a file that was read, until an interrupt. An
/// error does not end the command: the next change may remove its cause.
pub fn render(arguments: &RenderArgs) -> Result<ExitCode, Error> {
    check(arguments)?;
    let interrupted = interrupts();
    let mut is_first = true;
    loop {
        input::record();
        let code = match scenes::render(arguments) {
            Ok(code) => code,
            // No change of the scene makes wrong options right, or a missing device appear.
            Err(error) if is_first && matches!(error.exit_code(), 2 | 3) => return Err(error),
            Err(error) => {
                eprint(&format!("error: {error}"));
                ExitCode::from(error.exit_code())
            }
        };
        if interrupted.load(Ordering::Relaxed) {
            return Ok(code);
        }
        is_first = false;
        let files = input::recorded();
        if !arguments.log.quiet {
            let count = files.len();
            let what = if count == 1 { "file" } else { "files" };
            eprint(&format!("watching {count} {what}; an interrupt ends the command"));
        }
        let Some(changed) = wait(&files, &interrupted) else {
            return Ok(ExitCode::from(INTERRUPTED as u8));
        };
        if !arguments.log.quiet {
            eprint(&format!("{changed} was written"));
        }
    }
}

/// Checks that the command can render several times.
fn check(arguments: &RenderArgs) -> Result<(), Error> {
    let once = [
        ("--distribute", arguments.cluster.distribute.is_some(), "name one of them"),
        ("--checkpoint", arguments.checkpointing.checkpoint.is_some(), "name one of them"),
        ("standard output", is_stdout(&arguments.output), "name a file by -o"),
        ("the built-in scene", arguments.job.scene.is_none(), "name a scene"),
    ];
    match once.into_iter().find(|(_, given, _)| *given) {
        Some((with, _, remedy)) => Err(MotionError::Beside { what: "--watch", with, remedy }.into()),
        None => Ok(()),
    }
}

/// Waits until a file changes, and returns its path; `None` after an interrupt.
fn wait(files: &OpenedFiles, interrupted: &AtomicBool) -> Option<String> {
    loop {
        thread::sleep(INTERVAL);
        if interrupted.load(Ordering::Relaxed) {
            return None;
        }
        if let Some(changed) = files.first_changed() {
            let changed = changed.display().to_string();
            thread::sleep(INTERVAL);
            return Some(changed);
        }
    }
}
