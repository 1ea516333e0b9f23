//! Names of materials, textures and other files in a scene file, with their places.

use crate::error::SceneError;
use crate::import::{Folder, shown};
use crate::ron_error::{list, suggestion};
use ron::value::RawValue;
use serde::de::{Error as _, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::{BTreeSet, HashMap};
use std::fmt;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

/// A scene file's text. Every [`Name`] read from it borrows it, so an error found after reading
/// still has its place.
#[derive(Clone, Copy, Debug, Default)]
pub struct Source<'a> {
    /// Path of the file, or the name that stands for it.
    pub file: &'a str,
    /// Content of the file.
    pub text: &'a str,
}

impl Source<'_> {
    /// Returns an error at a name.
    pub fn at(&self, name: &Name, message: String) -> SceneError {
        let offset = name.place.as_ptr().addr().wrapping_sub(self.text.as_ptr().addr());
        let before = self.text.get(..offset).unwrap_or_default();
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
        SceneError::at(self.file, self.text, line, column, message)
    }

    /// Checks that a file's name has one of these extensions, in upper or lower case.
    pub fn check_extension(&self, file: &Name, extensions: &[&str], what: &str) -> Result<(), SceneError> {
        let extension = Path::new(&file.name).extension().and_then(|extension| extension.to_str());
        let known = |extension: &str| extensions.iter().any(|known| known.eq_ignore_ascii_case(extension));
        if extension.is_some_and(known) {
            return Ok(());
        }
        Err(self.at(file, format!("\"{}\" is not {what}; use .{}", file.name, extensions.join(", ."))))
    }

    /// Returns the path of a file that the scene names, for a scene in `folder`.
    pub fn locate(&self, file: &Name, folder: &Folder) -> Result<PathBuf, SceneError> {
        folder.locate(Path::new(&file.name)).map_err(|error| {
            self.at(file, format!("\"{}\": {error}; move it there, or pass `allow_outside`", file.name))
        })
    }

    /// Returns an error that concerns no single value.
    pub fn inconsistent(&self, message: impl Into<String>) -> SceneError {
        SceneError::Inconsistent { file: self.file.to_owned(), message: message.into() }
    }

    /// Places an error about a file as a whole at the name that refers to the file. An error with a
    /// place of its own keeps it.
    pub fn in_file(&self, name: &Name, error: SceneError) -> SceneError {
        match error {
            SceneError::Read { .. } | SceneError::Inconsistent { .. } | SceneError::UnknownFormat { .. } => {
                self.at(name, error.to_string())
            }
            _ => error,
        }
    }
}

/// A string that refers to something, with its place in the file.
#[derive(Clone, Debug)]
pub struct Name<'a> {
    /// Content of the string.
    pub name: String,
    /// The string with its quotation marks, as a part of the file's text.
    place: &'a str,
}

impl<'de: 'a, 'a> Deserialize<'de> for Name<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let raw = <&'de RawValue>::deserialize(deserializer)?;
        let name = raw.into_rust().map_err(|error| D::Error::custom(error.code))?;
        Ok(Self { name, place: raw.get_ron() })
    }
}

/// An entry that names refer to.
pub trait Named {
    /// Word for one entry in messages.
    const KIND: &'static str;
    /// Field that lists the entries.
    const FIELD: &'static str;
}

/// Indices of named entries.
pub struct Index<'a> {
    kind: &'static str,
    field: &'static str,
    of: HashMap<&'a str, usize>,
}

impl<'a> Index<'a> {
    /// Builds the index of a field's entries.
    pub fn new<T: Named>(entries: &'a [(String, T)]) -> Self {
        let of = entries.iter().enumerate().map(|(index, (name, _))| (name.as_str(), index)).collect();
        Self { kind: T::KIND, field: T::FIELD, of }
    }

    /// Returns the index of the entry that a name refers to.
    pub fn find(&self, name: &Name, source: Source) -> Result<usize, SceneError> {
        self.of.get(name.name.as_str()).copied().ok_or_else(|| {
            let mut known: Vec<&str> = self.of.keys().copied().collect();
            known.sort_unstable();
            let has = if known.is_empty() { "nothing".to_owned() } else { list(&known) };
            let suggestion = suggestion(&name.name, &known).unwrap_or_else(|| ";".to_owned());
            let (kind, field, name_shown) = (self.kind, self.field, shown(&name.name));
            source.at(name, format!("unknown {kind} \"{name_shown}\"{suggestion} `{field}` has: {has}"))
        })
    }
}

/// Reads a map in the file's order, and refuses a name that occurs twice.
pub fn unique_names<'de, D, T>(deserializer: D) -> Result<Vec<(String, T)>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de> + Named,
{
    struct Entries<T>(PhantomData<T>);
    impl<'de, T: Deserialize<'de> + Named> Visitor<'de> for Entries<T> {
        type Value = Vec<(String, T)>;

        fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
            write!(formatter, "a map from names to {}", T::FIELD)
        }

        fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
            let mut seen = BTreeSet::new();
            let mut entries = Vec::new();
            while let Some(name) = map.next_key::<String>()? {
                if !seen.insert(name.clone()) {
                    return Err(A::Error::custom(format!("{} \"{name}\" is defined twice", T::KIND)));
                }
                entries.push((name, map.next_value()?));
            }
            Ok(entries)
        }
    }
    deserializer.deserialize_map(Entries(PhantomData))
}
