//! What a rank renders next, and rendering it.

use super::piece::{Piece, Rendered, Travels};
use crate::Error;
use crate::film::{Film, Part, Rows};
use crate::render::{Renderer, Settings, chunks};
use std::ops::Range;
use std::time::{Duration, Instant};

/// What a piece should take to render: then it is worth a message, and little is lost with it.
const PIECE: Duration = Duration::from_millis(400);

/// Some samples of some rows.
#[derive(Clone, Debug)]
pub(super) struct Order {
    pub rows: Rows,
    /// Of each pixel.
    pub samples: Range<u32>,
    /// Rows of a piece that travels: what was rendered goes in so many.
    pub strip: u32,
}

/// What the rendering thread works with.
pub(super) struct Bench {
    pub renderer: Renderer,
    pub settings: Settings,
    pub travels: Travels,
    pub kernel: &'static str,
}

/// Renders an order, and hands out what travels of it.
pub(super) fn render(
    bench: &mut Bench,
    order: Order,
    out: &mut dyn FnMut((Piece, &'static str)),
) -> Result<(), Error> {
    let Bench { renderer, settings, travels, kernel } = bench;
    let (width, Order { rows, samples, strip }) = (settings.width, order);
    let parts: Vec<Range<u32>> = chunks(samples.clone()).collect();
    let by_chunk = matches!(travels, Travels::Sums | Travels::Guided);
    if by_chunk || parts.len() == 1 {
        for part in parts {
            let mut start = Instant::now();
            let sums = renderer.render_sums(settings, &rows, part.clone(), &mut ())?;
            *kernel = sums.kernel;
            let mut cost = (sums.device.as_secs_f64(), 0.0, sums.submissions as u32);
            for (rows, pixels) in strips(&rows, strip, width) {
                let guides = sums.guides.get(pixels.clone()).unwrap_or_default();
                let rendered = Rendered::Chunk(&sums.pixels[pixels], guides);
                let mut piece = Piece::new(&rows, part.clone(), width, *travels, &rendered, cost);
                piece.render_seconds = start.elapsed().as_secs_f64();
                out((piece, kernel));
                (start, cost) = (Instant::now(), (0.0, 0.0, 0));
            }
        }
        return Ok(());
    }
    let mut start = Instant::now();
    let mut cost = (0.0, 0.0, 0);
    let mut film = Film::new(width, rows.len());
    for part in parts {
        let sums = renderer.render_sums(settings, &rows, part.clone(), &mut ())?;
        *kernel = sums.kernel;
        cost.0 += sums.device.as_secs_f64();
        cost.2 += sums.submissions as u32;
        film.merge(&Part { rows: 0..rows.len(), samples: part }, sums.pixels)?;
    }
    for (rows, pixels) in strips(&rows, strip, width) {
        let rendered = Rendered::Totals(&film.pixels[pixels]);
        let mut piece = Piece::new(&rows, samples.clone(), width, *travels, &rendered, cost);
        piece.render_seconds = start.elapsed().as_secs_f64();
        out((piece, kernel));
        (start, cost) = (Instant::now(), (0.0, 0.0, 0));
    }
    Ok(())
}

/// Rows in strips, and their pixels among those of all.
fn strips(rows: &Rows, strip: u32, width: u32) -> impl Iterator<Item = (Rows, Range<usize>)> + '_ {
    let strip = strip.max(1);
    (0..rows.len()).step_by(strip as usize).map(move |first| {
        let end = first.saturating_add(strip).min(rows.len());
        (rows.part(first..end), first as usize * width as usize..end as usize * width as usize)
    })
}

/// Where a rank's work comes from.
pub(super) enum Source {
    /// Its own rows, so many at a time.
    Own { rows: Rows, next: u32, at_once: u32, whole: u32, samples: Range<u32>, strip: u32 },
    /// The root.
    Root { asked: bool, over: bool, ready: Option<Order> },
}

impl Source {
    pub fn is_over(&self) -> bool {
        match self {
            Self::Own { rows, next, samples, .. } => *next >= rows.len() || samples.start >= samples.end,
            Self::Root { over, ready, .. } => *over && ready.is_none(),
        }
    }

    pub fn take(&mut self) -> Option<Order> {
        match self {
            Self::Own { rows, next, at_once, samples, strip, .. }
                if *next < rows.len() && samples.start < samples.end =>
            {
                let rows = rows.part(*next..next.saturating_add(*at_once));
                let order = Order { rows, samples: samples.clone(), strip: *strip };
                *next += order.rows.len();
                Some(order)
            }
            Self::Own { .. } => None,
            Self::Root { ready, .. } => ready.take(),
        }
    }

    /// Fits the next piece to the speed of the last.
    pub fn learn(&mut self, piece: &Piece) {
        let Self::Own { at_once, whole, .. } = self else { return };
        let rows = f64::from(piece.rows.len()) * PIECE.as_secs_f64() / piece.render_seconds.max(1e-6);
        // Whole blocks, so that tiles stay whole, too.
        *at_once = (rows.min(f64::from(u32::MAX / 2)) as u32 / *whole * *whole).max(*whole);
    }
}

/// Hands over what the root says.
pub(super) fn give(source: &mut Source, rows: Option<Range<u32>>, samples: u32) {
    if let (Source::Root { ready, .. }, Some(rows)) = (source, rows) {
        *ready = Some(Order { rows: rows.into(), samples: 0..samples, strip: u32::MAX });
    }
}
