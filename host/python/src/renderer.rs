//! Renderer: a scene on a device.

use crate::checkpoints::FilmStart;
use crate::conclusion::Conclusion;
use crate::device::DeviceChoice;
use crate::error::{self, Facts};
use crate::film::Film;
use crate::frame::Frame;
use crate::header::LazyHeader;
use crate::job::{self, Kept, Work};
use crate::layers::SceneOfLayers;
use crate::lifecycle::{Running, is_forked};
use crate::nested::Nested;
use crate::observer::Watch;
use crate::options::RenderOptions;
use crate::ranks::{Ranks, Shared};
use crate::scene::Scene;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::{self, ThreadId};
use std::time::Duration;
use trisect::render::Settings;

/// A scene on a device, for any number of frames. One thread at a time renders with it.
#[pyclass(frozen, module = "trisect")]
pub struct Renderer {
    /// Renderer that one thread at a time uses. A forked child, which has none of its threads, does
    /// not drop it.
    inner: ManuallyDrop<Mutex<trisect::render::Renderer>>,
    /// Scene of the next frame.
    scene: Mutex<Py<Scene>>,
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
    renderer: MutexGuard<'a, trisect::render::Renderer>,
    owner: &'a Mutex<Option<ThreadId>>,
}

impl Drop for Alone<'_> {
    fn drop(&mut self) {
        *self.owner.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

/// A render that begins.
struct Begun<'a> {
    alone: Alone<'a>,
    scene: Py<Scene>,
    options: RenderOptions,
    header: LazyHeader,
    start: FilmStart,
}

impl Renderer {
    /// Waits until no other thread uses the renderer. Signals are handled meanwhile.
    fn alone(&self, py: Python<'_>) -> PyResult<Alone<'_>> {
        loop {
            match self.inner.try_lock() {
                Ok(renderer) => return Ok(self.owned(renderer)),
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

    fn owned<'a>(&'a self, renderer: MutexGuard<'a, trisect::render::Renderer>) -> Alone<'a> {
        *self.owner.lock().unwrap_or_else(PoisonError::into_inner) = Some(thread::current().id());
        Alone { renderer, owner: &self.owner }
    }

    /// Reads the arguments of a render, and prepares its film.
    fn begin<'a>(
        &'a self,
        py: Python<'_>,
        spp: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Begun<'a>> {
        let alone = self.alone(py)?;
        let scene = self.scene(py);
        let options = RenderOptions::read(scene.get(), spp.filter(|spp| !spp.is_none()), options)?;
        let header = LazyHeader::of_render(&alone.renderer, &SceneOfLayers::from(scene.get()), &options);
        let start = match options.request {
            Some(_) => FilmStart { film: trisect::film::Film::new(0, 0), saver: None },
            None => error::guarded(py, || FilmStart::new(&options, &header))?,
        };
        self.cancel.store(false, Ordering::Relaxed);
        Ok(Begun { alone, scene, options, header, start })
    }

    /// Renders a frame, which rank 0 receives if there are ranks.
    fn render_frame(
        &self,
        py: Python<'_>,
        spp: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
        ranks: Option<&Ranks>,
    ) -> PyResult<Option<Frame>> {
        let mut begun = self.begin(py, spp, options);
        if let Some(ranks) = ranks {
            begun = ranks
                .agree(py, begun, |begun| Some((begun.header.get().identity, begun.options.samples.clone())));
        }
        let Begun { mut alone, scene, mut options, header, start: FilmStart { film, saver } } = begun?;
        let progress = options.progress.take();
        let renderer = &mut *alone.renderer;
        let scene = SceneOfLayers::from(scene.get());
        let shared = Shared { height: options.settings.height, samples: options.samples.clone() };
        let share = ranks.map(|ranks| ranks.share(&shared));
        let callback = progress.as_ref().map(|progress| progress.callable().clone_ref(py));
        let mut watch = Watch::new(&self.cancel, callback, saver.as_ref(), options.request.is_some());
        let work = Work { options: &options, share: share.as_deref(), saver: saver.as_ref() };
        let mut kept = Kept::default();
        let conclusion = Conclusion { scene: scene.scene, options: &options, header: &header };
        let mut sampled = error::guarded(py, || job::sample(renderer, &work, film, &mut kept, &mut watch));
        if let Some(ranks) = ranks {
            if sampled.is_err() || watch.has_ended() {
                let failed = conclusion.of(py, sampled, &mut watch, kept, saver.as_ref());
                return ranks.agree(py, failed, |_| None).map(Some);
            }
            let mut own = ranks.agree(py, sampled, |_| None)?;
            match ranks.gather(py, own.film, &shared)? {
                None => return Ok(None),
                Some(film) => own.film = film,
            }
            own.count_all();
            sampled = Ok(own);
        }
        let finished = sampled.and_then(|sampled| {
            error::guarded(py, || job::finish(renderer, &options, &scene, sampled, &mut watch))
        });
        let frame = conclusion.of(py, finished, &mut watch, kept, saver.as_ref())?;
        progress.map_or(Ok(()), |progress| progress.close(py))?;
        Ok(Some(frame))
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
        let inner = ManuallyDrop::new(Mutex::new(renderer));
        let scene = Mutex::new(scene);
        Ok(Self { inner, scene, owner: Mutex::new(None), cancel: AtomicBool::new(false), device })
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
    ///
    /// checkpoint is a file that keeps all samples, written every checkpoint_every (seconds, "5m",
    /// "1024spp"), at the end and after an interrupt. The same call with resume=True continues it
    /// to the bits of a render that was not interrupted, and begins anew if there is no file.
    /// sample_range is (first, end): a part of the samples, for merge().
    ///
    /// comm is a communicator of mpi4py, all ranks of which make the same call. Rank 0 receives the
    /// frame of all, the others None.
    #[pyo3(
        signature = (spp = None, **options),
        text_signature = "(self, spp=None, *, budget=None, target_error=None, max_spp=None, adaptive='auto', width=None, height=None, crop=None, depth=None, seed=0, sampler=None, roulette=None, roulette_depth=None, light_sampling=True, clamp=None, transparent=False, denoise=None, aov=(), progress=None, sample_range=None, checkpoint=None, checkpoint_every='30s', resume=False, comm=None)"
    )]
    fn render(
        &self,
        py: Python<'_>,
        spp: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Option<Frame>> {
        let _running = Running::begin()?;
        let _nested = Nested::begin()?;
        let comm = options.map(|options| options.get_item("comm")).transpose()?.flatten();
        let Some(comm) = comm.filter(|comm| !comm.is_none()) else {
            return self.render_frame(py, spp, options, None);
        };
        let ranks = Ranks::new(&comm)?;
        let frame = self.render_frame(py, spp, options, Some(&ranks));
        let freed = ranks.free(py);
        frame.and_then(|frame| freed.map(|()| frame))
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
        let renderer = &mut *alone.renderer;
        let reuse = error::guarded(py, || renderer.update_scene(&records, None))?;
        let before =
            std::mem::replace(&mut *self.scene.lock().unwrap_or_else(PoisonError::into_inner), scene);
        // The lock is free again before the last reference to a scene may go.
        drop(before);
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
    fn scene(&self, py: Python<'_>) -> Py<Scene> {
        self.scene.lock().unwrap_or_else(PoisonError::into_inner).clone_ref(py)
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

/// Settings and film are kept by frames.
const _: fn() = || {
    fn is_shared<T: Send + Sync>() {}
    is_shared::<Settings>();
    is_shared::<Film>();
};
