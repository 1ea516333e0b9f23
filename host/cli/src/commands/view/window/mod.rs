//! `trisect view` in a window: winit for events, egui for the controls, a thread that renders.

mod graph;
mod help;
mod input;
mod interface;
mod layout;
mod opened;
mod output;
mod panel;
mod picked;
mod save;
mod worker;

use super::Session;
use crate::cli::{JobArgs, ViewArgs};
use egui::TextureHandle;
use graph::Graph;
use layout::window_size;
use opened::{Opened, SceneFiles};
use output::Output;
use panel::DeviceChoice;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};
use trisect::device::Choice;
use trisect::device::{self, BackendError};
use trisect::scene::{CameraPose, Rebase};
use trisect::view::{Layer, MOVING_FPS, Navigator, ViewOptions};
use trisect_lab::Error;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::window::{Window, WindowId};
use worker::{Frame, Picked, Task, ViewRequest, Worker};

/// Time between two steps of a camera that a key moves.
const STEP: Duration = Duration::from_millis(10);

/// Maximum time of a step, in seconds, if the window was busy.
const MAX_STEP: f64 = 0.1;

/// Event by which the worker wakes the window: a frame or an error is ready.
struct UpdateReady;

/// Opens a window and shows the scene until it is closed.
pub fn run(arguments: &ViewArgs, session: Session, look: ViewOptions) -> Result<ExitCode, Error> {
    // winit begins its message with a place in its own source, which is cut off.
    let said = |text: String| match text.strip_prefix("os error at ").and_then(|rest| rest.split_once(": ")) {
        Some((_, said)) => said.to_owned(),
        None => text,
    };
    let refused = |error: &dyn std::fmt::Display| BackendError::Unavailable {
        backend: "window",
        reason: said(error.to_string()),
        remedy: "start from a desktop (X11 or Wayland), or use trisect view --headless".to_owned(),
    };
    let event_loop = EventLoop::<UpdateReady>::with_user_event().build().map_err(|error| refused(&error))?;
    let proxy = event_loop.create_proxy();
    let navigator = Navigator::new(*session.renderer.pose());
    let job = JobArgs { needs_names: true, ..arguments.job.clone() };
    let (space, scene) = (session.space, session.name.clone());
    let is_fixed = job.resolution.is_some() || job.width.is_some() || job.height.is_some();
    let resolution = is_fixed.then_some((look.settings.width, look.settings.height));
    let backend = (job.backend, job.device, 0);
    let moving_fps = arguments.moving_fps.unwrap_or(MOVING_FPS);
    let pose = navigator.pose();
    let (look_first, layer) = (look.clone(), None);
    let wish = ViewRequest { look: look_first, pose, moving: false, moving_fps, layer, backend, stop: false };
    let files = SceneFiles::of(&session, arguments.exposure.is_none());
    let worker = Worker::start((session, files), job, wish, move || {
        let _ = proxy.send_event(UpdateReady);
    })?;
    let mut app = App {
        job: arguments.job.clone(),
        space,
        scene,
        look,
        moving_fps,
        resolution,
        navigator,
        backend,
        choices: choices(),
        worker,
        window: None,
        frame: None,
        texture: None,
        graph: Graph::default(),
        device: String::new(),
        message: String::new(),
        error: String::new(),
        panel: true,
        layer,
        help: false,
        picked: None,
        last: Instant::now(),
        held: false,
        dragged: false,
        was_typing: false,
        failed: None,
    };
    event_loop.run_app(&mut app).map_err(|error| refused(&error))?;
    match app.failed {
        Some(failed) => Err(refused(&failed).into()),
        None => Ok(ExitCode::SUCCESS),
    }
}

/// Returns the title of a window that shows a scene.
fn title(scene: &str) -> String {
    format!("Trisect: {scene}")
}

/// Returns all available devices.
fn choices() -> Vec<DeviceChoice> {
    let argument = |name| Choice::of_backend(name).unwrap_or(Choice::Auto);
    let all = device::list().into_iter().flat_map(|(name, devices)| {
        let devices = devices.unwrap_or_default().into_iter();
        devices.map(move |device| {
            (format!("{name}: {}", device.name), argument(name), (name != "cpu").then_some(device.index))
        })
    });
    all.collect()
}

