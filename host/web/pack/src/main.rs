//! Builds the page that renders with Trisect in a browser, into a folder of static files, and
//! serves it: `cargo page`.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command")]

mod build;
mod files;
mod scenes;
mod serve;

use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;
use thiserror::Error;

/// Builds the page that renders with Trisect in a browser.
#[derive(Debug, Parser)]
#[command(name = "cargo page")]
struct Arguments {
    /// Folder for the page's files: a new or empty one, or that of an earlier page, which is
    /// replaced.
    #[arg(short, long, default_value = "target/page")]
    output: PathBuf,
    /// Serves the page at this address after the build.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:8080")]
    serve: Option<String>,
}

/// Failure of the build or the server.
#[derive(Debug, Error)]
enum PageError {
    /// A file cannot be read or written.
    #[error("{path}: {source}")]
    Io {
        /// File or folder.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// The folder for the page has other files.
    #[error(
        "{path} is no folder of a page, which would be replaced\n  name a new or an empty folder: --output target/page"
    )]
    NotAPage {
        /// Folder that was asked for.
        path: PathBuf,
    },
    /// A scene of the list names a file outside of the repository.
    #[error("{path} lies outside of the repository, so the page cannot have it")]
    Outside {
        /// File.
        path: PathBuf,
    },
    /// Cargo does not build the module.
    #[error(
        "the module for browsers was not built\n  if its target is missing: rustup target add {}",
        build::TARGET
    )]
    Module,
    /// The glue between module and page cannot be made.
    #[error("the glue of the module: {0}")]
    Glue(String),
    /// A scene of the list cannot be read.
    #[error("{0}")]
    Scene(#[from] trisect_scene::SceneError),
    /// The address cannot be served.
    #[error("{address} cannot be served: {message}\n  choose another address: --serve 127.0.0.1:8081")]
    Serve {
        /// Address that was asked for.
        address: String,
        /// Error of the system.
        message: String,
    },
}

/// Returns what makes an error of the system one of a path.
fn at(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> PageError + '_ {
    move |source| PageError::Io { path: path.to_owned(), source }
}

fn run(arguments: &Arguments) -> Result<(), PageError> {
    let size = build::build(&arguments.output)?;
    println!(
        "wrote {}: {} files, {:.2} MB, {:.2} MB gzipped",
        arguments.output.display(),
        size.files,
        size.bytes as f64 / 1e6,
        size.gzipped as f64 / 1e6
    );
    arguments.serve.as_ref().map_or(Ok(()), |address| serve::serve(&arguments.output, address))
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
