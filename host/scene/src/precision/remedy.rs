//! Replaces the remedy `space` where no other space helps.

use super::finding::Finding;
use super::{camera, geometry, surface};
use crate::ImageSettings;
use crate::{Rebase, SceneDocument};

/// Returns the remedy that replaces the field `space`; `None` for a remedy that does not name it.
fn instead(remedy: &str) -> Option<&'static str> {
    match remedy {
        geometry::FAR => Some(
            "no other `space` helps: it is small beside the scene, so make it larger (triangles: wider), or leave it out",
        ),
        geometry::SMALL => {
            Some("no other `space` helps: it is tiny beside the scene, so make it larger, or leave it out")
        }
        camera::LENS => Some("no other `space` helps: set defocus_angle to 0"),
        surface::FLAT => Some("give a `Plane` a `point` near the eye; no other `space` helps"),
        _ => None,
    }
}

/// Replaces remedies that name the field `space` where the best space is the present one, or does
/// not improve the finding.
pub(super) fn settle(scene: &SceneDocument, image: &ImageSettings, best: Rebase, found: &mut [Finding]) {
    if !found.iter().any(|finding| instead(finding.remedy).is_some()) {
        return;
    }
    let mut mended = Vec::new();
    if best != scene.space {
        let moved = SceneDocument { space: best, ..scene.clone() };
        geometry::check(&moved, &mut mended);
        surface::check(&moved, &mut mended);
        camera::check(&moved, image, &mut mended);
    }
    for finding in found {
        let Some(other) = instead(finding.remedy) else { continue };
        let same = |left: &&Finding| left.limit == finding.limit && subject(left) == subject(finding);
        let helps = best != scene.space && mended.iter().filter(same).all(|left| is_less(left, finding));
        if !helps {
            finding.remedy = other;
        }
    }
}

/// Returns the name of the affected part, without a number of triangles.
fn subject(finding: &Finding) -> &str {
    match finding.triangles {
        Some(_) => finding.what.rsplit_once(": ").map_or(&*finding.what, |(name, _)| name),
        None => &finding.what,
    }
}

/// Returns whether at least half of the error, or of the affected triangles, is gone.
fn is_less(left: &Finding, before: &Finding) -> bool {
    let outside = |finding: &Finding| finding.triangles.map_or(1, |triangles| triangles.outside);
    left.predicted.value <= 0.5 * before.predicted.value || 2 * outside(left) <= outside(before)
}
