//! Renders and measurements that run in each other's progress callbacks.

use crate::error::{self, Facts};
use pyo3::prelude::*;
use std::cell::Cell;

/// Maximum number of renders that run in each other's progress callbacks: each takes stack.
const MAX_NESTED: u32 = 16;

thread_local! {
    /// Number of renders and measurements of this thread that run.
    static NESTED: Cell<u32> = const { Cell::new(0) };
}

/// A render or measurement of this thread that runs.
pub struct Nested(());

impl Nested {
    /// Begins a render or measurement.
    ///
    /// # Errors
    ///
    /// `BusyError` if too many run in each other's progress callbacks.
    pub fn begin() -> PyResult<Self> {
        if NESTED.get() >= MAX_NESTED {
            let message =
                format!("{MAX_NESTED} renders run in each other's progress callbacks; return from them");
            return Err(error::raise("BusyError", message, Facts::default()));
        }
        NESTED.set(NESTED.get() + 1);
        Ok(Self(()))
    }
}

impl Drop for Nested {
    fn drop(&mut self) {
        NESTED.set(NESTED.get() - 1);
    }
}
