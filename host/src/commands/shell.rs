//! `trisect completions` and `trisect man`: completion scripts and manual pages, generated from the
//! command line's own description.

use crate::cli::{Cli, CompletionsArgs, ManArgs};
use clap::CommandFactory;
use std::process::ExitCode;
use trisect::Error;
use trisect::image::ImageError;

/// Prints the completion script of a shell.
pub fn completions(arguments: &CompletionsArgs) -> Result<ExitCode, Error> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), "trisect", &mut script);
    super::print(&String::from_utf8_lossy(&script))?;
    Ok(ExitCode::SUCCESS)
}

/// Writes a manual page of the program and one of each command to a folder; without a folder,
/// prints that of the program.
pub fn man(arguments: &ManArgs) -> Result<ExitCode, Error> {
    let io = |path: &std::path::Path, source| ImageError::Io { path: path.to_owned(), source };
    let Some(folder) = &arguments.output else {
        let mut page = Vec::new();
        let here = std::path::Path::new("standard output");
        clap_mangen::Man::new(Cli::command()).render(&mut page).map_err(|source| io(here, source))?;
        super::print(&String::from_utf8_lossy(&page))?;
        return Ok(ExitCode::SUCCESS);
    };
    std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(Cli::command(), folder))
        .map_err(|source| io(folder, source))?;
    super::eprint(&format!("wrote pages to {}", folder.display()));
    Ok(ExitCode::SUCCESS)
}
