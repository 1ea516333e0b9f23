//! Finds the parts of a scene that are outside the range that single precision supports, predicts
//! the error, and names a remedy. Used by `trisect check`, and for warnings of `render` and
//! `bench`.
//!
//! A scene is described in f64 and rendered in f32, whose unit roundoff u is 2⁻²⁴. Each rule is a
//! first-order estimate of the rounding error, relative to what it affects. Tests measure that the
//! error exists beyond the limit and not within it. Formulas and measurements:
//! docs/reference/supported-ranges.md.

mod camera;
mod closest;
mod extent;
mod finding;
mod geometry;
mod light;
mod material;
mod remedy;
mod samples;
mod surface;
mod write;

pub use extent::Extent;
pub use finding::{Finding, Limit, Predicted, Severity, Supported, Triangles, Unit};
pub use samples::{ACCUMULATION, plain_accumulation};
pub use write::{Change, WriteError, write};

use crate::ImageSettings;
use crate::{Rebase, SceneDocument};
use serde::Serialize;
use std::collections::BTreeMap;

/// Half the distance from 1 to the next number of f32: the maximum relative error of one rounding.
pub const ROUNDING: f64 = 1.0 / (1 << 24) as f64;

/// Supported error of a hit, relative to the object. Few objects are more than a thousand pixels
/// wide, so this is at most about a pixel.
pub const RELATIVE: f64 = 1e-3;

/// Supported error of a ray in the image, in pixels: a third of the standard deviation (0.29) of
/// the box filter of a pixel.
pub const PIXELS: f64 = 0.1;

/// Maximum number of findings of a kind in a report, the worst first. The others are counted.
const MAX_FINDINGS: usize = 16;

/// Version of the record that `trisect check --json` prints.
const FORMAT: u32 = 1;

/// Findings of a scene.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Report {
    /// Version of the record's format.
    pub format: u32,
    /// Version of the program.
    pub version: &'static str,
    /// Path of the scene file, or the name of a built-in scene.
    pub scene: String,
    /// Extent of the scene.
    pub extent: Extent,
    /// Space that the scene file sets.
    pub space: Rebase,
    /// Space in which the scene is computed with the most digits.
    pub best_space: Rebase,
    /// Maximum relative error of a pixel's mean due to the summation of its samples.
    pub accumulation: f64,
    /// Findings by kind, the worst of each kind first.
    pub findings: Vec<Finding>,
    /// Number of further findings of each kind.
    pub more: BTreeMap<Limit, usize>,
}

impl Report {
    /// Returns whether any finding is a warning rather than a note.
    pub fn is_outside(&self) -> bool {
        self.findings.iter().any(|finding| finding.severity == Severity::Warning)
    }
}

/// Finds everything outside the supported range in the space that the scene sets, and the space
/// that suits it best.
pub fn check(scene: &SceneDocument, image: &ImageSettings) -> Report {
    let extent = Extent::of(&scene.description);
    let best_space = best(scene, extent.best_space());
    let mut found = collect(scene, image);
    remedy::settle(scene, image, best_space, &mut found);
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

fn collect(scene: &SceneDocument, image: &ImageSettings) -> Vec<Finding> {
    let mut found = Vec::new();
    geometry::check(scene, &mut found);
    surface::check(scene, &mut found);
    camera::check(scene, image, &mut found);
    material::check(scene, &mut found);
    light::check(scene, &mut found);
    samples::check(image, &mut found);
    found
}

/// Returns the space `wanted` if no primitive becomes too small in it, which a tiny object in a
/// large scene may. Otherwise the same origin without a scale, if that fits; otherwise the scene's
/// own space.
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

/// Returns one line for each kind of finding, without notes, for people who render the scene.
pub fn warnings(scene: &SceneDocument, image: &ImageSettings) -> Vec<String> {
    let mut found = collect(scene, image);
    found.retain(|finding| finding.severity == Severity::Warning);
    let (findings, more) = worst(found);
    summary(&findings, &more)
}

/// Returns the worst findings of each kind, at most one for each object, and the number of the
/// others.
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

/// Returns one line for each kind of finding: the worst of it, and the number of the others.
fn summary(findings: &[Finding], more: &BTreeMap<Limit, usize>) -> Vec<String> {
    let line = |same: &[Finding]| {
        let worst = same.first()?;
        let others = same.len() - 1 + more.get(&worst.limit).copied().unwrap_or_default();
        let others = if others > 0 { format!(" and {others} more") } else { String::new() };
        Some(format!("{}: {}{others}: {}", worst.limit.title(), worst.what, worst.predicted))
    };
    findings.chunk_by(|a, b| a.limit == b.limit).filter_map(line).collect()
}
