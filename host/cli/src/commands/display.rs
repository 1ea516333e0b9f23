//! `trisect render --display tev`: sends the image to the viewer tev while it is rendered.

use super::eprint;
use crate::cli::{DisplayAddress, RenderArgs};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};
use trisect::film::Film;
use trisect::image::{Image, ImageError};

/// Time until a viewer that does not answer is given up.
const PATIENCE: Duration = Duration::from_secs(3);

/// Minimum time between two images.
const INTERVAL: Duration = Duration::from_millis(250);

/// Share of the time that sending images may take.
const SHARE: u32 = 10;

/// Number of values in a packet, whose length in bytes tev reads as 32 bits.
const PACKET: usize = 1 << 22;

const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// Image in tev.
pub struct Display {
    name: String,
    state: Mutex<State>,
}

/// Connection to tev, and the time of the next image.
struct State {
    /// `None` after an error.
    client: Option<TevClient>,
    next: Instant,
    /// Size of the image that tev has.
    size: Option<(u32, u32)>,
}

impl Display {
    /// Connects with the viewer that a command names, if it does.
    ///
    /// # Errors
    ///
    /// [`ImageError::Codec`] if no viewer answers at the address.
    pub fn open(arguments: &RenderArgs) -> Result<Option<Arc<Self>>, ImageError> {
        let Some(DisplayAddress { host, port }) = &arguments.preview.display else { return Ok(None) };
        let failed = |error: std::io::Error| ImageError::Codec {
            path: format!("tev://{host}:{port}").into(),
            message: format!(
                "no viewer answers ({error}); start tev first, or name its address with --display"
            ),
        };
        let addresses = (host.as_str(), *port).to_socket_addrs().map_err(failed)?;
        let mut stream = Err(std::io::ErrorKind::NotFound.into());
        for address in addresses {
            stream = TcpStream::connect_timeout(&address, PATIENCE);
            if stream.is_ok() {
                break;
            }
        }
        let stream = stream.map_err(failed)?;
        // Packets of one image follow each other; none waits for an answer.
        stream.set_nodelay(true).and_then(|()| stream.set_write_timeout(Some(PATIENCE))).map_err(failed)?;
        let client = Some(TevClient::wrap(stream));
        let state = State { client, next: Instant::now(), size: None };
        Ok(Some(Arc::new(Self { name: arguments.output.display().to_string(), state: Mutex::new(state) })))
    }

    /// Returns whether it is time for another image.
    pub fn is_due(&self) -> bool {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.client.is_some() && Instant::now() >= state.next
    }

    /// Shows the mean radiance of a film, if it is time.
    pub fn show_if_due(&self, film: &Film) {
        if self.is_due() {
            self.show(&film.image());
        }
    }

    /// Shows an image. After an error, which is printed, nothing more is shown.
    pub fn show(&self, image: &Image) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let start = Instant::now();
        let Err(error) = state.send(&self.name, image) else {
            state.next = start + INTERVAL.max(start.elapsed() * SHARE);
            return;
        };
        state.client = None;
        eprint(&format!("warning: tev: {error}; the render continues without the preview"));
    }
}

impl State {
    fn send(&mut self, name: &str, image: &Image) -> std::io::Result<()> {
        let Some(client) = &mut self.client else { return Ok(()) };
        let size = (image.width, image.height);
        if self.size != Some(size) {
            let (width, height) = size;
            let (image_name, channel_names) = (name, &CHANNELS);
            client.send(PacketCreateImage { image_name, grab_focus: true, width, height, channel_names })?;
            self.size = Some(size);
        }
        let width = image.width as usize;
        let rows = (PACKET / (3 * width.max(1))).max(1);
        for (strip, pixels) in (0..).zip(image.pixels.chunks(rows * width.max(1))) {
            let data: &[f32] = pixels.as_flattened();
            client.send(PacketUpdateImage {
                image_name: name,
                grab_focus: false,
                channel_names: &CHANNELS,
                channel_offsets: &[0, 1, 2],
                channel_strides: &[3, 3, 3],
                x: 0,
                y: strip * rows as u32,
                width: image.width,
                height: (pixels.len() / width.max(1)) as u32,
                data,
            })?;
        }
        Ok(())
    }
}
