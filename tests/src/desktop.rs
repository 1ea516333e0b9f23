//! A virtual screen for tests: an X server without a monitor, captures of its windows, and input by
//! keyboard and mouse.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    AtomEnum, ConfigureWindowAux, ConnectionExt, ImageFormat, InputFocus, MapState, Window,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

/// Any error of the X server or its connection.
pub(crate) type Failure = Box<dyn std::error::Error>;

// Types of the X protocol's events.
const KEY: (u8, u8) = (2, 3);
const BUTTON: (u8, u8) = (4, 5);
const MOTION: u8 = 6;

/// Symbol of the shift key (X11/keysymdef.h).
const SHIFT: u32 = 0xffe1;

/// An X server without a monitor; it is stopped on drop.
pub struct Desktop {
    server: Child,
    /// Display name, for `DISPLAY`.
    pub name: String,
    connection: RustConnection,
    root: Window,
}

impl Drop for Desktop {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Image of a window.
#[derive(Clone, PartialEq, Eq)]
pub struct Capture {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Red, green and blue of each pixel, row by row.
    pub pixels: Vec<[u8; 3]>,
}

impl Capture {
    /// Returns the mean difference of the channels' codes over the columns `from..to`; 255 for
    /// images of different sizes.
    pub fn difference(&self, other: &Self, from: usize, to: usize) -> f64 {
        if (self.width, self.height) != (other.width, other.height) {
            return 255.0;
        }
        let (mut sum, mut count) = (0u64, 0u64);
        for (index, (a, b)) in self.pixels.iter().zip(&other.pixels).enumerate() {
            if (from..to).contains(&(index % self.width)) {
                sum += (0..3).map(|c| u64::from(a[c].abs_diff(b[c]))).sum::<u64>();
                count += 3;
            }
        }
        sum as f64 / count.max(1) as f64
    }
}

impl Desktop {
    /// Starts a server on a free display.
    ///
    /// # Errors
    ///
    /// If `Xvfb` is missing or does not start.
    pub fn start(width: u32, height: u32) -> Result<Self, Failure> {
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-nolisten", "tcp", "-screen", "0", &format!("{width}x{height}x24")])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?;
        let mut number = String::new();
        let out = server.stdout.take().ok_or("Xvfb has no output")?;
        BufReader::new(out).read_line(&mut number)?;
        let name = format!(":{}", number.trim());
        let connected = x11rb::connect(Some(&name));
        let (connection, screen) = match connected {
            Ok(connected) => connected,
            Err(error) => {
                let _ = server.kill();
                let _ = server.wait();
                return Err(format!("Xvfb on {name:?}: {error}").into());
            }
        };
        let root = connection.setup().roots[screen].root;
        Ok(Self { server, name, connection, root })
    }

    /// Returns the connection to the server.
    pub(crate) fn connection(&self) -> &RustConnection {
        &self.connection
    }

    /// Returns the window behind all others.
    pub(crate) fn root(&self) -> Window {
        self.root
    }

