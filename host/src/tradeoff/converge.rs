//! Convergence as evidence: noise falls as the root of the samples, and what does not is bias.

use super::errors::{self, Errors};
use super::reference::Facts;
use super::{Lab, Mode, Reference, TradeoffError, Truth, check_seeds};
use crate::Error;
use crate::bench::Line;
use crate::film::{Film, Part};
use crate::image::Image;
use crate::render::{Observer, Settings, chunks};
use crate::statistics::{Interval, jackknife_error};
use serde::{Deserialize, Serialize};

/// Version of the JSON. A field that changes its meaning, or goes, raises it.
const FORMAT: u32 = 1;

/// How far a slope may be from -1/2.
const TOLERANCE: f64 = 0.05;

/// The first seed; the others follow.
const FIRST_SEED: u32 = 2000;

/// Samples that go by before an image is looked at.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Capture {
    /// Samples a pixel.
    pub spp: u32,
    /// Then.
    pub errors: Errors,
}

/// How the error of a way of rendering falls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Course {
    /// As [`Mode::name`].
    pub mode: String,
    /// From few samples to many.
    pub captures: Vec<Capture>,
    /// Of log relative RMSE over log samples: -1/2 for independent noise.
    pub slope: Interval,
    /// Where the error ends that no samples lower, relative; none where no bias was seen.
    pub plateau: Option<f64>,
    /// In words.
    pub verdict: String,
}

/// Two ways of rendering beside each other, without a reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    /// As [`Mode::name`].
    pub modes: [String; 2],
    /// Mean over all pixels of the first over the second's, less 1.
    pub brightness: Interval,
    /// The chance of means that differ as much, of the whole and of blocks, if both converge to one image (Welch's test, Šidák's correction).
    pub p: f64,
    /// Whether that is too small to believe.
    pub differ: bool,
}

/// All that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Convergence {
    /// Of the JSON.
    pub format: u32,
    /// Of the program.
    pub version: String,
    /// Name of the scene.
    pub scene: String,
    /// What errors are measured against.
    pub reference: Facts,
    /// Repetitions.
    pub seeds: usize,
    /// Each way.
    pub courses: Vec<Course>,
    /// Each two of them.
    pub pairs: Vec<Pair>,
}

/// Follows each way from `first` samples a pixel to `last`, doubling. Ways that scale the image, or place samples by noise, have no course.
///
/// # Errors
///
/// As rendering; [`TradeoffError::TooFew`] for seeds that tell nothing.
#[allow(clippy::too_many_arguments, reason = "what, how far, how often, and who watches")]
pub fn converge(
    lab: &mut Lab,
    scene: &str,
    modes: &[Mode],
    (first, last): (u32, u32),
    seeds: usize,
    reference: &Reference,
    say: &mut dyn FnMut(&str),
    observer: &mut dyn Observer,
) -> Result<Convergence, Error> {
    check_seeds(seeds)?;
    let counts: Vec<u32> = std::iter::successors(Some(first), |count| count.checked_mul(2))
        .take_while(|&count| count <= last)
        .collect();
    if counts.len() < 3 {
        let (what, given) =
            ("the number of doublings from --first to --last", counts.len().saturating_sub(1));
        return Err(TradeoffError::TooFew { what, given, least: 2 }.into());
    }
    let image = reference.image();
    let truth = Truth::new(reference, &image)?;
    let (mut courses, mut ends): (Vec<Course>, Vec<Vec<Image>>) = (Vec::new(), Vec::new());
    for mode in modes.iter().filter(|mode| mode.divisor == 1 && !mode.adaptive) {
        let (captures, images) = follow(lab, mode, &counts, seeds, &truth, observer)?;
        let course = Course::of(mode.name(), captures);
        say(&course.line());
        courses.push(course);
        ends.push(images);
    }
    let mut pairs = Vec::new();
    for a in 0..ends.len() {
        for b in a + 1..ends.len() {
            let (brightness, p) = errors::difference(&ends[a], &ends[b]);
            let differ = p < errors::SIGNIFICANCE;
            pairs.push(Pair {
                modes: [courses[a].mode.clone(), courses[b].mode.clone()],
                brightness,
                p,
                differ,
            });
        }
    }
    Ok(Convergence {
        format: FORMAT,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scene: scene.to_owned(),
        reference: reference.facts.clone(),
        seeds,
        courses,
        pairs,
    })
}

