//! What is about the program itself, and what it says.

use clap::Args;
use std::path::PathBuf;

/// What a render says of itself.
#[derive(Clone, Debug, Args)]
pub struct LogArgs {
    /// Write what the render took as JSON; `-` prints it on standard output.
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,

    /// Print errors only.
    #[arg(short, long)]
    pub quiet: bool,

    /// Print also how it was rendered, and what each phase took.
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,
}

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
