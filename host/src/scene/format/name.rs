//! Names: what the file calls its materials, textures and other files, and where it does.

use crate::scene::error::SceneError;
use crate::scene::import::Folder;
use ron::value::RawValue;
use serde::de::{Error as _, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::{BTreeSet, HashMap};
use std::fmt;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

/// A scene file's text, which every [`Name`] read from it borrows: so an error found after reading still has its place.
#[derive(Clone, Copy, Debug, Default)]
pub struct Source<'a> {
    /// The file, or what stands for it.
    pub file: &'a str,
    /// What it contains.
    pub text: &'a str,
}

impl Source<'_> {
    /// An error at a name.
    pub fn at(&self, name: &Name, message: String) -> SceneError {
        let offset = name.place.as_ptr().addr().wrapping_sub(self.text.as_ptr().addr());
        let before = self.text.get(..offset).unwrap_or_default();
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
        SceneError::at(self.file, self.text, line, column, message)
    }

    /// Checks that a file's name ends as one of these formats' do, in letters of either case.
    pub fn check_extension(&self, file: &Name, extensions: &[&str], what: &str) -> Result<(), SceneError> {
        let extension = Path::new(&file.name).extension().and_then(|extension| extension.to_str());
        let known = |extension: &str| extensions.iter().any(|known| known.eq_ignore_ascii_case(extension));
        if extension.is_some_and(known) {
            return Ok(());
        }
        Err(self.at(file, format!("\"{}\" is not {what}; use .{}", file.name, extensions.join(", ."))))
    }

    /// Returns the path of a file that the scene names; the scene lies in `folder`.
    pub fn locate(&self, file: &Name, folder: &Folder) -> Result<PathBuf, SceneError> {
        folder.locate(Path::new(&file.name)).map_err(|error| {
            self.at(file, format!("\"{}\": {error}; put it there, or say --allow-outside", file.name))
        })
    }

    /// An error that concerns no single value.
    pub fn inconsistent(&self, message: impl Into<String>) -> SceneError {
        SceneError::Inconsistent { file: self.file.to_owned(), message: message.into() }
    }

    /// Places what is wrong with a file as a whole at the name that asks for it. An error with a place of its own keeps it.
    pub fn in_file(&self, name: &Name, error: SceneError) -> SceneError {
        match error {
            SceneError::Read { .. } | SceneError::Inconsistent { .. } | SceneError::UnknownFormat { .. } => {
                self.at(name, error.to_string())
            }
            _ => error,
        }
    }
}

/// A string that refers to something, and where it stands.
#[derive(Clone, Debug)]
pub struct Name<'a> {
    /// What it says.
    pub name: String,
    /// The part of the file's text with the string in its quotation marks.
    place: &'a str,
}

impl<'de: 'a, 'a> Deserialize<'de> for Name<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let raw = <&'de RawValue>::deserialize(deserializer)?;
        let name = raw.into_rust().map_err(|error| D::Error::custom(error.code))?;
        Ok(Self { name, place: raw.get_ron() })
    }
}

/// Something with a name of its own.
pub trait Named {
    /// What to call one of it.
    const KIND: &'static str;
    /// The field that lists them.
    const FIELD: &'static str;
}

/// The indices of what has names.
pub struct Index<'a> {
    kind: &'static str,
    field: &'static str,
    of: HashMap<&'a str, usize>,
}

impl<'a> Index<'a> {
    /// Of a field's entries.
    pub fn new<T: Named>(entries: &'a [(String, T)]) -> Self {
        let of = entries.iter().enumerate().map(|(index, (name, _))| (name.as_str(), index)).collect();
        Self { kind: T::KIND, field: T::FIELD, of }
    }

    /// The index of the entry that a name refers to.
    pub fn find(&self, name: &Name, source: Source) -> Result<usize, SceneError> {
        self.of.get(name.name.as_str()).copied().ok_or_else(|| {
            let known: BTreeSet<&str> = self.of.keys().copied().collect();
            let mut list: Vec<&str> = known.iter().take(8).copied().collect();
            if known.len() > list.len() {
                list.push("…");
            }
            let has = if list.is_empty() { "nothing".to_owned() } else { list.join(", ") };
            source.at(name, format!("unknown {} \"{}\"; `{}` has: {has}", self.kind, name.name, self.field))
        })
    }
}

/// A map that keeps its order and refuses a name that stands twice.
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
                    return Err(A::Error::custom(format!("{} \"{name}\" stands twice", T::KIND)));
                }
                entries.push((name, map.next_value()?));
            }
            Ok(entries)
        }
    }
    deserializer.deserialize_map(Entries(PhantomData))
}

/// An optional field without RON's `Some(…)` around it.
pub fn some<'de, D, T>(deserializer: D) -> Result<Option<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    T::deserialize(deserializer).map(Some)
}
