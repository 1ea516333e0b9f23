//! Second experiment: speed-up of the methods, and cost of a sample, against the number of spheres.

use super::method::{METHODS, Method, Outcome, frames};
use super::plan::Effort;
use super::{Bench, Conditions, csv, spheres};
use crate::Error;
use crate::bench::{Line, Summary};
use crate::plot::number;
use crate::plot::{Axis, Chart, Plot, Point, Series};
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use trisect::render::Renderer;
use trisect::render::Settings;
use trisect::scene::Scene;

/// Time of each method against the number of spheres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Complexity {
    /// Program, device and settings.
    pub conditions: Conditions,
    /// Points, by method and then by number of spheres.
    pub points: Vec<MethodPoint>,
    /// Points that were not measured, with the reason.
    pub left_out: Vec<LeftOut>,
    /// Growth of the cost, for each method with a BVH.
    pub costs: Vec<Cost>,
}

/// Time of a method on a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct MethodPoint {
    /// Name of the method.
    pub method: String,
    /// Name of the kernel.
    pub kernel: String,
    /// Number of spheres of the scene.
    pub spheres: u32,
    /// Samples per pixel: fewer than the plan's where a method without a BVH would take too long.
    pub samples: u32,
    /// Nanoseconds of device time per sample.
    pub nanoseconds: Summary,
    /// Mean number of path segments (rays) of a sample.
    pub segments: f64,
    /// Speed-up of the median time over the baseline: the first method available at the smallest
    /// number of spheres. See `extrapolated`.
    pub speed_up: Option<f64>,
    /// True if the baseline was too slow here, and its time is extrapolated from its last point in
    /// proportion to the spheres.
    pub extrapolated: bool,
}

/// A point that was not measured.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LeftOut {
    /// Name of the method.
    pub method: String,
    /// Number of spheres from which on the method was left out.
    pub spheres: u32,
    /// Reason.
    pub why: String,
}

/// Growth of a method's cost with the number of spheres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Cost {
    /// Name of the method.
    pub method: String,
    /// Line through the median nanoseconds per sample over the binary logarithm of the number of
    /// spheres.
    pub line: Option<Line>,
    /// Cost at the largest number of spheres over that at 100; `None` without both.
    pub growth: Option<f64>,
}

impl Complexity {
    pub(super) fn measure(bench: &mut Bench) -> Result<Self, Error> {
        let (mut points, mut left_out) = (Vec::new(), Vec::new());
        let mut conditions = None;
        for &count in &bench.plan.counts {
            let scene = spheres(count)?;
            bench.with(&scene, |bench, renderer| {
                for method in METHODS {
                    point(bench, renderer, &scene, count, method, &mut points, &mut left_out)?;
                }
                let settings = bench.plan.settings(Settings::of(&scene), bench.plan.samples);
                conditions = Some(Conditions::new(renderer.device().info(), &settings, bench.plan));
                Ok(())
            })?;
        }
        let Some(conditions) = conditions else {
            return Err(crate::bench::BenchError::NothingToMeasure.into());
        };
        Ok(Self::new(conditions, points, left_out))
    }

    fn new(conditions: Conditions, mut points: Vec<MethodPoint>, left_out: Vec<LeftOut>) -> Self {
        speed_up(&mut points);
        let place = |point: &MethodPoint| METHODS.iter().position(|method| method.name == point.method);
        points.sort_by_key(|point| (place(point), point.spheres));
        let trees = METHODS.iter().filter(|method| !method.is_linear());
        let costs = trees.filter_map(|method| cost(method, &points)).collect();
        Self { conditions, points, left_out, costs }
    }

    fn of<'a>(&'a self, method: &'a Method) -> impl Iterator<Item = &'a MethodPoint> {
        self.points.iter().filter(|point| point.method == method.name)
    }

    fn baseline(&self) -> &str {
        self.points.first().map_or("", |point| &point.method)
    }

    pub(super) fn summary(&self) -> String {
        let mut text = String::new();
        for cost in &self.costs {
            let _ = writeln!(text, "cost against spheres, {}: {}", cost.method, describe(cost));
        }
        for method in METHODS {
            let ups: Vec<String> = self
                .of(method)
                .filter_map(|point| Some(format!("{}: {}×", point.spheres, number(point.speed_up?))))
                .collect();
            if !ups.is_empty() {
                let _ =
                    writeln!(text, "speed-up over {}, {}: {}", self.baseline(), method.name, ups.join(", "));
            }
        }
        for LeftOut { method, spheres, why } in &self.left_out {
            let _ = writeln!(text, "left out: {method} from {spheres} spheres on: {why}");
        }
        text
    }

