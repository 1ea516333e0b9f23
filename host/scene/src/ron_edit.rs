//! Inserts or replaces the field `space` or `camera` in the text of a scene file, and leaves the
//! rest as it is. `precision::write` uses it for `trisect check --write` and for the viewer.

use super::error::SceneError;
use super::ron_text::container;
use super::{CameraPose, camera_value, format};
use ron::value::RawValue;
use serde::Deserialize;

/// Returns the text with `value` as its field `space`, in place of the present one or as the first
/// field, and whether the scene names other files.
///
/// # Errors
///
/// Those of a text that is not a scene; [`SceneError::Inconsistent`] if the field cannot be
/// inserted.
pub(crate) fn insert_space(text: &str, file: &str, value: &str) -> Result<(String, bool), SceneError> {
    let scene = format::parse(text, file)?;
    let written = insert_field(text, scene.space.place, "space", value);
    // Whatever the text was, the result must read back as intended.
    let parsed = written.as_deref().map(|written| format::parse(written, file));
    match (&written, parsed) {
        (Some(written), Some(Ok(parsed))) if parsed.space.place.map(str::trim) == Some(value) => {
            Ok((written.clone(), scene.names_files()))
        }
        _ => Err(no_place(file, "space", value)),
    }
}

/// Returns the text with `camera` as its field `camera`, in place of the present one or as the
/// first field, and whether the scene names other files.
///
/// # Errors
///
/// Those of [`insert_space`].
pub(crate) fn insert_camera(
    text: &str,
    file: &str,
    camera: &CameraPose,
) -> Result<(String, bool), SceneError> {
    #[derive(Deserialize)]
    #[serde(rename = "Scene")]
    struct Places<'a> {
        #[serde(borrow, default, deserialize_with = "crate::values::some")]
        camera: Option<&'a RawValue>,
    }
    let scene = format::parse(text, file)?;
    let value = camera_value(camera);
    let places: Places = ron::from_str(text).map_err(|_| no_place(file, "camera", &value))?;
    let written = insert_field(text, places.camera.map(RawValue::get_ron), "camera", &value);
    let parsed = written.as_deref().map(|written| format::parse(written, file));
    match (&written, parsed) {
        (Some(written), Some(Ok(parsed)))
            if parsed.camera.as_ref().is_some_and(|is| is.pose().is_near(camera)) =>
        {
            Ok((written.clone(), scene.names_files()))
        }
        _ => Err(no_place(file, "camera", &value)),
    }
}

fn no_place(file: &str, name: &str, value: &str) -> SceneError {
    SceneError::Inconsistent {
        file: file.to_owned(),
        message: format!("cannot insert the field {name}; add it by hand: {name}: {value},"),
    }
}

/// Returns the text with `value` in place of `place`, a part of the text, or as its first field.
fn insert_field(text: &str, place: Option<&str>, name: &str, value: &str) -> Option<String> {
    let (start, end, inserted) = match place {
        Some(place) => {
            let start = place.as_ptr().addr().wrapping_sub(text.as_ptr().addr());
            // The value's text may have blanks around it.
            let (before, after) = (place.len() - place.trim_start().len(), place.trim().len());
            (start + before, start + before + after, value.to_owned())
        }
        None => {
            let start = container(text, 0)?.opening;
            (start, start, format!("\n    {name}: {value},"))
        }
    };
    Some(format!("{}{inserted}{}", text.get(..start)?, text.get(end..)?))
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

    #[test]
    fn a_camera_is_replaced_or_added() {
        use glam::DVec3;
        let camera = CameraPose {
            look_from: DVec3::new(0.1, 2.0, -3.5),
            look_at: DVec3::new(1.0, 1e-3, 7.0),
            vertical_fov: 33.3f64.to_radians(),
            defocus_angle: 0.6f64.to_radians(),
            focus_distance: 10.0,
            ..CameraPose::PINHOLE
        };
        let text = format!("Scene({REST}");
        let (written, files) = insert_camera(&text, "scene.ron", &camera).unwrap();
        let start = "// (eight by four)\ncamera: (\n        look_from: (0.1, 2.0, -3.5), look_at";
        assert!(!files && written.contains(start), "{written}");
        assert!(written.ends_with("), materials: {}, objects: [])"), "{written}");
        let again = insert_camera(&written, "scene.ron", &camera).unwrap().0;
        assert_eq!(again, written);
        let none = "Scene(version: 1, image: (width: 8, height: 4), materials: {}, objects: [])";
        let (written, _) = insert_camera(none, "scene.ron", &camera).unwrap();
        assert!(written.starts_with("Scene(\n    camera: (") && written.ends_with("objects: [])"));
        assert!(insert_camera("Scene(", "scene.ron", &camera).is_err());
    }
}
