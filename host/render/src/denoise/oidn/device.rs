//! Device of Open Image Denoise with its buffers and filters, which are released when dropped.
//! Every step asks the library for its error.

use super::OidnError;
use super::library::{Handle, Library};
use std::ffi::{CStr, c_int};
use std::marker::PhantomData;

/// Type of the device that the library considers the fastest.
const DEFAULT: c_int = 0;
/// Type of a device that runs on the processor.
const CPU: c_int = 1;
/// Names of the types of devices, from [`DEFAULT`] on.
const TYPES: [&str; 6] = ["default", "CPU", "SYCL", "CUDA", "HIP", "Metal"];

/// Least time that a filter takes; version 2.3 has it, and older ones refuse it.
const FAST: c_int = 4;

/// Format of pixels of three `f32`.
const FLOAT3: c_int = 3;
/// Bytes of a pixel.
const PIXEL: usize = size_of::<[f32; 3]>();

/// Kind of image that a filter denoises.
#[derive(Clone, Copy)]
pub(super) enum Mode {
    /// Albedo or normal alone, in the least time.
    Feature,
    /// Radiance of any range, by features without noise.
    Radiance,
}

/// Device that runs filters.
pub(super) struct Device<'lib> {
    library: &'lib Library,
    handle: Handle,
    /// Major version of the library, minor version, and patch.
    pub version: [c_int; 3],
    /// Name of the type of the device.
    pub kind: &'static str,
}

impl<'lib> Device<'lib> {
    /// Opens the device that the library considers the fastest. One that runs on the processor has
    /// `threads` threads, or by default as many as the library chooses.
    pub fn open(library: &'lib Library, threads: Option<usize>) -> Result<Self, OidnError> {
        let action = "opening a device";
        // SAFETY: the type is one of the library's.
        let handle = unsafe { (library.functions.new_device)(DEFAULT) };
        if handle.is_null() {
            let message = library.error(handle).unwrap_or_else(|| "there is none".to_owned());
            return Err(OidnError::Failed { action, message });
        }
        let mut device = Self { library, handle, version: [0; 3], kind: TYPES[0] };
        device.version = [c"versionMajor", c"versionMinor", c"versionPatch"].map(|name| device.int(name));
        let [major, ..] = device.version;
        if major < 2 {
            let (path, reason) = (library.path.clone(), format!("it is version {major}"));
            return Err(OidnError::NotVersion2 { path, reason });
        }
        let kind = device.int(c"type");
        device.kind =
            usize::try_from(kind).ok().and_then(|kind| TYPES.get(kind)).copied().unwrap_or("device");
        if let (CPU, Some(threads)) = (kind, threads) {
            let threads = c_int::try_from(threads).unwrap_or(c_int::MAX);
            // SAFETY: the device is open, and the name ends with a zero.
            unsafe { (library.functions.set_device_int)(handle, c"numThreads".as_ptr(), threads) };
        }
        // SAFETY: the device is open.
        unsafe { (library.functions.commit_device)(handle) };
        device.check(action)?;
        Ok(device)
    }

    /// Returns a number that the device states.
    fn int(&self, name: &CStr) -> c_int {
        // SAFETY: the device is open, and the name ends with a zero.
        unsafe { (self.library.functions.get_device_int)(self.handle, name.as_ptr()) }
    }

    /// Returns the error that the library has noted since the last call.
    fn check(&self, action: &'static str) -> Result<(), OidnError> {
        match self.library.error(self.handle) {
            Some(message) => Err(OidnError::Failed { action, message }),
            None => Ok(()),
        }
    }

