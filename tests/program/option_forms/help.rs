//! Commands and options that a help text lists.

use std::collections::BTreeMap;

/// Form of an option's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Value {
    /// The option has none.
    Absent,
    /// `--name` or `--name=VALUE`.
    Optional,
    /// `--name VALUE` or `--name=VALUE`.
    Required,
}

/// Option as the help lists it.
#[derive(Debug)]
pub struct Listed {
    /// Short name, such as `-o`.
    pub short: Option<String>,
    /// Form of the value.
    pub value: Value,
    /// Possible values, if the help names them.
    pub possible: Vec<String>,
}

/// Options of a command by their long names.
pub type Options = BTreeMap<String, Listed>;

/// Returns the options that the long help of a command lists.
pub fn options(help: &str) -> Options {
    let mut options = Options::new();
    let mut last = String::new();
    for line in help.lines() {
        let text = line.trim_start();
        let indent = line.len() - text.len();
        if (2..=6).contains(&indent) && text.starts_with('-') {
            if let Some((name, listed)) = option(text) {
                last.clone_from(&name);
                options.insert(name, listed);
            }
        } else if indent >= 10
            && let Some((value, _)) = text.strip_prefix("- ").and_then(|rest| rest.split_once(':'))
            && value.bytes().all(|byte| byte.is_ascii_alphanumeric())
            && let Some(listed) = options.get_mut(&last)
        {
            listed.possible.push(value.to_owned());
        }
    }
    options
}

/// Reads a line such as `-o, --output <FILE>`.
fn option(text: &str) -> Option<(String, Listed)> {
    let (short, long) = match text.split_once(", ") {
        Some((short, rest)) if short.len() == 2 => (Some(short.to_owned()), rest),
        _ => (None, text),
    };
    let end = long.find(|letter: char| letter != '-' && !letter.is_ascii_alphanumeric());
    let (name, rest) = long.split_at(end.unwrap_or(long.len()));
    let value = match rest {
        _ if rest.starts_with("[=") => Value::Optional,
        _ if rest.starts_with(" <") => Value::Required,
        _ => Value::Absent,
    };
    let listed = Listed { short, value, possible: Vec::new() };
    name.starts_with("--").then(|| (name.to_owned(), listed))
}

/// Returns the names of the commands that a help text lists, without `help`.
pub fn commands(help: &str) -> Vec<String> {
    let section = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    section
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.strip_prefix("  ").filter(|rest| !rest.starts_with(' ')))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .map(str::to_owned)
        .collect()
}
