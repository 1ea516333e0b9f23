//! Light tree: a tree of bounds of lights, by which a connection descends to one light (Conty
//! Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", High
//! Performance Graphics 2018). Each child of a node has an importance, about the greatest light
//! that may arrive from it, and is chosen in proportion. Nodes have up to eight children: smaller
//! groups are known better, so fewer levels make fewer errors.
//!
//! The tree follows the lights in their array: a record whose `kind` is a link to the children of
//! the root, then [nodes](LightNode). A link to children is the number of the first of them, with
//! their number and [flags](MIXED); a link to a light is its index with [`LEAF`].

pub use super::importance::WIDTH;
use super::importance::{Importances, NODE_ROWS, of_node};
use super::{AREA, Light, ReferencePoint};
use crate::buffer::{load_record, load_row};
use crate::math::{max, min, unit_f32};
use crate::params::RenderParams;
pub use crate::records::light_node::LightNode;
use crate::rng::Words;
use crate::scene::Scene;

/// Flag of a link that stands for one light, whose index the other bits are.
pub const LEAF: u32 = 1 << 31;

/// Flag of a link to children of which some are infinitely far, but not all.
pub const MIXED: u32 = 1 << 30;

/// Shift of the three bits of a link that are the number of the children less one.
pub const COUNT_SHIFT: u32 = 27;

/// Link that leads nowhere: the parent of the root, and the choice of no light.
pub const NOWHERE: u32 = u32::MAX;

/// Part of the choices at a node that is even among the children that may send light: what blocks a
/// light is not known, and dim lights must not vanish beside a strong one behind a wall.
const EVEN_SHARE: f32 = 1.0 / 64.0;

/// Part of even choices between lights that are infinitely far and lights in the scene: a sun that
/// does not enter a room is a thousand times as strong as its lamps.
const EVEN_SHARE_OF_DISTANT: f32 = 0.5;

/// Light that was chosen, and the probability of that choice.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    /// Index of the light, or [`NOWHERE`].
    pub light: u32,
    /// Probability of the choice.
    pub probability: f32,
}

/// Returns the number of the first child that this links to.
#[inline(always)]
pub const fn first_child(link: u32) -> u32 {
    link & ((1 << COUNT_SHIFT) - 1)
}

/// Returns the number of children that this links to.
#[inline(always)]
pub const fn child_count(link: u32) -> u32 {
    (link >> COUNT_SHIFT & 7) + 1
}

/// Returns the first row of the tree in the array of lights.
#[inline(always)]
fn first_row(params: &RenderParams) -> u32 {
    (params.light_count + 1) * (size_of::<Light>() / 16) as u32
}

/// Children of a node, and the probabilities with which a descent chooses them.
struct Children {
    importances: Importances,
    /// Factor of an importance in a probability.
    by_importance: f32,
    /// Even part of the probability of each child that may send light.
    evenly: f32,
}

impl Children {
    /// # Safety
    ///
    /// The link is that of children in the tree with this first row.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    unsafe fn new(scene: Scene, first: u32, link: u32, from: &ReferencePoint) -> Self {
        // SAFETY: the caller's promise.
        let importances =
            unsafe { Importances::new(scene, first, first_child(link), child_count(link), from) };
        let even_share = if link & MIXED != 0 { EVEN_SHARE_OF_DISTANT } else { EVEN_SHARE };
        let by_importance = (1.0 - even_share) * (1.0 / max(importances.sum, f32::MIN_POSITIVE));
        let evenly = even_share * (1.0 / max(importances.lit, 1.0));
        Self { importances, by_importance, evenly }
    }

    /// Returns the probability of the child at `place`.
    ///
    /// # Safety
    ///
    /// There is this child.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    unsafe fn probability(&self, place: u32) -> f32 {
        // SAFETY: the caller's promise.
        let importance = unsafe { self.importances.of(place) };
        if importance > 0.0 { importance * self.by_importance + self.evenly } else { 0.0 }
    }
}

/// Light that arrives at a point, as importances of nodes state it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arriving {
    /// Sum for the lights in the scene.
    pub near: f32,
    /// Sum for the lights that are infinitely far.
    pub distant: f32,
}

