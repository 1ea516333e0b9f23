//! Escaping of messages: they quote file names and contents, which must not reach a terminal
//! unchanged.

use std::borrow::Cow;
use std::fmt::Write;

/// Maximum length of a line, in characters.
const MAX_LINE: usize = 300;

/// Prefixes of messages that may quote names from outside. Further lines of these messages are
/// indented.
const QUOTING: [&str; 3] = ["error: ", "warning: ", "wrote "];

/// Returns `text` with control characters other than line breaks escaped as in Rust (`\u{1b}`), and
/// without the middle of lines of more than 300 characters. In a message that may quote names, a
/// line break is also escaped unless the next line is indented, so that no name can fake another
/// message.
pub fn escaped(text: &str) -> Cow<'_, str> {
    let mut lines = text.split('\n').skip(1);
    if QUOTING.iter().any(|start| text.starts_with(start)) && lines.any(|line| !line.starts_with("  ")) {
        let mut joined = String::with_capacity(text.len());
        for (index, line) in text.split('\n').enumerate() {
            let is_further = index > 0 && line.starts_with("  ");
            joined += if is_further { "\n" } else { ["\\n", ""][usize::from(index == 0)] };
            joined += line;
        }
        return Cow::Owned(plain_lines(&joined).into_owned());
    }
    plain_lines(text)
}

/// Returns `text` with control characters escaped and long lines shortened.
fn plain_lines(text: &str) -> Cow<'_, str> {
    let is_plain = |line: &str| !line.chars().any(is_unsafe) && line.len() <= MAX_LINE;
    if text.split('\n').all(is_plain) {
        return Cow::Borrowed(text);
    }
    let lines: Vec<String> = text.split('\n').map(|line| shortened(&plain(line))).collect();
    Cow::Owned(lines.join("\n"))
}

/// Returns whether a terminal would act on a character: move the cursor, change colours, or write
/// from right to left.
fn is_unsafe(letter: char) -> bool {
    let is_format = matches!(
        letter,
        '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
    );
    is_format || letter.is_control()
}

fn plain(line: &str) -> String {
    let mut plain = String::with_capacity(line.len());
    for letter in line.chars() {
        if is_unsafe(letter) {
            let _ = write!(plain, "{}", letter.escape_default());
        } else {
            plain.push(letter);
        }
    }
    plain
}

/// Shortens a line, and keeps both ends: the file comes first, reason and remedy last.
fn shortened(line: &str) -> String {
    let count = line.chars().count();
    if count <= MAX_LINE {
        return line.to_owned();
    }
    let first = MAX_LINE / 2;
    let last = MAX_LINE - 1 - first;
    let start: String = line.chars().take(first).collect();
    let end: String = line.chars().skip(count - last).collect();
    format!("{start}…{end}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped() {
        assert_eq!(escaped("a: b\n  c: é"), "a: b\n  c: é");
        assert_eq!(escaped("\u{1b}[31mred\r\u{7}\t\u{9b}2J"), "\\u{1b}[31mred\\r\\u{7}\\t\\u{9b}2J");
        assert_eq!(escaped("ab\u{202e}dc\nx"), "ab\\u{202e}dc\nx");
        assert!(!escaped("a\0b").contains('\0'));
    }

    #[test]
    fn names_begin_no_message() {
        let forged = "error: x.ron\nerror: all is lost: not there\n  remedy";
        assert_eq!(escaped(forged), "error: x.ron\\nerror: all is lost: not there\n  remedy");
        assert_eq!(escaped("wrote a\nb.png"), "wrote a\\nb.png");
        // A message without quotes keeps its lines.
        assert_eq!(escaped("64 spp\n2 s"), "64 spp\n2 s");
        assert_eq!(escaped("error: a\n  b"), "error: a\n  b");
    }

    #[test]
    fn long_lines_keep_both_ends() {
        let line = |middle: usize| format!("first{}last", "é".repeat(middle));
        assert_eq!(escaped(&line(291)), line(291));
        let text = format!("one\n{}\nthree", line(292));
        let text = escaped(&text);
        let lengths: Vec<usize> = text.lines().map(|line| line.chars().count()).collect();
        assert_eq!(lengths, [3, 300, 5]);
        assert!(text.contains("\nfirst") && text.contains("é…é") && text.contains("last\n"), "{text}");
        // The length of an escape is that of its shown characters.
        assert_eq!(escaped(&"\u{1b}".repeat(100)).chars().count(), 300);
    }
}
