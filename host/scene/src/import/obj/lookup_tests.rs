//! Tests of libraries and images that are missing or elsewhere.

use super::super::testing::{Memory, png};
use super::super::{Folder, Includes};
use super::{Description, SceneError, parse};
use crate::description::{Lambertian, Surface, Texels};
use std::fs;

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";

/// Returns an image whose first texel has this red.
fn image(red: u8) -> Vec<u8> {
    png(1, 1, &[[red, 0, 0, 255]])
}

/// Reads a model whose library `sub/a.mtl` has `map` as its only map, in its third line.
fn read_with(map: &str, images: &[&'static str]) -> Result<Description, SceneError> {
    let library = format!("newmtl a\nKd 1 1 1\nmap_Kd {map}\n");
    let mut files = Memory([("sub/a.mtl", library.into_bytes())].into());
    files.0.extend((1..).zip(images).map(|(red, path)| (*path, image(red))));
    parse(format!("mtllib sub/a.mtl\n{OBJ}").as_bytes(), "a.obj", &mut files)
}

/// Returns the red of a model's image, which tells which one it is, and the warnings.
fn shown(map: &str, images: &[&'static str]) -> (u8, Vec<String>) {
    let scene = read_with(map, images).unwrap();
    let Texels::Srgb8(texels) = &scene.images[0].texels else { panic!() };
    (texels[0][0], scene.warnings)
}

#[test]
fn images_are_found_by_their_names() {
    let windows = "C:\\Users\\me\\tex\\checker.png";
    for (map, images, expected) in [
        (windows, &["sub/checker.png"][..], "sub/checker.png"),
        (windows, &["checker.png"], "checker.png"),
        (windows, &["tex/checker.png"], "tex/checker.png"),
        (windows, &["me/checker.png"], "me/checker.png"),
        (windows, &["sub/me/TEX/Checker.PNG"], "sub/me/TEX/Checker.PNG"),
        ("tex/checker.png", &["checker.png"], "checker.png"),
        ("/home/me/tex/checker.png", &["tex/checker.png"], "tex/checker.png"),
        ("../checker.png", &["sub/checker.png"], "sub/checker.png"),
        ("Checker.png", &["sub/checker.PNG"], "sub/checker.PNG"),
    ] {
        let (red, warnings) = shown(map, images);
        let written = map.replace('\\', "/");
        let expected = format!(
            "sub/a.mtl: line 3, map_Kd: \"{written}\" is missing; \"{expected}\" is used in its place"
        );
        assert_eq!((red, warnings), (1, vec![expected]));
    }
    // Control: an image at its path is used without a warning, with quotes, too.
    for map in ["Tex Maps/checker.png", "\"Tex Maps/checker.png\"", "-s 2 2 \"Tex Maps\\checker.png\""] {
        assert_eq!(shown(map, &["sub/Tex Maps/checker.png", "checker.png"]), (1, vec![]), "{map}");
    }
}

/// Paths are ranked by case first, then by the number of folders.
#[test]
fn the_nearest_path_is_chosen() {
    let windows = "C:\\me\\tex\\a.png";
    let ranked = ["sub/me/tex/a.png", "me/tex/a.png", "sub/tex/a.png", "tex/a.png", "sub/a.png", "a.png"];
    for first in 0..ranked.len() {
        let mut images = ranked[first..].to_vec();
        images.push("sub/me/tex/A.png");
        assert_eq!(shown(windows, &images).0, 1, "{images:?}");
    }
    assert_eq!(shown(windows, &["me/A.png", "sub/a.PNG"]).0, 2);
}

#[test]
fn missing_images_have_a_line_and_a_suggestion() {
    let error = |map: &str| read_with(map, &["sub/checker.png"]).unwrap_err().to_string();
    assert_eq!(
        error("cheker.png"),
        "sub/a.mtl: line 3, map_Kd: cannot read \"cheker.png\": no such file; did you mean \"checker.png\"?"
    );
    assert!(error("D:\\tex\\checkers.png").ends_with("did you mean \"checker.png\"?"));
    // Control: nothing is suggested for another name.
    assert_eq!(
        error("wood.png"),
        "sub/a.mtl: line 3, map_Kd: cannot read \"wood.png\": no such file; it must be at this path, relative to the folder of sub/a.mtl"
    );
    let error = read_with("\"\"", &[]).unwrap_err().to_string();
    assert!(error.contains("sub/a.mtl:3:1: map_Kd names no file"), "{error}");
}

#[test]
fn missing_libraries_are_warnings() {
    let read = |names: &str| {
        let mut files = Memory([("b.mtl", b"newmtl a\nKd 1 0 0\n".to_vec())].into());
        let scene = parse(format!("mtllib {names}\n{OBJ}").as_bytes(), "a.obj", &mut files).unwrap();
        (scene.materials[0].surface.clone(), scene.warnings)
    };
    let grey = Surface::from(Lambertian::rgb(0.8, 0.8, 0.8));
    let text = |name: &str| {
        format!(
            "line 1, mtllib: the material library \"{name}\" is missing (no such file): its materials are diffuse grey, as of a model without materials"
        )
    };
    let unknown = "materials that no library (mtllib) has, diffuse grey: 1, the first in usemtl a";
    for name in ["none.mtl", "my none.mtl"] {
        assert_eq!(read(name), (grey.clone(), vec![text(name), unknown.to_owned()]));
    }
    let red = Surface::from(Lambertian::rgb(1.0, 0.0, 0.0));
    assert_eq!(read("none.mtl b.mtl"), (red.clone(), vec![text("none.mtl")]));
    // Controls: a library that is there, with quotes, too.
    for name in ["b.mtl", "\"b.mtl\""] {
        assert_eq!(read(name), (red.clone(), vec![]));
    }
}

/// Files outside the scene's folder are read only if that is allowed.
#[test]
fn files_outside_are_refused() {
    let root = tempfile::tempdir().unwrap();
    let at = |name: &str| root.path().join(name);
    fs::create_dir_all(at("model/tex")).unwrap();
    fs::write(at("out.png"), image(9)).unwrap();
    fs::write(at("out.mtl"), "newmtl a\n").unwrap();
    let absolute = at("out.png").display().to_string();
    let read = |includes: Includes, library: &str, map: &str| {
        fs::write(at("model/a.mtl"), format!("newmtl a\nmap_Kd {map}\n")).unwrap();
        let mut folder = Folder::new(at("model")).including(includes);
        let scene = parse(format!("mtllib {library}\n{OBJ}").as_bytes(), "a.obj", &mut folder)?;
        let inside: Vec<bool> = folder
            .into_read()
            .iter()
            .map(|path| path.canonicalize().unwrap().starts_with(at("model").canonicalize().unwrap()))
            .collect();
        Ok::<_, SceneError>((scene.warnings.len(), inside))
    };
    for (library, map) in [("../out.mtl", "x"), ("a.mtl", "../out.png"), ("a.mtl", &absolute)] {
        let error = read(Includes::Below, library, map).unwrap_err();
        assert!(matches!(error, SceneError::Outside { .. }), "{error}");
        // Control: all of them are read if that is allowed.
        assert!(read(Includes::Anywhere, library, map).unwrap().1.contains(&false));
    }
    // A copy inside stands in for an absolute path, and for no other.
    fs::write(at("model/out.png"), image(1)).unwrap();
    assert_eq!(read(Includes::Below, "a.mtl", &absolute).unwrap(), (1, vec![true, true]));
    let error = read(Includes::Below, "a.mtl", "../out.png").unwrap_err();
    assert!(matches!(error, SceneError::Outside { .. }), "{error}");
    fs::remove_file(at("model/out.png")).unwrap();
    let error = read(Includes::Below, "a.mtl", "x/out.pgn").unwrap_err().to_string();
    assert!(error.contains("there is no folder"), "{error}");
}
