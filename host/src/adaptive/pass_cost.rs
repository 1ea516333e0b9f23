//! What passes of samples take, so that the last ends when it should.

use super::DualBuffers;
use super::renderer::{AdaptiveRenderer, Launches, PassCost};
use crate::Error;
use crate::backend::DeviceKind;
use crate::render::{RenderObserver, Renderer, Settings};
use std::time::Instant;

/// What a pass of samples for all pixels takes.
#[derive(Clone, Copy)]
pub(super) struct PassTime {
    /// Seconds, by the device's timer: those of one sample.
    pub each: f64,
    /// What else it takes, however many samples it has.
    pub beside: f64,
}

impl PassTime {
    /// Takes one sample.
    pub fn of_one(taker: &mut AdaptiveRenderer) -> Result<Self, Error> {
        let (start, before) = (Instant::now(), taker.totals.device);
        taker.render_uniform(1)?;
        let each = (taker.totals.device - before).as_secs_f64();
        Ok(Self { each: each.max(1e-9), beside: (start.elapsed().as_secs_f64() - each).max(0.0) })
    }
}

/// Passes that are thrown away, at most.
const MAX_CALIBRATION_PASSES: usize = 12;

/// What a pass takes over the one before, at least, if the device is as fast as it gets.
const STEADY: f64 = 0.9;

/// What passes took before a budget began.
#[derive(Clone, Copy)]
pub(super) struct Calibration {
    pub plain: PassTime,
    /// With guides, if there will be any.
    pub with_aovs: Option<PassTime>,
}

impl Calibration {
    pub fn pass(&self, with_guides: bool) -> Option<PassTime> {
        if with_guides { self.with_aovs } else { Some(self.plain) }
    }

    /// What of a sample's time with guides they take.
    pub fn aov_share(&self) -> f64 {
        self.with_aovs.map_or(0.0, |guided| (1.0 - self.plain.each / guided.each).max(0.0))
    }
}

/// On a GPU, where the first touch of memory takes longer than samples: touches all by passes that are thrown away. Returns what the last ones took.
pub(super) fn calibrate(
    renderer: &mut Renderer,
    plain: &Settings,
    with_guides: &Settings,
    mut halves: DualBuffers,
    observer: &mut dyn RenderObserver,
) -> Result<(DualBuffers, Option<Calibration>), Error> {
    if renderer.backend().device().kind != DeviceKind::Gpu {
        return Ok((halves, None));
    }
    renderer.pin_chunks(plain.pixels() as usize, with_guides.guides);
    let mut one = |halves: DualBuffers, settings: &Settings| {
        let mut taker = AdaptiveRenderer::with(renderer, settings, halves, observer);
        let pass = PassTime::of_one(&mut taker)?;
        Ok::<_, Error>((taker.halves, pass))
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
    halves.clear();
    let guided = with_guides.guides.then_some(guided);
    Ok((halves, Some(Calibration { plain: pass, with_aovs: guided })))
}

/// How long passes take.
pub(super) struct PassCostModel {
    /// Seconds of a chunk of both halves, whatever it renders.
    pub chunk: f64,
    /// The same of a launch in which tiles take their own numbers of samples.
    pub tile_launch: f64,
    /// Work a second, beside that.
    pub rate: f64,
}

impl PassCostModel {
    fn beside(&self, launches: Launches) -> f64 {
        f64::from(launches.chunks) * self.chunk + f64::from(launches.tile_launches) * self.tile_launch
    }

    /// Work that fits a time.
    pub fn fits(&self, seconds: f64, launches: Launches) -> f64 {
        ((seconds - self.beside(launches)) * self.rate).max(0.0)
    }

    /// From a pass.
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
        // What took less than ever before may not do so again: a pass that ends early leaves time for another.
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
