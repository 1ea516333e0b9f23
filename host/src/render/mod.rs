//! Renders a scene on a backend: cuts the work into submissions, merges chunks into the film.

mod camera;
mod schedule;
mod settings;

pub use settings::{Fresnel, MathMode, Settings, SettingsError};

use crate::Error;
use crate::backend::{Backend, Job, Launch, SceneRecords};
use crate::bvh::Bvh;
use crate::film::Film;
use crate::scene::{CameraPose, Scene};
use crate::stats::{Phases, RenderStats};
use schedule::{Pace, Submissions};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};
use trisect_shared::bvh::Child;
use trisect_shared::camera::Camera;
use trisect_shared::film::{CHUNK_SAMPLES, PixelSums};
use trisect_shared::params::RenderParams;
use trisect_shared::path::FirstHit;
use trisect_shared::sky::Sky;

/// Watches a render, and may end it.
pub trait Observer {
    /// Called after each submission: samples done and samples in all.
    fn progress(&mut self, done: u64, total: u64) -> ControlFlow<()>;
}

/// Watches nothing.
impl Observer for () {
    fn progress(&mut self, _: u64, _: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// A finished render.
#[derive(Debug)]
pub struct Frame {
    /// Its sums.
    pub film: Film,
    /// What it took.
    pub stats: RenderStats,
}

/// A scene on a backend, ready for any number of frames.
pub struct Renderer {
    backend: Box<dyn Backend>,
    camera: CameraPose,
    sky: Sky,
    root: Child,
    /// Learned from earlier submissions, kept from frame to frame.
    pace: Pace,
    /// One chunk as the device gives it, kept too.
    chunk: Vec<PixelSums>,
    phases: Phases,
}

impl Renderer {
    /// Builds the BVH and uploads the scene.
    pub fn new(mut backend: Box<dyn Backend>, scene: &Scene) -> Result<Self, Error> {
        let start = Instant::now();
        scene.prove()?;
        let bvh = Bvh::build(scene)?;
        let bvh_seconds = start.elapsed().as_secs_f64();
        let start = Instant::now();
        backend.upload(&SceneRecords::new(scene, &bvh))?;
        let phases =
            Phases { bvh_seconds, upload_seconds: start.elapsed().as_secs_f64(), ..Phases::default() };
        let pace = Pace::new(backend.device().kind);
        Ok(Self {
            backend,
            camera: scene.camera,
            sky: scene.sky,
            root: bvh.root,
            pace,
            chunk: Vec::new(),
            phases,
        })
    }

    /// Cuts work into submissions of about so many samples (a whole row has at least one each), or of 50 ms again. The film does not depend on it.
    pub fn limit_submissions(&mut self, samples: Option<u64>) {
        self.pace.limit(samples);
    }

    /// The backend in use.
    pub fn backend(&self) -> &dyn Backend {
        self.backend.as_ref()
    }

    /// Renders one frame.
    ///
    /// # Errors
    ///
    /// [`Error::Settings`] for sizes out of range or beyond memory, [`Error::Backend`] when the device fails,
    /// [`Error::Cancelled`] when the observer says so.
    pub fn render(&mut self, settings: &Settings, observer: &mut dyn Observer) -> Result<Frame, Error> {
        let start = Instant::now();
        self.prepare(settings)?;
        let mut stats = RenderStats::new(self.backend.device(), settings, self.phases.clone());
        stats.phases.prepare_seconds = start.elapsed().as_secs_f64();

        let start = Instant::now();
        let mut film = Film::new(settings.width, settings.height);
        self.chunk.resize(film.pixels.len(), PixelSums::UNWRITTEN);
        let total = settings.total_samples();
        let mut done = 0;
        let mut merge_time = Duration::ZERO;
        let mut first_sample = 0;
        while first_sample < settings.samples {
            let samples = CHUNK_SAMPLES.min(settings.samples - first_sample);
            let mut submissions = Submissions::new(settings.width, settings.height, samples);
            while let Some(part) = submissions.next(&self.pace) {
                let mut params = self.launch(settings);
                params.first_row = part.first_row;
                params.rows = part.rows;
                params.first_sample = first_sample + part.first_sample;
                params.end_sample = params.first_sample + part.samples;
                params.resume = u32::from(part.first_sample > 0);
                let wall = Instant::now();
                let time = self.backend.render(&Launch::new(params))?;
                let part_samples = part.samples(settings.width);
                self.pace.learn(part_samples, wall.elapsed().max(time));
                stats.submissions += 1;
                stats.device_seconds += time.as_secs_f64();
                done += part_samples;
                if observer.progress(done, total).is_break() {
                    return Err(Error::Cancelled);
                }
            }
            let merge = Instant::now();
            self.backend.read_film(&mut self.chunk)?;
            film.merge(&self.chunk, samples);
            merge_time += merge.elapsed();
            first_sample += samples;
        }
        stats.finish(&film, start.elapsed(), merge_time);
        Ok(Frame { film, stats })
    }

    /// The first hits of one sample of each pixel, row-major.
    pub fn first_hits(&mut self, settings: &Settings, sample: u32) -> Result<Vec<FirstHit>, Error> {
        self.prepare(settings)?;
        let mut params = self.launch(settings);
        params.rows = settings.height;
        params.first_sample = sample;
        params.end_sample = sample.saturating_add(1);
        let mut hits = vec![<FirstHit as bytemuck::Zeroable>::zeroed(); settings.pixels() as usize];
        self.backend.first_hits(&Launch::new(params), &mut hits)?;
        Ok(hits)
    }

    /// Checks the settings, chooses the kernel and makes the film.
    fn prepare(&mut self, settings: &Settings) -> Result<(), Error> {
        settings.check()?;
        self.backend.prepare(&Job {
            width: settings.width,
            height: settings.height,
            features: settings.features(),
            math: settings.math,
        })?;
        Ok(())
    }

    /// The camera's launch record.
    pub fn camera(&self, settings: &Settings) -> Camera {
        camera::record(&self.camera, settings.width, settings.height)
    }

    fn launch(&self, settings: &Settings) -> RenderParams {
        RenderParams {
            camera: self.camera(settings),
            sky: self.sky,
            width: settings.width,
            height: settings.height,
            first_row: 0,
            rows: 0,
            first_sample: 0,
            end_sample: 0,
            resume: 0,
            seed: settings.seed,
            depth: settings.depth,
            root: self.root.0,
            pad0: 0,
            pad1: 0,
        }
    }
}
