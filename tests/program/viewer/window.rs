//! Keys, mouse, sizes and rest of the window.

use super::*;
use trisect::image::Image;
use trisect::scene::Scene;
use trisect_tests::BackendUnderTest;

/// Keys and mouse move the camera, and R resets it. B compares, H hides the controls, I and C write
/// files.
#[test]
fn hands_on_keyboard_and_mouse() {
    let arguments = ["--backend", "cpu", "--width", "400", "--depth", "4", "--scale", "0.4", "--enough", "6"];
    let Some(mut viewer) = Viewer::open("hands", &arguments) else { return };
    let start = viewer.until("the first image", |_| true);
    let width = start.width;
    assert!(width > IMAGE + 200, "{width}");
    let off = |a: &Capture, b: &Capture| a.difference(b, 0, IMAGE);

    viewer.key(RIGHT, 500);
    viewer.until("an arrow turns", |now| off(now, &start) > MOVED);
    viewer.key(letter('r'), 30);
    viewer.until("R resets", |now| off(now, &start) < SAME);
    // The scene follows the pointer: down, so that the camera stays above the ground.
    viewer.desktop.drag(1, (250, 300), (120, 340)).unwrap();
    let dragged = viewer.until("the mouse turns", |now| off(now, &start) > MOVED);
    viewer.desktop.click(4, (200, 300)).unwrap();
    viewer.until("the wheel moves", |now| off(now, &dragged) > SAME);

    // The saved camera is the moved one.
    viewer.key(letter('c'), 30);
    let scene = Scene::load(&viewer.written("ron")).unwrap();
    let book = Scene::load(&viewer.folder.join("book.ron")).unwrap();
    let moved = (scene.camera.look_from - book.camera.look_from).length();
    assert!(moved > 1.0 && scene.camera.look_at == book.camera.look_at, "{moved}");
    assert_eq!(scene.spheres, book.spheres);

    // The left half is shown without denoising, with the noise of six samples; the right half
    // stays.
    viewer.key(letter('r'), 30);
    let plain = viewer.until("R resets again", |now| off(now, &start) < SAME);
    viewer.key(letter('b'), 30);
    let half = IMAGE / 2;
    viewer.until("B compares", |now| {
        let right = now.difference(&plain, half + 8, IMAGE);
        now.difference(&plain, 0, half - 8) > 5.0 * right + 2.0
    });
    viewer.key(letter('b'), 30);
    viewer.until("B does no more", |now| off(now, &plain) < SAME);

    viewer.key(letter('i'), 30);
    let image = Image::read(&viewer.written("png")).unwrap();
    assert!((150..=170).contains(&image.width) && image.height == 248, "{}x{}", image.width, image.height);
    viewer.key(letter('h'), 30);
    viewer.until("H hides", |now| now.difference(&plain, IMAGE + 20, width) > 20.0);
    viewer.key(letter('h'), 30);
    viewer.until("H shows", |now| now.difference(&plain, IMAGE + 20, width) < 20.0);
    viewer.quit();
}

