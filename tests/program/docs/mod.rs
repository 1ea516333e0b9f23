//! The documentation, tested: links resolve, commands run, generated pages are what the program
//! says, and the wording keeps to its rules.
//!
//! `UPDATE_DOCS=1 cargo test --release -p trisect-tests --test program docs::generated` writes the
//! generated pages and sections anew.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

mod commands;
mod fences;
mod generated;
mod glossary;
mod layers;
mod links;
mod schemas;
mod words;

use std::fs;
use std::path::{Path, PathBuf};
use trisect_tests::root;

/// Returns all files of the project that end in one of `endings`, without build outputs.
fn files(endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![root()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let hidden = name.starts_with('.') || name == "target" || name == "generated" || name == "dev";
            if path.is_dir() && !hidden {
                open.push(path);
            } else if endings.iter().any(|ending| name.ends_with(ending)) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Returns a file's text.
fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Returns a path as a reader of the project names it.
fn name(path: &Path) -> String {
    path.strip_prefix(root()).unwrap_or(path).display().to_string()
}
