//! Options of messages and statistics, and the arguments of `trisect info`, `doctor`, `completions`
//! and `man`.

use clap::Args;
use std::path::PathBuf;

/// Messages and statistics of a render.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Messages")]
pub struct LogArgs {
    /// Write statistics of the render as JSON; `-` prints them to standard output (default: none).
    #[arg(help_heading = "Messages", long, value_name = "FILE")]
    pub stats: Option<PathBuf>,

    /// Another spelling of --stats: --json prints, --json=FILE writes a file.
    #[arg(
        help_heading = "Messages",
        long,
        value_name = "FILE",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "-",
        conflicts_with = "stats"
    )]
    pub json: Option<PathBuf>,

    /// Option by which the file of statistics is named. Set by the program.
    #[arg(skip = "--stats")]
    pub stats_option: &'static str,

    /// Print warnings and errors only: no progress, no summary.
    #[arg(help_heading = "Messages", short, long)]
    pub quiet: bool,

    /// Also print the kernel with its traversal and schedule, and the time of each phase.
    #[arg(help_heading = "Messages", short, long, conflicts_with = "quiet")]
    pub verbose: bool,
}

impl LogArgs {
    /// Takes the value of `--json` for that of `--stats`.
    pub fn unify(&mut self) {
        if let Some(json) = self.json.take() {
            (self.stats, self.stats_option) = (Some(json), "--json");
        }
    }
}

/// Option `--json` of commands that print a result.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Result")]
pub struct JsonArgs {
    /// Print JSON instead of text; --json=FILE writes it to a file, beside the text.
    #[arg(help_heading = "Result", long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    pub json: Option<PathBuf>,
}

/// Arguments of `trisect info`.
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// Form of the result.
    #[command(flatten)]
    pub json: JsonArgs,
}

/// Arguments of `trisect doctor`.
#[derive(Debug, Args)]
#[command(after_help = "Exit codes: 0 all that is present works, 1 something is present and does not work.")]
pub struct DoctorArgs {
    /// Form of the result.
    #[command(flatten)]
    pub json: JsonArgs,
}

/// Arguments of `trisect completions`.
#[derive(Debug, Args)]
#[command(
    after_help = "bash: trisect completions bash > ~/.local/share/bash-completion/completions/trisect\nzsh:  trisect completions zsh > FOLDER/_trisect, FOLDER being one of $fpath\nfish: trisect completions fish > ~/.config/fish/completions/trisect.fish"
)]
pub struct CompletionsArgs {
    /// Shell that the script is for.
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// Arguments of `trisect man`.
#[derive(Debug, Args)]
pub struct ManArgs {
    /// Folder for trisect.1 and a page for each command, such as ~/.local/share/man/man1; created
    /// if it does not exist (default: print trisect.1).
    #[arg(short, long, value_name = "FOLDER")]
    pub output: Option<PathBuf>,
}
