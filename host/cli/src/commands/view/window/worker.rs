//! Thread that renders the frames of the window, so that the window responds however long a frame
//! takes.

use super::super::super::Session;
use super::opened::{LOOK, Opened, SceneFiles};
use super::save;
use crate::cli::JobArgs;
use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use trisect::device::Choice;
use trisect::output::Outputs;
use trisect::scene::{CameraPose, PartName, Rebase};
use trisect::threads::{self, ThreadError};
use trisect::view::{FrameTiming, Layer, Pace, Pick, ViewOptions, Viewer};

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
    /// Layer to show in place of the image.
    pub layer: Option<Layer>,
    /// Backend, device index, and a number; if the number changes, the device is opened again.
    pub backend: (Choice, Option<usize>, u32),
    /// True if the thread should end.
    pub stop: bool,
}

/// Work besides frames.
#[derive(Clone, Debug, PartialEq)]
pub enum Task {
    /// Tell what a point of the image shows, as shares of its width and height.
    Pick(f64, f64),
    /// Write the image of the last frame to an .exr.
    SaveRadiance,
    /// Show another scene or model.
    Open(PathBuf),
}

/// Surface at a point of the image, with the names of its object and material; `None` for the sky.
pub type Picked = Option<(Pick, PartName)>;

/// Maximum time that a frame waits for the next pose of a moving camera. After that the camera is
/// at rest, though a key or button is held.
const MAX_WAIT: Duration = Duration::from_millis(100);

/// Frame for the window.
pub struct Frame {
    /// RGBA with 8 bits each, red in the lowest byte; row by row from the top.
    pub pixels: Vec<u32>,
    /// Size and times of the frame.
    pub timing: FrameTiming,
    /// Values of the first and the last colour, for a layer of numbers.
    pub range: Option<[f64; 2]>,
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
    /// Error of a task; frames go on.
    pub refused: Option<String>,
    /// Surface that was picked.
    pub picked: Option<Picked>,
    /// Message about a file that was written.
    pub message: Option<String>,
    /// Scene that is shown from now on.
    pub opened: Option<Opened>,
}

