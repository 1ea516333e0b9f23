//! What commands do over the ranks that mpirun started. Rank 0 alone prints and writes.

pub mod bench;
pub mod render;
pub mod resume;
pub mod view;

use super::signals::noted;
use super::{Loaded, Session};
use crate::cli::{BackendArg, JobArgs, QualityArg, RankArgs};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use trisect::Error;
use trisect::backend::{self, Device};
use trisect::cluster::handshake::{FingerprintFields, fingerprint, handshake};
use trisect::cluster::mpi::Mpi;
use trisect::cluster::{ClusterError, Heartbeat, Network, Tag, devices};
use trisect::output::Outputs;
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect::threads::{ThreadError, start_shared};

/// All ranks, and whether this process was asked to end.
pub struct ClusterSession {
    /// The others.
    pub link: Heartbeat<Mpi>,
    ended: Arc<AtomicBool>,
}

/// Why ranks end.
struct Abort {
    error: Error,
    /// Whether all know it, and end by themselves.
    known_to_all: bool,
}

impl<E: Into<Error>> From<E> for Abort {
    fn from(error: E) -> Self {
        Self { error: error.into(), known_to_all: false }
    }
}

/// Leaves a rank that was not bound to processors its part of the host's, for what it sums and encodes: all of them for each rank would be in each
/// other's way.
fn share_threads(ranks: u32, asked: Option<u32>) -> Result<(), ThreadError> {
    let bound = std::thread::available_parallelism().map_or(1, usize::from);
    let mut system = sysinfo::System::new();
    system.refresh_cpu_list(sysinfo::CpuRefreshKind::nothing());
    // Without /proc no one tells how many there are.
    let all = Some(system.cpus().len()).filter(|&all| all > 0).unwrap_or(bound);
    let part = all.div_ceil(ranks.max(1) as usize);
    start_shared(Some(asked.map_or(bound.min(part.max(1)), |asked| asked as usize)))
}

impl ClusterSession {
    /// Starts MPI, and `threads` for what a rank sums and encodes, or its part of the host's.
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

    /// Set when this process is asked to end.
    pub fn flag(&self) -> Arc<AtomicBool> {
        self.ended.clone()
    }

    /// For those who watch it.
    pub fn ended(&self) -> impl Fn() -> bool + 'static {
        let ended = self.ended.clone();
        move || ended.load(Ordering::Relaxed)
    }

    /// Says what is wrong, once for all ranks, and ends them.
    pub fn give_up(&mut self, error: &Error) -> ExitCode {
        self.end(error, false)
    }

    fn end(&mut self, error: &Error, all_know: bool) -> ExitCode {
        // Who waits for a lost root says so itself.
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

    /// Reads the scene on each rank, or on the root for all, opens each rank's device, and finds
    /// out whether all would render the same: `check` is what the root must know before, and
    /// returns what it will write, and `adjust` fits the settings to the device and says what else
    /// must be the same. On all ranks a session, or the end.
    pub fn assemble(
        &mut self,
        job: &JobArgs,
        ranks: &RankArgs,
        check: impl FnOnce() -> Result<Outputs, Error> + Send + 'static,
        adjust: impl FnOnce(&mut Settings, &Device) -> Result<FingerprintFields, Error> + Send + 'static,
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
        adjust: impl FnOnce(&mut Settings, &Device) -> Result<FingerprintFields, Error> + Send + 'static,
    ) -> Result<Session, Abort> {
        // What this rank lacks is no error yet: the root must hear of it.
        let ready = match self.load(job, ranks, check)? {
            Ok(loaded) => self.open(loaded, job, ranks, adjust)?,
            Err(error) => Err(error),
        };
        let device = ready.as_ref().map_or_else(
            |_| String::new(),
            |(session, _)| {
                let device = session.renderer.backend().device();
                format!("{}: {}", device.backend, device.name)
            },
        );
        let facts = match &ready {
            Ok((_, facts)) => Ok(facts.clone()),
            Err(error) => Err((error.exit_code(), error.to_string())),
        };
        match handshake(&mut self.link, &device, facts) {
            Ok(_) => Ok(ready?.0),
            // Each rank has heard it from the root, but for one that heard nothing.
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
            Loaded::read(&job, &outputs)
        })?;
        if let Ok(loaded) = &loaded {
            loaded.warn();
        }
        if ranks.broadcast_scene {
            // Without one, the others have nothing to render, and say so.
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
        adjust: impl FnOnce(&mut Settings, &Device) -> Result<FingerprintFields, Error> + Send + 'static,
    ) -> Result<Result<(Session, FingerprintFields), Error>, Abort> {
        let (job, spare, local) = (job.clone(), ranks.spare(), self.link.network().local_rank());
        let open = move || {
            if job.backend == BackendArg::Auto && job.device.is_some() {
                return Err(trisect::render::SettingsError::DeviceWithoutBackend.into());
            }
            let start = Instant::now();
            let (choice, device) = devices::for_rank(job.backend.choice(), job.device, local, spare)?;
            let selection = backend::open(choice, device, job.threads.map(|threads| threads as usize))?;
            let mut settings = loaded.settings.clone();
            let more = adjust(&mut settings, selection.backend.device())?;
            settings.check()?;
            let digest = loaded.scene.digest();
            let quality = job.bvh_quality.map(QualityArg::quality);
            let mut facts = fingerprint(&digest, &settings, quality);
            facts.extend(more);
            let session = loaded.on(selection, start.elapsed().as_secs_f64(), &job)?;
            Ok((Session { settings, digest: Some(digest), ..session }, facts))
        };
        Ok(self.link.run_while_polling(open)?)
    }
}