/// Open window with its surface and egui's state.
struct Open {
    window: Arc<Window>,
    output: Output,
    input: egui_winit::State,
    context: egui::Context,
}

struct App {
    /// Scene that is shown, with the options with which it was read.
    job: JobArgs,
    space: Rebase,
    scene: String,
    look: ViewOptions,
    /// Frames a second to keep while the camera moves.
    moving_fps: f64,
    /// Resolution of the image from the command line; `None`: the image follows the window.
    resolution: Option<(u32, u32)>,
    navigator: Navigator,
    backend: (Choice, Option<usize>, u32),
    choices: Vec<DeviceChoice>,
    worker: Worker,
    window: Option<Open>,
    frame: Option<Frame>,
    texture: Option<TextureHandle>,
    graph: Graph,
    device: String,
    message: String,
    error: String,
    panel: bool,
    /// Layer that is shown in place of the image.
    layer: Option<Layer>,
    /// True if the help on keys is shown.
    help: bool,
    /// Surface that was picked, once it is known, its place in the image (as shares of its size),
    /// and the camera then.
    picked: Option<(Option<Picked>, egui::Vec2, CameraPose)>,
    last: Instant,
    /// True while a key moves the camera.
    held: bool,
    /// True while the mouse does.
    dragged: bool,
    /// True if a text or number field had the focus in the frame before.
    was_typing: bool,
    failed: Option<String>,
}

impl ApplicationHandler<UpdateReady> for App {
    fn new_events(&mut self, event_loop: &ActiveEventLoop, cause: StartCause) {
        let (StartCause::ResumeTimeReached { .. }, Some(open)) = (cause, &self.window) else { return };
        if !self.held {
            open.window.request_redraw();
            return;
        }
        // The next frame gets the pose of its time. Nothing is drawn until it is done.
        let context = open.context.clone();
        self.step(|held| context.input(held));
        self.request();
        event_loop.set_control_flow(ControlFlow::WaitUntil(Instant::now() + STEP));
    }

    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.window.is_none() {
            let monitor = event_loop.primary_monitor().or_else(|| event_loop.available_monitors().next());
            let screen = monitor.as_ref().map(|monitor| monitor.size().into());
            let scale_factor = monitor.as_ref().map_or(1.0, |monitor| monitor.scale_factor());
            let resolution = (self.look.settings.width, self.look.settings.height);
            let (width, height) = window_size(resolution, screen, scale_factor);
            let size = PhysicalSize::new(width, height);
            let attributes =
                Window::default_attributes().with_title(title(&self.scene)).with_inner_size(size);
            match event_loop.create_window(attributes) {
                Ok(window) => self.open(event_loop, Arc::new(window)),
                Err(error) => self.fail(event_loop, error.to_string()),
            }
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, _: UpdateReady) {
        let news = self.worker.take_update();
        if let Some(frame) = news.frame {
            let milliseconds = |seconds: f64| (seconds * 1e3) as f32;
            let shot = &frame.timing;
            let present = milliseconds(shot.present.as_secs_f64());
            self.graph.push([milliseconds(shot.trace()), milliseconds(shot.denoise()), present]);
            self.frame = Some(frame);
            self.texture = None;
            self.error.clear();
        }
        if let (Some(picked), Some((known, ..))) = (news.picked, &mut self.picked) {
            *known = Some(picked);
        }
        if let Some(refused) = news.refused {
            crate::terminal::eprint(&format!("error: {refused}"));
            self.message = refused;
        }
        if let Some(message) = news.message {
            self.message = message;
        }
        if let Some(opened) = news.opened {
            self.take(opened);
        }
        if let Some(device) = news.device {
            self.device = device;
        }
        if let Some(error) = news.error {
            crate::terminal::eprint(&format!("error: {error}"));
            self.error = error;
        }
        if let Some(open) = &self.window {
            open.window.request_redraw();
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.window else { return };
        let response = open.input.on_window_event(&open.window, &event);
        // A key that is held moves the camera without being repeated.
        let repeats = matches!(&event, WindowEvent::KeyboardInput { event, .. } if event.repeat);
        // Otherwise each drawing would ask for another.
        let draws = matches!(&event, WindowEvent::RedrawRequested);
        if response.repaint && !draws && !(repeats && self.held) {
            open.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::DroppedFile(path) => self.worker.give(Task::Open(path)),
            WindowEvent::RedrawRequested => self.redraw(event_loop),
            _ => {}
        }
    }
}

impl App {
    fn fail(&mut self, event_loop: &ActiveEventLoop, message: String) {
        self.failed = Some(message);
        event_loop.exit();
    }

