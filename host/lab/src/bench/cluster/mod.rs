//! Measures how renders scale with ranks, for `trisect bench cluster`: the charts of the report
//! "Parallelizing Ray Tracing", with this program's method of assembling pixels and the report's.
//!
//! Each number of ranks is measured in turn, while the other ranks wait. Rows: display frames are
//! sent to the root while the next one is rendered ([`series`](trisect_cluster::series)), against
//! an all-reduce of the whole image in f32 after each frame. Averages: images of some samples are
//! sent up a tree, against the same all-reduce. Also measured: noise of averages, and denoised
//! frames.

mod charts;
mod denoised;
mod measure;

pub use denoised::{BorderSource, Denoised};
pub use measure::{Average, GatherMethod, Noise, Point, RowFrames};

use crate::Error;
use crate::bench::BenchError;
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};
use trisect::render::{Renderer, Settings};
use trisect_cluster::cost::{Machine, Shape};
use trisect_cluster::{ClusterError, Heartbeat, Network};

/// Version of the JSON format.
const FORMAT: u32 = 1;

/// Numbers of ranks, samples and frames to measure.
#[derive(Clone, Debug)]
pub struct ClusterBenchPlan {
    /// Numbers of ranks to measure.
    pub ranks: Vec<u32>,
    /// Samples per pixel of frames distributed by rows.
    pub spp: Vec<u32>,
    /// Frames that count, after the warm-up.
    pub frames: u32,
    /// Samples per pixel of an averaged image, of all ranks together.
    pub average: u32,
    /// Samples per pixel that each rank adds where noise is measured.
    pub noise: u32,
    /// Rows of a block, as a power of two (log2).
    pub block_shift: u32,
    /// True if ranks spin while they wait.
    pub spins: bool,
    /// Methods of assembling the pixels on the root.
    pub ways: Vec<GatherMethod>,
}

/// Results of the measurement, on the root.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ClusterBench {
    format: u32,
    version: &'static str,
    /// Name of the scene.
    pub scene: String,
    /// Device of rank 0.
    pub device: String,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Measured rates of the ranks and the network between them.
    pub machine: Machine,
    /// Frames distributed by rows.
    pub frames: Vec<RowFrames>,
    /// Averaged images.
    pub averages: Vec<Average>,
    /// Noise of averaged images.
    pub noise: Vec<Noise>,
    /// Denoised frames.
    pub denoised: Vec<Denoised>,
}

/// Returns whether [`ClusterBench::write`] writes a file of this name.
pub fn is_output(name: &Path) -> bool {
    let is_kind = ["svg", "png", "json", "csv"].iter().any(|kind| name.extension() == Some(kind.as_ref()));
    let stem = name.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    let is_rows = stem.starts_with("rows_") && stem.ends_with("spp");
    is_kind && (is_rows || ["average_time", "average_noise", "model", "cluster"].contains(&stem))
}

