//! Model of the time of passes over an image, fitted to measured passes. With it, a render within a
//! time budget sizes its passes so that the last one ends on time.

use super::DualBuffers;
use super::renderer::{AdaptiveRenderer, of_half};
use super::sampling_pass::{Launches, PassCost};
use crate::Error;
use crate::render::{RenderObserver, Renderer, Settings};
use trisect_device::DeviceKind;
use web_time::Instant;

/// Time of a pass over all pixels.
#[derive(Clone, Copy)]
pub(super) struct PassTime {
    /// Device time of one sample of each pixel and half, in seconds.
    pub each: f64,
    /// Additional host time in seconds, independent of the number of samples.
    pub beside: f64,
}

impl PassTime {
    /// Measures a pass of one sample.
    pub fn of_one(renderer: &mut AdaptiveRenderer) -> Result<Self, Error> {
        let (start, before) = (Instant::now(), renderer.totals.device);
        renderer.render_uniform(1)?;
        let each = (renderer.totals.device - before).as_secs_f64();
        Ok(Self { each: each.max(1e-9), beside: (start.elapsed().as_secs_f64() - each).max(0.0) })
    }
}

/// Maximum number of calibration passes, whose samples are discarded.
const MAX_CALIBRATION_PASSES: usize = 12;

/// Minimum time of a pass relative to the one before, if the device is at full speed.
const STEADY: f64 = 0.9;

/// Times of passes, measured before a budget begins.
#[derive(Clone, Copy)]
pub(super) struct Calibration {
    pub plain: PassTime,
    /// Pass with AOV sums, if there will be any.
    pub with_aovs: Option<PassTime>,
    /// Seconds until the image is made from the sums.
    pub image: f64,
}

impl Calibration {
    pub fn pass(&self, with_guides: bool) -> Option<PassTime> {
        if with_guides { self.with_aovs } else { Some(self.plain) }
    }

    /// Returns the share of AOV sums in a sample's time.
    pub fn aov_share(&self) -> f64 {
        self.with_aovs.map_or(0.0, |guided| (1.0 - self.plain.each / guided.each).max(0.0))
    }
}

/// Calibrates a GPU, where the first touch of memory takes longer than samples: runs passes whose
/// samples are discarded, until all memory is touched and the device is at full speed. Returns the
/// times of the last passes; `None` for other devices.
pub(super) fn calibrate(
    renderer: &mut Renderer,
    plain: &Settings,
    with_guides: &Settings,
    mut halves: DualBuffers,
    observer: &mut dyn RenderObserver,
) -> Result<(DualBuffers, Option<Calibration>), Error> {
    if renderer.device().info().kind != DeviceKind::Gpu {
        return Ok((halves, None));
    }
    if !halves.is_on_device() {
        renderer.pin_chunks(plain.pixels() as usize, with_guides.guides);
    }
    let mut one = |halves: DualBuffers, settings: &Settings| {
        let mut renderer = AdaptiveRenderer::with(renderer, settings, halves, observer);
        let pass = PassTime::of_one(&mut renderer)?;
        Ok::<_, Error>((renderer.halves, pass))
    };
    let mut guided;
    (halves, guided) = one(halves, with_guides)?;
    let mut pass = guided;
    for index in 0..MAX_CALIBRATION_PASSES {
        let before = pass.each;
        (halves, pass) = one(halves, plain)?;
        // A device that was idle, or a driver that has just compiled, gets faster for a while.
        if index > 1 && pass.each > STEADY * before {
            break;
        }
    }
    if with_guides.guides {
        (halves, guided) = one(halves, with_guides)?;
    }
    let mut image = 0.0;
    // The second time, memory is touched.
    for _ in 0..2 {
        let mut renderer = AdaptiveRenderer::with(renderer, plain, halves, observer);
        let start = Instant::now();
        renderer.image()?;
        image = start.elapsed().as_secs_f64();
        halves = renderer.halves;
    }
    halves.clear();
    if halves.is_on_device() {
        renderer.begin_halves(&of_half(plain, 0))?;
    }
    let guided = with_guides.guides.then_some(guided);
    Ok((halves, Some(Calibration { plain: pass, with_aovs: guided, image })))
}

/// Model of the time of passes.
pub(super) struct PassCostModel {
    /// Host seconds of a chunk of both halves, independent of its size.
    pub chunk: f64,
    /// Host seconds of a launch with a sample count for each tile.
    pub tile_launch: f64,
    /// Work per second of device time.
    pub rate: f64,
}

impl PassCostModel {
    fn beside(&self, launches: Launches) -> f64 {
        f64::from(launches.chunks) * self.chunk + f64::from(launches.tile_launches) * self.tile_launch
    }

    /// Returns the work that fits the part of `seconds` that the host cost of `launches` leaves.
    pub fn fits(&self, seconds: f64, launches: Launches) -> f64 {
        ((seconds - self.beside(launches)) * self.rate).max(0.0)
    }

    /// Fits the model to a pass.
    pub fn learn(&mut self, spent: &PassCost) {
        if spent.work <= 0.0 || spent.device <= 0.0 {
            return;
        }
        self.rate = spent.work / spent.device;
        let expected = self.beside(spent.launches);
        if expected <= 0.0 {
            return;
        }
        let ratio = (spent.seconds - spent.device).max(0.0) / expected;
        // A pass that was faster than expected may stay an exception: it counts half. A pass that
        // ends early leaves time for another.
        let ratio = ratio.max(0.5 * (1.0 + ratio));
        for (launches, seconds) in
            [(spent.launches.chunks, &mut self.chunk), (spent.launches.tile_launches, &mut self.tile_launch)]
        {
            if launches > 0 {
                *seconds *= ratio;
            }
        }
    }
}
