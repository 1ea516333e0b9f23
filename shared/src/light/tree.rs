//! Light tree: a tree of bounds of lights, by which a connection descends to one light (Conty
//! Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", High
//! Performance Graphics 2018). Each child of a node has an importance, a bound of the light that
//! arrives from it, and is chosen in proportion. Nodes have up to eight children: the bounds of
//! smaller groups are tighter, so fewer levels make fewer errors.
//!
//! The nodes follow the lights in their array: the root, then the children of each node together.

use super::{AREA, Light, ReferencePoint};
use crate::buffer::load_record;
use crate::math::{max, min, sqrt, unit_f32};
use crate::params::RenderParams;
use crate::rng::Words;
use crate::scene::Scene;

/// Bit of [`Light::kind`] of a node that stands for one light, whose index the other bits are.
pub const LEAF: u32 = 1 << 31;

/// Index of a light that stands for no choice.
pub const NO_CHOICE: u32 = u32::MAX;

/// Maximum number of children of a node.
pub const WIDTH: usize = 8;

/// Part of the choices at a node that is even among the children that may send light: what blocks a
/// light is not known, and dim lights must not vanish beside a strong one behind a wall.
pub const EVEN_SHARE: f32 = 1.0 / 64.0;

/// Part of even choices between lights that are infinitely far and lights in the scene: a sun that
/// does not enter a room is a thousand times as strong as its lamps.
pub const EVEN_SHARE_OF_DISTANT: f32 = 0.5;

/// Factor of the importance of lights below the horizon: a normal map may turn the horizon.
const BELOW_HORIZON: f32 = 0.02;

/// Light that was chosen, and the probability of that choice.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    /// Index of the light, or [`NO_CHOICE`].
    pub light: u32,
    /// Probability of the choice.
    pub probability: f32,
}

/// Returns cosine and sine of angle a less angle b, of 0 if b is greater; both are from 0 to π and
/// given by cosine and sine.
#[inline(always)]
fn turned(a: (f32, f32), b: (f32, f32)) -> (f32, f32) {
    let less = (a.0 * b.0 + a.1 * b.1, a.1 * b.0 - a.0 * b.1);
    if a.0 >= b.0 { (1.0, 0.0) } else { less }
}

/// Returns the sine, at least 0, of the angle from 0 to π that has this cosine.
#[inline(always)]
fn sine(cos: f32) -> f32 {
    sqrt(max(1.0 - cos * cos, 0.0))
}

/// Returns an upper bound, but for the distance, of the light that arrives from a node: its
/// strength over the squared distance, times bounds of the cosines at the lights and at the surface
/// (section 4.1 of the paper).
#[inline(always)]
fn importance(node: &Light, from: &ReferencePoint) -> f32 {
    let (radius, cone) = (node.probability, (node.cone_offset, node.intensity.z));
    let (mut direction, mut spread, mut received) = (node.axis, cone, 1.0);
    if radius >= 0.0 {
        let to = node.position - from.point;
        let (square, least) = (to.dot(to), max(radius * radius, 1e-30));
        received = 1.0 / max(square, least);
        spread = (-1.0, 0.0);
        if square > least {
            let inverse = sqrt(received);
            direction = to * inverse;
            let sine = min(radius * inverse, 1.0);
            spread = (sqrt(max(1.0 - sine * sine, 0.0)), sine);
        }
        if cone.0 > -1.0 {
            let cos = -node.axis.dot(direction);
            let emitted = turned(turned((cos, sine(cos)), cone), spread).0;
            received *= if emitted > node.intensity.y { emitted } else { 0.0 };
        }
    }
    if from.normal.dot(from.normal) > 0.0 {
        let cos = from.normal.dot(direction);
        received *= max(turned((cos, sine(cos)), spread).0, BELOW_HORIZON);
    }
    node.intensity.x * received
}

/// Choice among the children of a node, one after the other: each takes the place of the one chosen
/// before with its share of the weights so far, and the random number is stretched to the part that
/// it fell into (weighted reservoir sampling, Chao, 1982).
#[derive(Clone, Copy)]
pub(super) struct Siblings {
    /// Sum of the importances, of which none is below 0.
    sum: f32,
    /// Number of children that may send light.
    count: f32,
    /// True if they are chosen evenly.
    even: bool,
    random: f32,
}

