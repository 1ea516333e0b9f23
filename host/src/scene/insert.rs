//! Putting a space into a scene file's text.

use super::error::SceneError;
use super::format;

/// The text with `value` as its field `space`, in place of the one that it has or as its first field; and whether it names other files.
///
/// # Errors
///
/// Those of a text that is no scene.
pub(crate) fn insert_space(text: &str, file: &str, value: &str) -> Result<(String, bool), SceneError> {
    let scene = format::parse(text, file)?;
    let (start, end, inserted) = match scene.space.place {
        Some(place) => {
            let start = place.as_ptr().addr().wrapping_sub(text.as_ptr().addr());
            // The value's text may have blanks around it.
            let (before, after) = (place.len() - place.trim_start().len(), place.trim().len());
            (start + before, start + before + after, value.to_owned())
        }
        None => {
            let start = first_field(text);
            (start, start, format!("\n    space: {value},"))
        }
    };
    let inconsistent = || SceneError::Inconsistent {
        file: file.to_owned(),
        message: format!("there is no place for a space; add the field by hand: space: {value},"),
    };
    let (Some(before), Some(after)) = (text.get(..start), text.get(end..)) else {
        return Err(inconsistent());
    };
    let written = format!("{before}{inserted}{after}");
    // Whatever the text was: what is written reads as it should.
    match format::parse(&written, file) {
        Ok(parsed) if parsed.space.place.map(str::trim) == Some(value) => Ok((written, scene.names_files())),
        _ => Err(inconsistent()),
    }
}

/// Behind the parenthesis that opens the scene: the first one outside comments and attributes.
fn first_field(text: &str) -> usize {
    let mut at = 0;
    let mut depth = 0; // block comments nest
    while let Some(rest) = text.get(at..).filter(|rest| !rest.is_empty()) {
        let line = || rest.find('\n').map_or(rest.len(), |end| end + 1);
        at += if rest.starts_with("/*") {
            depth += 1;
            2
        } else if depth > 0 {
            let ends = rest.starts_with("*/");
            depth -= i32::from(ends);
            if ends { 2 } else { rest.chars().next().map_or(1, char::len_utf8) }
        } else if rest.starts_with("//") {
            line()
        } else if rest.starts_with("#!") {
            rest.find(']').map_or(rest.len(), |end| end + 1)
        } else if rest.starts_with('(') {
            return at + 1;
        } else {
            rest.chars().next().map_or(1, char::len_utf8)
        };
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    const REST: &str = "version: 1, image: (width: 8, height: 4), // (eight by four)\n\
        camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40), materials: {}, objects: [])";
    const VALUE: &str = "(origin: (1.0, 2.0, 3.0), scale: 0.5)";

    fn inserted(text: &str) -> String {
        insert_space(text, "scene.ron", VALUE).unwrap().0
    }

    #[test]
    fn all_but_the_space_stays() {
        for head in [
            "Scene(",
            "(",
            "// (a)\n/* ( /* ( */ */ Scene (",
            "\u{feff}Scene(",
            "#![enable(implicit_some)]\nScene(",
        ] {
            let text = format!("{head}{REST}");
            if format::parse(&text, "scene.ron").is_err() {
                assert!(head.starts_with('\u{feff}'), "{head}");
                continue;
            }
            assert_eq!(inserted(&text), format!("{head}\n    space: {VALUE},{REST}"));
        }
    }

    #[test]
    fn a_space_that_is_there_is_replaced() {
        for old in ["(scale: 3)", "(origin: (1, 2, 3))", "()", "Space( scale : 2 , ) "] {
            let text = format!("Scene(space: {old}, {REST}");
            assert_eq!(
                inserted(&text),
                format!("Scene(space: {VALUE}{}, {REST}", &old[old.trim_end().len()..])
            );
        }
    }

    #[test]
    fn files_are_noticed() {
        let names = |objects: &str| {
            let text = format!("Scene({REST}").replace("objects: []", objects);
            insert_space(&text, "scene.ron", VALUE).unwrap().1
        };
        assert!(!names("objects: []") && names("objects: [Mesh(file: \"a.glb\")]"));
        assert!(names("objects: [], sky: Image(file: \"a.hdr\")"));
        assert!(insert_space("Scene(", "scene.ron", VALUE).is_err());
    }
}
