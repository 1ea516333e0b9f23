//! Places of values in the text of RON: what an edit replaces, and leaves the rest as it is.

use std::ops::Range;

/// Kind of a value that has entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Fields, or a tuple, in parentheses.
    Struct,
    /// Keys and values in braces.
    Map,
    /// Values in brackets.
    List,
}

/// Entry of a struct, a map or a list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry<'a> {
    /// Name of a field, or content of a key that is a string; `None` for a value without one.
    pub key: Option<&'a str>,
    /// Place of the value.
    pub value: Range<usize>,
}

/// A value that has entries.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Container<'a> {
    /// Kind of the value.
    pub kind: Kind,
    /// Offset behind the opening bracket.
    pub opening: usize,
    /// Entries in the order of the text.
    pub entries: Vec<Entry<'a>>,
}

/// Returns the container that begins at `start`, behind blanks, comments, attributes and its name;
/// `None` if the value there has no entries. The text is valid RON: of another one, any entries may
/// be returned.
pub fn container(text: &str, start: usize) -> Option<Container<'_>> {
    let mut at = skip(text, start);
    while text.get(at..)?.starts_with("#!") {
        at = skip(text, at + text.get(at..)?.find(']')? + 1);
    }
    if text.get(at..)?.starts_with(|c: char| c.is_alphabetic() || c == '_') {
        at = skip(text, token_end(text, at));
    }
    let (kind, closing) = match text.get(at..)?.chars().next()? {
        '(' => (Kind::Struct, ')'),
        '{' => (Kind::Map, '}'),
        '[' => (Kind::List, ']'),
        _ => return None,
    };
    let opening = at + 1;
    let mut entries = Vec::new();
    at = skip(text, opening);
    while let Some(rest) = text.get(at..).filter(|rest| !rest.is_empty() && !rest.starts_with(closing)) {
        let mut key = None;
        let (first, after) = (token_end(text, at), skip(text, token_end(text, at)));
        if kind != Kind::List && text.get(after..).is_some_and(|rest| rest.starts_with(':')) {
            let word = rest.get(..first - at).unwrap_or_default();
            key = Some(word.strip_prefix("r#").unwrap_or(word).trim_matches('"'));
            at = skip(text, after + 1);
        }
        let end = value_end(text, at);
        entries.push(Entry { key, value: at..end });
        let next = skip(text, end);
        at = match text.get(next..).is_some_and(|rest| rest.starts_with(',')) {
            true => skip(text, next + 1),
            false if next > at => next,
            false => break,
        };
    }
    Some(Container { kind, opening, entries })
}

/// Returns the offset of the first token from `at` on, behind blanks and comments.
fn skip(text: &str, mut at: usize) -> usize {
    while let Some(rest) = text.get(at..) {
        let blank =
            rest.len() - rest.trim_start_matches(|c: char| c.is_whitespace() || c == '\u{feff}').len();
        at += blank;
        let Some(rest) = text.get(at..) else { break };
        if rest.starts_with("//") {
            at += rest.find('\n').unwrap_or(rest.len());
        } else if rest.starts_with("/*") {
            at += comment_length(rest);
        } else {
            break;
        }
    }
    at
}

/// Returns the length of the block comment that begins the text; such comments nest.
fn comment_length(text: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    while let Some(rest) = text.get(at..).filter(|rest| !rest.is_empty()) {
        let (change, length) = match rest {
            rest if rest.starts_with("/*") => (1, 2),
            rest if rest.starts_with("*/") => (-1, 2),
            rest => (0, rest.chars().next().map_or(1, char::len_utf8)),
        };
        (depth, at) = (depth + change, at + length);
        if depth == 0 {
            break;
        }
    }
    at
}

