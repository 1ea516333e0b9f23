//! Messages about scene files whose text is not what the format allows.

use super::shown_text::shown;
use super::similar::nearest;
use super::version::VERSION;

/// Maximum length of a list of names in characters, unless the first name is longer.
const MAX_LIST: usize = 160;

/// Returns the parser's message. It has names in quotes, because backquotes stand for settings.
pub(crate) fn message(error: &ron::Error) -> String {
    let of = |outer: &Option<String>| outer.as_deref().map_or_else(String::new, |of| format!(" of {of}"));
    match error {
        ron::Error::NoSuchStructField { expected, found, outer } => {
            unknown(&format!("field \"{}\"{}", shown(found), of(outer)), found, expected)
        }
        ron::Error::NoSuchEnumVariant { expected, found, outer } => {
            unknown(&format!("variant \"{}\"{}", shown(found), of(outer)), found, expected)
        }
        ron::Error::MissingStructField { field, outer } => {
            let place = outer.as_deref().map_or_else(String::new, |of| format!(" in {of}"));
            let remedy =
                if *field == "version" { format!("; write version: {VERSION}") } else { String::new() };
            format!("the field \"{field}\" is missing{place}{remedy}")
        }
        ron::Error::DuplicateStructField { field, outer } => {
            format!("the field \"{field}\"{} is given twice", of(outer))
        }
        other => other.to_string().replace('`', "\""),
    }
}

/// Returns the message for a field that a struct or variant `of` does not have.
pub(crate) fn unknown_field(found: &str, of: &str, known: &[&str]) -> String {
    unknown(&format!("field \"{}\" of {of}", shown(found)), found, known)
}

fn unknown(what: &str, found: &str, known: &[&str]) -> String {
    let has = |is_sentence: bool| match (known, is_sentence) {
        ([], true) => String::new(),
        ([], false) => "; it has none".to_owned(),
        (_, true) => format!(" It has {}", list(known)),
        (_, false) => format!("; it has {}", list(known)),
    };
    match suggestion(found, known) {
        Some(suggestion) => format!("unknown {what}{suggestion}{}", has(true)),
        None => format!("unknown {what}{}", has(false)),
    }
}

/// Returns the end of a message about a name that is not known, if a known one is near.
pub(crate) fn suggestion(found: &str, known: &[&str]) -> Option<String> {
    nearest(found, known.iter().copied()).map(|name| format!(": did you mean \"{}\"?", shown(name)))
}

/// Returns a list of names, which leaves out the last of many.
pub(crate) fn list(names: &[&str]) -> String {
    let mut text = String::new();
    for (count, name) in names.iter().enumerate() {
        let name = shown(name);
        if count > 0 && text.chars().count() + 2 + name.chars().count() > MAX_LIST {
            return format!("{text} and {} more", names.len() - count);
        }
        text += if count > 0 { ", " } else { "" };
        text += &name;
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        crate::format::parse(text, "a.ron")
            .map(|_| ())
            .unwrap_err()
            .to_string()
            .lines()
            .next()
            .unwrap()
            .to_owned()
    }

    /// Returns a scene with these materials and objects.
    fn scene(materials: &str, objects: &str) -> String {
        format!(
            "Scene(version: 1, image: (width: 1, height: 1), materials: {{{materials}}}, objects: [{objects}])"
        )
    }

    #[test]
    fn the_nearest_name_comes_first() {
        for (text, expected) in [
            (
                scene("\"a\": MetallicRoughness(rougness: 1)", ""),
                "unknown field \"rougness\" of MetallicRoughness: did you mean \"roughness\"? It has base_color, texture, metallic, ",
            ),
            (
                scene("\"a\": Lambertian(albedo: (1, 1, 1), opacty: 1)", ""),
                "unknown field \"opacty\" of Lambertian: did you mean \"opacity\"? It has albedo, texture, emission, ",
            ),
            (
                scene("\"a\": Emissive(radiance: (1, 1, 1), twosided: true)", ""),
                "unknown field \"twosided\" of Emissive: did you mean \"two_sided\"? It has radiance, ",
            ),
            (
                scene("\"a\": Metalic()", ""),
                "unknown variant \"Metalic\" of Material: did you mean \"Metal\"? It has Lambertian, ",
            ),
            (
                scene("", "sphere(center: (0, 0, 0))"),
                "unknown variant \"sphere\" of Object: did you mean \"Sphere\"? It has Sphere, Quad, Disc, Plane, Box, Mesh",
            ),
            (
                scene("", "Sphere(centre: (0, 0, 0))"),
                "unknown field \"centre\" of Sphere: did you mean \"center\"? It has ",
            ),
            (
                scene("", "").replace("width", "widht"),
                "unknown field \"widht\" of Image: did you mean \"width\"? It has width, height, samples, depth",
            ),
            (
                scene("\"a\": Dielectric(ior: 1.5)", "Sphere(center: (0, 0, 0), radius: 1, material: \"A\")"),
                "unknown material \"A\": did you mean \"a\"? `materials` has: a",
            ),
            // Negative controls: other names.
            (
                scene("", "").replace("width", "haze"),
                "unknown field \"haze\" of Image; it has width, height, ",
            ),
            (scene("\"a\": Cloth()", ""), "unknown variant \"Cloth\" of Material; it has Lambertian, "),
        ] {
            let error = error(&text);
            assert!(error.contains(expected), "{error}\n{expected}");
        }
    }

    #[test]
    fn missing_and_repeated_fields_are_named() {
        let whole = scene("", "");
        for (old, new, expected) in [
            ("version: 1, ", "", "the field \"version\" is missing in Scene; write version: 1"),
            (", height: 1", "", "the field \"height\" is missing in Image"),
            ("width: 1", "width: 1, width: 1", "the field \"width\" of Image is given twice"),
        ] {
            let error = error(&whole.replace(old, new));
            assert!(error.ends_with(expected), "{error}");
        }
        assert!(crate::format::parse(&whole, "a.ron").is_ok());
    }

    #[test]
    fn lists_end_at_a_name() {
        assert_eq!(list(&["a", "b"]), "a, b");
        let names: Vec<String> = (0..40).map(|i| format!("name {i:02}")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let text = list(&names);
        assert!(text.ends_with("name 17 and 22 more") && text.chars().count() < MAX_LIST + 20, "{text}");
        // A long name is cut itself.
        assert_eq!(list(&[&"x".repeat(1000), "y"]), format!("{}…, y", "x".repeat(100)));
    }
}
