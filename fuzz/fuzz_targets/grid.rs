//! Fuzz target: grids of densities.

#![no_main]

use libfuzzer_sys::fuzz_target;
use trisect::scene::medium::DensityGrid;
use trisect_fuzz::bounded;

fuzz_target!(|bytes: &[u8]| {
    bounded(bytes.len(), || {
        if let Ok(grid) = DensityGrid::parse(bytes, "fuzz.vol") {
            assert_eq!(grid.to_bytes(), bytes);
        }
    });
});
