//! Parsing of the whole command line: forms of options beyond those of clap.

use super::Cli;
use clap::{ArgAction, Command, CommandFactory, FromArgMatches};
use std::ffi::OsString;
use std::path::Path;
use trisect::scene::import::{is_foreign_scene, is_model};

/// Parses the arguments of the process, the name of the program first.
///
/// # Errors
///
/// Those of clap; the text of `--help` and `--version` is among them.
pub fn parse(arguments: impl Iterator<Item = OsString>) -> Result<Cli, clap::Error> {
    let mut command = with_negative_numbers(Cli::command());
    let matches = command.try_get_matches_from_mut(join_json(arguments))?;
    Cli::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
}

/// Lets options take numbers such as `-1` as their values, so that a value that is refused is the
/// subject of the message, and not an unknown option.
fn with_negative_numbers(command: Command) -> Command {
    let names: Vec<String> = command.get_subcommands().map(|of| of.get_name().to_owned()).collect();
    let takes_value = |argument: &clap::Arg| {
        matches!(argument.get_action(), ArgAction::Set | ArgAction::Append) && !argument.is_positional()
    };
    let command = command.mut_args(|argument| match takes_value(&argument) {
        true => argument.allow_negative_numbers(true),
        false => argument,
    });
    names.into_iter().fold(command, |command, name| command.mut_subcommand(name, with_negative_numbers))
}

/// Joins `--json` and the file that follows it by `=`: `-`, or a file that ends in `.json`. Other
/// words after `--json`, which may stand alone, are scenes or images. The commands `bench` and
/// `view` take any file that is no scene, as they did when their `--json` always had a file.
fn join_json(arguments: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut joined: Vec<OsString> = Vec::new();
    let mut options = true;
    for argument in arguments {
        options &= argument != "--";
        let takes_any = joined.get(1).is_some_and(|command| command == "bench" || command == "view");
        let path = Path::new(&argument);
        let is_json = path.extension().is_some_and(|of| of == "json");
        let is_other = takes_any && !argument.to_string_lossy().starts_with('-') && !is_scene(path);
        let is_file = argument == "-" || is_json || is_other;
        match joined.last_mut() {
            Some(json) if options && is_file && *json == "--json" => {
                json.push("=");
                json.push(&argument);
            }
            _ => joined.push(argument),
        }
    }
    joined
}

/// Returns whether a path is that of a scene or a model, by its extension.
fn is_scene(path: &Path) -> bool {
    let is_ron = path.extension().is_some_and(|of| of.eq_ignore_ascii_case("ron"));
    is_ron || is_model(path) || is_foreign_scene(path)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    fn words(text: &str) -> Vec<OsString> {
        text.split(' ').map(OsString::from).collect()
    }

    #[test]
    fn json_takes_a_file() {
        for (given, wanted) in [
            ("trisect bench --json a.json b.ron", "trisect bench --json=a.json b.ron"),
            ("trisect bench --json - b.ron", "trisect bench --json=- b.ron"),
            ("trisect bench --json b.ron", "trisect bench --json b.ron"),
            ("trisect bench --json times.txt", "trisect bench --json=times.txt"),
            ("trisect compare --json a.png b.png", "trisect compare --json a.png b.png"),
            ("trisect view --json --headless", "trisect view --json --headless"),
            ("trisect bench --json=a.json c.json", "trisect bench --json=a.json c.json"),
            ("trisect render -- --json a.json", "trisect render -- --json a.json"),
        ] {
            assert_eq!(join_json(words(given).into_iter()), words(wanted));
        }
    }

    #[test]
    fn negative_numbers_are_values() {
        for option in ["--spp", "--budget", "--seed"] {
            let error = parse(words(&format!("trisect render {option} -1")).into_iter()).unwrap_err();
            assert!(error.to_string().contains(option) && !error.to_string().contains("-- -1"), "{error}");
        }
        // Negative control: without the change the value is an unknown option.
        let plain = Cli::command().try_get_matches_from(words("trisect render --spp -1")).unwrap_err();
        assert!(plain.to_string().contains("-- -1"), "{plain}");
    }
}
