//! Charts: as data, and drawn.

mod chart;
mod draw;
mod ticks;

pub(crate) use chart::{Axis, Bars, Chart, Plot, Point, Series};
pub(crate) use draw::{svg, write};
pub(crate) use ticks::number;
