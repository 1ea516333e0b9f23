//! What the tests share: backends that may be missing, files, and statistics.
//!
//! Environment:
//!
//! * `REQUIRE_BACKENDS`, such as `cpu,wgpu`: backends whose absence is a failure; without it an absent one is skipped aloud.
//! * `TRISECT_ROOT`: the folder with `scenes/`, when tests run away from their source tree.
//! * `TRISECT_BIN`: the program, when it is not beside the test binaries.
//! * `TRISECT_WGPU_DEVICE`: index of the wgpu adapter; without it the best hardware one, else the first.

#![allow(clippy::panic, reason = "this is how a test fails")]

#[cfg(target_os = "linux")]
pub mod desktop;
pub mod fault_injecting_backend;
pub mod hosts;
pub mod mpi;
pub mod probe;
pub mod program;
pub mod renders;
pub mod report;
pub mod running;
pub mod statistics;
pub mod ulp;

use std::path::{Path, PathBuf};
use trisect::backend::wgpu::{Route, Wgpu};
use trisect::backend::{Backend, BackendError, cpu::Cpu, cuda::Cuda};
use trisect::render::Renderer;
use trisect::scene::Scene;

/// A backend that tests are instantiated for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BackendUnderTest {
    /// Threads.
    Cpu,
    /// wgpu with the kernels as they are.
    Wgpu,
    /// wgpu with the kernels through naga.
    WgpuNaga,
    /// CUDA.
    Cuda,
}

impl BackendUnderTest {
    /// Its name in `REQUIRE_BACKENDS`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Wgpu | Self::WgpuNaga => "wgpu",
            Self::Cuda => "cuda",
        }
    }

    fn open(self) -> Result<Box<dyn Backend>, BackendError> {
        let wgpu = |route| -> Result<Box<dyn Backend>, BackendError> {
            Ok(Box::new(Wgpu::open(Some(self.index()), route)?))
        };
        match self {
            Self::Cpu => Ok(Box::new(Cpu::open(None)?)),
            Self::Wgpu => wgpu(Route::PassThrough),
            Self::WgpuNaga => wgpu(Route::Naga),
            Self::Cuda => Ok(Box::new(Cuda::open(None)?)),
        }
    }

    /// A renderer of `scene`, or `None` where the backend is missing and not required; says so on standard error.
    ///
    /// # Panics
    ///
    /// If `REQUIRE_BACKENDS` names a backend that is missing, or a backend that is there fails.
    pub fn renderer(self, scene: &Scene) -> Option<Renderer> {
        let backend = self.available(self.open())?;
        match Renderer::new(backend, scene) {
            Ok(renderer) => {
                // Or a comparison with the CPU would compare its image with itself.
                assert_eq!(renderer.backend().device().backend, self.name(), "{self:?} is another backend");
                Some(renderer)
            }
            Err(error) => panic!("{self:?}: {error}"),
        }
    }

    /// What was opened, or `None` where it is missing and not required; says so on standard error.
    ///
    /// # Panics
    ///
    /// If `REQUIRE_BACKENDS` names it and it is missing.
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

/// Instantiates a generic test, `fn name(subject: Subject)`, for each backend, as tests of a module of its name.
#[macro_export]
macro_rules! for_each_backend {
    ($($test:ident),* $(,)?) => {$(
        mod $test {
            #[test]
            fn cpu() { super::$test($crate::BackendUnderTest::Cpu); }
            #[test]
            fn wgpu() { super::$test($crate::BackendUnderTest::Wgpu); }
            #[test]
            fn wgpu_naga() { super::$test($crate::BackendUnderTest::WgpuNaga); }
            #[test]
            fn cuda() { super::$test($crate::BackendUnderTest::Cuda); }
        }
    )*};
}

/// The folder with `scenes/`.
pub fn root() -> PathBuf {
    std::env::var_os("TRISECT_ROOT")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join(".."), PathBuf::from)
}

/// A scene of the project.
///
/// # Panics
///
/// If it cannot be read.
pub fn scene(name: &str) -> Scene {
    match Scene::load(&root().join("scenes").join(name)) {
        Ok(scene) => scene,
        Err(error) => panic!("{error}"),
    }
}

/// The program.
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
