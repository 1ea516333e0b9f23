//! What in a scene lies outside the range that single precision supports, by how much that shows, and what helps.
//!
//! A scene is described in f64 and rendered in f32, whose unit roundoff u is 2⁻²⁴. Each rule is a first-order estimate of the error
//! that rounding makes, in units of what it spoils; a test measures that the error is there beyond the limit and is not within it.
//! `docs/accuracy.md` has the formulas and the measurements.

mod camera;
mod closest;
mod extent;
mod finding;
mod geometry;
mod light;
mod material;
pub(crate) mod names;
mod remedy;
mod samples;
mod surface;
mod write;

pub use extent::Extent;
pub use finding::{Finding, Limit, Predicted, Severity, Supported, Triangles, Unit};
pub use samples::{ACCUMULATION, plain_accumulation};
pub use write::{Change, WriteError, write};

use crate::render::Settings;
use crate::scene::{Rebase, SceneDocument};
use serde::Serialize;
use std::collections::BTreeMap;

/// Half the distance from 1 to the next number of f32: the greatest relative error of one rounding.
pub const ROUNDING: f64 = 1.0 / (1 << 24) as f64;

/// What a hit may be off, relative to what is hit. Few things fill more than a thousand pixels: for those, a pixel.
pub const RELATIVE: f64 = 1e-3;

/// What a ray may be off in the image, in pixels: a third of the deviation (0.29) of the box filter that spreads it.
pub const PIXELS: f64 = 0.1;

/// Findings of a kind that a report holds, the worst first; of the others it knows the number.
const MAX_FINDINGS: usize = 16;

/// Version of the record that `trisect check --json` prints.
const FORMAT: u32 = 1;

/// What was found in a scene.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Of this record.
    pub format: u32,
    /// Of the program.
    pub version: &'static str,
    /// The file, or what stands for it.
    pub scene: String,
    /// How large the scene is.
    pub extent: Extent,
    /// The space that the file asks for.
    pub space: Rebase,
    /// The space that suits it best.
    pub best_space: Rebase,
    /// By which share the mean of a pixel's samples may be off by their summation, at most.
    pub accumulation: f64,
    /// By kind, the worst of a kind first.
    pub findings: Vec<Finding>,
    /// How many more there are of a kind.
    pub more: BTreeMap<Limit, usize>,
}

impl Report {
    /// Returns whether something is outside the supported range, notes apart.
    pub fn is_outside(&self) -> bool {
        self.findings.iter().any(|finding| finding.severity == Severity::Warning)
    }
}

/// Looks for all that is outside the supported range, in the space that the scene asks for, and for the space that suits it best.
pub fn check(scene: &SceneDocument, settings: &Settings) -> Report {
    let extent = Extent::of(&scene.description);
    let best_space = best(scene, extent.best_space());
    let mut found = collect(scene, settings);
    remedy::settle(scene, settings, best_space, &mut found);
    let (findings, more) = worst(found);
    Report {
        format: FORMAT,
        version: env!("CARGO_PKG_VERSION"),
        scene: scene.name.clone(),
        extent,
        space: scene.space,
        best_space,
        accumulation: ACCUMULATION,
        findings,
        more,
    }
}

fn collect(scene: &SceneDocument, settings: &Settings) -> Vec<Finding> {
    let mut found = Vec::new();
    geometry::check(scene, &mut found);
    surface::check(scene, &mut found);
    camera::check(scene, settings, &mut found);
    material::check(scene, &mut found);
    light::check(scene, &mut found);
    samples::check(settings, &mut found);
    found
}

/// The space `wanted`, if everything has a place there: what is tiny in a great scene may be lost by its scale. Else only its origin,
/// else what the scene has.
fn best(scene: &SceneDocument, wanted: Rebase) -> Rebase {
    let lost = |scene: &SceneDocument| {
        let mut found = Vec::new();
        geometry::check(scene, &mut found);
        found.iter().filter(|finding| finding.limit == Limit::TooSmall).count()
    };
    let before = lost(scene);
    let fits = |space: &Rebase| {
        let mut moved = SceneDocument { space: *space, ..scene.clone() };
        lost(&moved) <= before && moved.description.move_to(*space).is_ok()
    };
    [wanted, Rebase { scale: 1.0, ..wanted }].into_iter().find(fits).unwrap_or(scene.space)
}

/// One line for each kind of finding, notes apart, for people who render the scene.
pub fn warnings(scene: &SceneDocument, settings: &Settings) -> Vec<String> {
    let mut found = collect(scene, settings);
    found.retain(|finding| finding.severity == Severity::Warning);
    let (findings, more) = worst(found);
    summary(&findings, &more)
}

/// The worst of each kind, one for each thing, and how many others there are.
fn worst(mut found: Vec<Finding>) -> (Vec<Finding>, BTreeMap<Limit, usize>) {
    found.sort_by(|a, b| {
        let by_error = b.predicted.value.total_cmp(&a.predicted.value);
        a.limit
            .cmp(&b.limit)
            .then(a.severity.cmp(&b.severity))
            .then(by_error)
            .then_with(|| a.what.cmp(&b.what))
    });
    let mut kept: Vec<Finding> = Vec::new();
    let mut more = BTreeMap::new();
    let mut seen = std::collections::HashSet::new();
    for finding in found {
        if !seen.insert((finding.limit, finding.what.clone())) {
            continue;
        }
        if kept.iter().rev().take_while(|other| other.limit == finding.limit).count() < MAX_FINDINGS {
            kept.push(finding);
        } else {
            *more.entry(finding.limit).or_insert(0) += 1;
        }
    }
    (kept, more)
}

/// One line for each kind: the worst of it, and how many others there are.
fn summary(findings: &[Finding], more: &BTreeMap<Limit, usize>) -> Vec<String> {
    let line = |same: &[Finding]| {
        let worst = same.first()?;
        let others = same.len() - 1 + more.get(&worst.limit).copied().unwrap_or_default();
        let others = if others > 0 { format!(" and {others} more") } else { String::new() };
        Some(format!("{}: {}{others}: {}", worst.limit.title(), worst.what, worst.predicted))
    };
    findings.chunk_by(|a, b| a.limit == b.limit).filter_map(line).collect()
}
