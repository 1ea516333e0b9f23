#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use super::super::tests::conditions;
use super::*;

fn point(method: &str, spheres: u32, nanoseconds: f64) -> MethodPoint {
    MethodPoint {
        method: method.to_owned(),
        kernel: "render".to_owned(),
        spheres,
        samples: 4,
        nanoseconds: Summary::of(&[nanoseconds]).unwrap(),
        segments: 2.5,
        speed_up: None,
        extrapolated: false,
    }
}

/// Points in the order of measurement, by scene: 2 log2 N ns with the BVH, 5 N ns without.
fn experiment() -> Complexity {
    let mut points = Vec::new();
    for spheres in [16, 256, 4096] {
        if spheres < 4096 {
            points.push(point("linear, pixel", spheres, 5.0 * f64::from(spheres)));
        }
        points.push(point("stack, pixel", spheres, 2.0 * f64::from(spheres).log2()));
    }
    let left = LeftOut { method: "linear, pixel".to_owned(), spheres: 4096, why: "more than 5 s".to_owned() };
    Complexity::new(conditions(), points, vec![left])
}

#[test]
fn speed_up_over_the_first_method() {
    let Complexity { points, .. } = experiment();
    let found: Vec<_> =
        points.iter().map(|p| (p.method.as_str(), p.spheres, p.speed_up.unwrap(), p.extrapolated)).collect();
    let want = [
        ("linear, pixel", 16, 1.0, false),
        ("linear, pixel", 256, 1.0, false),
        ("stack, pixel", 16, 80.0 / 8.0, false),
        ("stack, pixel", 256, 1280.0 / 16.0, false),
        // Extrapolated from the last point of the method without a BVH: sixteen times the spheres.
        ("stack, pixel", 4096, 16.0 * 1280.0 / 24.0, true),
    ];
    assert_eq!(found, want);
}

/// Nothing is extrapolated from a method with a BVH, because its time does not grow in proportion
/// to the spheres.
#[test]
fn nothing_to_extrapolate() {
    let points = vec![point("stack, pixel", 16, 8.0), point("stack, regenerate", 256, 9.0)];
    let Complexity { points, .. } = Complexity::new(conditions(), points, Vec::new());
    assert_eq!(points[0].speed_up, Some(1.0));
    assert_eq!((points[1].speed_up, points[1].extrapolated), (None, false));
}

#[test]
fn cost_against_the_logarithm() {
    let all = experiment();
    let [cost] = &all.costs[..] else { unreachable!("{:?}", all.costs) };
    let line = cost.line.unwrap();
    // Logarithms of powers of two, and these sums, are exact.
    assert_eq!((line.intercept, line.slope, line.r_squared, cost.growth), (0.0, 2.0, 1.0, None));
    let points = vec![point("stack, pixel", 100, 2.0), point("stack, pixel", 1_000_000, 7.0)];
    let growth = Complexity::new(conditions(), points, Vec::new()).costs[0].growth;
    assert_eq!(growth, Some(3.5));
}

#[test]
fn charts_name_what_is_missing() {
    let all = experiment();
    for chart in [all.speed_up_chart(), all.cost_chart()] {
        let Chart::Plot(plot) = chart else { unreachable!("a plot") };
        assert!(
            plot.notes.iter().any(|note| note == "left out, more than 5 s: linear, pixel from 4096 on"),
            "{:?}",
            plot.notes
        );
        assert!(plot.series.iter().any(|series| series.name == "stack, pixel" && series.points.len() == 3));
    }
    let Chart::Plot(plot) = all.speed_up_chart() else { unreachable!("a plot") };
    assert!(plot.series[1].points[2].hollow && !plot.series[1].points[1].hollow);
    assert!(all.summary().contains("left out: linear, pixel from 4096 spheres on: more than 5 s"));
    assert_eq!(all.csv().lines().count(), 1 + 5);
    assert!(all.csv().contains("\"stack, pixel\",render,4096,4,24,"), "{}", all.csv());
}
