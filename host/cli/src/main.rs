//! The `trisect` program: parses the command line, runs a command, maps errors to exit codes.
//!
//! Data goes to standard output, progress and messages to standard error. Exit codes: 0 success, 1
//! run-time error, 2 usage error, 3 backend unavailable, 4 bad scene, 5 images differ, 6 a scene is
//! outside the supported range, 7 ended by `--time-limit`, 130 interrupted.

#![deny(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "they panic if the stream cannot be written; `terminal` does not"
)]

mod cli;
mod commands;
mod device_layer;
mod process;
mod progress;
mod terminal;

use std::process::ExitCode;
use std::time::Instant;

#[allow(unsafe_code, reason = "the environment changes before any other thread starts")]
fn main() -> ExitCode {
    // SAFETY: nothing runs before this call, so the process has a single thread.
    unsafe { device_layer::quieten() };
    match process::prepare() {
        Ok(()) => run(),
        Err(message) => {
            terminal::eprint(&format!("error: {message}"));
            ExitCode::FAILURE
        }
    }
}

/// Parses the command line and runs its command. Not inlined into `main`, which must run on a stack
/// of any size.
#[inline(never)]
fn run() -> ExitCode {
    let start = Instant::now();
    let mut command = match cli::parse::parse(std::env::args_os()) {
        Ok(cli) => cli.command,
        Err(usage) => return terminal::print_usage(&usage),
    };
    for note in cli::old_spellings::notes(std::env::args_os().skip(1)) {
        terminal::eprint(&format!("note: {note}"));
    }
    match &mut command {
        cli::Command::Render(arguments) => arguments.log.unify(),
        cli::Command::Resume(arguments) => arguments.log.unify(),
        _ => {}
    }
    let outcome = match command {
        cli::Command::Render(arguments) if arguments.preview.watch => commands::watch::render(&arguments),
        cli::Command::Render(arguments) => commands::scenes::render(&arguments),
        cli::Command::Resume(arguments) => commands::dispatch::resume(&arguments),
        cli::Command::Merge(arguments) => commands::resume::merge(&arguments),
        cli::Command::Bench(arguments) => commands::dispatch::bench(&arguments, start),
        cli::Command::Tradeoff(arguments) => commands::tradeoff::run(&arguments),
        cli::Command::Converge(arguments) => commands::tradeoff::follow(&arguments),
        cli::Command::View(arguments) => commands::dispatch::view(&arguments),
        cli::Command::Evaluate(arguments) => commands::evaluate::run(&arguments),
        cli::Command::Compare(arguments) => commands::compare::run(&arguments),
        cli::Command::Check(arguments) => commands::check::run(&arguments),
        cli::Command::Info(arguments) => commands::info::run(&arguments),
        cli::Command::Doctor(arguments) => commands::doctor::run(&arguments),
        cli::Command::Completions(arguments) => commands::shell::completions(&arguments),
        cli::Command::Man(arguments) => commands::shell::man(&arguments),
    };
    match outcome {
        Ok(code) => code,
        Err(error) => {
            terminal::eprint(&format!("error: {error}"));
            ExitCode::from(error.exit_code())
        }
    }
}
