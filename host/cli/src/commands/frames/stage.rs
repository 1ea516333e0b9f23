//! A scene that moves, on a device.

use super::super::{Loaded, Session, eprint, fit_to_cpu, open, warn};
use crate::cli::{JobArgs, MetadataArg, RenderArgs};
use std::collections::HashSet;
use std::sync::Arc;
use std::time::Instant;
use trisect::device::Choice;
use trisect::error::MotionError;
use trisect::layers::Aov;
use trisect::output::Outputs;
use trisect::render::{PreparedScene, SceneTree};
use trisect::scene::{AnimatedScene, CameraPath, CameraPose, Scene, SceneError};
use trisect::surfaces::{NeighbourFrame, SurfaceScenes};
use trisect_lab::Error;

/// A scene at one time on a device, and how it is brought to another time.
pub struct Stage {
    /// Renderer, with the scene at the current time.
    pub session: Session,
    /// Scene at the current time.
    pub scene: Scene,
    /// Number of times at which the BVH was refitted, and built.
    pub trees: (u32, u32),
    animated: AnimatedScene,
    job: JobArgs,
    /// True with `--fallback`.
    falls_back: bool,
    outputs: Outputs,
    /// BVH at the current time.
    tree: Option<SceneTree>,
    /// Time of the scene in seconds.
    time: f64,
    /// Warnings that were printed.
    said: HashSet<String>,
    /// Path of the camera; `None` for the camera of the scene.
    track: Option<Track>,
    /// Frames per second, if the frames beside an image are needed.
    neighbours_at: Option<f64>,
}

/// Path of the camera, and the times of its frames.
pub struct Track {
    /// Poses at frames.
    pub path: CameraPath,
    /// Time of frame 0 in seconds.
    pub start: f64,
    /// Frames per second.
    pub fps: f64,
}

impl Track {
    /// Returns the pose at a time in seconds.
    fn pose(&self, time: f64) -> Result<CameraPose, SceneError> {
        let frame = (time - self.start) * self.fps;
        // The time of a whole frame is rounded.
        let whole = frame.round();
        self.path.pose_at(if (frame - whole).abs() < 1e-6 { whole } else { frame })
    }
}

