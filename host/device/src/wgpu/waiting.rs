//! Waits for the device: a thread blocks, a browser handles events meanwhile.

use super::adapter::Gpu;
use crate::BackendError;
use std::fmt::Display;
use std::sync::mpsc::Receiver;

fn failed(action: &'static str, error: &dyn Display) -> BackendError {
    BackendError::Device { backend: "wgpu", action, message: error.to_string() }
}

#[cfg(not(target_family = "wasm"))]
impl Gpu {
    /// Waits for all submitted work.
    pub fn wait(&self, action: &'static str) -> Result<(), BackendError> {
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| failed(action, &error))?;
        self.check(action)
    }

    /// Waits for all submitted work, after which a callback has sent a value.
    pub fn wait_for<T>(&self, callback: &Receiver<T>, action: &'static str) -> Result<T, BackendError> {
        self.wait(action)?;
        callback.recv().map_err(|error| failed(action, &error))
    }
}

impl Gpu {
    /// Returns an error that the last calls made, after waiting for it in a browser, where errors
    /// arrive later.
    pub fn settle(&self, action: &'static str) -> Result<(), BackendError> {
        if cfg!(target_family = "wasm") { self.wait(action) } else { self.check(action) }
    }
}

#[cfg(target_family = "wasm")]
impl Gpu {
    /// Waits for all submitted work.
    pub fn wait(&self, action: &'static str) -> Result<(), BackendError> {
        let (sender, receiver) = std::sync::mpsc::channel();
        self.queue.on_submitted_work_done(move || {
            let _ = sender.send(());
        });
        self.wait_for(&receiver, action)?;
        self.check(action)
    }

    /// Waits until a callback has sent a value.
    pub fn wait_for<T>(&self, callback: &Receiver<T>, action: &'static str) -> Result<T, BackendError> {
        use std::sync::mpsc::TryRecvError;
        loop {
            match callback.try_recv() {
                Ok(value) => {
                    // Errors arrive after the call that made them.
                    self.check(action)?;
                    return Ok(value);
                }
                // A device that was lost may call no one.
                Err(TryRecvError::Empty) => self.check(action)?,
                Err(error) => return Err(failed(action, &error)),
            }
            super::futures::handle_events();
        }
    }
}