/// The image has the given resolution, also on a screen without room for the controls beside it.
/// Escape closes an open list first, and then the window.
#[test]
fn the_resolution_is_what_was_asked_for() {
    let fixed = ["--backend", "cpu", "--depth", "2", "--enough", "1", "--denoise", "off", "--scale", "0.5"];
    for (resolution, screen, window) in [
        ((480, 300), (1000, 700), (820, 300)),
        // The screen is as wide as the image, so that the panel covers part of it.
        ((1280, 720), (1280, 800), (1280, 720)),
    ] {
        let name = format!("{}x{}", resolution.0, resolution.1);
        let arguments = [&fixed[..], &["--resolution", &name]].concat();
        let Some(mut viewer) = Viewer::on(screen, &name, &arguments) else { return };
        let start = viewer.until("the first image", |_| true);
        assert_eq!((start.width, start.height), window);
        viewer.key(letter('i'), 30);
        let image = Image::read(&viewer.written("png")).unwrap();
        assert_eq!((image.width, image.height), (resolution.0 / 2, resolution.1 / 2));
        viewer.until("a file was written", |_| true);
        // The panel's background is at the right border, and nowhere in the image.
        let column = |x: usize| start.pixels.iter().skip(x).step_by(start.width);
        let grey = start.pixels[window.0 - 2];
        let share = |x| column(x).filter(|&&pixel| pixel == grey).count() as f64 / window.1 as f64;
        assert!(share(window.0 - 2) > 0.9 && share(100) < 0.1, "{}, {}", share(window.0 - 2), share(100));

        let before = viewer.until("at rest", |_| true);
        viewer.desktop.click(1, (window.0 as i16 - 170, 36)).unwrap();
        let off = |a: &Capture, b: &Capture| a.difference(b, window.0 - 340, window.0);
        // The pointer over a closed list highlights it, which changes a quarter of this.
        let opened = viewer.until("a list opens", |now| off(now, &before) > 2.0);
        viewer.key(ESCAPE, 30);
        let is_closed = |now: &Capture| off(now, &before) < 0.5 * off(&opened, &before);
        viewer.until("Escape closes the list", is_closed);
        assert!(viewer.program.try_wait().unwrap().is_none(), "Escape ended the program");
        viewer.quit();
    }
}

/// The program survives window sizes from 1 pixel to almost the screen's and a hidden window, and
/// then draws again.
#[test]
fn sizes_and_hiding() {
    let arguments =
        ["--backend", "cpu", "--width", "400", "--scale", "0.2", "--enough", "4", "--denoise", "atrous"];
    let Some(mut viewer) = Viewer::open("sizes", &arguments) else { return };
    viewer.until("the first image", |_| true);
    for (width, height) in [(980, 660), (1, 1), (320, 40), (700, 500)] {
        viewer.desktop.resize(viewer.window, width, height).unwrap();
        std::thread::sleep(Duration::from_millis(400));
        assert!(viewer.program.try_wait().unwrap().is_none(), "{width}x{height}: {}", viewer.log());
    }
    let capture = viewer.until("700x500", |now| (now.width, now.height) == (700, 500));
    viewer.desktop.show(viewer.window, false).unwrap();
    std::thread::sleep(Duration::from_millis(500));
    viewer.desktop.show(viewer.window, true).unwrap();
    viewer.desktop.focus(viewer.window).unwrap();
    viewer.until("shown again", |now| now.difference(&capture, 0, 340) < 10.0);
    viewer.quit();
}

/// A window at rest draws nothing: its process takes almost no processor time.
#[test]
fn a_window_at_rest_rests() {
    let arguments = ["--backend", "cpu", "--width", "400", "--enough", "2", "--denoise", "off"];
    let Some(mut viewer) = Viewer::open("rest", &arguments) else { return };
    viewer.until("the first image", |_| true);
    let ticks = |viewer: &mut Viewer, meanwhile: &mut dyn FnMut(&mut Viewer)| {
        let before = viewer.ticks();
        meanwhile(viewer);
        viewer.ticks() - before
    };
    let rests = ticks(&mut viewer, &mut |_| std::thread::sleep(Duration::from_secs(2)));
    // Drawing all the time takes at least a hundred.
    assert!(rests <= 10, "{rests} ticks at rest");
    // Negative control: a camera that moves takes more.
    let moves = ticks(&mut viewer, &mut |viewer| viewer.key(RIGHT, 2000));
    assert!(moves > 10, "negative control not detected: {moves} ticks");
    viewer.quit();
}

/// Frames of a GPU backend reach the window; here of the adapter that the tests use.
#[test]
fn frames_of_wgpu() {
    let index = BackendUnderTest::Wgpu.index().to_string();
    let arguments = [
        "--backend",
        "wgpu",
        "--device",
        &index,
        "--width",
        "400",
        "--depth",
        "4",
        "--scale",
        "0.2",
        "--enough",
        "2",
    ];
    let Some(mut viewer) = Viewer::open("wgpu", &arguments) else { return };
    let start = viewer.until("the first image", |_| true);
    viewer.key(RIGHT, 500);
    viewer.until("an arrow turns", |now| now.difference(&start, 0, IMAGE) > MOVED);
    viewer.quit();
}

