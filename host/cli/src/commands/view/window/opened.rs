//! Scenes that the window opens after the first one: other files that are dropped on it, and the
//! same one after a change.

use super::super::super::Session;
use super::super::metered;
use crate::cli::JobArgs;
use std::time::{Duration, Instant};
use trisect::input::{self, OpenedFiles};
use trisect::output::Outputs;
use trisect::output::exposure::Exposure;
use trisect::scene::{CameraPose, Rebase};
use trisect::view::ViewOptions;
use trisect_lab::Error;

/// Scene that is shown from now on.
#[derive(Clone, Debug)]
pub struct Opened {
    /// Scene or model, with the options with which it was read.
    pub job: JobArgs,
    /// Name of the scene.
    pub name: String,
    /// Space in which it is computed.
    pub space: Rebase,
    /// Camera of the file; `None` if the camera stays where it is.
    pub camera: Option<CameraPose>,
    /// Exposure in stops for another scene, unless the user gives one.
    pub stops: Option<f32>,
}

/// Files of the scene that is shown, and its camera.
pub struct SceneFiles {
    files: OpenedFiles,
    camera: CameraPose,
    space: Rebase,
    /// True if the exposure of other scenes is determined, because the user gives none.
    meters: bool,
    /// Time of the last look at the files.
    looked: Instant,
}

/// Time between two looks at the scene's files.
pub const LOOK: Duration = Duration::from_millis(300);

impl SceneFiles {
    /// Returns the files that were opened for a session, since they are recorded.
    pub fn of(session: &Session, meters: bool) -> Self {
        let (files, camera) = (input::recorded(), *session.renderer.pose());
        Self { files, camera, space: session.space, meters, looked: Instant::now() }
    }

    /// Returns whether one of the files was written since it was read; false if the last look at
    /// them is not [`LOOK`] ago.
    pub fn have_changed(&mut self) -> bool {
        if self.looked.elapsed() < LOOK {
            return false;
        }
        self.looked = Instant::now();
        self.files.first_changed().is_some()
    }

    /// Reads a scene and opens it on its device. The camera is that of the file, but for one that
    /// `is_same` and has the camera that it had.
    pub fn open(
        &mut self,
        job: &JobArgs,
        look: &ViewOptions,
        is_same: bool,
    ) -> Result<(Session, Opened), Error> {
        input::record();
        let opened = Session::open(job, &Outputs::default());
        // After an error of the same scene, too: the next change of one of its files may remove the
        // cause. After that of another one, the scene that is shown is followed.
        if is_same || opened.is_ok() {
            self.files = input::recorded();
        }
        let mut session = opened?;
        let camera = *session.renderer.pose();
        let stays = is_same && (camera, session.space) == (self.camera, self.space);
        (self.camera, self.space) = (camera, session.space);
        let stops = match job.exposure(None) {
            _ if is_same || !self.meters => None,
            Exposure::Automatic(level) => Some(metered(&mut session, look, level)?),
            Exposure::Stops(stops) => Some(stops),
        };
        let opened = Opened {
            job: job.clone(),
            name: session.name.clone(),
            space: session.space,
            camera: (!stays).then_some(camera),
            stops,
        };
        Ok((session, opened))
    }
}
