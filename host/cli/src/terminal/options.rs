//! The library's messages name settings and functions in backquotes; the program's name its options
//! and commands.

use std::borrow::Cow;

/// Settings whose options have their names.
const OPTIONS: [&str; 56] = [
    "allow_outside",
    "aov",
    "background",
    "backend",
    "bits",
    "block",
    "budget",
    "cache",
    "camera_path",
    "checkpoint",
    "clamp",
    "counts",
    "crop",
    "denoise",
    "denoise_color",
    "denoise_depth",
    "denoise_levels",
    "denoise_normal",
    "depth",
    "deny_warnings",
    "device",
    "distribute",
    "exposure",
    "first",
    "frames",
    "gamma",
    "ground",
    "height",
    "history",
    "history_clamp",
    "knobs",
    "last",
    "light_group",
    "math",
    "max_spp",
    "patience",
    "quality",
    "reference",
    "resolution",
    "schedule",
    "seed",
    "seeds",
    "set",
    "spare",
    "spheres",
    "spp",
    "sums",
    "target_error",
    "threads",
    "tile",
    "time_limit",
    "tonemap",
    "traversal",
    "features",
    "width",
    "write_partial",
];

/// Functions and features of the library, and how the program has them.
const OTHERS: [(&str, &str); 4] = [
    ("device::list", "`trisect info`"),
    ("mpi", "--features mpi"),
    ("precision::write", "`trisect check --write`"),
    ("resume", "trisect resume"),
];

/// Returns the text with each backquoted setting replaced by the option that sets it.
pub fn with_options(text: &str) -> Cow<'_, str> {
    let mut said = String::new();
    let mut rest = text;
    while let Some((before, quoted)) = rest.split_once('`')
        && let Some((name, after)) = quoted.split_once('`')
    {
        said.push_str(before);
        match words(name) {
            Some(words) => {
                said.push_str(&words);
                rest = after;
            }
            // The second backquote may open a name.
            None => {
                said.push('`');
                rest = quoted;
            }
        }
    }
    if said.is_empty() { Cow::Borrowed(text) } else { Cow::Owned(said + rest) }
}

/// Returns the program's words for a setting or a function.
fn words(name: &str) -> Option<String> {
    if OPTIONS.contains(&name) {
        return Some(format!("--{}", name.replace('_', "-")));
    }
    OTHERS.iter().find(|(known, _)| *known == name).map(|(_, words)| (*words).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn settings_become_options() {
        for (text, want) in [
            ("`spp` is 0; lower `max_spp`", "--spp is 0; lower --max-spp"),
            ("`device::list` has them", "`trisect info` has them"),
            ("the field `space`, `seed`", "the field `space`, --seed"),
            ("`a `seed` b` `", "`a --seed b` `"),
            ("nothing", "nothing"),
            ("", ""),
        ] {
            assert_eq!(with_options(text), want, "{text}");
        }
    }

    #[test]
    fn each_option_exists() {
        let all = options(&crate::cli::Cli::command());
        for name in OPTIONS {
            // Options of ranks are in builds with MPI only.
            let built = cfg!(feature = "mpi") || !OF_RANKS.contains(&name);
            assert!(!built || all.contains(&name.replace('_', "-")), "{name}");
        }
    }

    const OF_RANKS: [&str; 6] = ["block", "counts", "distribute", "patience", "spare", "write_partial"];

    /// Returns the options of a command and of those below it.
    fn options(command: &clap::Command) -> Vec<String> {
        let own = command.get_arguments().filter_map(clap::Arg::get_long).map(str::to_owned);
        own.chain(command.get_subcommands().flat_map(options)).collect()
    }
}
