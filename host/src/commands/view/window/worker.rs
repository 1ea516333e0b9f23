//! A thread that renders what the window wishes, so that the window answers however long a frame takes.

use super::super::super::Session;
use crate::cli::{BackendArg, JobArgs};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use trisect::output::Outputs;
use trisect::scene::{CameraPose, Rebase};
use trisect::threads::{self, ThreadError};
use trisect::view::{FrameTiming, ViewOptions, Viewer};

/// What the window wants to see.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewRequest {
    /// How.
    pub look: ViewOptions,
    /// From where.
    pub pose: CameraPose,
    /// On what; another number asks for it again.
    pub backend: (BackendArg, Option<usize>, u32),
    /// Nothing any more.
    pub stop: bool,
}

/// A frame for the window.
pub struct Frame {
    /// Red, green, blue and opacity from the lowest byte on.
    pub pixels: Vec<u32>,
    /// What it took.
    pub timing: FrameTiming,
}

/// What the worker tells.
#[derive(Default)]
pub struct WorkerUpdate {
    /// A frame that the window has not seen.
    pub frame: Option<Frame>,
    /// The device in use.
    pub device: Option<String>,
    /// Why there are no frames.
    pub error: Option<String>,
}

struct Shared {
    request: Mutex<ViewRequest>,
    changed: Condvar,
    update: Mutex<WorkerUpdate>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The thread, as the window has it.
pub struct Worker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts it with a scene that is open; `wake` is called for each news.
    pub fn start(
        session: Session,
        job: JobArgs,
        wish: ViewRequest,
        wake: impl Fn() + Send + 'static,
    ) -> Result<Self, ThreadError> {
        let shared = Arc::new(Shared {
            request: Mutex::new(wish.clone()),
            changed: Condvar::new(),
            update: Mutex::new(WorkerUpdate { device: Some(device(&session)), ..WorkerUpdate::default() }),
        });
        let its = shared.clone();
        let thread = threads::spawn("thread that renders", move || {
            let backend = wish.backend;
            RenderLoop { shared: its, job, wake, backend, space: session.space }.run(Some(viewer(session)));
        })?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Says what to see.
    pub fn request(&self, wish: &ViewRequest) {
        let mut is = lock(&self.shared.request);
        if *is != *wish {
            is.clone_from(wish);
            self.shared.changed.notify_one();
        }
    }

    /// What is new.
    pub fn take_update(&self) -> WorkerUpdate {
        std::mem::take(&mut *lock(&self.shared.update))
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        lock(&self.shared.request).stop = true;
        self.shared.changed.notify_one();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn device(session: &Session) -> String {
    let device = session.renderer.backend().device();
    format!("{}: {}", device.backend, device.name)
}

fn viewer(session: Session) -> Viewer {
    Viewer::new(session.renderer)
}

struct RenderLoop<W> {
    shared: Arc<Shared>,
    job: JobArgs,
    wake: W,
    /// That the viewer has.
    backend: (BackendArg, Option<usize>, u32),
    space: Rebase,
}

impl<W: Fn()> RenderLoop<W> {
    fn run(mut self, mut viewer: Option<Viewer>) {
        // What failed: it is not tried again.
        let mut failed: Option<ViewRequest> = None;
        loop {
            let wish = {
                let mut wish = lock(&self.shared.request);
                loop {
                    let rests =
                        viewer.as_ref().is_some_and(|viewer| viewer.is_converged(&wish.look, &wish.pose));
                    let idle = rests && wish.backend == self.backend || failed.as_ref() == Some(&*wish);
                    if wish.stop || !idle {
                        break;
                    }
                    wish = self.shared.changed.wait(wish).unwrap_or_else(PoisonError::into_inner);
                }
                wish.clone()
            };
            if wish.stop {
                return;
            }
            if wish.backend != self.backend {
                self.backend = wish.backend;
                viewer = None; // its memory is free before other is asked for
            }
            let outcome = self.frame(&mut viewer, &wish);
            let mut news = lock(&self.shared.update);
            match outcome {
                Ok(frame) => {
                    failed = None;
                    (news.frame, news.error) = (Some(frame), None);
                }
                Err(error) => {
                    // A device that failed is opened anew when something else is wished.
                    viewer = None;
                    failed = Some(wish);
                    news.error = Some(error);
                }
            }
            drop(news);
            (self.wake)();
        }
    }

    fn frame(&self, viewer: &mut Option<Viewer>, wish: &ViewRequest) -> Result<Frame, String> {
        let open = match viewer {
            Some(viewer) => viewer,
            None => {
                let (backend, device_index, _) = wish.backend;
                let job = JobArgs { backend, device: device_index, ..self.job.clone() };
                let session = Session::open(&job, &Outputs::default()).map_err(|error| error.to_string())?;
                if session.space != self.space {
                    return Err("the scene's file has another space now; start the viewer again".to_owned());
                }
                lock(&self.shared.update).device = Some(device(&session));
                viewer.insert(self::viewer(session))
            }
        };
        let mut pixels = Vec::new();
        let shot = open.frame(&wish.look, &wish.pose, &mut pixels).map_err(|error| error.to_string())?;
        Ok(Frame { pixels, timing: shot })
    }
}
