//! Words of a pbrt file and of the files that it includes, in their order.

use super::super::files::{self, Files};
use super::super::source_location::{SourceLocation, shown};
use super::super::{budget::Budget, gzip};
use crate::error::SceneError;
use std::rc::Rc;

/// Maximum number of files within each other.
const MAX_DEPTH: usize = 16;

/// Maximum number of files of a scene; each counts as often as it is included.
const MAX_FILES: usize = 4096;

/// A place in a file of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct At {
    /// Index of the file.
    source: usize,
    /// Place in bytes.
    offset: usize,
}

/// A word of a file.
#[derive(Clone, Debug, PartialEq)]
pub enum Token {
    /// A word without quotes: a directive, a number, `true` or `false`.
    Word(String),
    /// Text between quotes.
    Text(String),
    /// `[`.
    Open,
    /// `]`.
    Close,
}

/// A file of the scene.
struct Source {
    name: String,
    text: Rc<str>,
    /// Place of each line in bytes.
    lines: Vec<usize>,
}

/// A file that is being read.
struct Frame {
    source: usize,
    text: Rc<str>,
    offset: usize,
}

/// Words of all files of a scene.
pub struct Tokens {
    sources: Vec<Source>,
    frames: Vec<Frame>,
    /// A word that was looked at and put back.
    next: Option<(Token, At)>,
    /// Number of files that were begun.
    begun: usize,
    /// Place of the word that was taken last.
    pub at: At,
}

impl Tokens {
    /// Returns the words of a file.
    pub fn new(bytes: &[u8], name: &str, budget: &mut Budget) -> Result<Self, SceneError> {
        let at = At { source: 0, offset: 0 };
        let mut tokens = Self { sources: Vec::new(), frames: Vec::new(), next: None, begun: 0, at };
        tokens.add_source(bytes, name, budget)?;
        tokens.begin(0);
        Ok(tokens)
    }

    fn add_source(&mut self, bytes: &[u8], name: &str, budget: &mut Budget) -> Result<usize, SceneError> {
        let text: Rc<str> = String::from_utf8_lossy(bytes).into();
        budget.take(256 + 10 * text.len() as u64, &SourceLocation::new(name, "the text"))?;
        let lines = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        self.sources.push(Source { name: name.to_owned(), text, lines });
        Ok(self.sources.len() - 1)
    }

    fn begin(&mut self, source: usize) {
        let text = Rc::clone(&self.sources[source].text);
        self.frames.push(Frame { source, text, offset: 0 });
        self.begun += 1;
    }

    /// Goes on with another file, and returns to this one at its end. A file that several
    /// directives name is read once.
    pub fn include(
        &mut self,
        name: &str,
        at: At,
        files: &mut dyn Files,
        budget: &mut Budget,
    ) -> Result<(), SceneError> {
        if self.frames.len() >= MAX_DEPTH {
            let message = format!("files include each other; at most {MAX_DEPTH} may be within each other");
            return Err(self.error(at, message));
        }
        if self.begun >= MAX_FILES {
            return Err(self.error(at, format!("the scene includes too many files; at most {MAX_FILES}")));
        }
        let name = name.replace('\\', "/");
        let source = match self.sources.iter().position(|source| source.name == name) {
            // The main file has its whole path as name; a file of this name beside it is itself.
            Some(known) => {
                let length = self.sources[known].text.len() as u64;
                budget.take(length, &self.site(at, "Include"))?;
                known
            }
            None => {
                let read = files.read(&name, files::readable());
                let bytes = read.map_err(|error| self.site(at, "Include").resource(&name, error))?;
                budget.extend(bytes.len());
                let bytes = gzip::decompressed(bytes, budget, &self.site(at, "Include"))?;
                self.add_source(&bytes, &name, budget)?
            }
        };
        self.begin(source);
        Ok(())
    }

