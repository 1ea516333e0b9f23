//! Session of a page: a device, the scene on it, its live frames and the image that it renders.

use super::request::{BackendName, ImageRequest, Move, Request};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use trisect::Error;
use trisect::checkpoint::{self, Header, Identity};
use trisect::device::{self, BackendError, Choice, Device, DeviceKind, Selection};
use trisect::film::Film;
use trisect::image::{Image, ImageError, metrics::srgb};
use trisect::output::exposure::Exposed;
use trisect::output::{Encoding, Picture};
use trisect::render::{FilmObserver, PreparedScene, RenderObserver, Renderer, Settings};
use trisect::scene::{
    CameraPose, EnvironmentSource, LoadOptions, Rebase, Scene, SceneDocument, Surroundings,
};
use trisect::view::{Navigator, ViewOptions, Viewer};

/// Failure of a request.
#[derive(Debug)]
pub enum WebError {
    /// The library's error.
    Library(Error),
    /// The request needs an earlier one.
    Needs(&'static str),
}

impl<E: Into<Error>> From<E> for WebError {
    fn from(error: E) -> Self {
        Self::Library(error.into())
    }
}

impl std::fmt::Display for WebError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Library(error) => error.fmt(f),
            Self::Needs(what) => f.write_str(what),
        }
    }
}

/// Answer to a request.
#[derive(Clone, Debug, Default)]
pub struct Answer {
    /// Facts by name.
    pub facts: Value,
    /// Pixels, or the content of a file.
    pub bytes: Vec<u8>,
}

impl From<Value> for Answer {
    fn from(facts: Value) -> Self {
        Self { facts, bytes: Vec::new() }
    }
}

/// Image that is rendered part by part.
struct Rendering {
    film: Film,
    settings: Settings,
    image: ImageRequest,
    seconds: f64,
    /// Image with its filter, once it is complete.
    finished: Option<Image>,
}

/// Scene on the device.
struct Shown {
    viewer: Viewer,
    camera: Navigator,
    scene: Scene,
    digest: [u8; 32],
    pixels: Vec<u32>,
}

/// Session of a page. Progress and the wish to stop are shared with the page.
pub struct Session {
    /// Receives the samples done and their total.
    progress: fn(u64, u64),
    /// True if the page wishes the render to end.
    stop: &'static AtomicBool,
    device: Option<Box<dyn Device>>,
    /// Backend that was opened last.
    backend: Option<BackendName>,
    shown: Option<Shown>,
    rendering: Option<Rendering>,
}

/// Observer that ends a render after its first part.
struct OnePart {
    has_ended: AtomicBool,
}

impl FilmObserver for OnePart {
    fn should_continue(&self) -> bool {
        !self.has_ended.load(Ordering::Relaxed)
    }

    fn part_added(&self, _: &Film) {
        self.has_ended.store(true, Ordering::Relaxed);
    }
}

struct Progress {
    report: fn(u64, u64),
    stop: &'static AtomicBool,
    /// Number of samples of the whole image.
    whole: u64,
}

