//! What passes of samples take, so that the last ends when it should.

use super::Halves;
use super::taker::{Launches, Spent, Taker};
use crate::Error;
use crate::backend::DeviceKind;
use crate::render::{Observer, Renderer, Settings};
use std::time::Instant;

/// What a pass of samples for all pixels takes.
#[derive(Clone, Copy)]
pub(super) struct Pass {
    /// Seconds, by the device's timer: those of one sample.
    pub each: f64,
    /// What else it takes, however many samples it has.
    pub beside: f64,
}

impl Pass {
    /// Takes one sample.
    pub fn of_one(taker: &mut Taker) -> Result<Self, Error> {
        let (start, before) = (Instant::now(), taker.took.device);
        taker.uniform(1)?;
        let each = (taker.took.device - before).as_secs_f64();
        Ok(Self { each: each.max(1e-9), beside: (start.elapsed().as_secs_f64() - each).max(0.0) })
    }
}

/// Passes that are thrown away, at most.
const REHEARSALS: usize = 12;

/// What a pass takes over the one before, at least, if the device is as fast as it gets.
const STEADY: f64 = 0.9;

/// On a GPU, where the first touch of memory takes longer than samples: touches all by passes that are thrown away. Returns what the last took.
pub(super) fn rehearse(
    renderer: &mut Renderer,
    plain: &Settings,
    with_guides: &Settings,
    mut halves: Halves,
    observer: &mut dyn Observer,
) -> Result<(Halves, Option<Pass>), Error> {
    if renderer.backend().device().kind != DeviceKind::Gpu {
        return Ok((halves, None));
    }
    renderer.pin_chunks(plain.pixels() as usize);
    let mut pass = None;
    for index in 0..REHEARSALS {
        let mut taker = Taker::with(renderer, if index == 0 { with_guides } else { plain }, halves, observer);
        let now = Pass::of_one(&mut taker)?;
        halves = taker.halves;
        // A device that was idle, or a driver that has just compiled, gets faster for a while.
        let is_steady = pass.is_some_and(|before: Pass| now.each > STEADY * before.each);
        pass = Some(now);
        if index > 1 && is_steady {
            break;
        }
    }
    halves.clear();
    Ok((halves, pass))
}

/// How long passes take.
pub(super) struct Clock {
    /// Seconds of a chunk of both halves, whatever it renders.
    pub chunk: f64,
    /// The same of a launch in which tiles take their own numbers of samples.
    pub own: f64,
    /// Work a second, beside that.
    pub rate: f64,
}

impl Clock {
    fn beside(&self, launches: Launches) -> f64 {
        f64::from(launches.chunks) * self.chunk + f64::from(launches.own) * self.own
    }

    /// Work that fits a time.
    pub fn fits(&self, seconds: f64, launches: Launches) -> f64 {
        ((seconds - self.beside(launches)) * self.rate).max(0.0)
    }

    /// From a pass.
    pub fn learn(&mut self, spent: &Spent) {
        if spent.work <= 0.0 || spent.device <= 0.0 {
            return;
        }
        self.rate = spent.work / spent.device;
        let beside = (spent.seconds - spent.device).max(0.0);
        // What took less than ever before may not do so again: a pass that ends early leaves time for another.
        let learn = |before: f64, now: f64| now.max(0.5 * (before + now));
        match spent.launches {
            Launches { chunks: 0, own: 0 } => {}
            Launches { chunks: 0, own } => self.own = learn(self.own, beside / f64::from(own)),
            Launches { chunks, own } => {
                let of_chunks = (beside - f64::from(own) * self.own).max(0.0);
                self.chunk = learn(self.chunk, of_chunks / f64::from(chunks));
            }
        }
    }
}
