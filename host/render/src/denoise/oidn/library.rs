//! The library of Open Image Denoise, loaded at run time, and its functions.

use super::{OidnError, VARIABLE};
#[cfg(target_family = "wasm")]
use absent::{Error as LoadError, Library as Loaded};
#[cfg(not(target_family = "wasm"))]
use libloading::{Error as LoadError, Library as Loaded};
use std::ffi::{CStr, OsStr, c_char, c_int, c_void};
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Names of the library, in the order in which they are tried.
pub(super) const NAMES: &[&str] = if cfg!(windows) {
    &["OpenImageDenoise.dll"]
} else if cfg!(target_vendor = "apple") {
    &["libOpenImageDenoise.2.dylib", "libOpenImageDenoise.dylib"]
} else {
    &["libOpenImageDenoise.so.2", "libOpenImageDenoise.so"]
};

/// Folders below one that the variable names, in which a release has the library.
const FOLDERS: [&str; 4] = ["", "lib", "lib64", "bin"];

/// Device, buffer or filter of the library.
pub(super) type Handle = *mut c_void;

/// Declares the functions of the library that are called, and loads them.
macro_rules! functions {
    ($($field:ident = $name:literal: fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// Functions of the library.
        pub(super) struct Functions {
            $(pub $field: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Functions {
            /// Loads the functions. Fails with the name of the first that is missing.
            ///
            /// # Safety
            ///
            /// Functions of these names in the library have the types of Open Image Denoise 2.
            unsafe fn load(library: &Loaded) -> Result<Self, &'static str> {
                $(
                    // SAFETY: the caller's promise.
                    let $field = *unsafe {
                        library.get::<unsafe extern "C" fn($($argument),*) $(-> $result)?>($name)
                    }
                    .map_err(|_| $name)?;
                )*
                Ok(Self { $($field),* })
            }
        }
    };
}

functions! {
    new_device = "oidnNewDevice": fn(c_int) -> Handle;
    release_device = "oidnReleaseDevice": fn(Handle);
    commit_device = "oidnCommitDevice": fn(Handle);
    set_device_int = "oidnSetDeviceInt": fn(Handle, *const c_char, c_int);
    get_device_int = "oidnGetDeviceInt": fn(Handle, *const c_char) -> c_int;
    get_device_error = "oidnGetDeviceError": fn(Handle, *mut *const c_char) -> c_int;
    new_buffer = "oidnNewBuffer": fn(Handle, usize) -> Handle;
    release_buffer = "oidnReleaseBuffer": fn(Handle);
    write_buffer = "oidnWriteBuffer": fn(Handle, usize, usize, *const c_void);
    read_buffer = "oidnReadBuffer": fn(Handle, usize, usize, *mut c_void);
    new_filter = "oidnNewFilter": fn(Handle, *const c_char) -> Handle;
    release_filter = "oidnReleaseFilter": fn(Handle);
    set_filter_image = "oidnSetFilterImage":
        fn(Handle, *const c_char, Handle, c_int, usize, usize, usize, usize, usize);
    set_filter_int = "oidnSetFilterInt": fn(Handle, *const c_char, c_int);
    set_filter_bool = "oidnSetFilterBool": fn(Handle, *const c_char, bool);
    commit_filter = "oidnCommitFilter": fn(Handle);
    execute_filter = "oidnExecuteFilter": fn(Handle);
}

/// Loaded library.
pub(super) struct Library {
    /// Its functions.
    pub functions: Functions,
    /// File, or the name by which the loader found it.
    pub path: String,
    /// Never unloaded: threads of the library may still run.
    _loaded: ManuallyDrop<Loaded>,
}

impl Library {
    /// Returns the library that [`VARIABLE`] names, or else the one that the loader finds. The
    /// first call that finds it decides for the whole process.
    pub fn shared() -> Result<&'static Self, OidnError> {
        static SHARED: OnceLock<Library> = OnceLock::new();
        match SHARED.get() {
            Some(library) => Ok(library),
            None => {
                let named = std::env::var_os(VARIABLE).filter(|value| !value.is_empty());
                let library = Self::load(named.as_deref())?;
                Ok(SHARED.get_or_init(|| library))
            }
        }
    }

    /// Loads the library from `named`, a file or a folder, or else by the loader's own search.
    pub fn load(named: Option<&OsStr>) -> Result<Self, OidnError> {
        let Some(named) = named.map(Path::new) else {
            return Self::first_of(NAMES.iter().map(PathBuf::from));
        };
        let inside = |folder: &'static str| NAMES.iter().map(move |name| Path::new(folder).join(name));
        let files: Vec<PathBuf> = match named.is_dir() {
            true => FOLDERS.into_iter().flat_map(inside).map(|file| named.join(file)).collect(),
            false => vec![named.to_owned()],
        };
        let present: Vec<PathBuf> = files.iter().filter(|file| file.exists()).cloned().collect();
        if present.is_empty() {
            let searched = match named.is_dir() {
                true => format!("{VARIABLE} is {}, which has no {}", named.display(), NAMES.join(" or ")),
                false => format!("{VARIABLE} is {}, which does not exist", named.display()),
            };
            return Err(OidnError::NotFound { searched });
        }
        Self::first_of(present)
    }

    /// Loads the first of the files that the loader accepts.
    fn first_of(files: impl IntoIterator<Item = PathBuf>) -> Result<Self, OidnError> {
        let mut refused = Vec::new();
        for file in files {
            // SAFETY: its initialisers are those of a library that user or system installed.
            match unsafe { Loaded::new(&file) } {
                Ok(loaded) => return Self::of(loaded, file.display().to_string()),
                Err(error) => refused.push(describe(&file, &error)),
            }
        }
        Err(OidnError::NotFound { searched: refused.join("; ") })
    }

    fn of(loaded: Loaded, path: String) -> Result<Self, OidnError> {
        // SAFETY: the name of each function is the library's own, with its prefix.
        let functions = match unsafe { Functions::load(&loaded) } {
            Ok(functions) => functions,
            Err(missing) => {
                // SAFETY: the function is not called.
                let is_first = unsafe { loaded.get::<unsafe extern "C" fn()>("oidnGetDevice1i") }.is_ok();
                let reason = match is_first {
                    true => "it is version 1".to_owned(),
                    false => format!("it has no function {missing}"),
                };
                return Err(OidnError::NotVersion2 { path, reason });
            }
        };
        Ok(Self { functions, path, _loaded: ManuallyDrop::new(loaded) })
    }

    /// Returns the error that a device has noted since the last call, with the library's message.
    /// Without a device it is that of the calling thread.
    pub fn error(&self, device: Handle) -> Option<String> {
        let mut message = std::ptr::null();
        // SAFETY: `device` is a device or null, and the message is written.
        let code = unsafe { (self.functions.get_device_error)(device, &raw mut message) };
        if code == 0 {
            return None;
        }
        if message.is_null() {
            return Some(format!("error {code}"));
        }
        // SAFETY: the library returns a text that lives until the next error.
        Some(unsafe { CStr::from_ptr(message) }.to_string_lossy().into_owned())
    }
}

/// Returns why the loader refused a file, in one line. On some systems the loader's message is the
/// source of the error.
fn describe(file: &Path, error: &LoadError) -> String {
    let name = file.display().to_string();
    let text = std::error::Error::source(error).map_or_else(|| error.to_string(), ToString::to_string);
    if text.contains(&name) { text } else { format!("{name}: {text}") }
}

/// Loader of a system that loads no libraries: a browser.
#[cfg(target_family = "wasm")]
mod absent {
    use std::path::Path;

    /// Refusal to load a library.
    #[derive(Debug, thiserror::Error)]
    #[error("a browser loads no libraries")]
    pub struct Error;

    /// Library, of which there is none.
    pub enum Library {}

    impl Library {
        /// Returns why no library is loaded.
        pub unsafe fn new(_: &Path) -> Result<Self, Error> {
            Err(Error)
        }

        /// Returns no function: there is no library.
        pub unsafe fn get<T>(&self, _: &str) -> Result<&T, Error> {
            match *self {}
        }
    }
}