impl RenderObserver for Progress {
    fn progress(&mut self, done: u64, missing: u64) -> ControlFlow<()> {
        (self.report)(self.whole.saturating_sub(missing) + done, self.whole);
        if self.stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

const NO_DEVICE: WebError = WebError::Needs("no device is open");
const NO_SCENE: WebError = WebError::Needs("no scene is loaded");
const NO_IMAGE: WebError = WebError::Needs("no image was rendered");

impl Session {
    /// Returns a session without a device. `progress` receives the samples done and their total;
    /// `stop` ends a render.
    pub fn new(progress: fn(u64, u64), stop: &'static AtomicBool) -> Self {
        Self { progress, stop, device: None, backend: None, shown: None, rendering: None }
    }

    /// Answers a request.
    ///
    /// # Errors
    ///
    /// [`WebError`] for what the library refuses, and for a request that needs an earlier one.
    pub fn answer(&mut self, request: Request) -> Result<Answer, WebError> {
        match request {
            Request::Open { backend } => self.open(backend),
            Request::Load { path, panorama } => self.load(&path, panorama),
            Request::View { image, scale, moves } => self.view(&image, scale, &moves),
            Request::Begin { image } => self.begin(image),
            Request::Part => self.part(),
            Request::Save { name } => self.save(&name),
            Request::Film => self.film(),
            Request::FirstHits { image, sample } => self.first_hits(&image, sample),
        }
    }

    fn open(&mut self, backend: BackendName) -> Result<Answer, WebError> {
        (self.device, self.shown, self.rendering) = (None, None, None);
        let cpu = |why: String| Ok::<_, BackendError>((Selection::of(Choice::Cpu)?, why));
        let (opened, why) = match backend {
            BackendName::Cpu => cpu(String::new())?,
            // The only adapter, by its index, so also one of software.
            BackendName::Wgpu => (device::open(Choice::Wgpu, Some(0), None)?, String::new()),
            BackendName::Auto => match Selection::of(Choice::Wgpu) {
                Ok(opened) => (opened, String::new()),
                Err(error) => cpu(error.to_string())?,
            },
        };
        let info = opened.device.info();
        let facts = json!({
            "backend": info.backend, "name": info.name, "details": info.details, "why": why,
            "slow": info.kind != DeviceKind::Gpu,
        });
        (self.device, self.backend) = (Some(opened.device), Some(backend));
        Ok(facts.into())
    }

    /// Opens the device again that was open.
    fn reopened(&mut self) -> Result<Box<dyn Device>, WebError> {
        self.open(self.backend.ok_or(NO_DEVICE)?)?;
        self.device.take().ok_or(NO_DEVICE)
    }

    fn load(&mut self, path: &str, panorama: Option<String>) -> Result<Answer, WebError> {
        self.rendering = None;
        let environment = panorama.map(|path| EnvironmentSource::File(path.into()));
        let surroundings = Surroundings { environment, ..Default::default() };
        let options = LoadOptions { surroundings, ..Default::default() };
        let document = SceneDocument::load_with(Path::new(path), &options)?;
        let scene = document.lower(Rebase::IDENTITY)?;
        let mut prepared = PreparedScene::new(&scene, None)?;
        let device = match (self.shown.take(), self.device.take()) {
            (Some(shown), _) => shown.viewer.into_renderer().into_device(),
            (None, Some(device)) => device,
            (None, None) => self.reopened()?,
        };
        // A scene that does not fit takes the device with it; the next one opens it again.
        let viewer = Viewer::new(Renderer::upload(device, &mut prepared)?);
        let of_file = Settings::of(&scene);
        let facts = json!({
            "name": scene.name, "warnings": scene.warnings, "primitives": scene.primitives(),
             "width": of_file.width, "height": of_file.height,
            "samples": of_file.samples, "depth": of_file.depth,
        });
        let camera = Navigator::new(scene.camera);
        let digest = scene.digest();
        self.shown = Some(Shown { viewer, camera, scene, digest, pixels: Vec::new() });
        Ok(facts.into())
    }

    fn view(&mut self, image: &ImageRequest, scale: f64, moves: &[Move]) -> Result<Answer, WebError> {
        let shown = self.shown.as_mut().ok_or(NO_SCENE)?;
        moves.iter().for_each(|&of| of.apply(&mut shown.camera));
        let settings = Settings { samples: 1, ..image.settings(&shown.scene) };
        let mut look = ViewOptions::new(settings, image.filter());
        (look.scale, look.max_samples, look.screen.stops) = (scale, image.samples, image.stops);
        let pose = shown.pose();
        if shown.viewer.is_converged(&look, &pose) {
            return Ok(json!({ "rests": true }).into());
        }
        let frame = shown.viewer.frame(&look, &pose, &mut shown.pixels)?;
        let facts = json!({
            "width": frame.size.0, "height": frame.size.1, "samples": frame.live.samples,
            "seconds": frame.whole.as_secs_f64(), "rests": shown.viewer.is_converged(&look, &pose),
        });
        Ok(Answer { facts, bytes: shown.pixels.iter().flat_map(|pixel| pixel.to_le_bytes()).collect() })
    }

    fn begin(&mut self, image: ImageRequest) -> Result<Answer, WebError> {
        let shown = self.shown.as_mut().ok_or(NO_SCENE)?;
        let mut settings = image.settings(&shown.scene);
        let filter = image.filter();
        settings.guides = filter.is_some();
        settings.check()?;
        let pose = shown.pose();
        shown.viewer.renderer().set_camera(pose)?;
        let film = match settings.guides {
            true => Film::with_aovs(settings.width, settings.height),
            false => Film::new(settings.width, settings.height),
        };
        self.stop.store(false, Ordering::Relaxed);
        self.rendering = Some(Rendering { film, settings, image, seconds: 0.0, finished: None });
        Ok(json!({}).into())
    }

    fn part(&mut self) -> Result<Answer, WebError> {
        let shown = self.shown.as_mut().ok_or(NO_SCENE)?;
        let now = self.rendering.as_mut().ok_or(NO_IMAGE)?;
        let (renderer, samples) = (shown.viewer.renderer(), 0..now.settings.samples);
        let whole = now.settings.total_samples();
        let mut observer = Progress { report: self.progress, stop: self.stop, whole };
        let part = OnePart { has_ended: AtomicBool::new(false) };
        match renderer.render_missing(&mut now.film, &now.settings, &samples, &part, &mut observer) {
            Ok(stats) => now.seconds += stats.phases.render_seconds,
            // The film keeps the parts before this one.
            Err(Error::Cancelled) => {}
            Err(error) => return Err(error.into()),
        }
        let is_complete = now.film.coverage.missing(&samples).is_empty();
        if is_complete && let Some(filter) = now.image.filter() {
            now.finished = Some(renderer.denoise(&now.film, &now.settings, filter)?.0);
        }
        let image = now.finished.clone().unwrap_or_else(|| now.film.image());
        let mut facts = json!({
            "width": image.width, "height": image.height, "done": is_complete,
            "seconds": now.seconds, "samples": now.settings.samples,
        });
        if is_complete {
            facts["fingerprint"] = json!(fingerprint(&image)?);
        }
        Ok(Answer { facts, bytes: displayed(&image, now.image.stops) })
    }

    fn save(&mut self, name: &str) -> Result<Answer, WebError> {
        let now = self.rendering.as_ref().ok_or(NO_IMAGE)?;
        let mut image = now.finished.clone().unwrap_or_else(|| now.film.image());
        let path = Path::new(name);
        if trisect::output::Format::of(path).is_ok_and(trisect::output::Format::is_display) {
            Exposed { stops: now.image.stops, automatic: None }.apply(&mut image);
        }
        let bytes = Picture::from(&image).encode(path, &Encoding::default())?;
        Ok(Answer { facts: json!({ "bytes": bytes.len() }), bytes })
    }

    fn film(&mut self) -> Result<Answer, WebError> {
        let shown = self.shown.as_mut().ok_or(NO_SCENE)?;
        let now = self.rendering.as_ref().ok_or(NO_IMAGE)?;
        let header = Header {
            format: checkpoint::FORMAT,
            identity: Identity::new(&shown.digest, &now.settings, shown.viewer.renderer()),
            scene: shown.scene.name.clone(),
            command: Vec::new(),
            folder: Path::new("").to_owned(),
            spp: now.settings.samples,
            samples: 0..now.settings.samples,
            seconds: now.seconds,
            camera: None,
        };
        let bytes = checkpoint::encode(&header, &now.film)?;
        Ok(Answer { facts: json!({ "bytes": bytes.len() }), bytes })
    }

    fn first_hits(&mut self, image: &ImageRequest, sample: u32) -> Result<Answer, WebError> {
        let shown = self.shown.as_mut().ok_or(NO_SCENE)?;
        let (settings, pose) = (image.settings(&shown.scene), shown.pose());
        shown.viewer.renderer().set_camera(pose)?;
        let hits = shown.viewer.renderer().first_hits(&settings, sample)?;
        let bytes = hits.iter().flat_map(|hit| hit.primitive.to_le_bytes()).collect();
        Ok(Answer { facts: json!({ "width": settings.width, "height": settings.height }), bytes })
    }
}

impl Shown {
    /// Returns the pose of the camera: the file's own bits, unless the camera was moved.
    fn pose(&self) -> CameraPose {
        let start = Navigator::new(self.scene.camera).pose();
        if self.camera.pose() == start { self.scene.camera } else { self.camera.pose() }
    }
}

/// Returns the SHA-256 of the image as a .pfm file, hexadecimal.
fn fingerprint(image: &Image) -> Result<String, ImageError> {
    let bytes = Picture::from(image).encode(Path::new("image.pfm"), &Encoding::default())?;
    Ok(Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Returns an image as a screen shows it: RGBA with 8 bits each.
fn displayed(image: &Image, stops: f32) -> Vec<u8> {
    let factor = stops.exp2();
    let bytes = image.pixels.iter().flat_map(|pixel| {
        let [red, green, blue] = pixel.map(|channel| srgb::encode_u8(channel * factor));
        [red, green, blue, 255]
    });
    bytes.collect()
}
