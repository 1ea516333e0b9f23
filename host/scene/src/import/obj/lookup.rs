//! Finds images whose paths are those of another computer.

use super::super::files::Files;
use crate::similar::nearest_file;
use std::collections::HashMap;

/// Maximum number of names that are kept of all folders.
const MAX_NAMES: usize = 100_000;

/// Maximum number of folders of a path that are looked for, from its end.
const MAX_PARTS: usize = 16;

/// Names in the folders that were searched.
#[derive(Debug, Default)]
pub struct Lookup {
    folders: HashMap<String, Vec<String>>,
    names: usize,
}

impl Lookup {
    /// Returns the path of a file that has the file name of `written`, in `folder` or in the folder
    /// that paths start from: by as many of the folders that end `written` as there are, then by
    /// its name alone, then in one folder that `written` names. Names of another case count if none
    /// has the same.
    pub fn find(&mut self, written: &str, folder: &str, files: &mut dyn Files) -> Option<String> {
        let is_name = |part: &&str| !matches!(*part, "" | "." | "..") && !part.ends_with(':');
        let parts: Vec<&str> = written.split('/').filter(is_name).collect();
        let (name, parts) = parts.split_last()?;
        let parts = &parts[parts.len().saturating_sub(MAX_PARTS)..];
        let ends = (0..=parts.len()).map(|first| &parts[first..]);
        let ways: Vec<&[&str]> = ends.chain(parts.chunks(1).rev()).collect();
        let starts = if folder.is_empty() { &[""][..] } else { &[folder, ""] };
        [true, false].iter().find_map(|&is_exact| {
            let found = |(way, start): (&&[&str], &&str)| {
                let path = way.iter().chain([name]);
                path.copied().try_fold((*start).to_owned(), |at, part| self.entry(&at, part, is_exact, files))
            };
            ways.iter().flat_map(|way| starts.iter().map(move |start| (way, start))).find_map(found)
        })
    }

    /// Returns a name in `folder` that is similar to that of the file `written`.
    pub fn similar(&mut self, written: &str, folder: &str, files: &mut dyn Files) -> Option<String> {
        let name = written.rsplit('/').next()?;
        let names: Vec<&str> = self.names(folder, files).iter().map(String::as_str).collect();
        nearest_file(name, &names).map(str::to_owned)
    }

    /// Returns the path of the entry `name` of a folder.
    fn entry(&mut self, folder: &str, name: &str, is_exact: bool, files: &mut dyn Files) -> Option<String> {
        let lower = name.to_lowercase();
        let is_it = |known: &&String| if is_exact { *known == name } else { known.to_lowercase() == lower };
        let known = self.names(folder, files).iter().find(is_it)?;
        Some(if folder.is_empty() { known.clone() } else { format!("{folder}/{known}") })
    }

    /// Returns the names in a folder, which is read once.
    fn names(&mut self, folder: &str, files: &mut dyn Files) -> &[String] {
        if !self.folders.contains_key(folder) {
            if self.names >= MAX_NAMES {
                return &[];
            }
            let names = files.list(folder);
            self.names += names.len() + 1;
            self.folders.insert(folder.to_owned(), names);
        }
        self.folders.get(folder).map_or(&[], Vec::as_slice)
    }
}