    /// Copies pixels to a buffer of the device.
    pub fn upload(&self, pixels: &[[f32; 3]]) -> Result<Buffer<'_>, OidnError> {
        let action = "copying an image to the device";
        let bytes = size_of_val(pixels);
        // SAFETY: the device is open.
        let handle = unsafe { (self.library.functions.new_buffer)(self.handle, bytes) };
        self.check(action)?;
        if handle.is_null() {
            return Err(OidnError::Failed { action, message: "there is no buffer".to_owned() });
        }
        let buffer = Buffer { library: self.library, handle, pixels: pixels.len(), device: PhantomData };
        // SAFETY: the buffer and the slice both have so many bytes.
        unsafe { (self.library.functions.write_buffer)(handle, 0, bytes, pixels.as_ptr().cast()) };
        self.check(action)?;
        Ok(buffer)
    }

    /// Copies a buffer of the device to pixels, of which there must be as many.
    pub fn download(&self, buffer: &Buffer, pixels: &mut [[f32; 3]]) -> Result<(), OidnError> {
        let action = "copying an image from the device";
        if pixels.len() != buffer.pixels {
            return Err(OidnError::Failed { action, message: "it is of another size".to_owned() });
        }
        let (bytes, to) = (size_of_val(pixels), pixels.as_mut_ptr().cast());
        // SAFETY: the buffer and the slice both have so many bytes.
        unsafe { (self.library.functions.read_buffer)(buffer.handle, 0, bytes, to) };
        self.check(action)
    }

    /// Runs a filter for path-traced images over images of one size, of which "output" is written.
    pub fn run(
        &self,
        action: &'static str,
        images: &[(&CStr, &Buffer)],
        [width, height]: [usize; 2],
        mode: Mode,
    ) -> Result<(), OidnError> {
        let functions = &self.library.functions;
        if images.iter().any(|(_, buffer)| Some(buffer.pixels) != width.checked_mul(height)) {
            return Err(OidnError::Failed { action, message: "an image is of another size".to_owned() });
        }
        // SAFETY: the device is open, and the name ends with a zero.
        let handle = unsafe { (functions.new_filter)(self.handle, c"RT".as_ptr()) };
        self.check(action)?;
        if handle.is_null() {
            return Err(OidnError::Failed { action, message: "there is no filter".to_owned() });
        }
        let filter = Filter { library: self.library, handle };
        for (name, image) in images {
            // SAFETY: filter and buffer are of this device, and the buffer has a pixel for each of
            // the image, row by row without gaps.
            unsafe {
                (functions.set_filter_image)(
                    filter.handle,
                    name.as_ptr(),
                    image.handle,
                    FLOAT3,
                    width,
                    height,
                    0,
                    PIXEL,
                    PIXEL * width,
                );
            }
        }
        match mode {
            Mode::Feature if self.version >= [2, 3, 0] => {
                // SAFETY: the filter exists, and the name ends with a zero.
                unsafe { (functions.set_filter_int)(filter.handle, c"quality".as_ptr(), FAST) };
            }
            Mode::Feature => {}
            Mode::Radiance => {
                for name in [c"hdr", c"cleanAux"] {
                    // SAFETY: the filter exists, and the name ends with a zero.
                    unsafe { (functions.set_filter_bool)(filter.handle, name.as_ptr(), true) };
                }
            }
        }
        // SAFETY: the filter exists.
        unsafe { (functions.commit_filter)(filter.handle) };
        self.check(action)?;
        // SAFETY: the filter is committed, and its buffers live until it is released.
        unsafe { (functions.execute_filter)(filter.handle) };
        self.check(action)
    }
}

impl Drop for Device<'_> {
    fn drop(&mut self) {
        // SAFETY: the device is open, and its buffers and filters borrow it.
        unsafe { (self.library.functions.release_device)(self.handle) };
    }
}

/// Image on a device.
pub(super) struct Buffer<'device> {
    library: &'device Library,
    handle: Handle,
    pixels: usize,
    device: PhantomData<&'device Device<'device>>,
}

impl Drop for Buffer<'_> {
    fn drop(&mut self) {
        // SAFETY: the buffer exists, and no filter runs.
        unsafe { (self.library.functions.release_buffer)(self.handle) };
    }
}

/// Filter of a device.
struct Filter<'device> {
    library: &'device Library,
    handle: Handle,
}

impl Drop for Filter<'_> {
    fn drop(&mut self) {
        // SAFETY: the filter exists, and has ended.
        unsafe { (self.library.functions.release_filter)(self.handle) };
    }
}
