//! Renderer: a scene on a device.

use crate::device::DeviceChoice;
use crate::error::{self, Facts};
use crate::film::Film;
use crate::frame::Frame;
use crate::layers::{FrameLayers, SceneOfLayers};
use crate::lifecycle::{Running, is_forked};
use crate::observer::Watch;
use crate::options::RenderOptions;
use crate::scene::Scene;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::cell::Cell;
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::{self, ThreadId};
use std::time::Duration;
use trisect::adaptive::{self, Goal, Sampled};
use trisect::error::Error;
use trisect::image::Image;
use trisect::render::{RenderObserver, Settings};
use trisect::stats::RenderStats;

/// Renderer and scene that one thread at a time uses.
struct Inner {
    renderer: trisect::render::Renderer,
    scene: Py<Scene>,
}

/// A scene on a device, for any number of frames. One thread at a time renders with it.
#[pyclass(frozen, module = "trisect")]
pub struct Renderer {
    /// Not dropped in a forked child, which has none of its threads.
    inner: ManuallyDrop<Mutex<Inner>>,
    /// Thread that renders.
    owner: Mutex<Option<ThreadId>>,
    cancel: AtomicBool,
    device: (&'static str, String, String),
}

impl Drop for Renderer {
    #[allow(unsafe_code, reason = "nothing uses the field after the last drop")]
    fn drop(&mut self) {
        if !is_forked() {
            // SAFETY: this is the only drop, and the field is not used again.
            unsafe { ManuallyDrop::drop(&mut self.inner) }
        }
    }
}

/// Renderer that this thread has alone.
struct Alone<'a> {
    inner: MutexGuard<'a, Inner>,
    owner: &'a Mutex<Option<ThreadId>>,
}

