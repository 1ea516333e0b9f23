//! The page in headless Chromium: every scene through WebGPU on a software adapter, the CPU in the
//! page, and what a user may do wrong.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

mod browser;
mod page;
mod threads;

use browser::Browser;
use page::{Page, SOFTWARE_ADAPTER, Server, served};
use serde_json::json;
use std::path::{Path, PathBuf};
use trisect::film::Film;
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_tests::renders::{apart, cpu, differing, film, independent, scene_files};
use trisect_tests::statistics::{Blocks, GLOBAL_LIMIT};

/// Returns the settings of the comparisons.
fn small(scene: &Scene) -> Settings {
    Settings { width: 64, height: 36, samples: 4, seed: 5, ..independent(scene) }
}

/// Returns whether a backend that rounds differently shows the CPU's image: the bounds are those of
/// `images every_scene`.
fn is_the_same(got: &Film, want: &Film) -> bool {
    apart(got, want) * 100 <= 3 * want.pixels.len()
        && Blocks::new(got).compare(&Blocks::new(want), 1e-5).whole < GLOBAL_LIMIT
}

/// Returns the film and the primitives of first hits that the CPU renders.
fn wanted(scene: &Scene) -> (Film, Vec<u32>) {
    let mut renderer = cpu(scene);
    let hits = renderer.first_hits(&small(scene), 0).unwrap();
    (film(&mut renderer, &small(scene)), hits.iter().map(|hit| hit.primitive).collect())
}

fn elsewhere(a: &[u32], b: &[u32]) -> usize {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).filter(|(a, b)| a != b).count()
}

#[test]
fn every_scene_is_the_cpus_through_webgpu() {
    let Some(found) = served() else { return };
    let mut page = Page::open(found, &SOFTWARE_ADAPTER, "wgpu");
    let mut seen = 0;
    for path in scene_files() {
        let name = path.file_name().unwrap().display();
        let scene = Scene::load(&path).unwrap();
        let (want, want_hits) = wanted(&scene);
        page.load(&path);
        let (got, _) = page.film(&small(&scene));
        let off = elsewhere(&page.first_hits(&small(&scene)), &want_hits);
        eprintln!(
            "{name}: {off} first hits and {} of {} pixels differ",
            apart(&got, &want),
            want.pixels.len()
        );
        assert_eq!(off, 0, "{name}: first hits");
        assert!(is_the_same(&got, &want), "{name}");
        seen += 1;
    }
    assert!(seen >= 12);
    // Negative control: a sphere that was moved.
    let original = trisect_tests::root().join("scenes/three_spheres.ron");
    let text = std::fs::read_to_string(&original).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let moved = folder.path().join("moved.ron");
    std::fs::write(&moved, text.replace("center: (0, 0.5, -0.5)", "center: (0.2, 0.5, -0.5)")).unwrap();
    assert_ne!(std::fs::read_to_string(&moved).unwrap(), text);
    let scene = Scene::load(&original).unwrap();
    let (want, want_hits) = wanted(&scene);
    page.load(&moved);
    let (got, _) = page.film(&small(&scene));
    assert!(elsewhere(&page.first_hits(&small(&scene)), &want_hits) > 0, "negative control not detected");
    assert!(!is_the_same(&got, &want), "negative control not detected");
}