/// Each seed's film grows; at each count all of them are looked at.
fn follow(
    lab: &mut Lab,
    mode: &Mode,
    counts: &[u32],
    seeds: usize,
    truth: &Truth,
    observer: &mut dyn Observer,
) -> Result<(Vec<Capture>, Vec<Image>), Error> {
    let of_seed = |index: usize| Settings {
        samples: counts.last().copied().unwrap_or(1),
        seed: FIRST_SEED + index as u32,
        guides: mode.denoise.is_some(),
        ..mode.settings.clone()
    };
    let (width, height) = (mode.settings.width, mode.settings.height);
    let new = if mode.denoise.is_some() { Film::with_guides } else { Film::new };
    let mut films: Vec<Film> = (0..seeds).map(|_| new(width, height)).collect();
    let (mut captures, mut images) = (Vec::new(), Vec::new());
    let mut before = 0;
    for &count in counts {
        images.clear();
        for (index, film) in films.iter_mut().enumerate() {
            let settings = of_seed(index);
            let renderer = lab.renderer(mode)?;
            for samples in chunks(before..count) {
                let part = Part { rows: 0..height, samples: samples.clone() };
                let sums = renderer.render_sums(&settings, &(0..height).into(), samples, observer)?;
                film.merge(&part, sums.pixels)?;
                if settings.guides {
                    film.merge_guides(&part, sums.guides)?;
                }
            }
            images.push(match &mode.denoise {
                Some(denoise) => renderer.denoise(film, &settings, denoise)?.0,
                None => film.image(),
            });
        }
        captures.push(Capture { spp: count, errors: Errors::of(&images, truth, 2)? });
        before = count;
    }
    Ok((captures, images))
}

impl Course {
    /// Of what was seen.
    pub fn of(mode: String, captures: Vec<Capture>) -> Self {
        let seeds = captures.first().map_or(0, |capture| capture.errors.each.len());
        let slope = |without: Option<usize>| {
            let point = |capture: &Capture| {
                let each = capture.errors.each.iter().enumerate();
                let kept: Vec<f64> = each.filter(|(s, _)| Some(*s) != without).map(|(_, e)| *e).collect();
                let mean = kept.iter().sum::<f64>() / kept.len().max(1) as f64;
                (f64::from(capture.spp).ln(), 0.5 * mean.ln())
            };
            Line::through(&captures.iter().map(point).collect::<Vec<_>>()).map_or(f64::NAN, |line| line.slope)
        };
        let without: Vec<f64> = (0..seeds).map(|s| slope(Some(s))).collect();
        let slope = Interval::of(slope(None), jackknife_error(&without), seeds as f64 - 1.0);
        let last = captures.last().map(|capture| &capture.errors);
        let biased = last.is_some_and(|errors| errors.biased);
        let plateau = last.filter(|_| biased).map(|errors| errors.squared_bias.value.max(0.0).sqrt());
        let verdict = match plateau {
            Some(plateau) => format!("ends at {:.3} %: biased", 100.0 * plateau),
            None if slope.low <= -0.5 + TOLERANCE && slope.high >= -0.5 - TOLERANCE => {
                "falls as noise does".to_owned()
            }
            None if slope.value < -0.5 => "falls faster than noise".to_owned(),
            None => "falls slower than noise".to_owned(),
        };
        Self { mode, captures, slope, plateau, verdict }
    }

    /// One line for people.
    pub fn line(&self) -> String {
        let errors: Vec<String> = self
            .captures
            .iter()
            .map(|c| format!("{}: {:.3} %", c.spp, 100.0 * c.errors.rel_mse.value.max(0.0).sqrt()))
            .collect();
        let Interval { value, low, high } = self.slope;
        format!(
            "{}: slope {value:.3} ({low:.3} to {high:.3}), {}; {}",
            self.mode,
            self.verdict,
            errors.join(", ")
        )
    }
}

impl Convergence {
    fn base(&self) -> &str {
        self.courses.first().map_or("", |course| &course.mode)
    }

    /// Which ways differ from the base, for people.
    pub fn summary(&self) -> String {
        let mut text = format!(
            "{}: {} seeds; reference of {:.0} samples a pixel, own error {:.3} %\n",
            self.scene,
            self.seeds,
            self.reference.samples,
            100.0 * self.reference.error
        );
        for pair in self.pairs.iter().filter(|pair| pair.modes[0] == self.base()) {
            let [a, b] = &pair.modes;
            let how = if pair.differ { "converge to different images" } else { "no difference seen" };
            let brightness = 100.0 * pair.brightness.value;
            text += &format!("{a} against {b}: {how} (p = {:.2e}, brightness {brightness:+.4} %)\n", pair.p);
        }
        text
    }
}
