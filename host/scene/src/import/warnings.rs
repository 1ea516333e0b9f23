//! Collects warnings about parts of a model file that are not rendered as the file states.

use std::collections::HashSet;

/// Maximum number of different warnings that are kept.
const MAX_WARNINGS: usize = 200;

/// Collected warnings: each feature once, and each kind of changed data with its count.
#[derive(Clone, Debug, Default)]
pub(super) struct Warnings {
    texts: Vec<String>,
    seen: HashSet<String>,
    tallies: Vec<Tally>,
}

#[derive(Clone, Debug)]
struct Tally {
    what: &'static str,
    count: u64,
    first: String,
}

impl Warnings {
    /// Adds a warning, unless it was added before.
    pub fn once(&mut self, text: impl AsRef<str>) {
        let text = text.as_ref();
        if self.texts.len() > MAX_WARNINGS || self.seen.contains(text) {
            return;
        }
        if self.texts.len() == MAX_WARNINGS {
            self.texts.push("there are more warnings, which are not shown".to_owned());
            return;
        }
        self.seen.insert(text.to_owned());
        self.texts.push(text.to_owned());
    }

    /// Adds `count` to the tally of `what`: a plural noun, and what is done to these things.
    pub fn tally(&mut self, what: &'static str, count: u64, place: &str) {
        if count == 0 {
            return;
        }
        match self.tallies.iter_mut().find(|tally| tally.what == what) {
            Some(tally) => tally.count = tally.count.saturating_add(count),
            None => self.tallies.push(Tally { what, count, first: place.to_owned() }),
        }
    }

    /// Returns all warnings as text.
    pub fn finish(mut self) -> Vec<String> {
        let tallies = self.tallies.iter();
        self.texts.extend(
            tallies.map(|Tally { what, count, first }| format!("{what}: {count}, the first in {first}")),
        );
        self.texts
    }
}