impl Stage {
    /// Reads the scene of a command whose option `option` makes it move, or its camera along a
    /// track, and uploads it at a time in seconds, after the checks of
    /// [`Session::open_to_render`].
    pub fn open(
        job: JobArgs,
        arguments: &RenderArgs,
        outputs: Outputs,
        (option, track): (&'static str, Option<Track>),
        time: f64,
    ) -> Result<Self, Error> {
        let keep = &arguments.checkpointing;
        let start = Instant::now();
        let path = job.scene.as_ref().ok_or(MotionError::BuiltIn { option })?;
        outputs.check_inputs("the scene", &job.scene)?;
        let mut animated = match track {
            Some(_) => AnimatedScene::load_moving_or_not(path, &job.load.options())?,
            None => AnimatedScene::load(path, &job.load.options())?,
        };
        animated.sharing = job.instances.into();
        animated.camera = job.camera.choice();
        let document = animated.document(time)?;
        let loaded = Loaded::of_document(&job, &outputs, document, start, |of| animated.lower(of))?;
        loaded.warn(&job)?;
        let said = loaded.warnings.iter().cloned().collect();
        let mut prepared = PreparedScene::new(&loaded.scene, job.bvh_quality)?;
        let start = Instant::now();
        let opened = open(job.backend, job.device, job.threads).and_then(|selection| {
            loaded.prepared_on(&mut prepared, selection, start.elapsed().as_secs_f64())
        });
        let mut session = Session::or_on_cpu(opened, &loaded, &job, keep)?;
        let has_metadata = arguments.file.metadata() != MetadataArg::None;
        session.digest = has_metadata.then(|| loaded.scene.digest());
        let tree = Some(prepared.into_tree());
        let (scene, falls_back) = (loaded.scene, keep.fallback.is_some());
        let trees = (0, 1);
        let neighbours_at = arguments.aov.contains(&Aov::Motion).then(|| arguments.motion.fps());
        let mut stage = Self {
            session,
            scene,
            trees,
            animated,
            job,
            falls_back,
            outputs,
            tree,
            time,
            said,
            track,
            neighbours_at,
        };
        stage.aim(time)?;
        stage.note_surfaces()?;
        Ok(stage)
    }

    /// Brings the camera to a time of its track.
    fn aim(&mut self, time: f64) -> Result<(), Error> {
        if let Some(track) = &self.track {
            let pose = self.session.space.camera(&track.pose(time)?);
            self.session.renderer.set_camera(pose)?;
            self.time = time;
        }
        Ok(())
    }

    /// Brings the scene to the first moment of an image, and prints the warnings that are new.
    pub fn begin_frame(&mut self, time: f64) -> Result<(), Error> {
        if time == self.time {
            return Ok(());
        }
        if !self.animated.moves() {
            self.aim(time)?;
            return self.note_surfaces();
        }
        let start = Instant::now();
        let document = self.animated.document(time)?;
        let animated = &mut self.animated;
        let loaded = Loaded::of_document(&self.job, &self.outputs, document, start, |of| animated.lower(of))?;
        let new = loaded.warnings.iter().filter(|warning| self.said.insert((*warning).clone()));
        let new: Vec<String> = new.map(|warning| format!("at {time:.3} s: {warning}")).collect();
        warn(&new, &loaded.scene.name, self.job.deny_warnings)?;
        // An image is identified by the scene at its first moment.
        if let Some(digest) = &mut self.session.digest {
            *digest = loaded.scene.digest();
        }
        self.set_scene(loaded.scene, time, start)?;
        self.note_surfaces()
    }

    /// Keeps the scene, and those of the frames beside it, if layers need them.
    fn note_surfaces(&mut self) -> Result<(), Error> {
        if !self.job.needs_surfaces {
            return Ok(());
        }
        let neighbours = match self.neighbours_at {
            Some(fps) => {
                Some([self.neighbour(self.time - 1.0 / fps)?, self.neighbour(self.time + 1.0 / fps)?])
            }
            None => None,
        };
        let scenes = SurfaceScenes { scene: Arc::new(self.scene.clone()), neighbours };
        let unknown =
            "objects appear or vanish beside this frame: its layer of motion has that of the camera alone";
        if !scenes.can_be_compared() {
            let at = format!("at {:.3} s: {unknown}", self.time);
            warn(&[at], &self.scene.name, self.job.deny_warnings)?;
        }
        self.session.surfaces = Some(scenes);
        Ok(())
    }

    /// Returns the frame at another time.
    fn neighbour(&mut self, time: f64) -> Result<NeighbourFrame, Error> {
        let scene = match self.animated.moves() {
            true => {
                let document = self.animated.document(time)?;
                Some(Arc::new(self.animated.lower(document)?))
            }
            false => None,
        };
        let camera = match &self.track {
            Some(track) => self.session.space.camera(&track.pose(time)?),
            None => scene.as_ref().map_or(self.scene.camera, |scene| scene.camera),
        };
        Ok(NeighbourFrame { scene, camera })
    }

    /// Brings the scene to another moment of an image.
    pub fn begin_moment(&mut self, time: f64) -> Result<(), Error> {
        if time == self.time {
            return Ok(());
        }
        if !self.animated.moves() {
            return self.aim(time);
        }
        let start = Instant::now();
        let document = self.animated.document(time)?;
        debug_assert_eq!(document.space, self.session.space, "the file states the space");
        let scene = self.animated.lower(document)?;
        self.set_scene(scene, time, start)
    }

    fn set_scene(&mut self, scene: Scene, time: f64, start: Instant) -> Result<(), Error> {
        self.session.load_seconds = start.elapsed().as_secs_f64();
        let quality = self.job.bvh_quality;
        let mut prepared = match self.tree.take() {
            Some(tree) => PreparedScene::moved(&scene, quality, tree)?,
            None => PreparedScene::new(&scene, quality)?,
        };
        *(if prepared.is_refitted() { &mut self.trees.0 } else { &mut self.trees.1 }) += 1;
        let Session { renderer, settings, fell_back, .. } = &mut self.session;
        // The fallback is the CPU, which another CPU backend cannot replace.
        let mut may_fall_back = self.falls_back && !*fell_back && renderer.device().info().backend != "cpu";
        renderer.set_scene_with_fallback(&mut prepared, &mut |error| {
            if !std::mem::take(&mut may_fall_back) {
                return None;
            }
            *fell_back = true;
            eprint(&format!("warning: {error}\n  the CPU continues (--fallback)"));
            fit_to_cpu(settings);
            Some(open(Choice::Cpu, None, self.job.threads).map(|selection| selection.device))
        })?;
        self.tree = Some(prepared.into_tree());
        (self.scene, self.time) = (scene, time);
        self.aim(time)
    }
}
