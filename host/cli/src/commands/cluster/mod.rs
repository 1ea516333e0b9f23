//! Commands over the ranks that mpirun started. Only rank 0, the root, prints and writes.

#![warn(clippy::too_many_lines)]

pub mod bench;
pub mod render;
pub mod resume;
pub mod view;

use super::signals::noted;
use super::{Loaded, Session};
use crate::cli::{JobArgs, RankArgs};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use trisect::device::{self, Choice, DeviceInfo};
use trisect::output::Outputs;
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect::threads::{ThreadError, start_shared};
use trisect_cluster::handshake::{RankFacts, handshake};
use trisect_cluster::mpi::Mpi;
use trisect_cluster::{ClusterError, Heartbeat, Network, Tag, devices};
use trisect_lab::Error;

/// Connection to all ranks, and the flag that a signal sets.
pub struct ClusterSession {
    /// Messages to and from the other ranks.
    pub link: Heartbeat<Mpi>,
    ended: Arc<AtomicBool>,
}

/// Error that ends the ranks.
struct Abort {
    error: Error,
    /// True if all ranks know the error and end without being aborted.
    known_to_all: bool,
}

impl<E: Into<Error>> From<E> for Abort {
    fn from(error: E) -> Self {
        Self { error: error.into(), known_to_all: false }
    }
}

/// Starts the shared thread pool, for summing and encoding, with `asked` threads. By default, a
/// rank that is not bound to processors gets its share of the host's, where `ranks` ranks run: if
/// each had a thread for every processor, they would compete.
fn share_threads(ranks: u32, asked: Option<u32>) -> Result<(), ThreadError> {
    let bound = std::thread::available_parallelism().map_or(1, usize::from);
    let mut system = sysinfo::System::new();
    system.refresh_cpu_list(sysinfo::CpuRefreshKind::nothing());
    // Without /proc the number of processors is unknown.
    let all = Some(system.cpus().len()).filter(|&all| all > 0).unwrap_or(bound);
    let part = all.div_ceil(ranks.max(1) as usize);
    start_shared(Some(asked.map_or(bound.min(part.max(1)), |asked| asked as usize)))
}

impl ClusterSession {
    /// Starts MPI and the shared thread pool: with `threads`, or with the rank's share of the
    /// host's processors.
    pub fn start(ranks: &RankArgs, threads: Option<u32>) -> Result<Self, Error> {
        let ended = noted();
        let mpi = Mpi::start()?;
        let started = share_threads(mpi.neighbours(), threads);
        let mut crew = Self { link: Heartbeat::new(mpi, ranks.patience()), ended };
        if let Err(error) = started {
            // The others wait for this rank.
            super::eprint(&format!("error: {error}"));
            crew.link.network().abort(error.exit_code());
        }
        Ok(crew)
    }

    /// Returns the flag that is set when this process is asked to end.
    pub fn flag(&self) -> Arc<AtomicBool> {
        self.ended.clone()
    }