    /// Creates surface and egui state of a window.
    fn open(&mut self, event_loop: &ActiveEventLoop, window: Arc<Window>) {
        match Output::new(window.clone()) {
            Ok(output) => {
                let context = egui::Context::default();
                let input = egui_winit::State::new(
                    context.clone(),
                    egui::ViewportId::ROOT,
                    event_loop,
                    Some(window.scale_factor() as f32),
                    None,
                    Some(output.greatest_side()),
                );
                self.texture = None;
                window.request_redraw();
                self.window = Some(Open { window, output, input, context });
            }
            Err(message) => self.fail(event_loop, message),
        }
    }

    fn redraw(&mut self, event_loop: &ActiveEventLoop) {
        let Some(mut open) = self.window.take() else { return };
        if open.output.is_lost() {
            let window = open.window.clone();
            drop(open);
            self.open(event_loop, window);
            return;
        }
        let input = open.input.take_egui_input(&open.window);
        let context = open.context.clone();
        let mut quit = false;
        let output = context.run_ui(input, |ui| quit |= self.lay_out(ui));
        self.request();
        open.input.handle_platform_output(&open.window, output.platform_output.clone());
        let delay =
            output.viewport_output.get(&egui::ViewportId::ROOT).map(|viewport| viewport.repaint_delay);
        open.output.draw(&context, output);
        match delay {
            // A frame that is done redraws the window.
            _ if self.held => event_loop.set_control_flow(ControlFlow::WaitUntil(Instant::now() + STEP)),
            Some(Duration::ZERO) => open.window.request_redraw(),
            Some(delay) if delay < Duration::from_secs(3600) => {
                event_loop.set_control_flow(ControlFlow::WaitUntil(Instant::now() + delay));
            }
            _ => event_loop.set_control_flow(ControlFlow::Wait),
        }
        self.window = Some(open);
        if quit {
            event_loop.exit();
        }
    }

    /// Shows a scene that was opened.
    fn take(&mut self, opened: Opened) {
        self.message = match self.job.scene == opened.job.scene {
            true => format!("read {} again", opened.name),
            false => format!("opened {}", opened.name),
        };
        (self.job, self.space, self.scene) = (opened.job, opened.space, opened.name);
        if let Some(camera) = opened.camera {
            let mode = self.navigator.mode;
            self.navigator = Navigator::new(camera);
            self.navigator.mode = mode;
        }
        if let Some(stops) = opened.stops {
            self.look.screen.stops = stops;
        }
        (self.picked, self.error) = (None, String::new());
        if let Some(open) = &self.window {
            open.window.set_title(&title(&self.scene));
        }
    }

    /// Asks the worker for a frame of the current options and pose.
    fn request(&self) {
        self.worker.request(&ViewRequest {
            look: self.look.clone(),
            pose: self.navigator.pose(),
            moving: self.held || self.dragged,
            moving_fps: self.moving_fps,
            layer: self.layer,
            backend: self.backend,
            stop: false,
        });
    }

    /// Moves the camera by the keys that were held since the last step. `read` calls a function
    /// with the input.
    fn step(&mut self, read: impl FnOnce(&mut dyn FnMut(&egui::InputState))) {
        let seconds = self.last.elapsed().as_secs_f64().min(MAX_STEP);
        self.last = Instant::now();
        read(&mut |input| self.held = input::held(input, seconds, &mut self.navigator));
    }
}
