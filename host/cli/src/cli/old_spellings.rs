//! Options that have new names. The old ones work for one version, with a note.

use std::ffi::OsString;

/// Old and new names of options.
const RENAMED: [(&str, &str); 2] = [("--samples", "--sample-range"), ("--out", "--output")];

/// Returns a note for each option among the arguments that has a new name.
pub fn notes(arguments: impl Iterator<Item = OsString>) -> Vec<String> {
    let given: Vec<String> = arguments
        .take_while(|argument| argument != "--")
        .map(|argument| argument.to_string_lossy().into_owned())
        .collect();
    let is = |argument: &String, name: &str| {
        argument.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('='))
    };
    RENAMED
        .into_iter()
        .filter(|(old, _)| given.iter().any(|argument| is(argument, old)))
        .map(|(old, new)| format!("{old} is now {new}; the old name ends with version 0.2"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_names_are_noted() {
        let of = |words: &[&str]| notes(words.iter().map(OsString::from));
        assert_eq!(of(&["render", "--samples", "0..256"]).len(), 1);
        assert_eq!(of(&["bench", "report", "--out=x"]).len(), 1);
        assert!(of(&["render", "--sample-range", "0..256", "--output", "x", "--", "--out"]).is_empty());
    }
}