impl Drop for Alone<'_> {
    fn drop(&mut self) {
        *self.owner.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

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

/// Result of a render.
struct Rendered {
    film: trisect::film::Film,
    image: Option<Image>,
    stats: RenderStats,
    layers: FrameLayers,
}

impl Renderer {
    /// Waits until no other thread uses the renderer. Signals are handled meanwhile.
    fn alone(&self, py: Python<'_>) -> PyResult<Alone<'_>> {
        loop {
            match self.inner.try_lock() {
                Ok(inner) => return Ok(self.owned(inner)),
                Err(TryLockError::Poisoned(poisoned)) => return Ok(self.owned(poisoned.into_inner())),
                Err(TryLockError::WouldBlock) => {}
            }
            let owner = *self.owner.lock().unwrap_or_else(PoisonError::into_inner);
            if owner == Some(thread::current().id()) {
                let message = "the renderer renders: its progress callback cannot use it; call cancel() to end the render";
                return Err(error::raise("BusyError", message.to_owned(), Facts::default()));
            }
            py.detach(|| thread::sleep(Duration::from_millis(1)));
            py.check_signals()?;
        }
    }

    fn owned<'a>(&'a self, inner: MutexGuard<'a, Inner>) -> Alone<'a> {
        *self.owner.lock().unwrap_or_else(PoisonError::into_inner) = Some(thread::current().id());
        Alone { inner, owner: &self.owner }
    }
}

/// Renders what the options ask for. `film` keeps the samples of a render that was ended early.
fn rendered(
    renderer: &mut trisect::render::Renderer,
    options: &RenderOptions,
    scene: &SceneOfLayers<'_>,
    film: &mut Option<trisect::film::Film>,
    observer: &mut Watch<'_>,
) -> Result<Rendered, Error> {
    let RenderOptions { settings, request, denoise, aovs, .. } = options;
    if let Some(denoise) = denoise {
        denoise.check()?;
    }
    let (done, mut image, mut stats) = match request {
        Some(request) => {
            let Sampled { film, image, stats } = adaptive::render(renderer, settings, request, observer)?;
            (film, matches!(request.goal, Goal::Time(_)).then_some(image), stats)
        }
        None => {
            settings.check()?;
            let new = match settings.guides {
                true => trisect::film::Film::with_aovs(settings.width, settings.height),
                false => trisect::film::Film::new(settings.width, settings.height),
            };
            let kept = film.insert(new);
            let stats = renderer.render_missing(kept, settings, &(0..settings.samples), &(), observer)?;
            (film.take().unwrap_or_else(|| trisect::film::Film::new(0, 0)), None, stats)
        }
    };
    if let Some(denoise) = denoise.as_ref().filter(|_| image.is_none() && !observer.has_ended()) {
        let (denoised, passes) = renderer.denoise(&done, settings, *denoise)?;
        stats.denoise_seconds = passes.iter().map(Duration::as_secs_f64).sum();
        stats.denoise = Some(*denoise);
        stats.denoise_library = denoise.library();
        image = Some(denoised);
    }
    let aovs: &[_] = if observer.has_ended() { &[] } else { aovs };
    let layers = match FrameLayers::of(renderer, (settings, &done), scene, aovs, &mut Quiet(observer)) {
        Err(Error::Cancelled) if observer.has_ended() => FrameLayers::default(),
        layers => layers?,
    };
    stats.scene.clone_from(&scene.scene.name);
    Ok(Rendered { film: done, image, stats, layers })
}

/// Observer of the layers' camera rays, which may end them, and whose progress is not told.
struct Quiet<'a, 'b>(&'a mut Watch<'b>);

impl RenderObserver for Quiet<'_, '_> {
    fn progress(&mut self, _: u64, _: u64) -> std::ops::ControlFlow<()> {
        self.0.look_at_signals();
        match self.0.should_continue() {
            true => std::ops::ControlFlow::Continue(()),
            false => std::ops::ControlFlow::Break(()),
        }
    }
}

#[pymethods]
impl Renderer {
    /// Upload a scene to a device: "auto" (CUDA, else a GPU by Vulkan, else the CPU), "cpu", "wgpu"
    /// or "cuda". device is an index among those of the backend, threads the number of threads of
    /// the CPU. Raises UnavailableError with a remedy.
    #[new]
    #[pyo3(signature = (scene, backend = None, *, device = None, threads = None))]
    fn new(
        py: Python<'_>,
        scene: Py<Scene>,
        backend: Option<&Bound<'_, PyAny>>,
        device: Option<usize>,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let _running = Running::begin()?;
        let choice = DeviceChoice::read(backend, device, threads)?;
        let records = Arc::clone(&scene.get().inner);
        let (renderer, device) = error::guarded(py, || {
            let selection = choice.open()?;
            let info = selection.device.info();
            let device = (info.backend, info.name.clone(), info.details.clone());
            let renderer = trisect::render::Renderer::new(selection.device, &records)?;
            Ok((renderer, device))
        })?;
        let inner = ManuallyDrop::new(Mutex::new(Inner { renderer, scene }));
        Ok(Self { inner, owner: Mutex::new(None), cancel: AtomicBool::new(false), device })
    }

    /// Render a frame: spp samples per pixel, the best image within a time (budget), or samples
    /// until the estimated relative error is reached (target_error).
    ///
    /// width, height, depth and the number of samples are those of the scene unless given; one of
    /// width and height keeps the aspect. crop is (x0, y0, x1, y1), shares or pixels. denoise is
    /// "off", "atrous", "svgf" or "oidn". aov names layers for Frame.aovs. progress is True for a
    /// bar, or a callable that receives a Progress at most ten times a second; an exception that it
    /// raises ends the render. The interpreter's lock is released meanwhile; Ctrl-C raises
    /// RenderInterrupted, whose frame has the samples so far.
    #[pyo3(
        signature = (spp = None, **options),
        text_signature = "(self, spp=None, *, budget=None, target_error=None, max_spp=None, adaptive='auto', width=None, height=None, crop=None, depth=None, seed=0, sampler=None, roulette=None, roulette_depth=None, light_sampling=True, clamp=None, transparent=False, denoise=None, aov=(), progress=None)"
    )]
    fn render(
        &self,
        py: Python<'_>,
        spp: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Frame> {
        let _running = Running::begin()?;
        let _nested = Nested::begin()?;
        let mut alone = self.alone(py)?;
        let Inner { renderer, scene } = &mut *alone.inner;
        let scene = scene.get();
        let spp = spp.filter(|spp| !spp.is_none());
        let options = RenderOptions::read(scene, spp, options)?;
        self.cancel.store(false, Ordering::Relaxed);
        let callback = options.progress.as_ref().map(|callback| callback.clone_ref(py));
        let mut watch = Watch::new(&self.cancel, callback, options.request.is_some());
        let records = &scene.inner;
        let of = SceneOfLayers { scene: records, space: scene.space, names: &scene.names };
        let mut kept = None;
        let result = error::guarded(py, || rendered(renderer, &options, &of, &mut kept, &mut watch));
        let ended = watch.has_ended();
        let raised = watch.raised();
        let frame = |film, image, stats, layers| {
            Frame::new(Arc::clone(records), (film, image), stats, layers, &options.settings, !ended)
        };
        match (result, raised) {
            (Ok(Rendered { film, image, stats, layers }), None) if !ended => {
                Ok(frame(film, image, Some(stats), layers))
            }
            (result, raised) => {
                let partial = match result {
                    Ok(Rendered { film, image, stats, layers }) => {
                        Some(frame(film, image, Some(stats), layers))
                    }
                    // Another error than the end that was asked for.
                    Err(error) if !ended => return Err(error),
                    Err(_) => kept
                        .filter(|film| !film.is_empty())
                        .map(|film| frame(film, None, None, FrameLayers::default())),
                };
                Err(interrupted(py, raised, partial))
            }
        }
    }

    /// Replace the scene, from the next frame on, and keep what is the same: after an edit of a
    /// material the BVH and the meshes stay on the device.
    ///
    /// Returns a dict with tree ("kept", "padded", "refitted" or "built") and written, a dict of
    /// the bytes of each array that went to the device.
    fn update<'py>(&self, py: Python<'py>, scene: Py<Scene>) -> PyResult<Bound<'py, PyDict>> {
        let _running = Running::begin()?;
        let mut alone = self.alone(py)?;
        let records = Arc::clone(&scene.get().inner);
        let renderer = &mut alone.inner.renderer;
        let reuse = error::guarded(py, || renderer.update_scene(&records, None))?;
        alone.inner.scene = scene;
        let written = PyDict::new(py);
        for array in &reuse.written {
            written.set_item(array.name, array.bytes)?;
        }
        let told = PyDict::new(py);
        told.set_item("tree", format!("{:?}", reuse.tree).to_lowercase())?;
        told.set_item("written", written)?;
        Ok(told)
    }

    /// End the render that another thread has in progress; its call raises CancelledError.
    fn cancel(&self) {
        self.cancel.store(true, Ordering::Relaxed);
    }

    /// Scene of the next frame.
    #[getter]
    fn scene(&self, py: Python<'_>) -> PyResult<Py<Scene>> {
        Ok(self.alone(py)?.inner.scene.clone_ref(py))
    }

    /// Backend of the device: "cpu", "wgpu" or "cuda".
    #[getter]
    fn backend(&self) -> &'static str {
        self.device.0
    }

    /// Name of the device.
    #[getter]
    fn device(&self) -> &str {
        &self.device.1
    }

    fn __repr__(&self) -> String {
        let (backend, name, details) = &self.device;
        format!("<Renderer on {backend}: {name} ({details})>")
    }
}

/// Returns the exception of a render that was ended: that of a callback or signal handler, else
/// CancelledError. One of Ctrl-C has the frame so far.
fn interrupted(py: Python<'_>, raised: Option<PyErr>, partial: Option<Frame>) -> PyErr {
    let class = match &raised {
        Some(error) if error.is_instance_of::<pyo3::exceptions::PyKeyboardInterrupt>(py) => {
            "RenderInterrupted"
        }
        Some(_) => return raised.unwrap_or_else(|| PyErr::fetch(py)),
        None => "CancelledError",
    };
    let with_frame = || -> PyResult<PyErr> {
        let error = py.import("trisect.errors")?.getattr(class)?.call1(("the render was ended",))?;
        error.setattr("frame", partial)?;
        Ok(PyErr::from_value(error))
    };
    with_frame().unwrap_or_else(|error| error)
}

/// Settings and film are kept by frames.
const _: fn() = || {
    fn is_shared<T: Send + Sync>() {}
    is_shared::<Settings>();
    is_shared::<Film>();
};
