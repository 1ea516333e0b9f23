//! Changes of single fields of a scene file, as `--set PATH=VALUE` states them: the text is edited
//! before it is read, so that values are checked as in the file.

use super::error::SceneError;
use super::format;
use super::ron_text::{Container, Entry, Kind, container};
use ron::value::RawValue;
use std::fmt::{self, Display, Formatter};
use std::ops::Range;
use std::str::FromStr;

/// Change of a field of a scene file.
///
/// Its text is `PATH=VALUE`. The path has names of fields and of entries, and numbers of list
/// entries from 0 on, with dots between them; names with dots or blanks are in quotes. An entry of
/// a list is also found by its field `name`. The value is RON; a vector needs no parentheses, and
/// the value of a field that holds a string needs no quotes.
///
/// ```
/// # use trisect_scene::FieldEdit;
/// let edit: FieldEdit = "camera.look_at=0,1,0".parse()?;
/// assert_eq!(edit.to_string(), "camera.look_at=(0,1,0)");
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldEdit {
    path: Vec<String>,
    /// RON, or the content of a string.
    value: String,
}

impl FromStr for FieldEdit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let hint = || "must be PATH=VALUE, such as camera.look_at=0,1,0".to_owned();
        let (path, value) = split(text).ok_or_else(hint)?;
        let value = value.trim();
        if value.is_empty() || path.iter().any(String::is_empty) {
            return Err(hint());
        }
        let is_value = |text: &str| ron::from_str::<&RawValue>(text).is_ok();
        let vector = format!("({value})");
        let value = if !is_value(value) && is_value(&vector) { vector } else { value.to_owned() };
        Ok(Self { path, value })
    }
}

impl Display for FieldEdit {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.path.join("."), self.value)
    }
}

/// Returns the parts of the path before the first `=` outside quotes, and the text after it.
fn split(text: &str) -> Option<(Vec<String>, &str)> {
    let (mut parts, mut is_quoted) = (vec![String::new()], false);
    for (place, c) in text.char_indices() {
        match c {
            '"' => is_quoted = !is_quoted,
            '=' if !is_quoted => return Some((parts, &text[place + 1..])),
            // `objects[3]` is `objects.3`.
            '.' | '[' if !is_quoted => parts.push(String::new()),
            ']' if !is_quoted => {}
            c => parts.last_mut()?.push(c),
        }
    }
    None
}

/// Applies changes to the text of a scene file, one after another.
///
/// # Errors
///
/// Those of a text that is not a scene, and [`SceneError::Inconsistent`] for a path that does not
/// exist. The values are not checked.
pub(crate) fn apply(text: &str, file: &str, edits: &[FieldEdit]) -> Result<String, SceneError> {
    let mut text = text.to_owned();
    if !edits.is_empty() {
        format::parse(&text, file)?;
    }
    for edit in edits {
        text = edit.applied(&text).map_err(|problem| SceneError::Inconsistent {
            file: file.to_owned(),
            message: format!("`set` {edit}: {problem}"),
        })?;
    }
    Ok(text)
}

/// Returns the name under which errors show an edited file.
pub(crate) fn edited_name(file: &str, edits: &[FieldEdit]) -> String {
    if edits.is_empty() { file.to_owned() } else { format!("{file}, changed by `set`") }
}

impl FieldEdit {
    /// Returns the path: names of fields and entries, and numbers of list entries.
    pub fn path(&self) -> &[String] {
        &self.path
    }

    /// Returns the change with another path.
    #[must_use]
    pub fn at(self, path: Vec<String>) -> Self {
        Self { path, ..self }
    }

    /// Returns whether this change, made after `earlier`, leaves nothing of it: both are of the
    /// same field, or `earlier` is of a part of this one's.
    pub(crate) fn replaces(&self, earlier: &Self) -> bool {
        earlier.path.starts_with(&self.path)
    }

