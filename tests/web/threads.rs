//! Threads of the CPU in a page: helpers with a module each, whose rows have the same bits.

use super::page::{Page, Server, served};
use super::{small, text, wanted};
use serde_json::json;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_tests::renders::{cpu, differing, film};

/// Number of threads, regardless of the machine's processors.
const THREADS: u32 = 4;

fn scene(name: &str) -> (std::path::PathBuf, Scene) {
    let path = trisect_tests::root().join("scenes").join(name);
    let scene = Scene::load(&path).unwrap();
    (path, scene)
}

/// Samples that take so long that helpers take rows.
fn long(scene: &Scene) -> Settings {
    Settings { samples: 64, ..small(scene) }
}

/// Each helper has the arrays of the scene that was loaded last, and of the film of this size.
#[test]
fn threads_render_the_same_bits() {
    let Some(found) = served() else { return };
    let mut page = Page::with_threads(found, &[], "cpu", THREADS);
    assert_eq!(text(&mut page, "device"), "CPU: 4 threads, wasm32");
    for name in [
        "three_spheres.ron",
        "cornell_smoke.ron",
        "cornell_box.ron",
        "gltf/features.glb",
        "three_spheres.ron",
    ] {
        let (path, scene) = scene(name);
        page.load(&path);
        let mut helped = 0;
        for settings in [
            long(&scene),
            Settings { width: 37, height: 51, guides: true, ..long(&scene) },
            Settings { width: 37, height: 51, ..long(&scene) },
            // Small and guided before large: what a launch wrote is no part of the next one.
            Settings { width: 16, height: 9, guides: true, ..long(&scene) },
            Settings { width: 97, height: 111, ..small(&scene) },
            Settings { height: 1, ..small(&scene) },
        ] {
            let want = film(&mut cpu(&scene), &settings);
            let (got, facts) = page.film(&settings);
            assert_eq!(differing(&got, &want), 0, "{name} {settings:?}");
            helped += facts["helped"].as_u64().unwrap();
        }
        eprintln!("{name}: helpers rendered {helped} rows");
        assert!(helped > 0, "{name}");
        assert_eq!(page.first_hits(&small(&scene)), wanted(&scene).1, "{name}");
    }
    // Fewer threads, and more: those before end.
    for (threads, shown) in [(1, "CPU: 1 thread, wasm32"), (3, "CPU: 3 threads, wasm32")] {
        page.browser.value(&format!("trisect.open('cpu', {threads}).then(() => true)"));
        assert_eq!(text(&mut page, "device"), shown);
        let (path, scene) = scene("three_spheres.ron");
        page.load(&path);
        let settings = Settings { samples: 256, ..small(&scene) };
        let (got, facts) = page.film(&settings);
        assert_eq!(differing(&got, &film(&mut cpu(&scene), &settings)), 0);
        assert_eq!(facts["helped"].as_u64().unwrap() > 0, threads > 1, "{facts}");
    }
}

/// A helper that fails leaves its rows to the worker that renders, and the page says so. Negative
/// control: a row that a helper does not render is missing in the film.
#[test]
fn failing_helpers_lose_no_row() {
    let Some((_, file)) = served() else { return };
    let (path, scene) = scene("three_spheres.ron");
    let settings = Settings { samples: 256, ..small(&scene) };
    let want = film(&mut cpu(&scene), &settings);
    let call = "trisect.render_row(row);";
    let throws = "if (row % 2) throw new Error(`row ${row}`); trisect.render_row(row);";
    for (name, from, to, differs, said) in [
        ("helper.js", call, throws, false, "another ended: row "),
        ("helpers.js", "2 ** 31", "2 ** 10", false, "another ended: all copies of a scene of 1 MiB"),
        ("helper.js", call, "if (row % 2) trisect.render_row(row);", true, ""),
    ] {
        let server = Server::start("edited").unwrap();
        server.edit(name, from, to);
        let mut page = Page::with_threads((&server, file.clone()), &[], "cpu", THREADS);
        page.load(&path);
        let (got, _) = page.film(&settings);
        assert_eq!(differing(&got, &want) > 0, differs, "{to}");
        if !differs {
            page.browser
                .wait_for(&format!("document.getElementById('device').textContent.includes('{said}')"));
            // What is left renders on.
            assert_eq!(differing(&page.film(&settings).0, &want), 0);
        }
    }
}

/// Server of static files that sends no headers for threads.
struct Plain {
    child: Child,
    url: String,
}

impl Plain {
    fn start(folder: &std::path::Path) -> Self {
        let mut command = Command::new("python3");
        command.args(["-u", "-m", "http.server", "--bind", "127.0.0.1", "--directory"]).arg(folder).arg("0");
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let line = lines.next().unwrap().unwrap();
        let port = line.split(" port ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
        Self { child, url: format!("http://127.0.0.1:{port}/") }
    }
}

impl Drop for Plain {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A host of static files cannot always send headers: the page says that it has one thread, and has
/// more once its service worker loads it.
#[test]
fn hosts_without_headers_have_threads_at_the_second_visit() {
    let Some((server, file)) = served() else { return };
    let plain = Plain::start(server.folder());
    let url = format!("{}?backend=cpu&scene=none&threads={THREADS}", plain.url);
    let mut browser = super::browser::Browser::start(file, &[]);
    let said = "document.getElementById('device').textContent";
    browser.open(&url);
    browser.value("trisect.ready.then(() => true)");
    let alone = "CPU: 1 thread, wasm32 – no more threads: the page is not cross-origin isolated";
    assert!(browser.text(said).starts_with(alone), "{}", browser.text(said));
    browser.wait_for("navigator.serviceWorker.controller !== null");
    assert_eq!(browser.value("document.getElementById('offline').hidden"), json!(true));
    browser.open("about:blank");
    browser.open(&url);
    browser.value("trisect.ready.then(() => true)");
    assert_eq!(browser.text(said), "CPU: 4 threads, wasm32");
}
