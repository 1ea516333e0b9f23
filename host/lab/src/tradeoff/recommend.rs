//! Chooses what to use for a scene: the fast, the balanced and the best of the measured points.

use super::point::{Point, Purpose, Recommended};
use crate::accuracy::Bias;

/// Maximum share by which the mean of a recommended image is known to be off.
const MAX_BRIGHTNESS: f64 = 0.05;

/// Maximum mean FLIP error of a recommended image.
const MAX_FLIP: f64 = 0.3;

/// Maximum relative error of a recommended image: the upper end of its interval.
pub(super) const MAX_ERROR: f64 = 0.25;

/// Maximum share of the error that is bias in the balanced image.
const MAX_BIAS_SHARE: f64 = 0.5;

/// Error of the best image without a bias, over the lowest of all, up to which it is the best.
const MAX_UNBIASED: f64 = 1.5;

/// The rules, for readers of the report.
pub(super) const RULES: [&str; 5] = [
    "Candidates are the points that one command renders, and whose difference from the base is more than noise. Their \
     error is at most 25 % (upper end of the interval), their mean brightness is not known to be off by more than 5 %, \
     and their mean FLIP error is not known to be above 0.3.",
    "Fast: the least time.",
    "Best: the lowest error without a bias, so that more samples make it better still; if a candidate with a bias has \
     less than two thirds of that error, the lowest error of all.",
    "Balanced: the least time with an error of at most the geometric mean of the errors of fast and best, of which at \
     most half is bias.",
    "So no other candidate of the same purpose is both faster and more accurate.",
];

/// Returns whether a point may be recommended.
fn is_candidate(point: &Point) -> bool {
    let errors = &point.errors;
    let brightness = errors.brightness;
    let off = if brightness.covers(0.0) { 0.0 } else { brightness.low.abs().min(brightness.high.abs()) };
    // The FLIP of a single repetition has no interval.
    let flip = if errors.flip.low.is_finite() { errors.flip.low } else { errors.flip.value };
    point.command.is_some()
        && point.against.as_ref().is_none_or(|against| against.measurable)
        && errors.left_out == 0
        && point.max_relative_error() <= MAX_ERROR
        && off <= MAX_BRIGHTNESS
        && flip <= MAX_FLIP
}

/// Returns the share of a point's error that is bias, as far as one was seen.
fn bias_share(point: &Point) -> f64 {
    let bias = match point.errors.bias() {
        Bias::NotSeen | Bias::Tiny => 0.0,
        Bias::Size(size) => size,
        Bias::Brightness(share) => share.abs(),
        Bias::Suspected => point.errors.squared_bias.value.max(0.0).sqrt(),
    };
    if bias == 0.0 { 0.0 } else { bias / point.relative_error() }
}

