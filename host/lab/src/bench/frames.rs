//! Measures frames after a warm-up.

use crate::Error;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};
use trisect::render::{RenderObserver, Renderer, Settings};
use trisect::stats::RenderStats;

/// Statistics of measured frames.
#[derive(Clone, Debug)]
pub struct FrameStats {
    /// Statistics of the first frame, which include work that is done once, such as compiling the
    /// kernel. Usually a frame of the warm-up.
    pub first: RenderStats,
    /// Number of warm-up frames.
    pub warm_up: u32,
    /// Statistics of each frame after the warm-up.
    pub counted: Vec<RenderStats>,
}

/// Warm-up before frames count: clocks settle, caches fill, and submissions get their size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WarmUp {
    /// Minimum number of frames; with 0, [`measure`] counts even the first frame.
    pub frames: u32,
    /// Minimum time: a GPU that was idle while its driver compiled is slow at first. [`measure`]
    /// takes it from the end of the first frame.
    pub time: Duration,
}

impl WarmUp {
    /// Returns a warm-up of `frames` frames, however long they take.
    pub fn of(frames: u32) -> Self {
        Self { frames, time: Duration::ZERO }
    }
}

/// Renders warm-up frames and then `frames` that count, and returns their statistics. At least one
/// frame is rendered. `observer` watches all frames.
///
/// # Errors
///
/// Errors of [`Renderer::render`].
pub fn measure(
    renderer: &mut Renderer,
    settings: &Settings,
    warm_up: WarmUp,
    frames: u32,
    observer: &mut dyn RenderObserver,
) -> Result<FrameStats, Error> {
    let mut render = || -> Result<RenderStats, Error> {
        let frame = renderer.render_observed(settings, observer)?;
        // As in a program that renders frame after frame.
        renderer.recycle(frame.film);
        Ok(frame.stats)
    };
    let first = render()?;
    if warm_up.frames == 0 {
        let mut counted = vec![first.clone()];
        for _ in 1..frames {
            counted.push(render()?);
        }
        return Ok(FrameStats { first, warm_up: 0, counted });
    }
    let start = Instant::now();
    let mut done = 1;
    while done < warm_up.frames || start.elapsed() < warm_up.time {
        render()?;
        done += 1;
    }
    let counted = (0..frames).map(|_| render()).collect::<Result<_, _>>()?;
    Ok(FrameStats { first, warm_up: done, counted })
}

/// Records when the first submission that it observes ended.
#[derive(Debug, Default)]
pub struct FirstSubmission {
    /// Time at which the first submission ended; `None` before.
    pub ended: Option<Instant>,
}

impl RenderObserver for FirstSubmission {
    fn progress(&mut self, _: u64, _: u64) -> ControlFlow<()> {
        self.ended.get_or_insert_with(Instant::now);
        ControlFlow::Continue(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use trisect::device::cpu::Cpu;
    use trisect::scene::Scene;

    #[test]
    fn the_warm_up_does_not_count() {
        let scene = Scene::hello_world().unwrap();
        let mut renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
        let settings = Settings { width: 8, height: 4, samples: 2, ..Settings::of(&scene) };
        let mut first = FirstSubmission::default();
        let frames = measure(&mut renderer, &settings, WarmUp::of(2), 3, &mut first).unwrap();
        assert_eq!((frames.warm_up, frames.counted.len()), (2, 3));
        assert!(frames.counted.iter().all(|stats| stats.samples == 8 * 4 * 2));
        // Without a warm-up the first frame counts, too.
        let none = WarmUp { frames: 0, time: Duration::from_secs(9) };
        let cold = measure(&mut renderer, &settings, none, 2, &mut ()).unwrap();
        assert_eq!((cold.warm_up, cold.counted.len(), &cold.counted[0]), (0, 2, &cold.first));
        // 64 samples take less than 20 ms.
        let long = WarmUp { frames: 1, time: Duration::from_millis(20) };
        assert!(measure(&mut renderer, &settings, long, 1, &mut ()).unwrap().warm_up > 1);
        let ended = first.ended.unwrap();
        let again = first.progress(1, 1);
        assert_eq!((first.ended, again), (Some(ended), ControlFlow::Continue(())));
    }
}
