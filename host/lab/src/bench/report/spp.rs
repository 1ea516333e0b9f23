//! First experiment: is the time of a frame proportional to the samples per pixel?

use super::plan::BOOK;
use super::{Bench, Conditions, csv, spheres};
use crate::Error;
use crate::bench::{Line, Summary};
use crate::plot::number;
use crate::plot::{Axis, Chart, Plot, Point, Series};
use serde::{Deserialize, Serialize};
use trisect::render::Settings;

/// Time of a frame against samples per pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Spp {
    /// Program, device and settings.
    pub conditions: Conditions,
    /// Name of the scene.
    pub scene: String,
    /// Name of the kernel: the backend's default for the scene.
    pub kernel: String,
    /// Points, in ascending order of samples.
    pub points: Vec<SppPoint>,
    /// Line through the median seconds of a frame over samples per pixel.
    pub line: Option<Line>,
}

/// Time of a frame with one number of samples per pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SppPoint {
    /// Samples per pixel.
    pub samples: u32,
    /// Device time of a frame, in seconds.
    pub seconds: Summary,
}

impl Spp {
    pub(super) fn measure(bench: &mut Bench) -> Result<Self, Error> {
        let scene = spheres(BOOK)?;
        bench.with(&scene, |bench, renderer| {
            let plan = bench.plan;
            let (mut points, mut kernel) = (Vec::new(), "");
            // In rounds over all points, so that a device that slows down meanwhile slows all of
            // them down.
            let mut seconds = vec![Vec::new(); plan.spp.len()];
            for round in 0..plan.warm_up + plan.frames {
                for (&samples, seconds) in plan.spp.iter().zip(&mut seconds) {
                    let settings = plan.settings(Settings::of(&scene), samples);
                    let stats = renderer.render(&settings)?.stats;
                    kernel = stats.kernel;
                    if round >= plan.warm_up {
                        seconds.push(stats.device_seconds);
                    }
                }
            }
            for (&samples, seconds) in plan.spp.iter().zip(&seconds) {
                if let Some(seconds) = Summary::of(seconds) {
                    bench.say(&format!("{}, {samples} spp: {} ms", scene.name, number(seconds.median * 1e3)));
                    points.push(SppPoint { samples, seconds });
                }
            }
            let settings = plan.settings(Settings::of(&scene), 1);
            Ok(Self::new(
                Conditions::new(renderer.device().info(), &settings, plan),
                &scene.name,
                kernel,
                points,
            ))
        })
    }

    fn new(conditions: Conditions, scene: &str, kernel: &str, points: Vec<SppPoint>) -> Self {
        let pairs: Vec<(f64, f64)> =
            points.iter().map(|point| (f64::from(point.samples), point.seconds.median)).collect();
        let line = Line::through(&pairs);
        Self { conditions, scene: scene.to_owned(), kernel: kernel.to_owned(), points, line }
    }

    fn fit(&self) -> String {
        match &self.line {
            Some(line) => format!(
                "least squares: {} ms + {} ms a sample a pixel, R² = {:.6}",
                number(line.intercept * 1e3),
                number(line.slope * 1e3),
                line.r_squared
            ),
            None => "no line through so few points".to_owned(),
        }
    }

    pub(super) fn summary(&self) -> String {
        format!("time against spp ({}): {}\n", self.scene, self.fit())
    }

    pub(super) fn chart(&self) -> Chart {
        let x = |point: &SppPoint| f64::from(point.samples);
        let mut series = Vec::new();
        if let (Some(line), Some(first), Some(last)) = (&self.line, self.points.first(), self.points.last()) {
            let points = [x(first), x(last)].map(|x| Point { x, y: line.at(x) * 1e3, hollow: false });
            series.push(Series {
                name: "least-squares line".to_owned(),
                style: 1,
                points: points.to_vec(),
                marks: false,
                line: true,
            });
        }
        let measured = self.points.iter().map(|point| (x(point), point.seconds.median * 1e3));
        series.push(Series { line: false, ..Series::measured("median of frames", 0, measured) });
        Chart::Plot(Plot {
            title: format!("Time of a frame against samples a pixel, {}", self.scene),
            notes: vec![
                self.conditions.device(),
                format!("{}, kernel {}", self.conditions.image(), self.kernel),
                self.fit(),
            ],
            x: Axis::linear("samples a pixel"),
            y: Axis::linear("device time, ms"),
            series,
        })
    }

    pub(super) fn csv(&self) -> String {
        let header = ["samples_per_pixel", "median_s", "least_s", "greatest_s", "iqr_s"];
        let row = |point: &SppPoint| {
            let SppPoint { samples, seconds } = point;
            [f64::from(*samples), seconds.median, seconds.least, seconds.greatest, seconds.spread()]
                .map(|value| value.to_string())
        };
        csv(header, self.points.iter().map(row))
    }
}