/// Makes docs/viewer.png, and the pictures of layers and of a pick in docs/tutorial: `cargo test
/// --release -p trisect-tests --test program viewer -- --ignored`.
#[test]
#[ignore = "makes pictures of docs, which a run of the tests must not change, and checks nothing: the tests above do"]
fn screenshots() {
    let common = ["--backend", "cpu", "--enough", "8", "--depth", "12"];
    let split = [&common[..], &["--split", "0.35", "--width", "640"]].concat();
    let Some(mut viewer) = Viewer::open("screenshot", &split) else { return };
    let capture = viewer.until("the image", |_| true);
    save(&capture, &root().join("docs/viewer.png"));
    viewer.quit();
    let size = [&common[..], &["--resolution", "640x480"]].concat();
    let mut viewer = Viewer::on((980, 480), "pictures", &size).unwrap();
    let pictures = root().join("docs/tutorial/pictures");
    viewer.until("the image", |_| true);
    viewer.desktop.click(1, (330, 200)).unwrap();
    std::thread::sleep(Duration::from_secs(1));
    let capture = viewer.until("the label", |_| true);
    save(&capture, &pictures.join("window-pick.png"));
    // The eighth layer: nodes.
    (0..8).for_each(|_| {
        viewer.key(letter('l'), 30);
        std::thread::sleep(Duration::from_millis(300));
    });
    let capture = viewer.until_any("the layer", |_| true);
    save(&capture, &pictures.join("window-nodes.png"));
    viewer.key(letter('?'), 30);
    std::thread::sleep(Duration::from_secs(1));
    let capture = viewer.until_any("the keys", |_| true);
    save(&capture, &pictures.join("window-keys.png"));
    viewer.key(ESCAPE, 30);
    viewer.quit();
}

/// Prints how many images a second the window shows while the camera moves, and after how long it
/// shows the last one once the camera rests, for docs/notebook/waits.md.
#[test]
#[ignore = "measures, and checks nothing: a rate depends on the machine"]
fn moving_rate() {
    for fps in ["10", "0"] {
        let arguments =
            ["--backend", "cpu", "--resolution", "1280x720", "--enough", "1", "--moving-fps", fps];
        let Some(mut viewer) = Viewer::on((1700, 800), "moving", &arguments) else { return };
        viewer.until("the first image", |_| true);
        let (desktop, window) = (&viewer.desktop, viewer.window);
        // The image without the panel, whose numbers change, too.
        let image = || -> Vec<_> {
            let Capture { pixels, width, .. } = desktop.capture(window).unwrap();
            pixels.chunks(width).step_by(9).flat_map(|row| row[..1280].iter().step_by(7).copied()).collect()
        };
        let changes = |seconds: f64| {
            let (start, mut last, mut changes) = (Instant::now(), image(), Vec::new());
            while start.elapsed().as_secs_f64() < seconds {
                std::thread::sleep(Duration::from_millis(20));
                let now = image();
                if now != last {
                    changes.push(start.elapsed().as_secs_f64());
                    last = now;
                }
            }
            changes
        };
        std::thread::scope(|scope| {
            let held = scope.spawn(|| desktop.key(RIGHT, Duration::from_secs(11)).is_ok());
            std::thread::sleep(Duration::from_secs(2));
            let moving = changes(8.0).len() as f64 / 8.0;
            assert!(held.join().unwrap());
            let rest = changes(3.0).last().copied().unwrap_or(0.0);
            println!("--moving-fps {fps}: {moving:.1} images a second; the last {rest:.2} s after the key");
        });
        viewer.quit();
    }
}

/// Without a screen, the program reports that with a remedy.
#[test]
fn without_a_screen() {
    let output = Command::new(binary())
        .args(["view", "--backend", "cpu"])
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .unwrap();
    let arguments = ["view"];
    trisect_tests::program::check_failure(&output, &arguments, 3, &["window", "DISPLAY", "--headless"]);
    assert!(!String::from_utf8_lossy(&output.stderr).contains(".rs:"), "a place in someone's source");
}
