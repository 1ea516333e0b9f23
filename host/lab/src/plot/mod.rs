//! Charts: as data, and drawn as SVG and PNG. Used by the benchmarks and the trade-off lab.

mod chart;
mod draw;
mod ticks;

pub(crate) use chart::{Axis, Bars, Chart, Plot, Point, Scale, Series};
pub(crate) use draw::write;
pub(crate) use ticks::{Ticks, number};