/// The CPU in the page has the bits of the CPU elsewhere, and so has the file that it saves.
#[test]
fn the_cpu_of_a_page_has_the_same_bits() {
    let Some(found) = served() else { return };
    let mut page = Page::open(found, &[], "cpu");
    for name in ["three_spheres.ron", "rtiow_final.ron", "cornell_box.ron", "gltf/features.glb"] {
        let path = trisect_tests::root().join("scenes").join(name);
        let scene = Scene::load(&path).unwrap();
        let (want, want_hits) = wanted(&scene);
        page.load(&path);
        let (got, facts) = page.film(&small(&scene));
        assert_eq!(differing(&got, &want), 0, "{name}");
        assert_eq!(page.first_hits(&small(&scene)), want_hits, "{name}");
        let (_, pfm) = page.ask(&json!({ "do": "save", "name": "image.pfm" }));
        let decoded = trisect::image::Image::decode(&pfm, Path::new("image.pfm")).unwrap();
        assert_eq!(decoded.pixels, want.image().pixels, "{name}");
        assert_eq!(facts["fingerprint"].as_str().unwrap().len(), 64, "{name}");
        for (file, magic) in [("image.png", &b"\x89PNG"[..]), ("image.exr", &b"\x76\x2f\x31\x01"[..])] {
            let (_, bytes) = page.ask(&json!({ "do": "save", "name": file }));
            assert!(bytes.starts_with(magic), "{file}");
        }
    }
}

/// Text of the element with this name.
fn text(page: &mut Page, name: &str) -> String {
    page.browser.text(&format!("document.getElementById('{name}').textContent"))
}

fn pick(page: &mut Page, files: &[PathBuf]) {
    page.browser.pick("#files", files);
}

/// A user picks files; what is wrong with them is said in the page.
#[test]
fn files_are_picked_and_refused_in_words() {
    let Some(found) = served() else { return };
    let mut page = Page::open(found, &[], "cpu");
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, content: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        path
    };
    let is_shown = "!document.getElementById('error').hidden";
    // The browser reads no path with "..".
    let scenes = trisect_tests::root().join("scenes").canonicalize().unwrap();
    let model = scenes.join("gltf/features.glb");
    let cut = &std::fs::read(&model).unwrap()[..5000];
    let cases = [
        (vec![scenes.join("textures/sky.hdr")], "A panorama needs a scene"),
        (vec![file("cut.glb", cut)], "cut.glb"),
        (vec![file("notes.txt", b"none")], "No scene among these files"),
        (vec![file("bad.ron", b"Scene(version: 1, objects: [Sphre()])")], "bad.ron"),
        (vec![file("lone.gltf", &std::fs::read(scenes.join("gltf/features.gltf")).unwrap())], "features"),
    ];
    for (files, words) in cases {
        pick(&mut page, &files);
        page.browser.wait_for(is_shown);
        let said = text(&mut page, "error");
        assert!(said.contains(words), "{words}: {said}");
        page.browser.value("document.getElementById('error').hidden = true");
    }
    // More than a page reads: no byte of it is read.
    let large = folder.path().join("large.glb");
    std::fs::File::create(&large).unwrap().set_len(3 << 30).unwrap();
    pick(&mut page, &[large]);
    page.browser.wait_for(is_shown);
    assert!(text(&mut page, "error").contains("The files have 3072 MiB; a page can read at most 512 MiB"));
    // A model is shown, then in front of a panorama.
    pick(&mut page, std::slice::from_ref(&model));
    page.browser.wait_for("/Live/.test(document.getElementById('live').textContent)");
    pick(&mut page, &[scenes.join("textures/sky.hdr")]);
    page.browser.wait_for("/Live/.test(document.getElementById('live').textContent)");
    assert_eq!(page.browser.value("document.getElementById('error').hidden"), json!(true));
    // What is refused leaves the scene before, and its frames.
    pick(&mut page, &[file("cut_again.glb", cut)]);
    page.browser.wait_for(is_shown);
    let live = "document.getElementById('live')";
    page.browser.wait_for(&format!("/Live/.test({live}.textContent)"));
    page.browser.value(&format!("{live}.textContent = ''"));
    page.browser.value("document.getElementById('canvas').focus()");
    press(&mut page.browser, "ArrowLeft", 37);
    page.browser.wait_for(&format!("/Live/.test({live}.textContent)"));
    // Another scene in the middle of a render ends it without a complaint.
    page.browser.value("document.getElementById('render').click()");
    page.browser.wait_for("!document.getElementById('progress').hidden");
    page.browser.value(
        "(() => { const scene = document.getElementById('scene'); scene.selectedIndex = 1; scene.dispatchEvent(new Event('change')); })()",
    );
    page.browser.wait_for("/cornell_box/.test(document.getElementById('status').textContent)");
    page.browser.wait_for(&format!("/Live/.test({live}.textContent)"));
    assert_eq!(page.browser.value("document.getElementById('error').hidden"), json!(true));
}