/// Returns the end of the token at `at`: a string, a word or number, or a single character.
fn token_end(text: &str, at: usize) -> usize {
    let rest = text.get(at..).unwrap_or_default();
    let Some(first) = rest.chars().next() else { return at };
    // Strings may have a prefix for bytes, and one for raw content.
    let prefix = rest.len() - rest.trim_start_matches(['b', 'r', '#']).len();
    if rest[prefix..].starts_with('"') {
        let (before, body) = rest.split_at(prefix);
        if before.contains('r') {
            let end = format!("\"{}", "#".repeat(before.matches('#').count()));
            return at + prefix + 1 + body[1..].find(&end).map_or(body.len() - 1, |place| place + end.len());
        }
        return at + prefix + quoted_length(body, '"');
    }
    if first == '\'' {
        return at + quoted_length(rest, '\'');
    }
    let is_word = |c: char| c.is_alphanumeric() || "_+-.#".contains(c);
    let word = rest.find(|c: char| !is_word(c)).unwrap_or(rest.len());
    at + word.max(first.len_utf8())
}

/// Returns the length of a quoted text with its quotes, in which a backslash escapes a character.
fn quoted_length(text: &str, quote: char) -> usize {
    let mut is_escaped = false;
    for (place, c) in text.char_indices().skip(1) {
        match c {
            _ if is_escaped => is_escaped = false,
            '\\' => is_escaped = true,
            c if c == quote => return place + c.len_utf8(),
            _ => {}
        }
    }
    text.len()
}

/// Returns the end of the value at `at`: that of the last token before a comma, or before a bracket
/// that closes what is around it.
fn value_end(text: &str, mut at: usize) -> usize {
    let (mut end, mut depth) = (at, 0usize);
    while let Some(first) = text.get(at..).and_then(|rest| rest.chars().next()) {
        match first {
            ',' if depth == 0 => break,
            ')' | ']' | '}' if depth == 0 => break,
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth -= 1,
            _ => {}
        }
        end = token_end(text, at);
        at = skip(text, end);
    }
    end
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    fn of(text: &str) -> (Kind, Vec<(Option<&str>, &str)>) {
        let Container { kind, entries, .. } = container(text, 0).unwrap();
        (kind, entries.into_iter().map(|entry| (entry.key, &text[entry.value])).collect())
    }

    #[test]
    fn entries_are_found() {
        let text = "\u{feff}#![enable(implicit_some)] // (a, b)\nScene /* ( /* , */ */ (\n version: 1, r#a : \"x, (\\\" y)\" , // c\n\
            b: Wrap(1, [2, 3]), c: -1.5e-3 /* , */, d: 'x', e: r#\"a\" , \"#, f: {}, )";
        let entries = [
            (Some("version"), "1"),
            (Some("a"), "\"x, (\\\" y)\""),
            (Some("b"), "Wrap(1, [2, 3])"),
            (Some("c"), "-1.5e-3"),
            (Some("d"), "'x'"),
            (Some("e"), "r#\"a\" , \"#"),
            (Some("f"), "{}"),
        ];
        assert_eq!(of(text), (Kind::Struct, entries.to_vec()));
        assert_eq!(
            of("{ \"a b\": X(y: 1), \"c\": Y }"),
            (Kind::Map, vec![(Some("a b"), "X(y: 1)"), (Some("c"), "Y")])
        );
        assert_eq!(of("[A(1), (2), 3]"), (Kind::List, vec![(None, "A(1)"), (None, "(2)"), (None, "3")]));
        assert_eq!(of("(0, 1.5,-2)"), (Kind::Struct, vec![(None, "0"), (None, "1.5"), (None, "-2")]));
        assert_eq!((of("[]").1, of("{ /* a: 1 */ }").1), (vec![], vec![]));
        assert!(
            ["", "Black", "1", "\"(a: 1)\"", "-1", "// (a: 1)"]
                .iter()
                .all(|text| container(text, 0).is_none())
        );
    }

    /// Whatever the text, the search ends.
    #[test]
    fn broken_text_is_harmless() {
        let text = "Scene(a: [1, {\"b\": 'c', /* d */ e: r#\"f\"#}], g: (h) // i\n)";
        for start in 0..text.len() {
            for end in start..=text.len() {
                let _ = container(text, start).and(container(&text[..end], 0));
            }
        }
        for odd in ["(:", "(,,,", "(]", "[)", "(é: ä, 'ö)", "(a: \"", "(a: r##\"", "#!(", "(a::b)", "(/*"]
        {
            let _ = container(odd, 0);
        }
    }
}
