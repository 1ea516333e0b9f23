//! Mutants: a text of a source file, its replacement, and the tests that must catch it.

use crate::error::Error;
use serde::Deserialize;
use std::collections::HashSet;
use std::fmt;
use std::path::{Component, Path, PathBuf};

/// A test by its package, its target (`lib`, or the name of an integration test) and its name
/// there.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[serde(try_from = "String")]
pub struct Test {
    /// Name of the package.
    pub package: String,
    /// `lib` for unit tests, else the target's name.
    pub target: String,
    /// Name with its modules, as libtest prints it.
    pub name: String,
}

impl TryFrom<String> for Test {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        match text.split(' ').collect::<Vec<_>>().as_slice() {
            &[package, target, name] if !name.is_empty() => {
                Ok(Self { package: package.into(), target: target.into(), name: name.into() })
            }
            _ => Err(format!("{text:?} is not a test: expected a package, `lib` or a target, and a name")),
        }
    }
}

impl fmt::Display for Test {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} {} {}", self.package, self.target, self.name)
    }
}

impl Test {
    /// Returns the backend that the test needs besides the CPU, by the names that
    /// `for_each_backend!` gives.
    pub fn backend(&self) -> Option<&'static str> {
        match self.name.rsplit("::").next() {
            Some("wgpu" | "wgpu_naga" | "wgpu_wgsl") => Some("wgpu"),
            Some("cuda") => Some("cuda"),
            _ => None,
        }
    }
}

/// A mutant of the list.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mutant {
    /// Unique short name.
    pub name: String,
    /// Description in one sentence.
    pub what: String,
    /// Path of the file from the workspace's root.
    pub file: PathBuf,
    /// Text that occurs exactly once in the file.
    pub find: String,
    /// Text that replaces it.
    pub replace: String,
    /// `find` and `replace` are bytes in hexadecimal, for prebuilt kernels.
    #[serde(default)]
    pub hex: bool,
    /// The gate's own negative control: it changes no code, and its tests must pass, which shows
    /// that tests fail because of mutants.
    #[serde(default)]
    pub control: bool,
    /// Tests that must fail.
    pub caught_by: Vec<Test>,
}

impl Mutant {
    /// Returns `source` with the mutant.
    ///
    /// # Errors
    ///
    /// If the text does not occur exactly once.
    pub fn apply(&self, source: &[u8]) -> Result<Vec<u8>, Error> {
        let (find, replace) = (self.bytes(&self.find), self.bytes(&self.replace));
        let places: Vec<usize> = (0..source.len()).filter(|&at| source[at..].starts_with(&find)).collect();
        let &[at] = places.as_slice() else {
            return Err(Error::Text {
                mutant: self.name.clone(),
                file: self.file.clone(),
                count: places.len(),
            });
        };
        Ok([&source[..at], &replace, &source[at + find.len()..]].concat())
    }

    /// Returns the bytes of `find` or `replace`; [`check`] has validated hexadecimal text.
    fn bytes(&self, text: &str) -> Vec<u8> {
        if self.hex { hexadecimal(text).unwrap_or_default() } else { text.as_bytes().to_vec() }
    }
}

fn hexadecimal(text: &str) -> Option<Vec<u8>> {
    let digits: Vec<u8> = text
        .split_whitespace()
        .flat_map(str::chars)
        .map(|c| Some(c.to_digit(16)? as u8))
        .collect::<Option<_>>()?;
    digits.len().is_multiple_of(2).then(|| digits.chunks(2).map(|pair| pair[0] << 4 | pair[1]).collect())
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    mutant: Vec<Mutant>,
}

