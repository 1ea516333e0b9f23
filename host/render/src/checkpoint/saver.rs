//! Saver of checkpoints: writes a film at intervals while it grows, on its own thread.

use super::{CheckpointError, Header, Place};
use crate::film::{Film, SampleBlock, SampleCoverage};
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use trisect_system::threads;
use web_time::Instant;

/// Interval between checkpoints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SaveInterval {
    /// Time since the last checkpoint.
    Time(Duration),
    /// Mean samples per pixel since the last checkpoint.
    Samples(u32),
}

impl Default for SaveInterval {
    fn default() -> Self {
        Self::Time(Duration::from_secs(30))
    }
}

impl FromStr for SaveInterval {
    type Err = String;

    /// Parses `30` or `30s`, `5m`, `2h`, `500ms` or `1024spp`.
    fn from_str(text: &str) -> Result<Self, String> {
        let split = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
        let (number, unit) = (text[..split].trim(), text[split..].trim());
        if unit == "spp" {
            return match number.parse::<u32>() {
                Ok(samples) if samples > 0 => Ok(Self::Samples(samples)),
                _ => Err(format!("{number} is not a positive number of samples")),
            };
        }
        let unit = match unit {
            "ms" => 1e-3,
            "s" | "" => 1.0,
            "m" | "min" => 60.0,
            "h" => 3600.0,
            _ => return Err("write it as 30s, 5m, 2h or 1024spp".to_owned()),
        };
        let seconds = number.parse::<f64>().map_err(|error| error.to_string())? * unit;
        match Duration::try_from_secs_f64(seconds) {
            Ok(time) if time > Duration::ZERO => Ok(Self::Time(time)),
            Ok(_) => Err("must be above 0".to_owned()),
            Err(_) => Err(format!("{text} is not a valid time")),
        }
    }
}

/// Thread that writes copies of the film, with the channels to it and back.
struct Writer {
    to: Option<Sender<(Film, Header)>>,
    back: Receiver<(Film, Result<(), CheckpointError>)>,
    thread: Option<JoinHandle<()>>,
}

/// State of the last checkpoint, and memory for the next one.
struct State {
    path: PathBuf,
    writer: Writer,
    /// Memory for a copy of the film; `None` while a copy is being written.
    spare: Option<Film>,
    last: Instant,
    /// Mean samples per pixel of the last checkpoint.
    samples: f64,
    failed: Option<CheckpointError>,
}

/// Writes checkpoints of a render. The film is copied, and the copy is written while the render
/// continues. If a copy is still being written when the next checkpoint is due, the checkpoint
/// waits, not the render. A file that another process wrote meanwhile is not replaced.
pub struct Saver {
    place: Place,
    header: Mutex<Header>,
    every: SaveInterval,
    start: Instant,
    state: Mutex<State>,
}

impl Saver {
    /// Returns the saver of a new render; it replaces no existing file.
    pub fn new(path: &Path, header: Header, every: SaveInterval) -> Self {
        Self::with(Place::new(path), header, every, 0.0)
    }

    /// Returns the saver of a render that continues `film` from the file of `place`; it replaces
    /// that file.
    pub fn resume(place: Place, header: Header, every: SaveInterval, film: &Film) -> Self {
        Self::with(place, header, every, mean_samples(&film.coverage))
    }

    fn with(place: Place, header: Header, every: SaveInterval, samples: f64) -> Self {
        let (to, films) = channel::<(Film, Header)>();
        let (done, back) = channel();
        let own = place.clone();
        let thread = threads::spawn("checkpoint thread", move || {
            for (film, header) in films {
                let written = own.write(&header, &film);
                if done.send((film, written)).is_err() {
                    return;
                }
            }
        });
        // If the thread cannot be started, the rendering thread writes the checkpoints.
        let writer = Writer { to: Some(to), back, thread: thread.ok() };
        let state = State {
            path: place.path().to_owned(),
            writer,
            spare: Some(Film::new(0, 0)),
            last: Instant::now(),
            samples,
            failed: None,
        };
        let (header, start) = (Mutex::new(header), Instant::now());
        Self { place, header, every, start, state: Mutex::new(state) }
    }

    /// Returns the path of the checkpoint.
    pub fn path(&self) -> &Path {
        self.place.path()
    }

