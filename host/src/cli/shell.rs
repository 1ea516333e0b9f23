//! What is about the program itself.

use clap::Args;
use std::path::PathBuf;

/// `trisect info`.
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// `trisect doctor`.
#[derive(Debug, Args)]
#[command(after_help = "Exit codes: 0 what is here works, 1 something is here and does not work.")]
pub struct DoctorArgs {
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// `trisect completions`.
#[derive(Debug, Args)]
#[command(
    after_help = "bash: trisect completions bash > ~/.local/share/bash-completion/completions/trisect\nzsh:  trisect completions zsh > FOLDER/_trisect, FOLDER being one of $fpath\nfish: trisect completions fish > ~/.config/fish/completions/trisect.fish"
)]
pub struct CompletionsArgs {
    /// Which.
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// `trisect man`.
#[derive(Debug, Args)]
pub struct ManArgs {
    /// Folder for trisect.1 and a page of each command, such as ~/.local/share/man/man1; without it, trisect.1 is printed.
    #[arg(short, long, value_name = "FOLDER")]
    pub output: Option<PathBuf>,
}
