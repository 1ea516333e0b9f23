//! Launches of the kernels of a film's totals.

use super::misuse;
use bytemuck::{Zeroable, bytes_of};
use std::ops::Range;
use trisect_device::{BackendError, Buffer, Command, Device, Dispatch, MathMode, RowSet};
use trisect_kernels::entry_point;
use trisect_shared::totals::{SUMS, TotalsParams};

/// Returns the parameters of a launch over these rows of a share, of a chunk of `samples`.
pub(super) fn params((width, height): (u32, u32), rows: &RowSet, samples: &Range<u32>) -> TotalsParams {
    let (share_first_row, block_shift, block_gap) = rows.share();
    TotalsParams {
        width,
        height,
        first_row: rows.places().start,
        rows: rows.len(),
        share_first_row,
        block_shift,
        block_gap,
        first_sample: samples.start,
        samples: samples.len() as u32,
        sums: SUMS,
        ..TotalsParams::zeroed()
    }
}

/// Returns a launch of a kernel of the totals, of so many threads across and down. Integers have
/// one math build, and samples must not go elsewhere by the other.
pub(super) fn launch<'a>(
    name: &'static str,
    params: &'a TotalsParams,
    arrays: [&'a Buffer; 4],
    threads: (u32, u32),
) -> Result<Command<'a>, BackendError> {
    Ok(Command::Dispatch(Dispatch {
        entry_point: entry_point(name).ok_or_else(|| misuse("there is no such kernel"))?,
        math: MathMode::Precise,
        params: bytes_of(params),
        lengths: &[],
        arrays: arrays.to_vec(),
        threads,
    }))
}

/// Compiles kernels.
pub(super) fn compile(device: &mut dyn Device, names: &[&'static str]) -> Result<(), BackendError> {
    names.iter().try_for_each(|name| {
        let kernel = entry_point(name).ok_or_else(|| misuse("there is no such kernel"))?;
        device.compile(kernel, MathMode::Precise)
    })
}