    /// Returns the text with the new value in place of the old one, or as a new entry at the start
    /// of the struct or map that lacks it.
    fn applied(&self, text: &str) -> Result<String, String> {
        let mut place = 0..text.len();
        for (depth, name) in self.path.iter().enumerate() {
            let parent = || match depth {
                0 => "the scene".to_owned(),
                _ => self.path[..depth].join("."),
            };
            let within = container(text, place.start).ok_or_else(|| format!("{} has no fields", parent()))?;
            match find(text, &within, name) {
                Some(found) => place = found,
                None if depth + 1 == self.path.len() && can_insert(&within) => {
                    let key = if within.kind == Kind::Map { format!("{name:?}") } else { name.clone() };
                    let (before, after) = text.split_at(within.opening);
                    return Ok(format!("{before}{key}: {},{after}", self.value));
                }
                None => return Err(format!("{} has no {name}; {}", parent(), contents(text, &within))),
            }
        }
        let was_string = text[place.clone()].starts_with('"');
        let value = match was_string && !self.value.starts_with('"') {
            true => format!("{:?}", self.value),
            false => self.value.clone(),
        };
        Ok(format!("{}{value}{}", &text[..place.start], &text[place.end..]))
    }
}

/// Returns whether a field can be added: lists and tuples have none.
fn can_insert(within: &Container<'_>) -> bool {
    within.kind != Kind::List && within.entries.iter().all(|entry| entry.key.is_some())
}

/// Maximum number of names in a message.
const MAX_NAMES: usize = 20;

/// Returns the place of the value of an entry, by its key, its number, or its field `name`.
fn find(text: &str, within: &Container<'_>, name: &str) -> Option<Range<usize>> {
    let by_key = within.entries.iter().find(|entry| entry.key == Some(name));
    let by_number = || name.parse::<usize>().ok().and_then(|index| within.entries.get(index));
    let is_named = |entry: &&Entry<'_>| own_name(text, entry) == Some(name);
    let by_name = || within.entries.iter().find(is_named).filter(|_| within.kind == Kind::List);
    let has_keys = within.entries.iter().any(|entry| entry.key.is_some());
    let found = by_key.or_else(|| if has_keys { None } else { by_number() }).or_else(by_name);
    found.map(|entry| entry.value.clone())
}

/// Returns the content of an entry's field `name`, if it has one.
fn own_name<'a>(text: &'a str, entry: &Entry<'_>) -> Option<&'a str> {
    let fields = container(text, entry.value.start)?.entries;
    let field = fields.into_iter().find(|field| field.key == Some("name"))?;
    Some(text.get(field.value)?.trim_matches('"'))
}

