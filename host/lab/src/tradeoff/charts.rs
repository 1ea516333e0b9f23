//! Charts of the report: error over time for selected configurations, and the Pareto front.

use super::point::{Point as Found, Tradeoff};
use super::reference::ReferenceInfo;
use crate::page::{Figure, Mark, Marks, inline};
use crate::plot::{Axis, Chart, Plot, Point, Series, number};

/// Names of the configurations with a line in the chart, each with its style. There is one sampler
/// besides the base's.
const SHOWN: [(usize, &str); 8] = [
    (0, "base"),
    (1, "sampler sobol"),
    (1, "sampler independent"),
    (2, "roulette from segment 4"),
    (3, "adaptive on"),
    (4, "denoiser svgf"),
    (5, "scale 1/2"),
    (6, "together sobol, svgf"),
];

fn notes(found: &Tradeoff) -> Vec<String> {
    vec![
        format!("{}, {}x{}, {}", found.scene, found.width, found.height, found.device),
        format!("{}; {} seeds", ReferenceInfo::summary(found.reference.as_ref()), found.seeds),
    ]
}

fn place(point: &Found, hollow: bool) -> Point {
    Point { x: point.seconds.all.median, y: 100.0 * point.relative_error(), hollow }
}

/// Returns the chart of error over time for the configurations that most users ask about.
pub(super) fn over_time(found: &Tradeoff) -> Chart {
    let line = |&(style, name): &(usize, &str)| {
        let points: Vec<Point> = found
            .points
            .iter()
            .filter(|p| p.name() == name)
            .map(|p| place(p, p.errors.bias().is_seen()))
            .collect();
        let slope = found.slopes.iter().find(|s| format!("{} {}", s.knob, s.level) == name || s.knob == name);
        let slope = slope.and_then(|slope| slope.over_time).map_or(String::new(), |s| format!(" ({s:.2})"));
        let name = format!("{}{slope}", name.replace("together ", "").replace(" from segment 4", ""));
        (!points.is_empty()).then_some(Series { name, style, points, marks: true, line: true })
    };
    let mut notes = notes(found);
    notes.push("hollow: biased; in brackets: the slope, -0.5 for noise".to_owned());
    Chart::Plot(Plot {
        title: "Relative error over time".to_owned(),
        notes,
        x: Axis::log("seconds"),
        y: Axis::log("relative error, %"),
        series: SHOWN.iter().filter_map(line).collect(),
    })
}

/// Returns the chart of all points, with a line through the Pareto front.
pub(super) fn front(found: &Tradeoff) -> Chart {
    let series = |name: &str, style, line, points: Vec<Point>| {
        let name = name.to_owned();
        (!points.is_empty()).then_some(Series { name, style, points, marks: true, line })
    };
    let of = |biased: bool| {
        found
            .points
            .iter()
            .filter(|p| p.errors.bias().is_seen() == biased)
            .map(|p| place(p, biased))
            .collect()
    };
    let mut on_front: Vec<&Found> = found.points.iter().filter(|p| p.on_front).collect();
    on_front.sort_by(|a, b| a.seconds.all.median.total_cmp(&b.seconds.all.median));
    let others = found.others.iter().filter_map(|other| {
        let (x, y) = other.place()?;
        Some(Point { x, y, hollow: other.row.errors.bias().is_seen() })
    });
    let best = on_front.iter().map(|p| place(p, p.errors.bias().is_seen())).collect();
    let all = [
        series("unbiased", 0, false, of(false)),
        series("biased", 1, false, of(true)),
        series("Pareto front", 2, true, best),
        series("other renderers", 3, false, others.collect()),
    ];
    Chart::Plot(Plot {
        title: "Pareto front of time and error".to_owned(),
        notes: notes(found),
        x: Axis::log("seconds"),
        y: Axis::log("relative error, %"),
        series: all.into_iter().flatten().collect(),
    })
}

/// Returns the figures of a point, line by line.
fn tip(point: &Found) -> String {
    let bias = point.errors.bias();
    let bias = if bias.is_seen() { String::new() } else { format!("{bias}, ") };
    let flip = number(point.errors.flip.value);
    format!("{}\n{}\n{bias}FLIP {flip}\n{}", point.title(), point.cost(), point.verdict())
}

/// Returns the chart of all points for a page: with the figures of each point in its tooltip, and
/// labels on the Pareto front.
pub(super) fn inline_front(found: &Tradeoff) -> String {
    let mark = |point: &Found| Mark {
        x: point.seconds.all.median,
        y: 100.0 * point.relative_error(),
        hollow: point.errors.bias().is_seen(),
        tip: tip(point),
        label: point.on_front.then(|| point.title()),
    };
    let series = |name: &str, style, line: bool, points: Vec<Mark>| Marks {
        name: name.to_owned(),
        style,
        marks: !line,
        line,
        points,
    };
    let of = |biased: bool| -> Vec<Mark> {
        found.points.iter().filter(|p| p.errors.bias().is_seen() == biased).map(mark).collect()
    };
    let mut front: Vec<Mark> = found.points.iter().filter(|point| point.on_front).map(mark).collect();
    front.sort_by(|a, b| a.x.total_cmp(&b.x));
    front.iter_mut().for_each(|mark| mark.label = None);
    let others = found.others.iter().filter_map(|other| {
        let (x, y) = other.place()?;
        let (hollow, name) = (other.row.errors.bias().is_seen(), other.row.name.clone());
        Some(Mark { x, y, hollow, tip: other.line(), label: Some(name) })
    });
    let (x, y) = (Axis::log("time of a render, s"), Axis::log("relative error, %"));
    let title = format!("Time and error of all settings for {}", found.scene);
    let all = [
        series("Pareto front", 2, true, front),
        series("no bias seen", 0, false, of(false)),
        series("biased", 1, false, of(true)),
        series("other renderers", 3, false, others.collect()),
    ];
    let series = all.into_iter().filter(|series| !series.points.is_empty()).collect();
    inline(&Figure { title: &title, x: &x, y: &y, series })
}