    /// Waits for a visible window whose title begins with `title`.
    ///
    /// # Errors
    ///
    /// If there is no such window within `limit`.
    pub fn window(&self, title: &str, limit: Duration) -> Result<Window, Failure> {
        let start = Instant::now();
        while start.elapsed() < limit {
            let mut open = vec![self.root];
            while let Some(window) = open.pop() {
                if let Ok(tree) = self.connection.query_tree(window)?.reply() {
                    open.extend(tree.children);
                }
                let name =
                    self.connection.get_property(false, window, AtomEnum::WM_NAME, AtomEnum::ANY, 0, 1024)?;
                let is = name.reply().is_ok_and(|name| name.value.starts_with(title.as_bytes()));
                let attributes = self.connection.get_window_attributes(window)?.reply();
                if is && attributes.is_ok_and(|attributes| attributes.map_state == MapState::VIEWABLE) {
                    return Ok(window);
                }
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        Err(format!("no window {title:?}").into())
    }

    /// Gives a window the keyboard focus, as there is no window manager to do so.
    ///
    /// # Errors
    ///
    /// If the server refuses.
    pub fn focus(&self, window: Window) -> Result<(), Failure> {
        self.connection.set_input_focus(InputFocus::PARENT, window, x11rb::CURRENT_TIME)?.check()?;
        Ok(())
    }

    /// Captures the content of a window.
    ///
    /// # Errors
    ///
    /// If the window shows nothing.
    pub fn capture(&self, window: Window) -> Result<Capture, Failure> {
        let geometry = self.connection.get_geometry(window)?.reply()?;
        let (width, height) = (geometry.width, geometry.height);
        let image =
            self.connection.get_image(ImageFormat::Z_PIXMAP, window, 0, 0, width, height, !0)?.reply()?;
        let pixels = image.data.chunks_exact(4).map(|bgrx| [bgrx[2], bgrx[1], bgrx[0]]).collect();
        Ok(Capture { width: usize::from(width), height: usize::from(height), pixels })
    }

    /// Waits until a window's content has been the same for 0.7 s and `good` accepts it, and
    /// returns it.
    ///
    /// # Errors
    ///
    /// If that does not happen within `limit`.
    pub fn settled(
        &self,
        window: Window,
        limit: Duration,
        good: impl Fn(&Capture) -> bool,
    ) -> Result<Capture, Failure> {
        let start = Instant::now();
        let (mut last, mut since) = (self.capture(window)?, Instant::now());
        while start.elapsed() < limit {
            std::thread::sleep(Duration::from_millis(60));
            let now = self.capture(window)?;
            if now != last {
                (last, since) = (now, Instant::now());
            } else if since.elapsed() > Duration::from_millis(700) && good(&last) {
                return Ok(last);
            }
        }
        Err("the window does not settle on the expected content".into())
    }

    fn fake(&self, kind: u8, detail: u8, x: i16, y: i16) -> Result<(), Failure> {
        self.connection.xtest_fake_input(kind, detail, 0, self.root, x, y, 0)?.check()?;
        Ok(())
    }

    /// Holds a key down for a while.
    ///
    /// # Errors
    ///
    /// If the keyboard has no key for this symbol.
    pub fn key(&self, symbol: u32, hold: Duration) -> Result<(), Failure> {
        let setup = self.connection.setup();
        let (first, count) = (setup.min_keycode, setup.max_keycode - setup.min_keycode + 1);
        let map = self.connection.get_keyboard_mapping(first, count)?.reply()?;
        let of_key = usize::from(map.keysyms_per_keycode).max(1);
        let place = |wanted: u32| {
            let mut keys = map.keysyms.chunks(of_key).enumerate();
            keys.find_map(|(key, symbols)| Some((key, symbols.iter().position(|&is| is == wanted)?)))
        };
        let code = |key: usize| Ok::<_, Failure>(first + u8::try_from(key)?);
        let (key, level) = place(symbol).ok_or("no such key")?;
        let (shift, _) = place(SHIFT).ok_or("no shift key")?;
        let shift = if level == 1 { Some(code(shift)?) } else { None };
        shift.map_or(Ok(()), |shift| self.fake(KEY.0, shift, 0, 0))?;
        self.fake(KEY.0, code(key)?, 0, 0)?;
        std::thread::sleep(hold);
        self.fake(KEY.1, code(key)?, 0, 0)?;
        shift.map_or(Ok(()), |shift| self.fake(KEY.1, shift, 0, 0))
    }

    /// Drags with a button from one point of the screen to another.
    ///
    /// # Errors
    ///
    /// If the server refuses.
    pub fn drag(&self, button: u8, from: (i16, i16), to: (i16, i16)) -> Result<(), Failure> {
        let pause = || std::thread::sleep(Duration::from_millis(40));
        self.fake(MOTION, 0, from.0, from.1)?;
        pause();
        self.fake(BUTTON.0, button, 0, 0)?;
        for step in 1..=8 {
            pause();
            let between = |a: i16, b: i16| a + (b - a) / 8 * step;
            self.fake(MOTION, 0, between(from.0, to.0), between(from.1, to.1))?;
        }
        pause();
        self.fake(BUTTON.1, button, 0, 0)
    }

    /// Clicks a button at a point of the screen; buttons 4 and 5 are the wheel.
    ///
    /// # Errors
    ///
    /// If the server refuses.
    pub fn click(&self, button: u8, at: (i16, i16)) -> Result<(), Failure> {
        self.fake(MOTION, 0, at.0, at.1)?;
        std::thread::sleep(Duration::from_millis(40));
        self.fake(BUTTON.0, button, 0, 0)?;
        std::thread::sleep(Duration::from_millis(40));
        self.fake(BUTTON.1, button, 0, 0)
    }

    /// Resizes a window.
    ///
    /// # Errors
    ///
    /// If the server refuses.
    pub fn resize(&self, window: Window, width: u32, height: u32) -> Result<(), Failure> {
        let size = ConfigureWindowAux::new().width(width).height(height);
        self.connection.configure_window(window, &size)?.check()?;
        Ok(())
    }

    /// Shows or hides a window.
    ///
    /// # Errors
    ///
    /// If the server refuses.
    pub fn show(&self, window: Window, shown: bool) -> Result<(), Failure> {
        match shown {
            true => self.connection.map_window(window)?.check()?,
            false => self.connection.unmap_window(window)?.check()?,
        }
        Ok(())
    }
}