/// Reads the mutants of a TOML file, in its order.
///
/// # Errors
///
/// If the file cannot be read, two mutants have the same name, or a mutant is invalid.
pub fn read(path: &Path) -> Result<Vec<Mutant>, Error> {
    let text = std::fs::read_to_string(path).map_err(Error::io(path))?;
    let failed = |message| Error::Mutants { path: path.to_owned(), message };
    let List { mutant: mutants } = toml::from_str(&text).map_err(|error| failed(error.to_string()))?;
    let mut names = HashSet::new();
    for mutant in &mutants {
        check(mutant).map_err(|message| failed(format!("mutant {}: {message}", mutant.name)))?;
        if !names.insert(&mutant.name) {
            return Err(failed(format!("mutant {} is listed twice", mutant.name)));
        }
    }
    Ok(mutants)
}

fn check(mutant: &Mutant) -> Result<(), &'static str> {
    if mutant.name.is_empty() || mutant.name.contains(|c: char| !c.is_ascii_alphanumeric() && c != '-') {
        return Err("its name may have letters, digits and hyphens only");
    }
    if mutant.caught_by.is_empty() {
        return Err("`caught_by` names no test");
    }
    if !mutant.file.components().all(|part| matches!(part, Component::Normal(_))) {
        return Err("its file is not inside the workspace");
    }
    if mutant.find.is_empty() || mutant.find == mutant.replace {
        return Err("`find` is empty, or equal to `replace`");
    }
    if mutant.hex && [&mutant.find, &mutant.replace].into_iter().any(|text| hexadecimal(text).is_none()) {
        return Err("`find` or `replace` is not hexadecimal");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mutant(find: &str, replace: &str, hex: bool) -> Mutant {
        let test = Test::try_from("a lib b::c".to_owned()).unwrap();
        Mutant {
            name: "some".into(),
            what: "Some.".into(),
            file: "src/lib.rs".into(),
            find: find.into(),
            replace: replace.into(),
            hex,
            control: false,
            caught_by: vec![test],
        }
    }

    #[test]
    fn a_text_must_stand_there_once() {
        let planted = mutant("a + b", "a - b", false).apply(b"x = a + b;").unwrap();
        assert_eq!(planted, b"x = a - b;");
        for (source, want) in [("x = a * b;", 0), ("a + b, a + b", 2), ("", 0)] {
            let error = mutant("a + b", "a - b", false).apply(source.as_bytes()).unwrap_err();
            assert!(matches!(error, Error::Text { count, .. } if count == want), "{source}: {error}");
        }
        // Overlapping occurrences count, too.
        let error = mutant("aa", "b", false).apply(b"aaa").unwrap_err();
        assert!(matches!(error, Error::Text { count: 2, .. }));
    }

    #[test]
    fn bytes_in_hexadecimal() {
        assert_eq!(mutant("0f 49", "0f4A", true).apply(&[1, 0x0f, 0x49]).unwrap(), [1, 0x0f, 0x4a]);
        for odd in ["0", "0g", "0f 4"] {
            assert!(check(&mutant(odd, "00", true)).is_err(), "{odd}");
        }
    }

    #[test]
    fn what_is_no_fault_is_refused() {
        assert_eq!(check(&mutant("a", "b", false)), Ok(()));
        assert!(check(&mutant("a", "a", false)).is_err());
        assert!(check(&mutant("", "b", false)).is_err());
        assert!(check(&Mutant { caught_by: Vec::new(), ..mutant("a", "b", false) }).is_err());
        for file in ["../outside", "/etc/passwd"] {
            assert!(check(&Mutant { file: file.into(), ..mutant("a", "b", false) }).is_err(), "{file}");
        }
        for text in ["a lib", "a lib b c", "", "a lib "] {
            assert!(Test::try_from(text.to_owned()).is_err(), "{text:?}");
        }
    }

    #[test]
    fn backends_by_name() {
        let backend = |name: &str| Test::try_from(format!("a b {name}")).unwrap().backend();
        assert_eq!(backend("x::wgpu"), Some("wgpu"));
        assert_eq!(backend("x::wgpu_naga"), Some("wgpu"));
        assert_eq!(backend("x::cuda"), Some("cuda"));
        assert_eq!((backend("x::cpu"), backend("wgpu_is_there")), (None, None));
    }
}