/// Returns the sum of the importances of the root's children at `from`.
///
/// # Safety
///
/// As [`choose`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(super) unsafe fn arriving(params: &RenderParams, scene: Scene, from: &ReferencePoint) -> Arriving {
    let mut sum = Arriving { near: 0.0, distant: 0.0 };
    let first = first_row(params);
    // SAFETY: the caller's promise.
    let link = unsafe { load_record::<Light>(scene.lights, params.light_count) }.kind;
    let (mut child, end) = (first_child(link), first_child(link) + child_count(link));
    while child < end {
        // SAFETY: as above.
        let (importance, is_distant) = unsafe { of_node(scene, first, child, from) };
        if is_distant {
            sum.distant += importance;
        } else {
            sum.near += importance;
        }
        child += 1;
    }
    sum
}

/// Chooses a light for the point `from`: by `random.z` at the first two levels, by `random.w` at
/// the next, then by words made from it, so that each number is stretched twice.
///
/// # Safety
///
/// The scene has a light tree, whose indices were proven as [`crate::buffer`] says.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn choose(params: &RenderParams, scene: Scene, from: &ReferencePoint, random: Words) -> Choice {
    let (mut probability, mut level) = (1.0, 0);
    let (mut number, mut word) = (unit_f32(random.z), random.w);
    let first = first_row(params);
    // SAFETY: the caller's promise.
    let mut link = unsafe { load_record::<Light>(scene.lights, params.light_count) }.kind;
    while link & LEAF == 0 {
        // SAFETY: as above.
        let children = unsafe { Children::new(scene, first, link, from) };
        // By the cumulative probabilities: children beside each other have numbers beside each
        // other, so that well distributed numbers choose well distributed lights.
        let (mut sum, mut before, mut own, mut chosen) = (0.0, 0.0, 0.0, NOWHERE);
        let mut place = 0;
        while place < child_count(link) {
            // SAFETY: there are so many.
            let probability = unsafe { children.probability(place) };
            if probability > 0.0 && sum <= number {
                (before, own, chosen) = (sum, probability, first_child(link) + place);
            }
            sum += probability;
            place += 1;
        }
        probability *= own;
        number = min((number - before) * (1.0 / max(own, f32::MIN_POSITIVE)), 0.999_999_94);
        level += 1;
        if level & 1 == 0 {
            number = unit_f32(word);
            word = (word ^ (word >> 15)).wrapping_mul(0x2c1b_3c6d) ^ level;
        }
        link = chosen;
        if chosen != NOWHERE {
            // SAFETY: as above.
            link = unsafe { load_row(scene.lights, first + NODE_ROWS * chosen + 1) }.z;
        }
    }
    Choice { light: if link == NOWHERE { NOWHERE } else { link & !LEAF }, probability }
}

/// Returns the probability that [`choose`] chooses a primitive that emits, and its pdf by area; 0
/// for one that is no light.
///
/// # Safety
///
/// As [`choose`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn area_pdf(params: &RenderParams, scene: Scene, from: &ReferencePoint, primitive: u32) -> f32 {
    // Lights are sorted by their primitives.
    let (mut low, mut high) = (0, params.area_light_count);
    while low < high {
        let middle = (low + high) / 2;
        // SAFETY: the caller's promise.
        if unsafe { load_record::<Light>(scene.lights, middle).primitive } < primitive {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    if low >= params.area_light_count {
        return 0.0;
    }
    // SAFETY: as above.
    let light = unsafe { load_record::<Light>(scene.lights, low) };
    if light.primitive != primitive || light.kind != AREA {
        return 0.0;
    }
    let first = first_row(params);
    let (mut pdf, mut link, mut place) = (light.intensity.x, light.threshold, light.alias);
    while link != NOWHERE && pdf > 0.0 {
        let row = first + NODE_ROWS * first_child(link) + 1;
        // SAFETY: as above; where there is a parent, there are two children.
        unsafe {
            pdf *= Children::new(scene, first, link, from).probability(place);
            link = load_row(scene.lights, row).w;
            if link != NOWHERE {
                place = load_row(scene.lights, row + NODE_ROWS).w;
            }
        }
    }
    pdf
}
