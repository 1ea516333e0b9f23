//! Reads the table of forms.

use super::table::{BASES, GROUPS};

/// Form of an option's value, and the result of a command that has it.
#[derive(Debug)]
pub struct Form {
    /// Value, or `None` for the option without one.
    pub value: Option<String>,
    /// Exit codes, one of which the command ends with.
    pub codes: Vec<i32>,
    /// Word of the message, if it is not the name of the option.
    pub word: Option<&'static str>,
}

/// Line of the table.
#[derive(Debug)]
pub struct Row {
    /// Long name.
    pub option: &'static str,
    /// True if only a build with MPI lists the option.
    pub of_ranks: bool,
    /// Commands that have the option, by their names in `BASES`.
    pub commands: Vec<&'static str>,
    /// Options that each form has beside it, and a scene in place of a.ron.
    pub context: Vec<&'static str>,
    /// Forms that the commands take.
    pub accepted: Vec<Form>,
    /// Forms that the commands refuse.
    pub refused: Vec<Form>,
}

impl Row {
    /// Returns whether the row is of this option of this command.
    pub fn covers(&self, command: &str, option: &str) -> bool {
        self.option == option && self.commands.contains(&command)
    }

    /// Returns whether a form of the row has this value.
    pub fn has(&self, value: &str) -> bool {
        self.accepted.iter().chain(&self.refused).any(|form| form.value.as_deref() == Some(value))
    }
}

/// Returns the rows of a table.
pub fn rows(table: &'static str) -> Vec<Row> {
    let (mut context, mut name, mut rows) = (Vec::new(), "", Vec::new());
    for line in table.lines().filter(|line| !line.is_empty() && !line.starts_with("# ")) {
        if let Some(words) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            context = words.split_whitespace().collect();
            continue;
        }
        let cells: Vec<&'static str> = line.split('|').map(str::trim).collect();
        let [option, commands, accepted, refused] = cells[..] else { panic!("{line}: not four cells") };
        if !option.is_empty() {
            name = option;
        }
        let forms = |cell: &'static str, code| cell.split_whitespace().map(|text| form(text, code)).collect();
        rows.push(Row {
            option: name.trim_start_matches('*'),
            of_ranks: name.starts_with('*'),
            commands: commands.split_whitespace().flat_map(members).collect(),
            context: context.clone(),
            accepted: forms(accepted, 0),
            refused: forms(refused, super::USAGE),
        });
    }
    rows
}

/// Returns the commands of a group, or the one command of this name.
fn members(name: &'static str) -> Vec<&'static str> {
    match GROUPS.iter().find(|group| group.0 == name) {
        Some((_, members)) => members.split_whitespace().collect(),
        None if name == "every" => BASES.iter().map(|base| base.0).collect(),
        None => vec![name],
    }
}

/// Reads a form such as `VALUE`, `VALUE@3` or `VALUE@4~word`.
fn form(text: &'static str, code: i32) -> Form {
    let (text, word) = text.split_once('~').map_or((text, None), |(text, word)| (text, Some(word)));
    let coded = text.rsplit_once('@').and_then(|(value, codes)| {
        let codes: Option<Vec<i32>> = codes.split('/').map(|code| code.parse().ok()).collect();
        codes.map(|codes| (value, codes))
    });
    let (value, codes) = coded.unwrap_or_else(|| (text, vec![code]));
    let value = match value {
        "." => None,
        "\"\"" => Some(String::new()),
        _ => Some(value.replace('␣', " ")),
    };
    Form { value, codes, word }
}
