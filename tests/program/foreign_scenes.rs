//! Scenes of pbrt and Mitsuba on the command line: their settings, warnings by name, errors with
//! their place, and the folder that their files must be in.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::path::PathBuf;
use trisect::image::Image;
use trisect_tests::program::{self, check_failure, trisect};

/// Temporary folder of a test, which is removed on drop.
struct Files(PathBuf);

impl Files {
    fn new(test: &str) -> Self {
        Self(program::folder("foreign-scenes", test))
    }

    fn write(&self, name: &str, text: &str) -> String {
        let path = self.0.join(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).to_str().unwrap().to_owned()
    }
}

impl Drop for Files {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A lamp before a wall that is twice as wide as high.
const PBRT: &str = r#"Film "rgb" "integer xresolution" 16 "integer yresolution" 8
Sampler "independent" "integer pixelsamples" 2
Camera "perspective" "float fov" 90
WorldBegin
AttributeBegin
    Translate 2 0 4
    AreaLightSource "diffuse" "rgb L" [1 2 3]
    Shape "sphere" "float radius" 2
AttributeEnd
Translate 0 0 10 Shape "disk" "float radius" 30
"#;

/// That scene in the format of Mitsuba.
const MITSUBA: &str = r#"<scene version="3.0.0">
<sensor type="perspective"><float name="fov" value="90"/><string name="fov_axis" value="y"/>
<transform name="to_world"><lookat origin="0,0,0" target="0,0,1" up="0,1,0"/></transform>
<sampler type="independent"><integer name="sample_count" value="2"/></sampler>
<film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="8"/></film></sensor>
<shape type="sphere"><point name="center" value="-2,0,4"/><float name="radius" value="2"/>
<emitter type="area"><rgb name="radiance" value="1,2,3"/></emitter></shape>
<shape type="disk"><transform name="to_world"><scale value="30"/><translate z="10"/></transform></shape>
</scene>
"#;

fn render<'a>(scene: &'a str, image: &'a str) -> Vec<&'a str> {
    vec!["render", scene, "--backend", "cpu", "-o", image]
}

/// The file states camera, size and samples; nothing is added, and the lamp is at the right.
#[test]
fn scenes_of_other_renderers_are_rendered_as_they_are() {
    let files = Files::new("render");
    for (name, text) in [("a.pbrt", PBRT), ("a.xml", MITSUBA)] {
        let (scene, image) = (files.write(name, text), files.path("a.pfm"));
        let arguments = render(&scene, &image);
        let output = trisect(&arguments);
        check_failure(&output, &arguments, 0, &[]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!said.contains("studio") && !said.contains("ground"), "{said}");
        let picture = Image::read(image.as_ref()).unwrap();
        assert_eq!((picture.width, picture.height), (16, 8), "{name}");
        // At (10, 4) the lamp itself is seen.
        assert_eq!(picture.pixels[4 * 16 + 10], [1.0, 2.0, 3.0], "{name}");
        assert!(picture.pixels[4 * 16 + 2][0] < 0.5, "{name}");
        let more = [&arguments[..], &["--resolution", "4x2", "--spp", "1"]].concat();
        check_failure(&trisect(&more), &more, 0, &[]);
        assert_eq!(Image::read(image.as_ref()).unwrap().width, 4);
        let check = ["check", &scene];
        check_failure(&trisect(&check), &check, 0, &[]);
    }
}

#[test]
fn what_is_not_modelled_is_a_warning_by_name() {
    let files = Files::new("warn");
    let hair =
        files.write("a.pbrt", &(PBRT.to_owned() + "Material \"hair\" Shape \"sphere\" Shape \"curve\""));
    let image = files.path("a.png");
    let arguments = render(&hair, &image);
    let words = ["Material \"hair\"", "Shape \"curve\"", "line 11", "left out"];
    check_failure(&trisect(&arguments), &arguments, 0, &words);
    let shape = "<shape type=\"bsplinecurve\"/></scene>";
    let curve = files.write("a.xml", &MITSUBA.replace("</scene>", shape));
    let arguments = render(&curve, &image);
    check_failure(&trisect(&arguments), &arguments, 0, &["bsplinecurve", "line 9", "left out"]);
}

#[test]
fn errors_name_file_line_and_column() {
    let files = Files::new("errors");
    let image = files.path("a.png");
    let cases = [
        (
            "a.pbrt",
            PBRT.replace("\"disk\"", "\"disk\" \"float height\" tall"),
            "a.pbrt:10:46",
            "a finite number",
        ),
        ("b.pbrt", PBRT.replace("WorldBegin", "WorldStart"), "b.pbrt:4:1", "unknown directive"),
        ("a.xml", MITSUBA.replace("value=\"90\"", "value=\"wide\""), "a.xml:2:28", "not a finite number"),
        ("b.xml", MITSUBA.replace("</sensor>", ""), "b.xml:", "not XML"),
    ];
    for (name, text, place, words) in cases {
        let scene = files.write(name, &text);
        let arguments = render(&scene, &image);
        check_failure(&trisect(&arguments), &arguments, 4, &[place, words]);
        let check = ["check", &scene];
        check_failure(&trisect(&check), &check, 4, &[place, words]);
    }
}

/// Files outside the scene's folder need `--allow-outside`.
#[test]
fn files_must_be_in_the_folder_of_the_scene() {
    let files = Files::new("outside");
    std::fs::create_dir_all(files.0.join("scene")).unwrap();
    files.write("lamp.pbrt", "LightSource \"point\"");
    files.write("lamp.xml", "<scene version=\"3.0.0\"><emitter type=\"point\"/></scene>");
    let image = files.path("a.png");
    let including = MITSUBA.replace("</scene>", "<include filename=\"../lamp.xml\"/></scene>");
    for (name, text) in
        [("scene/a.pbrt", PBRT.to_owned() + "Include \"../lamp.pbrt\""), ("scene/a.xml", including)]
    {
        let scene = files.write(name, &text);
        let arguments = render(&scene, &image);
        check_failure(&trisect(&arguments), &arguments, 4, &["../lamp", "--allow-outside"]);
        let allowed = [&arguments[..], &["--allow-outside"]].concat();
        check_failure(&trisect(&allowed), &allowed, 0, &[]);
    }
}

/// A scene is no model of another scene, does not move, and has no copy in another format.
#[test]
fn what_scenes_of_other_renderers_are_not() {
    let files = Files::new("not");
    let scene = files.write("a.pbrt", PBRT);
    let (image, copy) = (files.path("a.png"), files.path("copy.ron"));
    let outer = files.write(
        "outer.ron",
        "Scene(version: 1, image: (width: 8, height: 4), materials: {}, objects: [Mesh(file: \"a.pbrt\")], \
         camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40))",
    );
    let arguments = render(&outer, &image);
    check_failure(&trisect(&arguments), &arguments, 4, &["\"a.pbrt\" is not a model"]);
    let check = ["check", &scene, "--write", &copy];
    let output = trisect(&check);
    assert!(!output.status.success() && !PathBuf::from(&copy).exists());
    assert!(String::from_utf8_lossy(&output.stderr).contains("cannot be written"));
}
