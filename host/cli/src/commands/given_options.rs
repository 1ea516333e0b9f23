//! Options of the command line as they were given.

use crate::cli::{Cli, JobArgs};
use clap::parser::ValueSource;
use clap::{ArgMatches, Args, Command, CommandFactory};

/// Returns the options of a render ([`JobArgs`]) that this process was given after the command
/// `name`, such as `--depth` with its value, without those named in `without`.
pub fn of_job(name: &str, without: &[&str]) -> Vec<(String, Option<String>)> {
    let matches = Cli::command().try_get_matches_from(std::env::args_os());
    let given = matches.ok().and_then(|matches| matches.subcommand_matches(name).cloned());
    given.map_or_else(Vec::new, |given| job_options(&given, without))
}

fn job_options(given: &ArgMatches, without: &[&str]) -> Vec<(String, Option<String>)> {
    let known = JobArgs::augment_args(Command::new("job"));
    let mut options = Vec::new();
    for argument in known.get_arguments() {
        let id = argument.get_id().as_str();
        let Some(long) = argument.get_long().filter(|long| !without.contains(long)) else { continue };
        if given.try_contains_id(id).is_err() || given.value_source(id) != Some(ValueSource::CommandLine) {
            continue;
        }
        let option = format!("--{long}");
        if !argument.get_action().takes_values() {
            options.push((option, None));
            continue;
        }
        let values = given.get_raw(id).into_iter().flatten();
        options.extend(values.map(|value| (option.clone(), Some(value.to_string_lossy().into_owned()))));
    }
    options
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_as_they_were_given() {
        let words = "trisect tradeoff a.ron --allow-outside --resolution 48x32 --sampler independent --spp 4 \
                     --time=-1.5s --seeds 4 --time-limit 1m -o out --threads=2";
        let matches = Cli::command().try_get_matches_from(words.split_whitespace());
        let matches = matches.unwrap_or_else(|error| panic!("{error}"));
        let given = matches.subcommand_matches("tradeoff").map(|given| job_options(given, &["spp"]));
        let mut given = given.unwrap_or_default();
        given.sort();
        let with = |name: &str, value: &str| (name.to_owned(), Some(value.to_owned()));
        let expected = [
            ("--allow-outside".to_owned(), None),
            with("--resolution", "48x32"),
            with("--sampler", "independent"),
            with("--threads", "2"),
            with("--time", "-1.5s"),
        ];
        assert_eq!(given, expected);
    }
}
