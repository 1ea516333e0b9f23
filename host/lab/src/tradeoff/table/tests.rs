//! Tests the words of results against their figures.

use super::super::{Capture, ErrorCurve, Seconds};
use super::*;
use crate::accuracy::Errors;
use crate::bench::Summary;

/// Returns errors whose tests say that there is a bias, or not. The intervals have no width.
fn errors(is_significant: bool, squared_bias: f64, brightness: f64) -> Errors {
    let of = |value| Interval { value, low: value, high: value };
    let means_p = if is_significant { 1e-9 } else { 0.5 };
    let found = Errors {
        seeds: 4,
        rel_mse: of(1e-4),
        variance: of(1e-4),
        squared_bias: of(squared_bias),
        rmse: of(0.01),
        flip: of(0.01),
        brightness: of(brightness),
        means_p,
        bias_p: 0.5,
        biased: false,
        each: vec![1e-4; 4],
        left_out: 0,
    };
    Errors { biased: found.bias().is_seen(), ..found }
}

/// Returns the printed lines for a configuration with these errors: that of a point, and that
/// of its error curve.
fn said(errors: &Errors, exact: bool) -> [String; 2] {
    let seconds =
        Seconds { all: Summary::NOTHING, render: 1.0, denoise: 0.0, scale: 0.0, each: vec![1.0; 4] };
    let point = Point {
        knob: "clamp".to_owned(),
        level: "16".to_owned(),
        exact,
        spp: 16,
        seconds,
        errors: errors.clone(),
        efficiency: Interval { value: 1.0, low: 1.0, high: 1.0 },
        against: None,
        on_front: false,
        command: None,
    };
    let captures = [16, 32, 64].map(|spp| Capture { spp, errors: errors.clone() });
    [point.line(), ErrorCurve::of("clamp 16".to_owned(), captures.to_vec()).line()]
}

#[test]
fn what_prints_as_nothing_is_not_called_a_bias() {
    // The squared bias is below 0 by chance; a bias of 0.00049 % rounds to 0.000.
    for (squared, brightness) in [(-1e-9, 0.0), (2.4e-11, 4e-6), (0.0, -4e-6)] {
        for line in
            [false, true].into_iter().flat_map(|exact| said(&errors(true, squared, brightness), exact))
        {
            assert!(!line.contains("biased") && !line.contains("bias 0.000"), "{line}");
            assert!(!line.contains("off by 0.000") && !line.contains("ends at 0.000"), "{line}");
        }
    }
    let [line, course] = said(&errors(true, 1e-6, 0.0), false);
    assert!(line.contains("bias 0.100 %") && line.ends_with(": biased"), "{line}");
    assert!(course.contains("ends at 0.100 %: biased"), "{course}");
    let [line, course] = said(&errors(true, -1e-9, -2e-3), false);
    assert!(line.contains("bias -0.200 % of the brightness") && line.ends_with(": biased"), "{line}");
    assert!(course.contains("bias -0.200 % of the brightness"), "{course}");
    assert!(said(&errors(true, 1e-6, 0.0), true)[0].contains("rare paths"));
    // Negative control: the same figures without significance.
    assert!(said(&errors(false, 1e-6, 0.1), false).iter().all(|line| !line.contains("biased")));
}

/// A bias whose interval contains 0 is not called one, even if parts of the image surely differ.
#[test]
fn what_may_be_nothing_is_not_called_a_bias() {
    let around = |value: f64, half: f64| Interval { value, low: value - half, high: value + half };
    let uncertain = Errors {
        squared_bias: around(1e-6, 2e-6),
        brightness: around(1e-3, 2e-3),
        ..errors(true, 1e-6, 1e-3)
    };
    assert_eq!(uncertain.bias(), Bias::Suspected);
    for line in said(&uncertain, false) {
        assert!(line.contains("suspected") && !line.contains("biased"), "{line}");
        assert!(!line.contains("bias 0.") && !line.contains("ends at"), "{line}");
    }
    assert!(said(&uncertain, true)[0].contains("rare paths"));
    // Negative controls: either interval without 0.
    let of_size = Errors { squared_bias: around(1e-6, 5e-7), ..uncertain.clone() };
    assert!(matches!(of_size.bias(), Bias::Size(_)) && said(&of_size, false)[0].ends_with(": biased"));
    let of_mean = Errors { brightness: around(1e-3, 5e-4), ..uncertain };
    assert!(matches!(of_mean.bias(), Bias::Brightness(_)));
}