/// Chooses from the measured points by [`RULES`]. Returns nothing if no point is good enough.
pub(super) fn recommend(points: &[Point]) -> Vec<Recommended> {
    let seconds = |point: &Point| point.seconds.all.median;
    let all: Vec<&Point> = points.iter().filter(|point| is_candidate(point)).collect();
    let by_time = |a: &&Point, b: &&Point| {
        seconds(a).total_cmp(&seconds(b)).then(a.relative_error().total_cmp(&b.relative_error()))
    };
    let by_error = |a: &&Point, b: &&Point| {
        a.relative_error().total_cmp(&b.relative_error()).then(seconds(a).total_cmp(&seconds(b)))
    };
    let candidates = || all.iter().copied();
    let (Some(fast), Some(lowest)) = (candidates().min_by(by_time), candidates().min_by(by_error)) else {
        return Vec::new();
    };
    let is_unbiased = |point: &&Point| matches!(point.errors.bias(), Bias::NotSeen | Bias::Tiny);
    let best = candidates()
        .filter(is_unbiased)
        .min_by(by_error)
        .filter(|best| best.relative_error() <= MAX_UNBIASED * lowest.relative_error())
        .unwrap_or(lowest);
    let middle = (fast.relative_error() * best.relative_error()).sqrt();
    let is_balanced =
        |point: &&Point| point.relative_error() <= middle && bias_share(point) <= MAX_BIAS_SHARE;
    let balanced = candidates().filter(is_balanced).min_by(by_time).unwrap_or(best);
    [(Purpose::Fast, fast), (Purpose::Balanced, balanced), (Purpose::Best, best)]
        .map(|(purpose, point)| Recommended {
            purpose,
            knob: point.knob.clone(),
            level: point.level.clone(),
            spp: point.spp,
        })
        .to_vec()
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::point::{Seconds, VsBase};
    use super::*;
    use crate::accuracy::Errors;
    use crate::bench::Summary;
    use crate::statistics::{Interval, Welch};

    /// Returns an unbiased point whose intervals are a tenth of their values wide, on each side.
    pub fn point(name: &str, spp: u32, seconds: f64, error: f64) -> Point {
        let of = |value: f64| Interval { value, low: 0.9 * value, high: 1.1 * value };
        let around = |half: f64| Interval { value: 0.0, low: -half, high: half };
        let rel_mse = of(error * error);
        let errors = Errors {
            seeds: 4,
            rel_mse,
            variance: rel_mse,
            squared_bias: around(0.1 * rel_mse.value),
            rmse: of(error),
            flip: of(0.05),
            brightness: around(0.01),
            means_p: 0.5,
            bias_p: 0.5,
            biased: false,
            each: vec![rel_mse.value; 4],
            left_out: 0,
        };
        let (knob, level) = name.split_once(' ').unwrap_or((name, "as asked"));
        let test = Welch { t: 9.0, freedom: 3.0, p: 1e-6 };
        let against = VsBase {
            time: 1.0,
            error: 1.0,
            time_test: test,
            error_test: test,
            efficiency: of(2.0),
            measurable: true,
        };
        Point {
            knob: knob.to_owned(),
            level: level.to_owned(),
            exact: false,
            spp,
            seconds: Seconds {
                all: Summary::of(&[seconds]).unwrap_or(Summary::NOTHING),
                render: seconds,
                denoise: 0.0,
                scale: 0.0,
                each: vec![seconds; 4],
            },
            efficiency: errors.efficiency(seconds),
            errors,
            against: (knob != "base").then_some(against),
            on_front: false,
            command: Some(format!("trisect render --spp {spp}")),
        }
    }

    fn chosen(points: &[Point]) -> Vec<String> {
        recommend(points).iter().map(|of| format!("{} {}: {}", of.knob, of.level, of.spp)).collect()
    }

    #[test]
    fn fast_balanced_and_best() {
        let points = [
            point("base", 4, 1.0, 0.4),
            point("base", 16, 4.0, 0.2),
            point("base", 64, 16.0, 0.1),
            point("base", 256, 64.0, 0.05),
            // As accurate as the base with 64 samples, in less time.
            point("sampler sobol", 32, 8.0, 0.09),
            point("depth 4", 64, 12.0, 0.12),
        ];
        // Of an error of 20 % and of 5 %, the geometric mean is 10 %.
        let expected = ["base as asked: 16", "sampler sobol: 32", "base as asked: 256"];
        assert_eq!(chosen(&points), expected);
        // The order of the points does not matter.
        let mut turned = points.to_vec();
        turned.reverse();
        assert_eq!(chosen(&turned), expected);
        assert_eq!(chosen(&points[1..2]), ["base as asked: 16"; 3]);
        assert!(recommend(&points[..1]).is_empty() && recommend(&[]).is_empty());
    }

    #[test]
    fn what_is_broken_is_not_recommended() {
        let good = point("base", 64, 16.0, 0.1);
        let alone = |point: Point| chosen(&[point, good.clone()]);
        let fine = point("depth 4", 16, 1.0, 0.09);
        assert_eq!(alone(fine.clone()), ["depth 4: 16"; 3], "the negative control");
        let of = |value: f64| Interval { value, low: value, high: value };
        let changed = |change: &dyn Fn(&mut Point)| {
            let mut point = fine.clone();
            change(&mut point);
            point
        };
        let broken: [(&str, Point); 8] = [
            ("nearly black", point("depth 4", 16, 1.0, 0.94)),
            ("uncertain", changed(&|p| p.errors.rel_mse = Interval { high: 0.07, ..p.errors.rel_mse })),
            ("an error that is not a number", changed(&|p| p.errors.rel_mse = of(f64::NAN))),
            ("too dark", changed(&|p| p.errors.brightness = of(-0.08))),
            ("visibly different", changed(&|p| p.errors.flip = of(0.4))),
            ("with pixels that are not finite", changed(&|p| p.errors.left_out = 1)),
            ("of no command", changed(&|p| p.command = None)),
            ("as the base is", changed(&|p| p.against.iter_mut().for_each(|a| a.measurable = false))),
        ];
        for (what, point) in broken {
            assert_eq!(alone(point), ["base as asked: 64"; 3], "{what}");
        }
        assert!(recommend(&[point("base", 1, 1.0, 0.94)]).is_empty());
        // Noise of the brightness does not count: only what it is known to be off.
        let noisy = changed(&|p| p.errors.brightness = Interval { value: -0.08, low: -0.14, high: -0.02 });
        assert_eq!(alone(noisy), ["depth 4: 16"; 3]);
    }

    /// Returns the point with a bias of this share of its error.
    fn biased(point: Point, share: f64) -> Point {
        let squared = share * share * point.errors.rel_mse.value;
        let squared_bias = Interval { value: squared, low: 0.9 * squared, high: 1.1 * squared };
        Point { errors: Errors { means_p: 1e-9, squared_bias, biased: true, ..point.errors }, ..point }
    }

    /// The best image has no bias unless that costs much; the balanced one has little.
    #[test]
    fn bias_counts() {
        let base = [point("base", 4, 1.0, 0.2), point("base", 16, 4.0, 0.1), point("base", 64, 16.0, 0.05)];
        let with = |filtered: Point| chosen(&[&base[..], &[filtered]].concat());
        let filter = |spp, seconds, error| point("denoiser svgf", spp, seconds, error);
        // A little more accurate than the best, but it will not become better.
        assert_eq!(with(biased(filter(64, 17.0, 0.04), 0.9))[2], "base as asked: 64");
        assert_eq!(with(filter(64, 17.0, 0.04))[2], "denoiser svgf: 64", "the negative control");
        assert_eq!(with(biased(filter(64, 17.0, 0.03), 0.9))[2], "denoiser svgf: 64");
        // Half the error may be bias.
        assert_eq!(with(biased(filter(4, 2.0, 0.08), 0.45))[1], "denoiser svgf: 4");
        assert_eq!(with(biased(filter(4, 2.0, 0.08), 0.6))[1], "base as asked: 16");
        // The fast image may have more.
        assert_eq!(with(biased(filter(1, 0.5, 0.2), 0.9))[0], "denoiser svgf: 1");
    }

    /// A point that is 94 % wrong is not called better, however much faster it is.
    #[test]
    fn nearly_black_is_not_better() {
        assert_eq!(point("depth 2", 16, 1e-3, 0.94).verdict(), "too inaccurate");
        assert_eq!(point("depth 2", 16, 1e-3, f64::NAN).verdict(), "too inaccurate");
        // Negative controls.
        assert_eq!(point("depth 2", 16, 1e-3, 0.49).verdict(), "better");
        assert_eq!(point("base", 16, 1e-3, 0.94).verdict(), "base");
    }
}
