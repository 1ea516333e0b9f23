//! Construction of one tree over boxes: in one piece, in parts, or balanced where obvhs gives a
//! tree that is too deep.

use super::bounds::BoxOf;
use super::parts::{self, PartSizes};
use super::{Bvh, BvhQuality, balanced};
use obvhs::BvhBuildParams;
use trisect_shared::bvh::{Child, STACK_SIZE};

/// Maximum number of primitives for which the default is [`BvhQuality::High`]; larger scenes would
/// take long to build with it.
const MAX_HIGH_QUALITY_PRIMITIVES: usize = 100_000;

impl Bvh {
    /// Builds a tree over the boxes of `count` primitives.
    pub(super) fn over(count: usize, boxes: BoxOf, quality: Option<BvhQuality>) -> Result<Self, String> {
        Self::over_parts(count, boxes, quality, &PartSizes::DEFAULT)
    }

    /// Builds a tree as [`over`](Self::over) does, in parts of these sizes.
    pub(super) fn over_parts(
        count: usize,
        boxes: BoxOf,
        quality: Option<BvhQuality>,
        sizes: &PartSizes,
    ) -> Result<Self, String> {
        let default =
            if count <= MAX_HIGH_QUALITY_PRIMITIVES { BvhQuality::High } else { BvhQuality::Medium };
        let preset = match quality.unwrap_or(default) {
            BvhQuality::Fast => BvhBuildParams::fast_build(),
            BvhQuality::Medium => BvhBuildParams::medium_build(),
            BvhQuality::High => BvhBuildParams::very_slow_build(),
        };
        let bvh = match count {
            0 => return Ok(Self::leaf(Child::EMPTY)),
            1 => Self::leaf(Child::leaf(0)),
            count if count > sizes.whole => parts::build(count, boxes, &preset, sizes),
            count => Self::whole(count, boxes, |all| all, &preset),
        };
        let bvh = if bvh.depth > STACK_SIZE { balanced::build(count, boxes) } else { bvh };
        bvh.validate(count)?;
        Ok(bvh)
    }
}
