//! Copies of a scene's arrays to a device, into arrays of the scene before where that is possible.

use super::misuse;
use bytemuck::Pod;
use trisect_device::{BackendError, Buffer, Command, Device, LentRecords};
use trisect_scene::SharedVec;

/// Array of a scene that was written to a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WrittenArray {
    /// Content of the array, such as "materials".
    pub name: &'static str,
    /// Number of bytes.
    pub bytes: u64,
}

/// Array of a scene that goes to a device.
pub(super) struct SceneArray<'a> {
    bytes: &'a [u8],
    /// Records that a device may read in place.
    lent: Option<LentRecords>,
    /// "the scene's" and a name.
    what: &'static str,
    /// Array of the scene before.
    old: Option<Buffer>,
    /// True if `old` has the same content.
    is_same: bool,
}

impl<'a> SceneArray<'a> {
    /// Returns an array that the device copies. `what` is "the scene's" and a name; `old` is the
    /// array of the scene before, which `is_same` if it has the same content.
    pub fn of<T: Pod>(records: &'a [T], what: &'static str, old: Option<Buffer>, is_same: bool) -> Self {
        Self { bytes: bytemuck::cast_slice(records), lent: None, what, old, is_same }
    }

    /// Returns an array that the device reads in place if it can, and copies otherwise.
    pub fn lent<T: Pod + Send + Sync>(
        records: &'a SharedVec<T>,
        what: &'static str,
        old: Option<Buffer>,
        is_same: bool,
    ) -> Self {
        Self { lent: Some(LentRecords::of(records.shared())), ..Self::of(records, what, old, is_same) }
    }

    /// Returns whether the memory of the old array holds the new one.
    fn fits(&self) -> bool {
        let holds = |old: &Buffer| old.bytes() == self.bytes.len() as u64 && !old.is_shared();
        !self.bytes.is_empty() && self.old.as_ref().is_some_and(holds)
    }

    /// Returns whether the old array is there and has the same content.
    fn stays(&self) -> bool {
        self.is_same && self.old.is_some()
    }
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

    /// Returns an array on the device: that of the scene before if it has the same content, or its
    /// memory if that has the size and no other stream reads it, or new memory.
    pub fn write(&mut self, mut array: SceneArray<'_>) -> Result<Buffer, BackendError> {
        if let Some(adopted) = array.lent.as_ref().and_then(|lent| self.device.adopt(lent)) {
            return Ok(adopted);
        }
        let (stays, fits) = (array.stays(), array.fits());
        // An array that is not used again is freed before the other one is allocated.
        match array.old.take().filter(|_| stays || fits) {
            Some(old) if stays => Ok(old),
            Some(old) => self.copy(&array, &old).map(|()| old),
            None => {
                self.count(&array);
                self.device.upload(array.bytes, array.what)
            }
        }
    }

    /// Returns arrays on the device that kernels may read from one buffer, as `write` does. If one
    /// of them needs new memory, all do: the device copies those whose content is the same, and
    /// then holds the old ones, too, until this returns.
    pub fn write_joined<const N: usize>(
        &mut self,
        mut arrays: [SceneArray<'_>; N],
        what: &'static str,
    ) -> Result<[Buffer; N], BackendError> {
        let mut all = Vec::new();
        if !self.device.joins_arrays() || arrays.iter().all(|array| array.stays() || array.fits()) {
            for array in arrays {
                all.push(self.write(array)?);
            }
        } else {
            for array in &mut arrays {
                array.old = array.old.take().filter(|_| array.is_same);
            }
            let bytes = arrays.each_ref().map(|array| array.bytes.len() as u64);
            let new = self.device.allocate_joined(&bytes, what)?;
            let mut copies = Vec::new();
            for (array, new) in arrays.iter().zip(&new) {
                match &array.old {
                    Some(old) => copies.push(Command::Copy { from: old, to: new, bytes: new.bytes() }),
                    None => self.copy(array, new)?,
                }
            }
            copies.retain(|copy| !matches!(copy, Command::Copy { bytes: 0, .. }));
            if !copies.is_empty() {
                // SAFETY: no launch; nothing else uses the new memory.
                unsafe { self.device.run(copies) }?;
            }
            all = new;
        }
        all.try_into().map_err(|_| misuse("a device has allocated another number of arrays"))
    }

    /// Copies an array to memory of its size.
    fn copy(&mut self, array: &SceneArray<'_>, to: &Buffer) -> Result<(), BackendError> {
        self.count(array);
        self.device.write(to, 0, array.bytes)
    }

    fn count(&mut self, array: &SceneArray<'_>) {
        if !array.bytes.is_empty() {
            let name = array.what.strip_prefix("the scene's ").unwrap_or(array.what);
            self.written.push(WrittenArray { name, bytes: array.bytes.len() as u64 });
        }
    }
}
