//! Frames after a warm-up.

use crate::Error;
use crate::render::{Observer, Renderer, Settings};
use crate::stats::RenderStats;
use std::ops::ControlFlow;
use std::time::Instant;

/// What frames took.
#[derive(Clone, Debug)]
pub struct Frames {
    /// The very first, with what happens once: mostly one of the warm-up.
    pub first: RenderStats,
    /// Those that count.
    pub counted: Vec<RenderStats>,
}

/// Renders `warm_up` frames, in which clocks settle, caches fill and the scheduler learns its pace, and then `frames` that count: what
/// each of those took. At least one is rendered. `observer` watches all of them.
///
/// # Errors
///
/// As [`Renderer::render`].
pub fn measure(
    renderer: &mut Renderer,
    settings: &Settings,
    warm_up: u32,
    frames: u32,
    observer: &mut dyn Observer,
) -> Result<Frames, Error> {
    let mut render = || renderer.render(settings, observer).map(|frame| frame.stats);
    let first = render()?;
    for _ in 1..warm_up {
        render()?;
    }
    let rest = if warm_up == 0 { frames.saturating_sub(1) } else { frames };
    let mut counted = if warm_up == 0 { vec![first.clone()] } else { Vec::new() };
    for _ in 0..rest {
        counted.push(render()?);
    }
    Ok(Frames { first, counted })
}

/// Notes when the first submission that it sees has ended.
#[derive(Debug, Default)]
pub struct FirstSubmission {
    /// Then; `None` before.
    pub ended: Option<Instant>,
}

impl Observer for FirstSubmission {
    fn progress(&mut self, _: u64, _: u64) -> ControlFlow<()> {
        self.ended.get_or_insert_with(Instant::now);
        ControlFlow::Continue(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use crate::backend::cpu::Cpu;
    use crate::scene::Scene;

    #[test]
    fn the_warm_up_does_not_count() {
        let scene = Scene::hello_world().unwrap();
        let mut renderer = Renderer::new(Box::new(Cpu::open(Some(1)).unwrap()), &scene).unwrap();
        let settings = Settings { width: 8, height: 4, samples: 2, ..scene.settings() };
        let mut first = FirstSubmission::default();
        let frames = measure(&mut renderer, &settings, 2, 3, &mut first).unwrap();
        assert_eq!(frames.counted.len(), 3);
        assert!(frames.counted.iter().all(|stats| stats.samples == 8 * 4 * 2));
        // Without a warm-up the first counts, too.
        let cold = measure(&mut renderer, &settings, 0, 2, &mut ()).unwrap();
        assert_eq!((cold.counted.len(), &cold.counted[0]), (2, &cold.first));
        let ended = first.ended.unwrap();
        let again = first.progress(1, 1);
        assert_eq!((first.ended, again), (Some(ended), ControlFlow::Continue(())));
    }
}
