//! Filters of the denoiser on a CPU: pixels of a row, eight at a time, with the bits of the filters
//! for one pixel.

mod level;
mod neighbourhood;
mod planes;

pub use level::{atrous_rows, level_numbers};
pub use neighbourhood::{NeighbourhoodRow, neighbourhood_numbers};

#[cfg(test)]
mod tests;
