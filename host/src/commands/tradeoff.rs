//! `trisect tradeoff` and `trisect converge`.

use super::{Loaded, open, print, say};
use crate::cli::{ConvergeArgs, JobArgs, QualityArg, ReferenceArgs, TradeoffArgs};
use crate::progress::Bar;
use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;
use trisect::Error;
use trisect::image::ImageError;
use trisect::sampling::Goal;
use trisect::scene::Scene;
use trisect::tradeoff::{
    Convergence, Fit, KNOBS, Lab, Mode, Sweep, TradeoffError, check_seeds, converge, fit, modes,
};

/// An error that no reference has: it takes all its samples.
const NEVER: f64 = 1e-9;

/// Times as many samples as the last that a course is followed to.
const REFERENCE_OF_COURSE: u32 = 8;

/// Pixels from which on FLIP is computed of fewer repetitions.
const LARGE: u64 = 200_000;

/// Nanoseconds that statistics take for a pixel of an image on one thread, and FLIP.
const NANOSECONDS: (f64, f64) = (300.0, 2000.0);

/// A scene with its modes, on a device.
struct Ready {
    scene: Scene,
    base: Mode,
    fast: bool,
    backend: Box<dyn trisect::backend::Backend>,
}

impl Ready {
    fn new(job: &JobArgs) -> Result<Self, Error> {
        let loaded = Loaded::read(job)?;
        loaded.warn();
        let selection = open(job.backend, job.device, job.threads)?;
        let fast = selection.backend.device().backend != "cpu";
        let base = Mode::base(&loaded.settings, job.bvh_quality.map(QualityArg::quality));
        Ok(Self { scene: loaded.scene, base, fast, backend: selection.backend })
    }

    fn modes(&self, knobs: &[String]) -> Result<Vec<Mode>, TradeoffError> {
        let all: Vec<String> = KNOBS.iter().map(|&knob| knob.to_owned()).collect();
        modes(&self.scene, &self.base, if knobs.is_empty() { &all } else { knobs }, self.fast)
    }
}

/// The user's cache, by the XDG base directory specification; none without a home.
pub fn user_cache() -> Option<PathBuf> {
    let home = || std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".cache"));
    std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from).or_else(home)
}

/// Where references are kept.
fn cache(arguments: &ReferenceArgs) -> PathBuf {
    let user = || user_cache().unwrap_or_else(std::env::temp_dir).join("trisect/references");
    arguments.cache.clone().unwrap_or_else(user)
}

/// Turns each knob, measures what it costs, and writes a report.
pub fn run(arguments: &TradeoffArgs) -> Result<ExitCode, Error> {
    check_seeds(arguments.seeds)?;
    let start = Instant::now();
    let ready = Ready::new(&arguments.job)?;
    let modes = ready.modes(&arguments.knobs)?;
    fs::create_dir_all(&arguments.output).map_err(TradeoffError::io(&arguments.output))?;
    let Ready { scene, base, backend, .. } = ready;
    let mut lab = Lab::new(&scene, backend);
    let quiet = arguments.quiet;
    let mut say = |line: &str| {
        if !quiet {
            say(line);
        }
    };
    let mut bar = Bar::of_goal(true);
    let pixels = base.settings.pixels();
    let flips = if pixels > LARGE { 2 } else { 4.min(arguments.seeds) };
    let threads = std::thread::available_parallelism().map_or(1.0, |threads| threads.get() as f64);
    let share = flips as f64 / arguments.seeds.max(1) as f64;
    let analysis = pixels as f64 * (NANOSECONDS.0 + NANOSECONDS.1 * share) * 1e-9 / threads;
    let Fit { mut levels, seeds, reference } =
        fit(arguments.time_limit, modes.len(), arguments.seeds, lab.pace(&base, &mut bar)?, analysis);
    match (&arguments.levels[..], arguments.job.spp) {
        ([], None) => {}
        ([], Some(most)) => levels = vec![most.div_ceil(16), most.div_ceil(4), most],
        (given, _) => levels = given.to_vec(),
    }
    levels.sort_unstable();
    levels.dedup();
    let goal = match arguments.reference.reference_spp {
        Some(most) => Goal::Error { target: NEVER, most },
        None => Goal::Time(reference),
    };
    say(&format!("{} ways, {levels:?} samples a pixel, {seeds} seeds", modes.len()));
    let reference = lab.reference(&base, goal, &cache(&arguments.reference), &mut say, &mut bar)?;
    let facts = &reference.facts;
    say(&format!("reference: {:.0} samples a pixel, own error {:.3} %", facts.samples, 100.0 * facts.error));
    let sweep = Sweep { modes: &modes, levels: &levels, seeds, flips };
    let (mut found, pictures) = lab.measure(&sweep, &reference, &mut say, &mut bar)?;
    found.seconds = start.elapsed().as_secs_f64();
    let files = found.write(&pictures, &arguments.output)?;
    print(&if arguments.json { found.json()? } else { found.summary() })?;
    files.iter().for_each(|file| say(&format!("wrote {}", file.display())));
    Ok(ExitCode::SUCCESS)
}

/// Follows the error of ways of rendering, and compares each two of them.
pub fn follow(arguments: &ConvergeArgs) -> Result<ExitCode, Error> {
    check_seeds(arguments.seeds)?;
    let ready = Ready::new(&arguments.job)?;
    let modes = ready.modes(&arguments.knobs)?;
    if let Some(path) = &arguments.output {
        trisect::output::probe(path)?;
    }
    let Ready { scene, base, backend, .. } = ready;
    let mut lab = Lab::new(&scene, backend);
    let mut bar = Bar::of_goal(true);
    let most =
        arguments.reference.reference_spp.unwrap_or(arguments.last.saturating_mul(REFERENCE_OF_COURSE));
    let goal = Goal::Error { target: NEVER, most };
    let reference = lab.reference(&base, goal, &cache(&arguments.reference), &mut say, &mut bar)?;
    let range = (arguments.first, arguments.last);
    let found: Convergence =
        converge(&mut lab, &scene.name, &modes, range, arguments.seeds, &reference, &mut say, &mut bar)?;
    let json = || {
        serde_json::to_string_pretty(&found).map(|text| text + "\n").map_err(|error| ImageError::Codec {
            path: arguments.output.clone().unwrap_or_else(|| "standard output".into()),
            message: error.to_string(),
        })
    };
    if let Some(path) = &arguments.output {
        fs::write(path, json()?).map_err(|source| ImageError::Io { path: path.clone(), source })?;
    }
    print(&if arguments.json { json()? } else { found.summary() })?;
    Ok(ExitCode::SUCCESS)
}
