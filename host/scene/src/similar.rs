//! Finds the name that a misspelt word stands for.

use strsim::osa_distance;

/// Maximum length of a word that is compared, in characters.
const MAX_LENGTH: usize = 100;

/// Returns the name nearest to `word`, if one is near: at most a third of the characters are wrong,
/// missing, extra or swapped with the next. Case does not count.
pub(crate) fn nearest<'a>(word: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    nearest_by(word, names, |name| name)
}

/// Returns the file name nearest to `word`, if one is near by [`nearest`] without counting the
/// characters of the extension, or else one that has another extension.
pub(crate) fn nearest_file<'a>(word: &str, names: &[&'a str]) -> Option<&'a str> {
    let other_extension = || {
        let of_word = stem(word).to_lowercase();
        names.iter().copied().find(|name| *name != word && stem(name).to_lowercase() == of_word)
    };
    nearest_by(word, names.iter().copied(), stem).or_else(other_extension)
}

/// Returns the nearest name to `word`. `counted` gives the part whose length allows for
/// differences.
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
    fn misspelt_words_are_near() {
        let names = ["base_color", "roughness", "roughness_texture", "metallic", "up", "k"];
        for (word, expected) in [
            ("rougness", "roughness"),
            ("roguhness", "roughness"),
            ("Metallic", "metallic"),
            ("mettalic", "metallic"),
            ("basecolour", "base_color"),
            ("roughnesstexture", "roughness_texture"),
            ("upp", "up"),
        ] {
            assert_eq!(nearest(word, names), Some(expected), "{word}");
        }
        // Negative controls: short words and others are not near, and no word is near itself.
        for word in ["", "u", "n", "albedo", "specular", "k", &"roughness".repeat(20)] {
            assert_eq!(nearest(word, names), None, "{word}");
        }
    }

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