/// Returns what a container has, for a message.
fn contents(text: &str, within: &Container<'_>) -> String {
    let keys: Vec<&str> = within.entries.iter().filter_map(|entry| entry.key).collect();
    match (within.entries.len(), keys.is_empty()) {
        (0, _) => "it is empty".to_owned(),
        (count, true) => {
            let names: Vec<&str> =
                within.entries.iter().filter_map(|entry| own_name(text, entry)).take(MAX_NAMES).collect();
            let names =
                if names.is_empty() { String::new() } else { format!(", named {}", names.join(", ")) };
            format!("its entries are 0 to {}{names}", count - 1)
        }
        (_, false) => format!("it has {}", keys.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    const SCENE: &str = r#"Scene( // a box
    version: 1,
    image: (width: 8, height: 4),
    camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40),
    materials: { "red": Lambertian(albedo: (1, 0, 0)), "dark red": Lambertian(albedo: (0.1, 0, 0)) },
    objects: [
        Sphere(center: (0, 0, 0), radius: 1, material: "red"), // first
        Sphere(name: "ball", center: (2, 0, 0), radius: 1, material: "red"),
    ],
)"#;

    fn edited(edit: &str) -> Result<String, String> {
        let edits = [edit.parse()?];
        let text = apply(SCENE, "scene.ron", &edits).map_err(|error| error.to_string())?;
        format::parse(&text, &edited_name("scene.ron", &edits)).map_err(|error| error.to_string())?;
        Ok(text)
    }

    /// Only the value changes.
    #[test]
    fn fields_are_replaced() {
        for (edit, old, new) in [
            ("image.width=16", "width: 8", "width: 16"),
            ("camera.look_at=0,1,-2", "look_at: (0, 0, 0)", "look_at: (0,1,-2)"),
            ("camera.look_from.2= 9", "look_from: (0, 0, 3)", "look_from: (0, 0, 9)"),
            ("materials.red.albedo=0,1,0", "albedo: (1, 0, 0)", "albedo: (0,1,0)"),
            (
                "materials.\"dark red\"=Metal(albedo: (1, 1, 1), fuzz: 0)",
                "Lambertian(albedo: (0.1, 0, 0))",
                "Metal(albedo: (1, 1, 1), fuzz: 0)",
            ),
            (
                "objects[0].material=dark red",
                "radius: 1, material: \"red\"), // first",
                "radius: 1, material: \"dark red\"), // first",
            ),
            (
                "objects.0.radius=2",
                "radius: 1, material: \"red\"), // first",
                "radius: 2, material: \"red\"), // first",
            ),
            ("objects.ball.center=3,0,0", "(2, 0, 0)", "(3,0,0)"),
            ("image.samples=9", "image: (", "image: (samples: 9,"),
            ("sky=Black", "Scene(", "Scene(sky: Black,"),
            (
                "materials.new=Lambertian(albedo: (1, 1, 1))",
                "materials: {",
                "materials: {\"new\": Lambertian(albedo: (1, 1, 1)),",
            ),
        ] {
            assert_eq!(edited(edit).unwrap(), SCENE.replacen(old, new, 1), "{edit}");
        }
    }

    /// Several changes follow each other; the last of a field counts.
    #[test]
    fn changes_follow_each_other() {
        let edits =
            ["sky=Uniform(radiance: (1, 1, 1))", "sky.radiance=2,2,2", "image.width=1", "image.width=3"];
        let edits: Vec<FieldEdit> = edits.iter().map(|edit| edit.parse().unwrap()).collect();
        let text = apply(SCENE, "a", &edits).unwrap();
        assert!(text.contains("sky: Uniform(radiance: (2,2,2))") && text.contains("width: 3"), "{text}");
        assert_eq!(apply(SCENE, "a", &[]).unwrap(), SCENE);
    }

    #[test]
    fn a_change_replaces_those_of_the_same_field_and_its_parts() {
        let edit = |text: &str| text.parse::<FieldEdit>().unwrap();
        for (later, earlier, replaces) in [
            ("sky=Black", "sky=Uniform(radiance: (1, 1, 1))", true),
            ("sky=Black", "sky.radiance=2,2,2", true),
            ("sky.radiance=2,2,2", "sky=Black", false),
            ("objects[0].radius=2", "objects.0.radius=1", true),
            ("objects.0.radius=2", "objects.1.radius=1", false),
            ("objects.0=Sphere()", "objects.0.radius=1", true),
        ] {
            assert_eq!(edit(later).replaces(&edit(earlier)), replaces, "{later} {earlier}");
        }
    }

    #[test]
    fn faults_are_named() {
        for (edit, words) in [
            ("", &["PATH=VALUE"][..]),
            ("image.width", &["PATH=VALUE"]),
            ("=1", &["PATH=VALUE"]),
            ("image..width=1", &["PATH=VALUE"]),
            ("image.width=", &["PATH=VALUE"]),
            ("image.widht=1", &["widht", "`set`"]),
            ("imag.width=1", &["the scene has no imag", "image"]),
            ("objects.7.radius=1", &["objects has no 7", "0 to 1"]),
            ("objects.bal.radius=1", &["objects has no bal", "0 to 1, named ball"]),
            ("image.width.x=1", &["image.width has no fields"]),
            ("image.width=-1", &["changed by `set`"]),
            ("image.width=1), sky: (", &["changed by `set`"]),
            ("objects.0.material=blue", &["blue"]),
        ] {
            let error = edited(edit).unwrap_err();
            assert!(words.iter().all(|word| error.contains(word)), "{edit}: {error}");
        }
        // A file that is no scene has its own error.
        let error = apply("Scene(", "a", &["sky=Black".parse().unwrap()]).unwrap_err().to_string();
        assert!(!error.contains("set"), "{error}");
    }
}