impl ClusterBench {
    /// Measures all points of the plan. All ranks call this with the same plan and settings; the
    /// root gets the results. `say` is called with a line for each point.
    ///
    /// # Errors
    ///
    /// Errors of rendering and of ranks; [`ClusterError::Unsupported`] for more ranks than were
    /// started.
    pub fn measure<N: Network>(
        link: &mut Heartbeat<N>,
        mut renderer: Renderer,
        scene: &str,
        settings: &Settings,
        plan: &ClusterBenchPlan,
        say: &mut dyn FnMut(&str),
    ) -> Result<(Renderer, Option<Self>), Error> {
        let all = link.ranks();
        if plan.ranks.iter().any(|&ranks| ranks == 0 || ranks > all) {
            let what = format!("`counts` {:?}: {all} ranks were started", plan.ranks);
            let remedy = "start more with mpirun -n, or name fewer in `counts`".to_owned();
            return Err(ClusterError::Unsupported { what, remedy }.into());
        }
        let device = renderer.device().info().clone();
        let mut machine;
        let trial = Settings { samples: plan.spp.iter().copied().max().unwrap_or(1), ..settings.clone() };
        (renderer, machine) = trisect_cluster::cost::measure(link, renderer, &trial)?;
        if let Some(together) = machine {
            let alone;
            (renderer, alone) = trisect_cluster::cost::with_slowdown(link, renderer, &trial, together)?;
            machine = Some(alone);
        }
        let mut bench = Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION"),
            scene: scene.to_owned(),
            device: format!("{}: {}", device.backend, device.name),
            width: settings.width,
            height: settings.height,
            machine: machine.unwrap_or(Machine::UNKNOWN),
            frames: Vec::new(),
            averages: Vec::new(),
            noise: Vec::new(),
            denoised: Vec::new(),
        };
        for &spp in &plan.spp {
            let settings = Settings { samples: spp, ..settings.clone() };
            let mut points = Vec::new();
            for &ranks in &plan.ranks {
                for &way in &plan.ways {
                    let point;
                    (renderer, point) = measure::with_ranks(link, renderer, ranks, |link, renderer| {
                        measure::rows(link, renderer, &settings, plan, ranks, way)
                    })?;
                    if let Some(point) = point {
                        say(&format!("rows, {spp} spp, {}", point.line(ranks, way)));
                        points.push((ranks, way, point));
                    }
                }
            }
            bench.frames.push(RowFrames::new(spp, points, &bench.machine, &Shape::of(&settings), plan));
        }
        let settings_of = |samples| Settings { samples, ..settings.clone() };
        for &ranks in &plan.ranks {
            for &way in &plan.ways {
                let settings = settings_of(plan.average);
                let point;
                (renderer, point) = measure::with_ranks(link, renderer, ranks, |link, renderer| {
                    measure::average(link, renderer, &settings, ranks, way)
                })?;
                if let Some(point) = point {
                    say(&format!("average, {} spp, {}", plan.average, point.line(ranks, way)));
                    let shape = Shape::of(&settings);
                    let one = bench.averages.iter().find(|one| one.ranks == 1 && one.way == way);
                    let one = one.map(|one| one.point.render).or((ranks == 1).then_some(point.render));
                    bench.averages.push(Average::new(ranks, way, point, &bench.machine, &shape, one));
                }
            }
        }
        for &ranks in &plan.ranks {
            let settings = settings_of(plan.noise * ranks);
            let noise;
            (renderer, noise) = measure::with_ranks(link, renderer, ranks, |link, renderer| {
                measure::noise(link, renderer, &settings, ranks)
            })?;
            if let Some(noise) = noise {
                say(&format!("noise, {} spp a rank, {ranks} ranks: RMS {noise:.6}", plan.noise));
                bench.noise.push(Noise { ranks, spp: settings.samples, rms: noise });
            }
        }
        for &ranks in &plan.ranks {
            for around in [BorderSource::Halo, BorderSource::Gathered] {
                let point;
                (renderer, point) = measure::with_ranks(link, renderer, ranks, |link, renderer| {
                    denoised::denoised(link, renderer, settings, plan, ranks, around)
                })?;
                if let Some(point) = point {
                    say(&format!(
                        "denoised, 1 spp, {ranks} ranks, {around:?}: frame {:.3} ms",
                        point.frame * 1e3
                    ));
                    bench.denoised.push(Denoised { ranks, around, point });
                }
            }
        }
        let root = link.is_root();
        Ok((renderer, root.then_some(bench)))
    }

    /// Writes charts and data into a folder, which is created if necessary. Returns the paths of
    /// the files.
    ///
    /// # Errors
    ///
    /// [`BenchError`] if a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>, BenchError> {
        fs::create_dir_all(folder).map_err(BenchError::io(folder))?;
        let mut files = charts::write(self, folder)?;
        let path = folder.join("cluster.json");
        let json = serde_json::to_string_pretty(self).map_err(|error| BenchError::encode(&path, error))?;
        fs::write(&path, json + "\n").map_err(BenchError::io(&path))?;
        files.push(path);
        let path = folder.join("cluster.csv");
        fs::write(&path, self.csv()).map_err(BenchError::io(&path))?;
        files.push(path);
        Ok(files)
    }

    /// Returns a CSV table with one line per measured point.
    pub fn csv(&self) -> String {
        let mut text = "what,spp,ranks,way,frame_s,render_s,device_s,sync_s,bytes,model_frame_s\n".to_owned();
        let mut line = |what: &str, spp: u32, ranks: u32, way: GatherMethod, point: &Point| {
            text += &format!(
                "{what},{spp},{ranks},{},{},{},{},{},{},{}\n",
                way.name(),
                point.frame,
                point.render,
                point.device,
                point.sync,
                point.bytes,
                point.model.frame()
            );
        };
        for frames in &self.frames {
            frames
                .points
                .iter()
                .for_each(|(ranks, way, point)| line("rows", frames.spp, *ranks, *way, point));
        }
        for average in &self.averages {
            line("average", average.spp, average.ranks, average.way, &average.point);
        }
        text
    }

    /// Returns a summary for people.
    pub fn summary(&self) -> String {
        let mut text = format!(
            "scene     {}\ndevice    {}\nframe     {}x{}\nmachine   {:.1} Msamples/s per rank, {:.2} ms fixed per image; messages: latency {:.1} us ({:.1} us each of many), {:.2} GB/s\nhost      {:.3} ms until another thread answers; all ranks at once render {:.2} times as long\n\n",
            self.scene,
            self.device,
            self.width,
            self.height,
            self.machine.rate * 1e-6,
            self.machine.fixed * 1e3,
            self.machine.latency * 1e6,
            self.machine.overhead * 1e6,
            self.machine.bandwidth * 1e-9,
            self.machine.handoff * 1e3,
            self.machine.slowdown
        );
        text += &format!(
            "{:<14} {:>6} {:>6} {:<10} {:>10} {:>10} {:>10} {:>10} {:>7} {:>9} {:>9}\n",
            "",
            "spp",
            "ranks",
            "sync",
            "frame ms",
            "render ms",
            "device ms",
            "sync ms",
            "sync %",
            "speed-up",
            "model ms"
        );
        let mut row = |what: &str, spp: u32, ranks: u32, way: GatherMethod, point: &Point, one: f64| {
            text += &format!(
                "{what:<14} {spp:>6} {ranks:>6} {:<10} {:>10.3} {:>10.3} {:>10.3} {:>10.3} {:>7.1} {:>9.2} {:>9.3}\n",
                way.name(),
                point.frame * 1e3,
                point.render * 1e3,
                point.device * 1e3,
                point.sync * 1e3,
                point.sync / point.frame.max(1e-12) * 100.0,
                one / point.frame.max(1e-12),
                point.model.frame() * 1e3
            );
        };
        for frames in &self.frames {
            for (ranks, way, point) in &frames.points {
                row("rows", frames.spp, *ranks, *way, point, frames.one_rank(*way));
            }
        }
        for average in &self.averages {
            let one = self.averages.iter().find(|other| other.way == average.way);
            let one = one.map_or(average.point.frame, |one| one.point.frame * f64::from(one.ranks));
            row("average", average.spp, average.ranks, average.way, &average.point, one);
        }
        for denoised in &self.denoised {
            text += &format!(
                "denoised            1 {:>6} {:<10} {:>10.3} {:>10.3} {:>10.3}\n",
                denoised.ranks,
                match denoised.around {
                    BorderSource::Halo => "halo",
                    BorderSource::Gathered => "gathered",
                },
                denoised.point.frame * 1e3,
                denoised.point.render * 1e3,
                denoised.point.device * 1e3
            );
        }
        let first = self.noise.first().map_or(0.0, |noise| noise.rms * f64::from(noise.spp).sqrt());
        for noise in &self.noise {
            let off = noise.rms * f64::from(noise.spp).sqrt() / first.max(1e-300) - 1.0;
            text += &format!(
                "noise          {:>6} {:>6} RMS {:.6}, from 1/sqrt: {:+.1} %\n",
                noise.spp,
                noise.ranks,
                noise.rms,
                off * 100.0
            );
        }
        text
    }
}