impl Siblings {
    #[inline(always)]
    pub(super) fn new(random: f32, even_share: f32) -> Self {
        let even = random < even_share;
        let (low, width) = if even { (0.0, even_share) } else { (even_share, 1.0 - even_share) };
        let random = min((random - low) * (1.0 / width), 0.999_999_94);
        Self { sum: 0.0, count: 0.0, even, random }
    }

    /// Adds a child. Returns whether it is the one chosen so far.
    #[inline(always)]
    pub(super) fn add(&mut self, importance: f32) -> bool {
        let mut chosen = false;
        if importance > 0.0 {
            let before = if self.even { self.count } else { self.sum };
            self.sum += importance;
            self.count += 1.0;
            let weight = if self.even { 1.0 } else { importance };
            let place = self.random * (before + weight);
            chosen = place < weight;
            let (part, width) = if chosen { (place, weight) } else { (place - weight, before) };
            self.random = min(part * (1.0 / max(width, f32::MIN_POSITIVE)), 0.999_999_94);
        }
        chosen
    }

    /// Returns the probability of a child.
    #[inline(always)]
    fn probability(&self, importance: f32, even_share: f32) -> f32 {
        let by_importance = importance * (1.0 / max(self.sum, f32::MIN_POSITIVE));
        let evenly = 1.0 / max(self.count, 1.0);
        if importance > 0.0 { by_importance * (1.0 - even_share) + evenly * even_share } else { 0.0 }
    }
}

/// Bounds of the light that arrives at a point, as importances of nodes state it.
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
    // SAFETY: the caller's promise.
    let root = unsafe { load_record::<Light>(scene.lights, params.light_count) };
    let is_leaf = root.kind & LEAF != 0;
    let (first, count) = if is_leaf { (params.light_count, 1) } else { (root.kind, root.alias) };
    let mut child = 0;
    while child < count {
        // SAFETY: as above.
        let node = unsafe { load_record::<Light>(scene.lights, first + child) };
        let importance = importance(&node, from);
        if node.probability < 0.0 {
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
    // SAFETY: the caller's promise.
    let mut node = unsafe { load_record::<Light>(scene.lights, params.light_count) };
    while node.kind & LEAF == 0 {
        let mut siblings = Siblings::new(number, node.cone_scale);
        let (mut chosen, mut own) = (NO_CHOICE, 0.0);
        let mut child = 0;
        while child < node.alias {
            // SAFETY: as above.
            let importance =
                importance(&unsafe { load_record::<Light>(scene.lights, node.kind + child) }, from);
            if siblings.add(importance) {
                (chosen, own) = (node.kind + child, importance);
            }
            child += 1;
        }
        probability *= siblings.probability(own, node.cone_scale);
        number = siblings.random;
        level += 1;
        if level & 1 == 0 {
            number = unit_f32(word);
            word = (word ^ (word >> 15)).wrapping_mul(0x2c1b_3c6d) ^ level;
        }
        if chosen == NO_CHOICE {
            node.kind = NO_CHOICE;
        } else {
            // SAFETY: as above.
            node = unsafe { load_record::<Light>(scene.lights, chosen) };
        }
    }
    Choice { light: if node.kind == NO_CHOICE { NO_CHOICE } else { node.kind & !LEAF }, probability }
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
    let (mut pdf, mut place) = (light.intensity.x, light.threshold);
    while place != params.light_count && pdf > 0.0 {
        // SAFETY: as above.
        let node = unsafe { load_record::<Light>(scene.lights, place) };
        // SAFETY: as above.
        let parent = unsafe { load_record::<Light>(scene.lights, node.primitive) };
        let (mut siblings, mut own, mut child) = (Siblings::new(0.0, 1.0), 0.0, 0);
        while child < parent.alias {
            // SAFETY: as above.
            let importance =
                importance(&unsafe { load_record::<Light>(scene.lights, parent.kind + child) }, from);
            siblings.add(importance);
            own = if parent.kind + child == place { importance } else { own };
            child += 1;
        }
        pdf *= siblings.probability(own, parent.cone_scale);
        place = node.primitive;
    }
    pdf
}
