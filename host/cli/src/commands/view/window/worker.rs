//! Thread that renders the frames of the window, so that the window responds however long a frame
//! takes.

use super::super::super::Session;
use crate::cli::JobArgs;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use trisect::device::Choice;
use trisect::output::Outputs;
use trisect::scene::{CameraPose, Rebase};
use trisect::threads::{self, ThreadError};
use trisect::view::{FrameTiming, Pace, ViewOptions, Viewer};

/// Request of the window for frames.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewRequest {
    /// Settings, filter and display options.
    pub look: ViewOptions,
    /// Pose of the camera.
    pub pose: CameraPose,
    /// True while a key or the mouse moves the camera, so that another pose is on its way.
    pub moving: bool,
    /// Frames a second to keep while the camera moves; 0: at any resolution.
    pub moving_fps: f64,
    /// Backend, device index, and a number; if the number changes, the device is opened again.
    pub backend: (Choice, Option<usize>, u32),
    /// True if the thread should end.
    pub stop: bool,
}

/// Maximum time that a frame waits for the next pose of a moving camera. After that the camera is
/// at rest, though a key or button is held.
const MAX_WAIT: Duration = Duration::from_millis(100);

/// Frame for the window.
pub struct Frame {
    /// RGBA with 8 bits each, red in the lowest byte; row by row from the top.
    pub pixels: Vec<u32>,
    /// Size and times of the frame.
    pub timing: FrameTiming,
}

/// News of the worker since the last update.
#[derive(Default)]
pub struct WorkerUpdate {
    /// New frame.
    pub frame: Option<Frame>,
    /// Name of the device in use, if it changed.
    pub device: Option<String>,
    /// Error for which there are no frames.
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

/// Handle of the thread; dropping it ends the thread.
pub struct Worker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Starts the thread with an open scene. It calls `wake` for each update.
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
            let (space, pace) = (session.space, Pace::new(wish.moving_fps));
            let last = None;
            RenderLoop { shared: its, job, wake, backend, space, pace, last }.run(Some(viewer(session)));
        })?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Sends a request to the thread if it differs from the last one.
    pub fn request(&self, wish: &ViewRequest) {
        let mut is = lock(&self.shared.request);
        if *is != *wish {
            is.clone_from(wish);
            self.shared.changed.notify_one();
        }
    }

    /// Returns what is new since the last call.
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
    let device = session.renderer.device().info();
    format!("{}: {}", device.backend, device.name)
}

fn viewer(session: Session) -> Viewer {
    Viewer::new(session.renderer)
}

struct RenderLoop<W> {
    shared: Arc<Shared>,
    job: JobArgs,
    wake: W,
    /// Backend, device index and number of the last request that a viewer was opened for.
    backend: (Choice, Option<usize>, u32),
    space: Rebase,
    pace: Pace,
    /// Pose of the last frame, and when it was done.
    last: Option<(CameraPose, Instant)>,
}

impl<W: Fn()> RenderLoop<W> {
    fn run(mut self, mut viewer: Option<Viewer>) {
        // The request that failed last; the same one is not tried again.
        let mut failed: Option<ViewRequest> = None;
        loop {
            let wish = {
                let mut wish = lock(&self.shared.request);
                loop {
                    let rests =
                        viewer.as_ref().is_some_and(|viewer| viewer.is_converged(&wish.look, &wish.pose));
                    let idle = rests && wish.backend == self.backend || failed.as_ref() == Some(&*wish);
                    let wait = if idle { None } else { self.wait_for_pose(&wish) };
                    if wish.stop || !idle && wait.is_none() {
                        break;
                    }
                    let changed = &self.shared.changed;
                    wish = match wait {
                        Some(time) => {
                            changed.wait_timeout(wish, time).unwrap_or_else(PoisonError::into_inner).0
                        }
                        None => changed.wait(wish).unwrap_or_else(PoisonError::into_inner),
                    };
                }
                wish.clone()
            };
            if wish.stop {
                return;
            }
            if wish.backend != self.backend {
                self.backend = wish.backend;
                viewer = None; // frees its memory before the other device is opened
            }
            let outcome = self.frame(&mut viewer, &wish);
            let mut news = lock(&self.shared.update);
            match outcome {
                Ok(frame) => {
                    failed = None;
                    (news.frame, news.error) = (Some(frame), None);
                }
                Err(error) => {
                    // A device that failed is opened again for the next request that differs.
                    viewer = None;
                    failed = Some(wish);
                    news.error = Some(error);
                }
            }
            drop(news);
            (self.wake)();
        }
    }

    /// Returns how long to wait for the next pose: a frame of the last one would be out of date
    /// when it is done. `None`: there is nothing to wait for.
    fn wait_for_pose(&self, wish: &ViewRequest) -> Option<Duration> {
        let (_, done) = self.last.filter(|(pose, _)| wish.moving && *pose == wish.pose)?;
        MAX_WAIT.checked_sub(done.elapsed()).filter(|left| !left.is_zero())
    }

    fn frame(&mut self, viewer: &mut Option<Viewer>, wish: &ViewRequest) -> Result<Frame, String> {
        let open = match viewer {
            Some(viewer) => viewer,
            None => {
                let (backend, device_index, _) = wish.backend;
                let job = JobArgs { backend, device: device_index, ..self.job.clone() };
                let session = Session::open(&job, &Outputs::default()).map_err(|error| error.to_string())?;
                if session.space != self.space {
                    return Err("`space` of the scene file changed; start the viewer again".to_owned());
                }
                lock(&self.shared.update).device = Some(device(&session));
                viewer.insert(self::viewer(session))
            }
        };
        self.pace.set_goal(wish.moving_fps);
        let look = ViewOptions { scale: self.pace.scale(&wish.look, &wish.pose), ..wish.look.clone() };
        let mut pixels = Vec::new();
        let shot = open.frame(&look, &wish.pose, &mut pixels).map_err(|error| error.to_string())?;
        self.pace.learn(look.scale, shot.whole.as_secs_f64());
        self.last = Some((wish.pose, Instant::now()));
        Ok(Frame { pixels, timing: shot })
    }
}