    /// Returns the next word; `None` at the end of the scene.
    pub fn take(&mut self) -> Result<Option<Token>, SceneError> {
        if let Some((token, at)) = self.next.take() {
            self.at = at;
            return Ok(Some(token));
        }
        while let Some(frame) = self.frames.last_mut() {
            let (token, at) = (frame.token(), At { source: frame.source, offset: frame.offset });
            match token {
                Ok(Some((token, offset))) => {
                    self.at = At { offset, ..at };
                    return Ok(Some(token));
                }
                Ok(None) => drop(self.frames.pop()),
                Err((message, offset)) => return Err(self.error(At { offset, ..at }, message)),
            }
        }
        Ok(None)
    }

    /// Puts the word back that was taken last.
    pub fn put_back(&mut self, token: Token) {
        self.next = Some((token, self.at));
    }

    /// Returns line and column, counted from 1; columns in characters.
    fn position(&self, at: At) -> (&Source, usize, usize) {
        let source = &self.sources[at.source];
        let line = source.lines.partition_point(|&start| start <= at.offset).max(1);
        let before = source.text.get(source.lines[line - 1]..at.offset).unwrap_or_default();
        (source, line, 1 + before.chars().count())
    }

    /// Returns an error at a place.
    pub fn error(&self, at: At, message: impl Into<String>) -> SceneError {
        let (source, line, column) = self.position(at);
        SceneError::at(&source.name, &source.text, line, column, message.into())
    }

    /// Returns a place for messages; `what` stands there.
    pub fn site(&self, at: At, what: &str) -> SourceLocation<'_> {
        let (source, line, _) = self.position(at);
        SourceLocation::new(&source.name, format!("line {line}, {what}"))
    }
}

impl Frame {
    /// Returns the next word with its place; `None` at the end of the file.
    fn token(&mut self) -> Result<Option<(Token, usize)>, (String, usize)> {
        let bytes = self.text.as_bytes();
        loop {
            match bytes.get(self.offset) {
                None => return Ok(None),
                Some(b'#') => {
                    let rest = &bytes[self.offset..];
                    self.offset += rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
                }
                Some(byte) if byte.is_ascii_whitespace() => self.offset += 1,
                Some(_) => break,
            }
        }
        let start = self.offset;
        let token = match bytes[start] {
            b'[' => {
                self.offset += 1;
                Token::Open
            }
            b']' => {
                self.offset += 1;
                Token::Close
            }
            b'"' => {
                let inside = &bytes[start + 1..];
                let length = inside.iter().position(|&byte| matches!(byte, b'"' | b'\n'));
                let Some(length) = length.filter(|&length| inside[length] == b'"') else {
                    return Err((
                        "the text has no end; it must end with a quote on its line".to_owned(),
                        start,
                    ));
                };
                self.offset += length + 2;
                Token::Text(self.text[start + 1..start + 1 + length].to_owned())
            }
            _ => {
                let is_end =
                    |&byte: &u8| byte.is_ascii_whitespace() || matches!(byte, b'"' | b'[' | b']' | b'#');
                let rest = &bytes[start..];
                let length = rest.iter().position(is_end).unwrap_or(rest.len());
                self.offset += length;
                Token::Word(self.text[start..start + length].to_owned())
            }
        };
        Ok(Some((token, start)))
    }
}

impl Token {
    /// Returns the word for messages.
    pub fn shown(&self) -> String {
        match self {
            Self::Word(word) => format!("\"{}\"", shown(word)),
            Self::Text(text) => format!("the text \"{}\"", shown(text)),
            Self::Open => "\"[\"".to_owned(),
            Self::Close => "\"]\"".to_owned(),
        }
    }
}

/// Returns a word as a finite number.
pub fn number(word: &str) -> Option<f64> {
    let starts =
        word.starts_with(|letter: char| letter.is_ascii_digit() || matches!(letter, '-' | '+' | '.'));
    word.parse().ok().filter(|number: &f64| starts && number.is_finite())
}