    /// Returns the header for the next checkpoint, with the time until now.
    pub fn header(&self) -> Header {
        let header = self.header.lock().unwrap_or_else(PoisonError::into_inner).clone();
        Header { seconds: header.seconds + self.start.elapsed().as_secs_f64(), ..header }
    }

    /// Adds the arithmetic of a device that continues the render.
    pub fn add_rounding(&self, arithmetic: &str) {
        self.header.lock().unwrap_or_else(PoisonError::into_inner).identity.add_rounding(arithmetic);
    }

    /// Returns whether a checkpoint of a film with these samples is due.
    pub fn is_due(&self, coverage: &SampleCoverage) -> bool {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).is_due(self.every, coverage)
    }

    /// Copies the film and starts writing the copy, if a checkpoint is due and no copy is being
    /// written.
    pub fn save_if_due(&self, film: &Film) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if !state.is_due(self.every, &film.coverage) {
            return;
        }
        state.take_back(false);
        let Some(mut copy) = state.spare.take() else { return };
        copy.copy_from(film);
        state.last = Instant::now();
        state.samples = mean_samples(&film.coverage);
        if let Some(to) = &state.writer.to
            && let Err(lost) = to.send((copy, self.header()))
        {
            let (film, header) = lost.0;
            // Without the thread, this one writes.
            state.failed = self.place.write(&header, &film).err().or(state.failed.take());
            state.spare = Some(film);
        }
    }

    /// Returns the error since the last call, if there was one. The render continues, and the saver
    /// tries again when the next checkpoint is due.
    pub fn failure(&self) -> Option<CheckpointError> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.take_back(false);
        state.failed.take()
    }

    /// Waits for the copy that is being written, if any, and then writes the final film.
    ///
    /// # Errors
    ///
    /// [`CheckpointError::Io`]: an earlier checkpoint is still there then.
    /// [`CheckpointError::Taken`] if another process wrote the file.
    pub fn finish(&self, film: &Film) -> Result<(), CheckpointError> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.take_back(true);
        state.failed = None;
        state.last = Instant::now();
        self.place.write(&self.header(), film)
    }
}

/// Returns the mean number of samples per pixel.
fn mean_samples(coverage: &SampleCoverage) -> f64 {
    let samples: u64 = coverage.parts().iter().map(SampleBlock::size).sum();
    samples as f64 / f64::from(coverage.height().max(1))
}

impl State {
    fn is_due(&self, every: SaveInterval, coverage: &SampleCoverage) -> bool {
        match every {
            SaveInterval::Time(time) => self.last.elapsed() >= time,
            SaveInterval::Samples(count) => mean_samples(coverage) - self.samples >= f64::from(count),
        }
    }

    fn take_back(&mut self, wait: bool) {
        while self.spare.is_none() {
            let back = match wait {
                true => self.writer.back.recv().map_err(|_| TryRecvError::Disconnected),
                false => self.writer.back.try_recv(),
            };
            match back {
                Ok((film, written)) => {
                    self.spare = Some(film);
                    self.failed = written.err().or(self.failed.take());
                }
                Err(TryRecvError::Empty) => return,
                Err(TryRecvError::Disconnected) => {
                    self.spare = Some(Film::new(0, 0));
                    let source = io::Error::other("the thread that writes it has ended");
                    self.failed = Some(CheckpointError::Io { path: self.path.clone(), source });
                }
            }
        }
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        // Without a sender, the thread ends after the current film.
        self.to = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn how_often() {
        let of = |text: &str| text.parse::<SaveInterval>();
        assert_eq!((of("30s"), of("30")), (Ok(SaveInterval::default()), Ok(SaveInterval::default())));
        assert_eq!(of("1.5min"), Ok(SaveInterval::Time(Duration::from_secs(90))));
        assert_eq!(of("250ms"), Ok(SaveInterval::Time(Duration::from_millis(250))));
        assert_eq!(of("1024spp"), Ok(SaveInterval::Samples(1024)));
        for bad in ["", "s", "0s", "-1s", "1e400h", "soon", "0spp", "-1spp", "1.5spp", "NaNs"] {
            assert!(of(bad).is_err(), "{bad}");
        }
    }
}
