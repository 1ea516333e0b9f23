//! The viewer in a real X server: input by keyboard and mouse, and what the window then shows.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use trisect::image::Image;
use trisect::scene::Scene;
use trisect_tests::desktop::{Capture, Desktop};
use trisect_tests::program::folder;
use trisect_tests::{BackendUnderTest, binary, root};
use x11rb::protocol::xproto::Window;

// Key symbols (X11/keysymdef.h).
const ESCAPE: u32 = 0xff1b;
const RIGHT: u32 = 0xff53;

/// Returns the key symbol of a letter.
fn letter(c: char) -> u32 {
    u32::from(c)
}

/// Number of the window's columns that show the image; the rest are controls.
const IMAGE: usize = 400;

/// Time limit for a single step, which a software adapter may need.
const LIMIT: Duration = Duration::from_secs(60);

struct Viewer {
    desktop: Desktop,
    program: Child,
    window: Window,
    folder: PathBuf,
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

impl Viewer {
    /// Opens a copy of the book's scene. `None`, with a message, where no X server is installed and
    /// none is required.
    fn open(name: &str, arguments: &[&str]) -> Option<Self> {
        Self::on((1000, 700), name, &[&["--height", "620"], arguments].concat())
    }

    /// Opens a copy of the book's scene on a screen of this size.
    fn on(screen: (u32, u32), name: &str, arguments: &[&str]) -> Option<Self> {
        let desktop = Desktop::start(screen.0, screen.1).map_err(|error| error.to_string());
        if let Err(error) = &desktop {
            // A window needs a Vulkan adapter, so a screen is required where wgpu is.
            let required = std::env::var("REQUIRE_BACKENDS").unwrap_or_default();
            assert!(!required.contains("wgpu"), "Xvfb: {error}; install it (Debian: xvfb)");
            eprintln!("SKIPPED: Xvfb: {error}");
            return None;
        }
        let desktop = desktop.unwrap();
        let folder = folder("viewer", name);
        let scene = folder.join("book.ron");
        std::fs::copy(root().join("scenes/rtiow_final.ron"), &scene).unwrap();
        let log = std::fs::File::create(folder.join("log.txt")).unwrap();
        let program = Command::new(binary())
            .args(["view", "book.ron"])
            .args(arguments)
            .current_dir(&folder)
            .env("DISPLAY", &desktop.name)
            .env("XDG_RUNTIME_DIR", &folder)
            .env_remove("WAYLAND_DISPLAY")
            .stderr(Stdio::from(log))
            .spawn()
            .unwrap();
        let mut viewer = Self { desktop, program, window: 0, folder };
        match viewer.desktop.window("Trisect", LIMIT) {
            Ok(window) => viewer.window = window,
            Err(error) => panic!("{error}: {}", viewer.log()),
        }
        viewer.desktop.focus(viewer.window).unwrap();
        Some(viewer)
    }

    fn log(&self) -> String {
        std::fs::read_to_string(self.folder.join("log.txt")).unwrap_or_default()
    }

    /// Waits until the window is at rest, shows more than a few colours, and `good` accepts it.
    fn until(&mut self, what: &str, good: impl Fn(&Capture) -> bool) -> Capture {
        let settled =
            self.desktop.settled(self.window, LIMIT, |capture| colours(capture) > 300 && good(capture));
        let ended = self.program.try_wait().unwrap();
        match settled {
            Ok(capture) => capture,
            Err(error) => panic!("{what}: {error}; ended: {ended:?}; {}", self.log()),
        }
    }

    fn key(&mut self, symbol: u32, milliseconds: u64) {
        self.desktop.key(symbol, Duration::from_millis(milliseconds)).unwrap();
    }

    /// Returns the processor time of the program so far, in clock ticks of 10 ms.
    fn ticks(&self) -> u64 {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.program.id())).unwrap();
        // User and system time are fields 14 and 15; the second may contain spaces.
        let fields: Vec<&str> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
        fields[11].parse::<u64>().unwrap() + fields[12].parse::<u64>().unwrap()
    }

    /// Waits for a file that the program writes, and returns its path.
    fn written(&self, extension: &str) -> PathBuf {
        let path = self.folder.join(format!("book-view-1.{extension}"));
        let start = Instant::now();
        while !path.exists() {
            assert!(start.elapsed() < LIMIT, "no .{extension} was written: {}", self.log());
            std::thread::sleep(Duration::from_millis(50));
        }
        std::thread::sleep(Duration::from_millis(300)); // until it is complete
        path
    }

    /// Presses Escape and waits for the end of the program.
    fn quit(&mut self) {
        self.desktop.key(ESCAPE, Duration::from_millis(30)).unwrap();
        let start = Instant::now();
        while start.elapsed() < LIMIT {
            if let Some(status) = self.program.try_wait().unwrap() {
                assert!(status.success(), "{status}: {}", self.log());
                assert!(!self.log().contains("panicked"), "{}", self.log());
                return;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        panic!("Escape does not end the program");
    }
}

/// Returns the number of colours in the left third of the window, which shows the image.
fn colours(capture: &Capture) -> usize {
    let rows = capture.pixels.chunks(capture.width.max(1));
    let all: HashSet<[u8; 3]> = rows.flat_map(|row| row.iter().take(capture.width / 3)).copied().collect();
    all.len()
}

// Mean difference of codes that is above the noise of other samples, and one that is not.
const MOVED: f64 = 9.0;
const SAME: f64 = 5.0;

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

/// Makes the picture of docs/how-to/denoise.md: `cargo test --release -p trisect-tests --test
/// program viewer -- --ignored`.
#[test]
#[ignore = "makes docs/viewer.png, which a run of the tests must not change, and checks nothing: the tests above do"]
fn screenshot() {
    let arguments =
        ["--backend", "cpu", "--enough", "4", "--split", "0.35", "--depth", "12", "--width", "640"];
    let Some(mut viewer) = Viewer::open("screenshot", &arguments) else { return };
    let capture = viewer.until("the image", |_| true);
    save(&capture, &root().join("docs/viewer.png"));
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

/// Writes a capture as a PNG.
fn save(capture: &Capture, path: &Path) {
    let decode = |code: u8| trisect::metrics::srgb::decode(f32::from(code) / 255.0);
    let pixels = capture.pixels.iter().map(|pixel| pixel.map(decode)).collect();
    let (width, height) = (capture.width as u32, capture.height as u32);
    trisect::output::write(&Image { width, height, pixels }, path).unwrap();
}