struct Shared {
    request: Mutex<ViewRequest>,
    tasks: Mutex<Vec<Task>>,
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
        (session, files): (Session, SceneFiles),
        job: JobArgs,
        wish: ViewRequest,
        wake: impl Fn() + Send + 'static,
    ) -> Result<Self, ThreadError> {
        let shared = Arc::new(Shared {
            request: Mutex::new(wish.clone()),
            tasks: Mutex::default(),
            changed: Condvar::new(),
            update: Mutex::new(WorkerUpdate { device: Some(device(&session)), ..WorkerUpdate::default() }),
        });
        let its = shared.clone();
        let thread = threads::spawn("thread that renders", move || {
            let (space, names) = (session.space, session.names.clone());
            let its = RenderLoop {
                shared: its,
                job,
                wake,
                backend: wish.backend,
                space,
                names,
                files,
                pace: Pace::new(wish.moving_fps),
                last: None,
                shown: None,
            };
            its.run(Some(viewer(session)));
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

    /// Gives the thread a task.
    pub fn give(&self, task: Task) {
        lock(&self.shared.tasks).push(task);
        // The lock keeps the thread from missing the notice between its look and its wait.
        let _request = lock(&self.shared.request);
        self.shared.changed.notify_one();
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
    /// Names of the scene's objects.
    names: Vec<PartName>,
    files: SceneFiles,
    pace: Pace,
    /// Pose of the last frame, and when it was done.
    last: Option<(CameraPose, Instant)>,
    /// Layer of the last frame.
    shown: Option<Layer>,
}

impl<W: Fn()> RenderLoop<W> {
    fn run(mut self, mut viewer: Option<Viewer>) {
        // The request that failed last; the same one is not tried again.
        let mut failed: Option<ViewRequest> = None;
        loop {
            let wish = self.next_wish(viewer.as_ref(), failed.as_ref());
            if wish.stop {
                return;
            }
            let tasks = std::mem::take(&mut *lock(&self.shared.tasks));
            let changed = self.files.have_changed();
            if changed || !tasks.is_empty() {
                let reload = changed.then_some(None).into_iter();
                for task in reload.chain(tasks.into_iter().map(Some)) {
                    self.fulfil(task, &mut viewer, &wish);
                }
                if viewer.is_some() {
                    failed = None;
                }
                (self.wake)();
                // A scene that was opened has another camera, which the next request brings.
                continue;
            }
            if self.is_idle(viewer.as_ref(), failed.as_ref(), &wish) {
                continue;
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

    /// Returns whether there is nothing to render for a request.
    fn is_idle(&self, viewer: Option<&Viewer>, failed: Option<&ViewRequest>, wish: &ViewRequest) -> bool {
        let rests = viewer.is_some_and(|viewer| viewer.is_converged(&wish.look, &wish.pose));
        rests && wish.backend == self.backend && wish.layer == self.shown || failed == Some(wish)
    }

    /// Waits for a request to render, for tasks, or for the time to look at the files, and returns
    /// the request.
    fn next_wish(&self, viewer: Option<&Viewer>, failed: Option<&ViewRequest>) -> ViewRequest {
        let start = Instant::now();
        let mut wish = lock(&self.shared.request);
        loop {
            let idle = self.is_idle(viewer, failed, &wish);
            let wait = if idle { LOOK.checked_sub(start.elapsed()) } else { self.wait_for_pose(&wish) };
            let Some(time) = wait.filter(|_| !wish.stop && lock(&self.shared.tasks).is_empty()) else {
                return wish.clone();
            };
            let changed = &self.shared.changed;
            wish = changed.wait_timeout(wish, time).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Does a task, or reads the scene again for `None`.
    fn fulfil(&mut self, task: Option<Task>, viewer: &mut Option<Viewer>, wish: &ViewRequest) {
        let job = match &task {
            None => Some(self.job.clone()),
            Some(Task::Open(path)) => Some(self.job.of_scene(path.clone())),
            Some(Task::Pick(..) | Task::SaveRadiance) => None,
        };
        if let Some(job) = job {
            let (backend, device, _) = wish.backend;
            let (job, is_same) = (JobArgs { backend, device, ..job }, task.is_none());
            match self.files.open(&job, &wish.look, is_same) {
                Ok((session, opened)) => {
                    (self.space, self.names, self.job) = (session.space, session.names.clone(), job);
                    *viewer = Some(self::viewer(session));
                    lock(&self.shared.update).opened = Some(opened);
                }
                Err(error) => lock(&self.shared.update).refused = Some(error.to_string()),
            }
            return;
        }
        let Some(viewer) = viewer else { return };
        match task {
            Some(Task::Pick(x, y)) => match self.pick(viewer, (x, y)) {
                Ok(picked) => lock(&self.shared.update).picked = Some(picked),
                Err(error) => lock(&self.shared.update).refused = Some(error),
            },
            Some(Task::SaveRadiance) => {
                let path = self.job.scene.as_deref();
                let message = save::radiance(path, viewer.image());
                lock(&self.shared.update).message = Some(message);
            }
            None | Some(Task::Open(_)) => {}
        }
    }

    /// Returns what a point of the last frame shows, in the scene's own units.
    fn pick(&self, viewer: &mut Viewer, (x, y): (f64, f64)) -> Result<Picked, String> {
        let Some((width, height)) = viewer.size() else { return Ok(None) };
        let place = |share: f64, pixels: u32| (share * f64::from(pixels)) as u32;
        let picked = viewer.pick((place(x, width), place(y, height))).map_err(|error| error.to_string())?;
        let unnamed = || PartName { object: "?".to_owned(), material: "?".to_owned() };
        Ok(picked.map(|pick| {
            let name = self.names.get((pick.object as usize).wrapping_sub(1)).cloned();
            let position = pick.position / self.space.scale + self.space.origin;
            let depth = pick.depth / self.space.scale;
            (Pick { position, depth, ..pick }, name.unwrap_or_else(unnamed))
        }))
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
                self.names.clone_from(&session.names);
                lock(&self.shared.update).device = Some(device(&session));
                viewer.insert(self::viewer(session))
            }
        };
        self.pace.set_goal(wish.moving_fps);
        let look = ViewOptions { scale: self.pace.scale(&wish.look, &wish.pose), ..wish.look.clone() };
        let mut pixels = Vec::new();
        // A finished image stays as it is, whatever layer of it is shown.
        let kept = match open.is_converged(&wish.look, &wish.pose) {
            true => open.show_again(&mut pixels).map_err(|error| error.to_string())?,
            false => None,
        };
        let shot = match kept {
            Some(shot) => shot,
            None => {
                let shot = open.frame(&look, &wish.pose, &mut pixels).map_err(|error| error.to_string())?;
                self.pace.learn(look.scale, shot.whole.as_secs_f64());
                self.last = Some((wish.pose, Instant::now()));
                shot
            }
        };
        self.shown = wish.layer;
        let mut range = None;
        if let Some(layer) = wish.layer
            && let Some(picture) = open.layer(layer, &self.names).map_err(|error| error.to_string())?
        {
            (pixels, range) = (picture.pixels, picture.range);
        }
        Ok(Frame { pixels, timing: shot, range })
    }
}
