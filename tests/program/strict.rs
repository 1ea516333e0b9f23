//! Warnings that scripts deny, and options with other effects than they seem to have.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use serde_json::Value;
use std::fs;
use trisect_tests::program::{Temporary, check_failure, trisect};

const SCENE: &str = "Scene(version: 1, image: (width: 32, height: 16, samples: 4, depth: 3), \
    camera: (look_from: (0, 0, 5), look_at: (0, 0, 0), vertical_fov: 30), \
    sky: Uniform(radiance: (1, 1, 1)), materials: { \"a\": Lambertian(albedo: (0.5, 0.5, 0.5)) }, \
    objects: [Sphere(center: (0, 0, 0), radius: 1, material: \"a\")])";

/// Each kind of warning about a scene is printed before rendering, with its remedy, and is an error
/// if the user denies it.
#[test]
fn warnings_are_errors_if_denied() {
    let folder = Temporary::new("strict", "deny");
    let (scene, image) = (folder.file("a.ron"), folder.file("a.png"));
    let render = |text: &str, options: &[&str]| {
        fs::write(&scene, text).unwrap();
        trisect(&[&["render", &scene, "-o", &image, "--backend", "cpu", "-q"], options].concat())
    };
    let dark = SCENE.replace("sky: Uniform(radiance: (1, 1, 1))", "sky: Black");
    let away = SCENE.replace("look_at: (0, 0, 0)", "look_at: (0, 0, 9)");
    let plane = SCENE
        .replace("materials: {", "textures: { \"t\": (file: \"t.png\") }, materials: {")
        .replace("0.5))", "0.5), texture: \"t\")")
        .replace("Sphere(center: (0, 0, 0), radius: 1", "Plane(point: (0, 0, 0), normal: (0, 0, 1)");
    let png = trisect::output::encode_bytes(2, 2, &[200; 12]).unwrap();
    fs::write(folder.path("t.png"), png).unwrap();
    let far = SCENE.replace("(0, 0, 0)", "(4e6, 0, 0)").replace("(0, 0, 5)", "(4e6, 0, 5)");
    for (text, wanted) in [
        (&dark, "no light: nothing in the scene emits"),
        (&away, "nothing in view: the camera at (0, 0, 5) looks at (0, 0, 9)"),
        (&plane, "a plane has no end, so its texture is one colour; use a Quad"),
        (&far, "for remedies: trisect check"),
    ] {
        let warned = render(text, &[]);
        let told = String::from_utf8_lossy(&warned.stderr).into_owned();
        assert!(warned.status.success() && told.contains("warning: "), "{wanted}: {told}");
        assert_eq!(told.matches(wanted).count(), 1, "{wanted}: {told}");
        fs::remove_file(&image).unwrap();
        let arguments = ["--deny-warnings"];
        let denied = render(text, &arguments);
        check_failure(
            &denied,
            &arguments,
            4,
            &[wanted, "--deny-warnings: the warnings above (1) are errors"],
        );
        assert!(!folder.path("a.png").exists());
    }
    // Negative control: a scene without warnings, and an option without effect.
    assert!(render(SCENE, &["--deny-warnings"]).status.success());
    let arguments = ["--deny-warnings", "--max-spp", "8"];
    check_failure(&render(SCENE, &arguments), &arguments, 4, &["--max-spp has no effect"]);
    fs::write(&scene, &away).unwrap();
    let check = ["check", &scene, "--deny-warnings"];
    let output = trisect(&check);
    assert_eq!(output.status.code(), Some(4), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(trisect(&["check", &scene]).status.success());
}

/// A segment from which roulette ends paths turns roulette on, unless it is turned off, which is
/// warned about.
#[test]
fn a_depth_of_roulette_implies_roulette() {
    let folder = Temporary::new("strict", "roulette");
    let (scene, image, stats) = (folder.file("a.ron"), folder.file("a.png"), folder.file("a.json"));
    fs::write(&scene, SCENE).unwrap();
    for (options, roulette, warned) in [
        (&["--roulette-depth", "3"][..], true, false),
        (&["--roulette-depth", "3", "--roulette", "off"], false, true),
        (&["--roulette-depth", "3", "--roulette", "on"], true, false),
        (&[], false, false),
    ] {
        let common = ["render", &scene, "-o", &image, "--stats", &stats, "--backend", "cpu", "-q"];
        let output = trisect(&[&common[..], options].concat());
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{told}");
        assert_eq!(told.contains("--roulette-depth has no effect with --roulette off"), warned, "{told}");
        let json: Value = serde_json::from_slice(&fs::read(&stats).unwrap()).unwrap();
        assert_eq!(json["settings"]["roulette"], roulette, "{options:?}");
    }
}

/// Old spellings work, with a note.
#[test]
fn old_spellings_work() {
    let folder = Temporary::new("strict", "old");
    let (scene, image) = (folder.file("a.ron"), folder.file("a.png"));
    fs::write(&scene, SCENE).unwrap();
    let (old, new) = (folder.file("old.ckpt"), folder.file("new.ckpt"));
    let run = |option: &str, checkpoint: &str| {
        let range = ["--spp", "300", option, "0..256", "--checkpoint", checkpoint];
        let output =
            trisect(&[&["render", &scene, "-o", &image, "--backend", "cpu", "-q"], &range[..]].concat());
        (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (passed, told) = run("--samples", &old);
    assert!(passed && told.contains("note: --samples is now --sample-range"), "{told}");
    let (passed, told) = run("--sample-range", &new);
    assert!(passed && !told.contains("note:"), "{told}");
    let arguments = ["render", &scene, "--samples", "64", "--checkpoint", "a.ckpt"];
    check_failure(&trisect(&arguments), &arguments, 2, &["for a number of samples use --spp"]);
}

/// `--json` prints, and `--json=FILE` writes the same beside the text.
#[test]
fn results_go_to_files_and_to_standard_output() {
    let folder = Temporary::new("strict", "json");
    let (scene, image) = (folder.file("a.ron"), folder.file("a.pfm"));
    fs::write(&scene, SCENE).unwrap();
    let stats = format!("--json={}", folder.file("stats.json"));
    assert!(trisect(&["render", &scene, "-o", &image, "--backend", "cpu", "-q", &stats]).status.success());
    assert!(folder.path("stats.json").exists());
    for arguments in [&["compare", &image, &image][..], &["check", &scene], &["info"], &["doctor"]] {
        let file = folder.file("result.json");
        let text = trisect(arguments).stdout;
        let printed = trisect(&[arguments, &["--json"]].concat()).stdout;
        let both = trisect(&[arguments, &[&format!("--json={file}")]].concat()).stdout;
        let parse = |bytes: &[u8]| serde_json::from_slice::<Value>(bytes).unwrap();
        // Free memory differs from call to call.
        if arguments[0] != "doctor" {
            assert_eq!(text, both, "{arguments:?}");
            assert_eq!(parse(&printed), parse(&fs::read(&file).unwrap()), "{arguments:?}");
        }
        assert!(serde_json::from_slice::<Value>(&text).is_err(), "{arguments:?}: text is no JSON");
        parse(&printed);
        parse(&trisect(&[arguments, &["--json=-"]].concat()).stdout);
    }
    // The next word is the scene, not the file of --json.
    let output = trisect(&["render", "--json", &scene, "-o", &image, "--backend", "cpu", "-q"]);
    assert_eq!(serde_json::from_slice::<Value>(&output.stdout).unwrap()["scene"], *scene);
    assert_eq!(fs::read_to_string(&scene).unwrap(), SCENE);
    let over = format!("--json={scene}");
    let measure = ["tradeoff", &scene, &over, "-o", &folder.file("report")];
    check_failure(&trisect(&measure), &measure, 2, &["--json would overwrite the scene"]);
    let arguments = ["check", &scene, &over];
    check_failure(&trisect(&arguments), &arguments, 2, &["--json would overwrite the scene"]);
}
