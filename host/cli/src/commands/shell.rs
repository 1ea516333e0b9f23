//! `trisect completions` and `trisect man`: completion scripts and manual pages, generated from the
//! command line's own description.

use crate::cli::{Cli, CompletionsArgs, ManArgs};
use clap::{Arg, Command, CommandFactory};
use std::process::ExitCode;
use trisect::image::ImageError;
use trisect_lab::Error;

/// Prints the completion script of a shell.
pub fn completions(arguments: &CompletionsArgs) -> Result<ExitCode, Error> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut visible(&Cli::command()), "trisect", &mut script);
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

/// Returns the command without hidden options and subcommands, which `clap_complete` would offer.
fn visible(command: &Command) -> Command {
    let mut copy = Command::new(command.get_name().to_owned())
        .args(command.get_arguments().filter(|argument| !argument.is_hide_set()).map(Arg::clone))
        .subcommands(command.get_subcommands().filter(|inner| !inner.is_hide_set()).map(visible));
    if let Some(about) = command.get_about() {
        copy = copy.about(about.clone());
    }
    if let Some(version) = command.get_version() {
        copy = copy.version(version.to_owned());
    }
    copy
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::ValueEnum;
    use clap_complete::{Shell, generate};

    fn script(shell: Shell, mut command: Command) -> String {
        let mut script = Vec::new();
        generate(shell, &mut command, "program", &mut script);
        String::from_utf8_lossy(&script).into_owned()
    }

    #[test]
    fn hidden_options_are_not_offered() {
        let option = |name: &'static str| Arg::new(name).long(name);
        let inner = Command::new("inner").arg(option("shown")).arg(option("secret").hide(true));
        let command = Command::new("program").subcommand(inner).subcommand(Command::new("covert").hide(true));
        for shell in Shell::value_variants() {
            let offered = script(*shell, visible(&command));
            assert!(offered.contains("shown"), "{shell}");
            assert!(!offered.contains("secret") && !offered.contains("covert"), "{shell}");
        }
        // Negative control: without the filter, both are offered.
        let all = script(Shell::Bash, command);
        assert!(all.contains("secret") && all.contains("covert"));
    }

    #[test]
    fn every_shell_has_a_script_with_all_visible_options() {
        for shell in Shell::value_variants() {
            let offered = script(*shell, visible(&Cli::command()));
            assert!(offered.contains("target-error") && offered.contains("denoise"), "{shell}");
            assert_eq!(offered.contains("write-partial"), cfg!(feature = "mpi"), "{shell}");
        }
    }
}
