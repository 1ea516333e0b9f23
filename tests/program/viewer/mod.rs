//! The viewer in a real X server: input by keyboard and mouse, and what the window then shows.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

mod tools;
mod window;

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use trisect::image::Image;
use trisect_tests::desktop::{Capture, Desktop};
use trisect_tests::program::folder;
use trisect_tests::{binary, root};
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
        let scene = std::fs::read(root().join("scenes/rtiow_final.ron")).unwrap();
        Self::of(&scene, screen, name, arguments)
    }

    /// Opens a scene, in the file book.ron, on a screen of this size.
    fn of(scene: &[u8], screen: (u32, u32), name: &str, arguments: &[&str]) -> Option<Self> {
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
        std::fs::write(folder.join("book.ron"), scene).unwrap();
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
        self.until_any(what, |capture| colours(capture) > 300 && good(capture))
    }

    /// Waits until the window is at rest, and `good` accepts it.
    fn until_any(&mut self, what: &str, good: impl Fn(&Capture) -> bool) -> Capture {
        let settled = self.desktop.settled(self.window, LIMIT, good);
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

/// Writes a capture as a PNG.
fn save(capture: &Capture, path: &Path) {
    let decode = |code: u8| trisect::metrics::srgb::decode(f32::from(code) / 255.0);
    let pixels = capture.pixels.iter().map(|pixel| pixel.map(decode)).collect();
    let (width, height) = (capture.width as u32, capture.height as u32);
    trisect::output::write(&Image { width, height, pixels }, path).unwrap();
}