    fn notes(&self) -> Vec<String> {
        let samples = self.points.iter().map(|point| point.samples).max().unwrap_or(0);
        let mut notes = vec![self.conditions.device(), format!("{}, {samples} spp", self.conditions.image())];
        let mut reasons: Vec<&str> = self.left_out.iter().map(|left| left.why.as_str()).collect();
        reasons.sort_unstable();
        reasons.dedup();
        for reason in reasons {
            let missing = self.left_out.iter().filter(|left| left.why == reason);
            let names: Vec<String> = missing
                .map(|left| {
                    if self.points.iter().any(|point| point.method == left.method) {
                        format!("{} from {} on", left.method, left.spheres)
                    } else {
                        left.method.clone()
                    }
                })
                .collect();
            notes.extend(names.chunks(5).map(|some| format!("left out, {reason}: {}", some.join("; "))));
        }
        notes
    }

    pub(super) fn speed_up_chart(&self) -> Chart {
        let series = METHODS.iter().enumerate().filter_map(|(style, method)| {
            let points: Vec<Point> = self
                .of(method)
                .filter_map(|point| {
                    let (x, y) = (f64::from(point.spheres), point.speed_up?);
                    Some(Point { x, y, hollow: point.extrapolated })
                })
                .collect();
            let series = Series { points, ..Series::measured(method.name, style, []) };
            (!series.points.is_empty()).then_some(series)
        });
        let mut notes = self.notes();
        if self.points.iter().any(|point| point.extrapolated) {
            notes.push(format!("hollow: {} extrapolated in proportion to the spheres", self.baseline()));
        }
        Chart::Plot(Plot {
            title: format!("Speed-up over \"{}\" against spheres", self.baseline()),
            notes,
            x: Axis::log("spheres"),
            y: Axis::log("speed-up, ×"),
            series: series.collect(),
        })
    }

    pub(super) fn cost_chart(&self) -> Chart {
        let mut notes = self.notes();
        let mut series = Vec::new();
        for cost in &self.costs {
            let points = self.points.iter().filter(|point| point.method == cost.method);
            let points = points.map(|point| (f64::from(point.spheres), point.nanoseconds.median));
            let style = METHODS.iter().position(|method| method.name == cost.method).unwrap_or(0);
            series.push(Series::measured(&cost.method, style, points));
            notes.push(format!("{}: {}", cost.method, describe(cost)));
        }
        Chart::Plot(Plot {
            title: "Cost of a sample against spheres, methods with a tree".to_owned(),
            notes,
            x: Axis::log("spheres"),
            y: Axis::linear("device time a sample, ns"),
            series,
        })
    }

    pub(super) fn csv(&self) -> String {
        let header = [
            "method",
            "kernel",
            "spheres",
            "samples_per_pixel",
            "median_ns_per_sample",
            "least_ns",
            "greatest_ns",
            "iqr_ns",
            "segments_per_sample",
            "speed_up",
            "baseline",
        ];
        let row = |point: &MethodPoint| {
            let baseline = if point.extrapolated { "extrapolated" } else { "measured" };
            let time = &point.nanoseconds;
            [
                point.method.clone(),
                point.kernel.clone(),
                point.spheres.to_string(),
                point.samples.to_string(),
                time.median.to_string(),
                time.least.to_string(),
                time.greatest.to_string(),
                time.spread().to_string(),
                point.segments.to_string(),
                point.speed_up.map_or_else(String::new, |value| value.to_string()),
                baseline.to_owned(),
            ]
        };
        csv(header, self.points.iter().map(row))
    }
}