/// Without an adapter the CPU renders, and the page says so; a device that is lost is said, too.
#[test]
fn without_a_gpu_the_cpu_renders() {
    let Some(found) = served() else { return };
    let mut page = Page::open(found, &["--disable-features=WebGPU,WebGPUService"], "auto");
    let said = text(&mut page, "device");
    assert!(said.starts_with("CPU") && said.contains("not on a GPU: "), "{said}");
    let Some(found) = served() else { return };
    let mut page = Page::open(found, &SOFTWARE_ADAPTER, "wgpu");
    assert!(text(&mut page, "device").starts_with("WebGPU"));
    let scene = trisect_tests::root().join("scenes/three_spheres.ron");
    page.load(&scene);
    page.browser.call("Browser.crashGpuProcess", json!({}));
    let begin = json!({ "do": "begin", "image": { "width": 8, "height": 8, "samples": 1, "depth": 2, "denoise": null } });
    let said = page.browser.text(&format!(
        "(async () => {{ try {{ await trisect.renderer.call({begin}); await trisect.renderer.call({{ do: 'part' }}); return 'rendered'; }} catch (error) {{ return error.message; }} }})()"
    ));
    assert!(said.contains("wgpu"), "{said}");
    page.browser.value("trisect.open('cpu').then(() => true)");
    page.load(&scene);
    page.film(&Settings { width: 8, height: 8, samples: 1, ..Settings::of(&Scene::load(&scene).unwrap()) });
}

/// The page takes at most 5 MB, compressed, and works when its server is gone. Each control is
/// reached by the keyboard, which also moves the camera.
#[test]
fn the_page_is_small_and_works_offline_and_by_keyboard() {
    let Some((_, file)) = served() else { return };
    let server = Server::start("offline").unwrap();
    let gzipped = server.built.split(", ").find_map(|part| part.strip_suffix(" MB gzipped")).unwrap();
    assert!(gzipped.parse::<f64>().unwrap() <= 5.0, "{}", server.built);
    let url = format!("{}?backend=cpu&scene=Cornell%20box", server.url);
    let mut browser = Browser::start(file, &[]);
    browser.open(&url);
    browser.value("trisect.ready.then(() => navigator.serviceWorker.ready).then(() => true)");
    // The service worker has all files once it controls the page.
    browser.wait_for("navigator.serviceWorker.controller !== null");
    drop(server);
    browser.open("about:blank");
    browser.open(&url);
    browser.value("trisect.ready.then(() => true)");
    browser.wait_for("/Live: /.test(document.getElementById('live').textContent)");
    assert_eq!(browser.text("fetch('none').then(() => 'served', () => 'gone')"), "gone");
    let mut seen = Vec::new();
    for _ in 0..14 {
        press(&mut browser, "Tab", 9);
        seen.push(browser.text("document.activeElement.id"));
    }
    for id in
        ["canvas", "scene", "files", "width", "samples", "denoise", "stops", "reset", "render", "backend"]
    {
        assert!(seen.iter().any(|name| name == id), "{id} is not reached: {seen:?}");
    }
    let samples = "Number(/Live: (\\d+)/.exec(document.getElementById('live').textContent)?.[1] ?? 0)";
    browser.wait_for(&format!("{samples} > 2"));
    browser.value("document.getElementById('canvas').focus()");
    press(&mut browser, "ArrowLeft", 37);
    browser.wait_for(&format!("{samples} === 1"));
}

fn press(browser: &mut Browser, key: &str, code: u32) {
    for kind in ["keyDown", "keyUp"] {
        browser.call(
            "Input.dispatchKeyEvent",
            json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code }),
        );
    }
}
