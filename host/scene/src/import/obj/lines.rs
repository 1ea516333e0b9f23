//! Lines of OBJ and MTL: a keyword and its arguments.

use crate::error::SceneError;
use std::borrow::Cow;

/// Text of a file, and the file's name in messages.
#[derive(Debug)]
pub struct Source<'a> {
    pub name: &'a str,
    text: Cow<'a, str>,
}

impl<'a> Source<'a> {
    /// Takes a file's bytes. Invalid UTF-8, such as in comments of old programs, is replaced.
    pub fn new(name: &'a str, bytes: &'a [u8]) -> Self {
        Self { name, text: String::from_utf8_lossy(bytes) }
    }

    /// Returns the statements: lines that are neither empty nor comments. A `\` at the end of a
    /// line joins the next line.
    pub fn statements(&self) -> impl Iterator<Item = Statement<'_>> {
        let mut lines = (1..).zip(self.text.split('\n'));
        std::iter::from_fn(move || {
            let (number, first) = lines.next()?;
            let mut text = Cow::Borrowed(first.trim());
            while text.ends_with('\\') {
                let mut joined = text.into_owned();
                joined.pop();
                joined.push(' ');
                joined.push_str(lines.next().map_or("", |(_, next)| next.trim()));
                text = Cow::Owned(joined);
            }
            Some(Statement { source: self, line: number, text })
        })
        .filter(|statement| !statement.text.is_empty() && !statement.text.starts_with('#'))
    }
}

/// A statement: a keyword and its arguments.
#[derive(Debug)]
pub struct Statement<'s> {
    source: &'s Source<'s>,
    /// Line, counted from 1.
    pub line: usize,
    text: Cow<'s, str>,
}

impl Statement<'_> {
    /// Returns the first word.
    pub fn keyword(&self) -> &str {
        self.text.split_whitespace().next().unwrap_or_default()
    }

    /// Returns everything after the first word: a name, which may contain spaces.
    pub fn rest(&self) -> &str {
        self.text.split_once(char::is_whitespace).map_or("", |(_, rest)| rest.trim())
    }

    /// Returns the words after the first one, up to a comment.
    pub fn arguments(&self) -> impl Iterator<Item = &str> {
        self.text.split_whitespace().skip(1).take_while(|word| !word.starts_with('#'))
    }

    /// Returns the arguments as numbers, which may be infinite or NaN. Omitted numbers are 0.
    ///
    /// # Errors
    ///
    /// [`SceneError::Invalid`] for a word that is not a number, or for fewer than `least` numbers.
    pub fn numbers<const N: usize>(&self, least: usize) -> Result<[f64; N], SceneError> {
        let mut numbers = [0.0; N];
        let mut count = 0;
        for (number, word) in numbers.iter_mut().zip(self.arguments()) {
            *number = self.number(word)?;
            count += 1;
        }
        if count < least {
            return Err(self.error("", format!("{} has {count} numbers, it takes {least}", self.keyword())));
        }
        Ok(numbers)
    }

    /// Parses a word as a number.
    pub fn number(&self, word: &str) -> Result<f64, SceneError> {
        word.parse().map_err(|_| {
            self.error(word, format!("\"{}\" is not a number", crate::import::source_location::shown(word)))
        })
    }

    /// Returns an error at `word`, a part of the statement, or at its line if `word` is empty.
    pub fn error(&self, word: &str, message: String) -> SceneError {
        let column = if word.is_empty() { None } else { self.text.find(word) };
        let before = self.text.get(..column.unwrap_or_default()).unwrap_or_default();
        SceneError::at(self.source.name, &self.source.text, self.line, 1 + before.chars().count(), message)
    }
}
