//! A CUDA device that is really lost or full: the error is typed, nothing that was rendered is
//! lost, and the CPU continues with the same bits. Needs a CUDA device; `fallback.rs` simulates the
//! same with a failing backend.
//!
//! The test runs in a process of its own, whose context nothing else uses. While it fills the
//! device's memory, other tests on the device may fail; `--test-threads=1` prevents that.
#![allow(clippy::unwrap_used, reason = "this is how a test fails")]
#![allow(unsafe_code, reason = "launches a kernel that crashes")]

use cudarc::driver::{CudaContext, LaunchConfig, PushKernelArg, result};
use cudarc::nvrtc::Ptx;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use trisect::Error;
use trisect::device::BackendError;
use trisect::film::Film;
use trisect::render::{FilmObserver, Renderer, Settings};
use trisect_tests::{BackendUnderTest, renders, scene};

/// A kernel that writes to address 0, after which the driver gives up the context with everything
/// in it.
const CRASHING_PTX: &str = "
.version 7.0
.target sm_61
.address_size 64
.visible .entry fatal(.param .u64 at)
{
    .reg .u64 %address;
    .reg .u32 %value;
    ld.param.u64 %address, [at];
    mov.u32 %value, 1;
    st.global.u32 [%address], %value;
    ret;
}
";

/// Destroys the CUDA context of the process after some parts.
struct ContextDestroyer {
    context: Arc<CudaContext>,
    left: AtomicU32,
}

impl FilmObserver for ContextDestroyer {
    fn part_added(&self, _: &Film) {
        if self.left.fetch_sub(1, Ordering::Relaxed) == 1 {
            self.context.bind_to_thread().unwrap();
            let fatal = self
                .context
                .load_module(Ptx::from_src(CRASHING_PTX))
                .unwrap()
                .load_function("fatal")
                .unwrap();
            let stream = self.context.new_stream().unwrap();
            let shape = LaunchConfig { grid_dim: (1, 1, 1), block_dim: (1, 1, 1), shared_mem_bytes: 0 };
            // SAFETY: affects only this test's process, whose context it destroys.
            unsafe { stream.launch_builder(&fatal).arg(&0u64).launch(shape) }.unwrap();
            let _ = stream.synchronize();
        }
    }
}

fn cuda(scene: &trisect::scene::Scene) -> Option<Renderer> {
    BackendUnderTest::Cuda.renderer(scene)
}

/// Environment variable of the process whose context is lost.
const ALONE: &str = "TRISECT_TEST_LOSES_ITS_CONTEXT";

/// Starts this test binary with this test only, and passes on what it prints.
#[test]
fn lost() {
    if std::env::var_os(ALONE).is_some() {
        return a_lost_context();
    }
    let mut alone = Command::new(std::env::current_exe().unwrap());
    alone.args(["--exact", "lost_context::lost", "--nocapture"]).env(ALONE, "1");
    let output = alone.output().unwrap();
    eprint!("{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && said.contains("1 passed"), "{}: {said}", output.status);
}

/// A single test for all of this, because a process has one context, which does not survive it.
fn a_lost_context() {
    let scene = scene("three_spheres.ron");
    let settings = Settings { width: 320, height: 200, samples: 2048, depth: 8, ..Settings::of(&scene) };
    let Some(mut renderer) = cuda(&scene) else { return };
    let whole = renderer.render(&settings).unwrap().film;

    a_full_device(&scene);

    let context = CudaContext::new(0).unwrap();
    let fatal = ContextDestroyer { context, left: AtomicU32::new(2) };
    let mut film = Film::new(settings.width, settings.height);
    let mut said = None;
    let mut elsewhere = |error: &BackendError, film: &Film, _: &mut Settings| {
        assert!(matches!(error, BackendError::Device { backend: "cuda", .. }), "{error}");
        let missing = film.coverage.missing(&(0..2048));
        assert!(missing[0].samples.start >= 512, "rendered samples must be kept: {missing:?}");
        said = Some((error.to_string(), missing));
        Some(Ok(renders::cpu(&scene)))
    };
    let mut with = settings.clone();
    let stats = renderer
        .render_missing_with_fallback(&mut film, &mut with, &(0..2048), &fatal, &mut (), &mut elsewhere)
        .unwrap();
    eprintln!("{said:?}");
    assert!(said.is_some() && stats.samples == whole.counts().samples);
    assert_eq!(film, whole);
    // A new renderer in the same process works, or fails with the same kind of error.
    let again = trisect::device::cuda::Cuda::open(None).map(|_| ());
    eprintln!("opened again: {again:?}");
    assert!(matches!(again, Ok(()) | Err(BackendError::Device { .. } | BackendError::Unavailable { .. })));
    // Negative control: another seed on the CPU.
    let mut film = Film::new(settings.width, settings.height);
    let strange = Settings { seed: settings.seed + 1, ..settings.clone() };
    renders::cpu(&scene).render_missing(&mut film, &strange, &(0..256), &(), &mut ()).unwrap();
    renders::cpu(&scene).render_missing(&mut film, &settings, &(0..2048), &(), &mut ()).unwrap();
    assert_ne!(film, whole, "negative control not detected");
}

/// A device without free memory gives a typed error; once the memory is released, it renders again.
fn a_full_device(scene: &trisect::scene::Scene) {
    let context = CudaContext::new(0).unwrap();
    let stream = context.new_stream().unwrap();
    let mut taken = Vec::new();
    let mut bytes = result::mem_get_info().unwrap().0;
    // Allocates ever smaller pieces until the driver has no room for one.
    while bytes >= 1 << 20 {
        match stream.alloc_zeros::<u8>(bytes) {
            Ok(memory) => taken.push(memory),
            Err(_) => bytes /= 2,
        }
    }
    let settings = Settings { width: 1920, height: 1080, samples: 256, depth: 4, ..Settings::of(scene) };
    let full = cuda_error(scene, &settings);
    eprintln!("a full device: {full}");
    assert!(
        matches!(full, Error::Backend(BackendError::Device { .. } | BackendError::TooLarge { .. })),
        "{full:?}"
    );
    drop(taken);
    stream.synchronize().unwrap();
    // With the memory released, rendering works again.
    assert!(cuda(scene).unwrap().render(&Settings { samples: 16, ..settings }).is_ok());
}

fn cuda_error(scene: &trisect::scene::Scene, settings: &Settings) -> Error {
    let opened = trisect::device::cuda::Cuda::open(None).map_err(Error::from);
    let made = opened.and_then(|cuda| Renderer::new(cuda, scene));
    made.and_then(|mut renderer| renderer.render(settings)).map(|_| ()).unwrap_err()
}
