//! Support code of the tests: backends that may be missing, the program, files and statistics.
//!
//! Environment variables:
//!
//! * `REQUIRE_BACKENDS`, such as `cpu,wgpu`: backends whose absence is a failure. Others are
//!   skipped with a message.
//! * `TRISECT_ROOT`: the folder with `scenes/`, for tests that run without their source tree.
//! * `TRISECT_BIN`: the program, if it is not beside the test binaries.
//! * `TRISECT_WGPU_DEVICE`: index of the wgpu adapter; default: the first hardware adapter, else
//!   the first adapter.

#![allow(clippy::panic, reason = "this is how a test fails")]

pub mod counting_backend;
#[cfg(target_os = "linux")]
pub mod desktop;
pub mod fault_injecting_backend;
mod file_drop;
pub mod hosts;
pub mod models;
pub mod mpi;
pub mod oidn;
pub mod probe;
pub mod program;
pub mod renders;
pub mod report;
mod reused_device;
pub mod running;
pub mod statistics;
pub mod ulp;

use reused_device::ReusedDevice;
use std::path::{Path, PathBuf};
use trisect::device::wgpu::{Route, Wgpu};
use trisect::device::{BackendError, Device, cpu::Cpu, cuda::Cuda};
use trisect::render::Renderer;
use trisect::scene::Scene;

/// A backend that tests are instantiated for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BackendUnderTest {
    /// CPU threads.
    Cpu,
    /// wgpu that passes the SPIR-V kernels through.
    Wgpu,
    /// wgpu with kernels that naga translates.
    WgpuNaga,
    /// wgpu with kernels in WGSL, as browsers get them.
    WgpuWgsl,
    /// CUDA.
    Cuda,
}

impl BackendUnderTest {
    /// Returns its name in `REQUIRE_BACKENDS`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Wgpu | Self::WgpuNaga | Self::WgpuWgsl => "wgpu",
            Self::Cuda => "cuda",
        }
    }

    fn open(self) -> Result<Box<dyn Device>, BackendError> {
        let wgpu = |route| ReusedDevice::take(self, || Ok(Box::new(Wgpu::open(Some(self.index()), route)?)));
        match self {
            Self::Cpu => Ok(Box::new(Cpu::open(None)?)),
            Self::Wgpu => wgpu(Route::PassThrough),
            Self::WgpuNaga => wgpu(Route::Naga),
            Self::WgpuWgsl => wgpu(Route::Wgsl),
            Self::Cuda => Ok(Box::new(Cuda::open(None)?)),
        }
    }

    /// Returns a renderer of `scene`, or `None` with a message on standard error where the backend
    /// is missing and not required.
    ///
    /// # Panics
    ///
    /// If `REQUIRE_BACKENDS` names a missing backend, or an available backend fails.
    pub fn renderer(self, scene: &Scene) -> Option<Renderer> {
        let backend = self.available(self.open())?;
        match Renderer::new(backend, scene) {
            Ok(renderer) => {
                // If the CPU had been opened in place of this backend, a comparison with the CPU
                // would compare an image with itself.
                assert_eq!(renderer.device().info().backend, self.name(), "{self:?} is another backend");
                Some(renderer)
            }
            Err(error) => panic!("{self:?}: {error}"),
        }
    }

    /// Returns the opened device, or `None` with a message on standard error where the backend is
    /// missing and not required.
    ///
    /// # Panics
    ///
    /// If `REQUIRE_BACKENDS` names the missing backend.
    pub fn available<T>(self, opened: Result<T, BackendError>) -> Option<T> {
        let required = std::env::var("REQUIRE_BACKENDS").unwrap_or_default();
        match opened {
            Ok(opened) => Some(opened),
            Err(error) if required.split(',').any(|name| name.trim() == self.name()) => {
                panic!("REQUIRE_BACKENDS names {}, but: {error}", self.name())
            }
            Err(error) => {
                eprintln!("SKIPPED for {self:?}: {error}");
                None
            }
        }
    }
}

/// Instantiates a test, `fn name(subject: BackendUnderTest)`, in a module of its name: a function
/// for each name and backend.
#[macro_export]
macro_rules! instantiate {
    ($test:ident: $($name:ident $backend:ident),*) => {
        mod $test {
            $(
                #[test]
                fn $name() { super::$test($crate::BackendUnderTest::$backend); }
            )*
        }
    };
}

/// Instantiates a test for each backend. Tests of what kernels compute are for each backend, those
/// of how kernels are translated [for each route](crate::for_each_route).
#[macro_export]
macro_rules! for_each_backend {
    ($($test:ident),* $(,)?) => {$($crate::instantiate!($test: cpu Cpu, wgpu Wgpu, cuda Cuda);)*};
}

/// Instantiates a test for each backend, and for wgpu by both routes: with the SPIR-V of the
/// kernels, and with naga's translation of it.
#[macro_export]
macro_rules! for_each_route {
    ($($test:ident),* $(,)?) => {
        $($crate::instantiate!($test: cpu Cpu, wgpu Wgpu, wgpu_naga WgpuNaga, cuda Cuda);)*
    };
}

/// Instantiates a test [for each route](crate::for_each_route), and for wgpu with WGSL.
#[macro_export]
macro_rules! for_each_translation {
    ($($test:ident),* $(,)?) => {$(
        $crate::instantiate!($test: cpu Cpu, wgpu Wgpu, wgpu_naga WgpuNaga, wgpu_wgsl WgpuWgsl, cuda Cuda);
    )*};
}

/// Returns the folder with `scenes/`.
pub fn root() -> PathBuf {
    std::env::var_os("TRISECT_ROOT")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join(".."), PathBuf::from)
}

/// Returns the path of a scene of the project: in `scenes/`, or in `tests/scenes/` if it is one of
/// the tests alone.
pub fn scene_path(name: &str) -> PathBuf {
    let shared = root().join("scenes").join(name);
    if shared.exists() { shared } else { root().join("tests/scenes").join(name) }
}

/// Loads a scene of the project.
///
/// # Panics
///
/// If it cannot be read.
pub fn scene(name: &str) -> Scene {
    match Scene::load(&scene_path(name)) {
        Ok(scene) => scene,
        Err(error) => panic!("{error}"),
    }
}

/// Returns the path of the program.
pub fn binary() -> PathBuf {
    if let Some(path) = std::env::var_os("TRISECT_BIN") {
        return path.into();
    }
    // target/release/deps/test-hash → target/release/trisect
    let mut path = std::env::current_exe().unwrap_or_default();
    path.pop();
    if path.ends_with("deps") {
        path.pop();
    }
    path.join(format!("trisect{}", std::env::consts::EXE_SUFFIX))
}