/// Measures a method on a scene, unless it is known to be missing or too slow.
fn point(
    bench: &mut Bench,
    renderer: &mut Renderer,
    scene: &Scene,
    spheres: u32,
    method: &Method,
    points: &mut Vec<MethodPoint>,
    left_out: &mut Vec<LeftOut>,
) -> Result<(), Error> {
    if left_out.iter().any(|left| left.method == method.name) {
        return Ok(());
    }
    let mut leave_out = |bench: &mut Bench, why: String| {
        bench.say(&format!("{spheres} spheres, {}: left out: {why}", method.name));
        left_out.push(LeftOut { method: method.name.to_owned(), spheres, why });
    };
    let plan = bench.plan;
    let before = points.iter().rfind(|point| point.method == method.name);
    let mut effort = plan.effort();
    if let (true, Some(before)) = (method.is_linear(), before) {
        let growth = f64::from(spheres) / f64::from(before.spheres);
        let pixels = f64::from(plan.width) * f64::from(plan.height);
        let expected = before.nanoseconds.median * 1e-9 * growth * pixels;
        // The scene may no longer fit a cache that a smaller one fitted. Unless the expected time
        // is beyond the limit, one frame of one sample is measured first.
        let pilot = Effort { samples: 1, warm_up: 0, frames: 1 };
        let mut seconds = expected;
        if expected <= plan.limit {
            let settings = method.settings(plan.settings(Settings::of(scene), pilot.samples));
            if let Outcome::Measured(frames) = frames(renderer, &settings, pilot)? {
                seconds = frames.iter().map(|stats| stats.device_seconds).fold(expected, f64::max);
            }
        }
        match plan.affordable(seconds) {
            Some(affordable) => effort = affordable,
            None => {
                leave_out(bench, format!("more than {} s", number(plan.limit)));
                return Ok(());
            }
        }
    }
    let settings = method.settings(plan.settings(Settings::of(scene), effort.samples));
    let frames = match frames(renderer, &settings, effort)? {
        Outcome::Measured(frames) => frames,
        Outcome::Missing(why) => {
            leave_out(bench, why);
            return Ok(());
        }
    };
    let traced = settings.total_samples() as f64;
    let times: Vec<f64> = frames.iter().map(|stats| stats.device_seconds * 1e9 / traced).collect();
    if let (Some(nanoseconds), Some(last)) = (Summary::of(&times), frames.last()) {
        bench.say(&format!("{spheres} spheres, {}: {} ns a sample", method.name, number(nanoseconds.median)));
        points.push(MethodPoint {
            method: method.name.to_owned(),
            kernel: last.kernel.to_owned(),
            spheres,
            samples: effort.samples,
            nanoseconds,
            segments: last.segments as f64 / traced,
            speed_up: None,
            extrapolated: false,
        });
    }
    Ok(())
}

/// Fills in the speed-up of each point. Points are in the order in which they were measured.
fn speed_up(points: &mut [MethodPoint]) {
    let Some(first) = points.first().map(|point| point.method.clone()) else { return };
    let baseline: Vec<(u32, f64)> = points
        .iter()
        .filter(|point| point.method == first)
        .map(|point| (point.spheres, point.nanoseconds.median))
        .collect();
    let linear = METHODS.iter().any(|method| method.name == first && method.is_linear());
    for point in points {
        let same = baseline.iter().find(|(spheres, _)| *spheres == point.spheres).map(|(_, time)| *time);
        let last = baseline.last().filter(|(spheres, _)| linear && *spheres < point.spheres);
        let grown = last.map(|(spheres, time)| time * f64::from(point.spheres) / f64::from(*spheres));
        point.extrapolated = same.is_none() && grown.is_some();
        point.speed_up = same.or(grown).map(|time| time / point.nanoseconds.median);
    }
}

fn cost(method: &Method, points: &[MethodPoint]) -> Option<Cost> {
    let own: Vec<(f64, f64)> = points
        .iter()
        .filter(|point| point.method == method.name)
        .map(|point| (f64::from(point.spheres), point.nanoseconds.median))
        .collect();
    let (greatest, last) = *own.last()?;
    let hundred = own.iter().find(|(spheres, _)| *spheres == 100.0 && greatest > 100.0);
    let logarithms: Vec<(f64, f64)> = own.iter().map(|(spheres, time)| (spheres.log2(), *time)).collect();
    Some(Cost {
        method: method.name.to_owned(),
        line: Line::through(&logarithms),
        growth: hundred.map(|(_, time)| last / time),
    })
}

fn describe(cost: &Cost) -> String {
    let mut text = match &cost.line {
        Some(line) => format!(
            "{} ns + {} ns log2 N, R² = {:.4}",
            number(line.intercept),
            number(line.slope),
            line.r_squared
        ),
        None => "no line through so few points".to_owned(),
    };
    if let Some(growth) = cost.growth {
        let _ = write!(text, "; from 100 to the most spheres {}×", number(growth));
    }
    text
}

#[cfg(test)]
mod tests;