    /// Returns a function that returns whether this process was asked to end.
    pub fn ended(&self) -> impl Fn() -> bool + 'static {
        let ended = self.ended.clone();
        move || ended.load(Ordering::Relaxed)
    }

    /// Prints the error once for all ranks, aborts the job, and returns the exit code.
    pub fn give_up(&mut self, error: &Error) -> ExitCode {
        self.end(error, false)
    }

    fn end(&mut self, error: &Error, all_know: bool) -> ExitCode {
        // If the root is lost, the ranks that wait for it print the error.
        let lost = matches!(error, Error::Cluster(ClusterError::Silent { rank: 0, .. }));
        if self.link.is_root() || lost {
            super::eprint(&format!("error: {error}"));
        }
        let code = error.exit_code();
        if !all_know {
            self.link.network().abort(code);
        }
        ExitCode::from(code)
    }

    /// Reads the scene on each rank, or on the root for all, opens each rank's device, and checks
    /// in a handshake that all ranks would render the same image.
    ///
    /// `check` runs first, on the root only, and returns the outputs. `adjust` fits the settings to
    /// the device and returns further fields that must be equal on all ranks. All ranks get a
    /// session, or all get an exit code.
    pub fn assemble(
        &mut self,
        job: &JobArgs,
        ranks: &RankArgs,
        check: impl FnOnce() -> Result<Outputs, Error> + Send + 'static,
        adjust: impl FnOnce(&mut Settings, &DeviceInfo) -> Result<Vec<(String, String)>, Error> + Send + 'static,
    ) -> Result<Session, ExitCode> {
        match self.gather(job, ranks, check, adjust) {
            Ok(session) => Ok(session),
            Err(Abort { error, known_to_all: all_know }) => Err(self.end(&error, all_know)),
        }
    }

    fn gather(
        &mut self,
        job: &JobArgs,
        ranks: &RankArgs,
        check: impl FnOnce() -> Result<Outputs, Error> + Send + 'static,
        adjust: impl FnOnce(&mut Settings, &DeviceInfo) -> Result<Vec<(String, String)>, Error> + Send + 'static,
    ) -> Result<Session, Abort> {
        // An error of this rank does not end it yet: the handshake reports it to the root.
        let ready = match self.load(job, ranks, check)? {
            Ok(loaded) => self.open(loaded, job, ranks, adjust)?,
            Err(error) => Err(error),
        };
        let device = ready.as_ref().map_or_else(
            |_| String::new(),
            |(session, _)| {
                let device = session.renderer.device().info();
                format!("{}: {}", device.backend, device.name)
            },
        );
        let facts = match &ready {
            Ok((_, facts)) => Ok(facts.clone()),
            Err(error) => Err((error.exit_code(), error.to_string())),
        };
        match handshake(&mut self.link, &device, facts) {
            Ok(_) => Ok(ready?.0),
            // The root sends these errors to all ranks; a rank that it does not reach gets another
            // one.
            Err(error @ (ClusterError::Rank { .. } | ClusterError::Mismatch { .. })) => {
                Err(Abort { error: error.into(), known_to_all: true })
            }
            Err(error) => Err(error.into()),
        }
    }

    fn load(
        &mut self,
        job: &JobArgs,
        ranks: &RankArgs,
        check: impl FnOnce() -> Result<Outputs, Error> + Send + 'static,
    ) -> Result<Result<Loaded, Error>, Abort> {
        let job = job.clone();
        if !self.link.is_root() && ranks.broadcast_scene {
            let bytes = self.link.expect(Tag::Scene)?.bytes;
            return Ok(self.link.run_while_polling(move || Loaded::of(Scene::from_bytes(&bytes)?, &job))?);
        }
        if !self.link.is_root() {
            return Ok(self.link.run_while_polling(move || Loaded::read(&job, &Outputs::default()))?);
        }
        let loaded = self.link.run_while_polling(move || {
            let outputs = check()?;
            let loaded = Loaded::read(&job, &outputs)?;
            loaded.warn(&job)?;
            Ok(loaded)
        })?;
        if ranks.broadcast_scene {
            // If the root has no scene, the others fail to decode the empty message, and report
            // that.
            let bytes = loaded.as_ref().map_or_else(|_| Vec::new(), |loaded| loaded.scene.to_bytes());
            self.link.send_all(Tag::Scene, &bytes)?;
        }
        Ok(loaded)
    }

    fn open(
        &mut self,
        loaded: Loaded,
        job: &JobArgs,
        ranks: &RankArgs,
        adjust: impl FnOnce(&mut Settings, &DeviceInfo) -> Result<Vec<(String, String)>, Error> + Send + 'static,
    ) -> Result<Result<(Session, RankFacts), Error>, Abort> {
        let (job, spare, local) = (job.clone(), ranks.spare(), self.link.network().local_rank());
        let open = move || {
            if job.backend == Choice::Auto && job.device.is_some() {
                return Err(trisect::render::SettingsError::DeviceWithoutBackend.into());
            }
            let start = Instant::now();
            let (choice, device) = devices::for_rank(job.backend, job.device, local, spare)?;
            let selection = device::open(choice, device, job.threads.map(|threads| threads as usize))?;
            let mut settings = loaded.settings.clone();
            let others = adjust(&mut settings, selection.device.info())?;
            settings.check()?;
            let digest = loaded.scene.digest();
            let session = loaded.on(selection, start.elapsed().as_secs_f64(), &job)?;
            let fingerprint = session.renderer.fingerprint(&digest, &settings);
            let facts = RankFacts { fingerprint, others };
            Ok((Session { settings, digest: Some(digest), ..session }, facts))
        };
        Ok(self.link.run_while_polling(open)?)
    }
}
