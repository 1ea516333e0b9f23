//! Copies of a scene's arrays to a device, into arrays of the scene before where that is possible.

use bytemuck::Pod;
use trisect_device::{BackendError, Buffer, Device, LentRecords};
use trisect_scene::SharedVec;

/// Array of a scene that was written to a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WrittenArray {
    /// Content of the array, such as "materials".
    pub name: &'static str,
    /// Number of bytes.
    pub bytes: u64,
}

/// Writes arrays to a device, and counts what it writes.
pub(super) struct SceneWriter<'a> {
    device: &'a mut dyn Device,
    /// Arrays that were written.
    pub written: Vec<WrittenArray>,
}

impl<'a> SceneWriter<'a> {
    pub fn new(device: &'a mut dyn Device) -> Self {
        Self { device, written: Vec::new() }
    }

    /// Copies records to the device: into `old`, if that has the size and no other stream reads it.
    /// If `old` `is_same`, it is returned as it is. `what` is "the scene's" and a name.
    pub fn upload<T: Pod>(
        &mut self,
        records: &[T],
        what: &'static str,
        old: Option<Buffer>,
        is_same: bool,
    ) -> Result<Buffer, BackendError> {
        let bytes: &[u8] = bytemuck::cast_slice(records);
        let fits = |old: &Buffer| old.bytes() == bytes.len() as u64 && !bytes.is_empty() && !old.is_shared();
        // An array that is not used again is freed before the other one is allocated.
        let old = match old {
            Some(old) if is_same => return Ok(old),
            other => other.filter(fits),
        };
        if !bytes.is_empty() {
            let name = what.strip_prefix("the scene's ").unwrap_or(what);
            self.written.push(WrittenArray { name, bytes: bytes.len() as u64 });
        }
        match old {
            Some(old) => {
                self.device.write(&old, 0, bytes)?;
                Ok(old)
            }
            None => self.device.upload(bytes, what),
        }
    }

    /// Gives records to the device: their own memory if it reads that in place, and a copy
    /// otherwise, as [`upload`](Self::upload) does.
    pub fn give<T: Pod + Send + Sync>(
        &mut self,
        records: &SharedVec<T>,
        what: &'static str,
        old: Option<Buffer>,
        is_same: bool,
    ) -> Result<Buffer, BackendError> {
        match self.device.adopt(&LentRecords::of(records.shared())) {
            Some(buffer) => Ok(buffer),
            None => self.upload(records, what, old, is_same),
        }
    }
}
