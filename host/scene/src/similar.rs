//! Finds the name that a misspelt word stands for.

use strsim::osa_distance;

/// Maximum length of a word that is compared, in characters.
const MAX_LENGTH: usize = 100;

/// Returns the file name nearest to `word`, if one is near: at most as many characters are
/// wrong, missing, extra or swapped as a third of the name without its extension has. Case does not
/// count. Otherwise, the same name with another extension is near.
pub(crate) fn nearest_file<'a>(word: &str, names: &[&'a str]) -> Option<&'a str> {
    let other_extension = || {
        let of_word = stem(word).to_lowercase();
        names.iter().copied().find(|name| *name != word && stem(name).to_lowercase() == of_word)
    };
    nearest_by(word, names.iter().copied(), stem).or_else(other_extension)
}

/// Returns the nearest name to `word`. `counted` gives the part whose length allows for differences.
fn nearest_by<'a>(
    word: &str,
    names: impl IntoIterator<Item = &'a str>,
    counted: fn(&str) -> &str,
) -> Option<&'a str> {
    let length = |text: &str| text.chars().take(MAX_LENGTH + 1).count();
    if length(word) > MAX_LENGTH {
        return None;
    }
    let lower = word.to_lowercase();
    let near = |name: &'a str| {
        let limit = length(counted(word)).max(length(counted(name))) / 3;
        let is_other = name != word && length(name) <= MAX_LENGTH;
        let distance = is_other.then(|| osa_distance(&lower, &name.to_lowercase()))?;
        (distance <= limit).then_some((distance, name))
    };
    let nearest = names.into_iter().filter_map(near).min_by_key(|(distance, _)| *distance);
    nearest.map(|(_, name)| name)
}

/// Returns a file name without its extension.
fn stem(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_names_are_near_by_their_stems() {
        let names = ["a.png", "checker.png", "wood.jpg"];
        for (word, expected) in [
            ("cheker.png", Some("checker.png")),
            ("Checker.PNG", Some("checker.png")),
            ("wood.png", Some("wood.jpg")),
            ("b.png", None),
            ("a.png", None),
            ("stone.png", None),
        ] {
            assert_eq!(nearest_file(word, &names), expected, "{word}");
        }
    }
}
