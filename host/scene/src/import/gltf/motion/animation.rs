//! Animations: samples their channels at a time (glTF 2.0, section 3.11 and appendix C).

use super::super::super::source_location::{SourceLocation, shown};
use super::super::accessor::{Component, Elements, Expected};
use super::super::buffers::get;
use super::super::json::{Animation, Channel, ChannelSampler};
use super::super::{Document, Output};
use super::Pose;
use crate::error::SceneError;
use crate::import::ModelOptions;
use Component::{F32, I8, I16, U8, U16};
use glam::{DQuat, DVec3, DVec4};

const TIME: Expected = Expected { kind: "SCALAR", components: &[F32] };
const VECTOR: Expected = Expected { kind: "VEC3", components: &[F32] };
const ROTATION: Expected = Expected { kind: "VEC4", components: &[F32, I8, U8, I16, U16] };
const WEIGHT: Expected = Expected { kind: "SCALAR", components: &[F32, I8, U8, I16, U16] };

/// Animation that was chosen, at a time.
#[derive(Clone, Copy, Debug)]
pub struct Chosen {
    /// Index of the animation.
    pub animation: usize,
    /// Time in seconds.
    pub time: f64,
}

/// Returns the animation that `options` ask for; `None` for the file's own pose.
///
/// # Errors
///
/// * [`SceneError::Malformed`] for an animation that does not exist
pub fn choose(
    document: &Document,
    output: &mut Output,
    options: &ModelOptions,
) -> Result<Option<Chosen>, SceneError> {
    let animations = &document.root.animations;
    let list = || {
        let names = animations.iter().take(8).map(|of| format!("\"{}\"", label(of)));
        let more = if animations.len() > 8 { ", …" } else { "" };
        names.collect::<Vec<_>>().join(", ") + more
    };
    let index = match (&options.animation, options.time) {
        (None, None) => {
            if !animations.is_empty() {
                let note = "animated: drawn in the file's own pose, because no time or animation is chosen";
                output.notes.push(format!("{note}; it has {}", list()));
            }
            return Ok(None);
        }
        (None, Some(_)) if animations.is_empty() => {
            output.warnings.once("there is no animation: a time has no effect");
            return Ok(None);
        }
        (None, Some(_)) => {
            if animations.len() > 1 {
                output.notes.push(format!("the first of the animations is drawn: {}", list()));
            }
            0
        }
        (Some(name), _) => {
            let found = animations.iter().position(|of| of.name.as_deref() == Some(name));
            found.ok_or_else(|| {
                let has = if animations.is_empty() { "none".to_owned() } else { list() };
                let site = document.site("animations");
                site.malformed(format!("there is no animation \"{}\"", shown(name)), format!("it has {has}"))
            })?
        }
    };
    Ok(Some(Chosen { animation: index, time: options.time.unwrap_or(0.0) }))
}

/// Returns the pose of the document's nodes in an animation.
///
/// # Errors
///
/// * [`SceneError::Malformed`] for an animation that violates the specification
pub fn pose<'a>(
    document: &'a Document,
    output: &mut Output,
    chosen: Option<Chosen>,
) -> Result<Pose<'a>, SceneError> {
    let mut pose = Pose::at_rest(&document.root, &document.name);
    let Some(Chosen { animation: index, time }) = chosen else { return Ok(pose) };
    let site = document.site(format!("animations[{index}]"));
    if let Some(animation) = document.root.animations.get(index) {
        for (place, channel) in animation.channels.iter().enumerate() {
            let site = site.member(&format!("channels[{place}]"));
            move_node(document, output, animation, channel, time, &mut pose, &site)?;
        }
    }
    Ok(pose)
}

fn label(animation: &Animation) -> String {
    animation.name.as_deref().map_or_else(|| "unnamed".to_owned(), shown)
}

/// Puts what a channel has at a time into the pose.
fn move_node(
    document: &Document,
    output: &mut Output,
    animation: &Animation,
    channel: &Channel,
    time: f64,
    pose: &mut Pose,
    site: &SourceLocation,
) -> Result<(), SceneError> {
    let path = &*channel.target.path;
    let parts: Vec<&str> = channel.target.pointer().unwrap_or_default().split('/').skip(1).collect();
    let (node, path) = match channel.target.node {
        Some(node) => (node, path),
        None if path == "pointer" => match node_property(&parts) {
            Some(named) => named,
            None => return Ok(()),
        },
        None => return Ok(()),
    };
    get(&document.root.nodes, node, "nodes", site)?;
    let sampler = get(&animation.samplers, channel.sampler, "samplers", site)?;
    let track = |output: &mut Output, expected| Track::open(document, output, sampler, expected, site);
    match path {
        "translation" => {
            let [x, y, z] = track(output, VECTOR)?.interpolate(time, 0, linear);
            pose.of(node).translation = Some(DVec3::new(x, y, z));
        }
        "scale" => {
            let [x, y, z] = track(output, VECTOR)?.interpolate(time, 0, linear);
            pose.of(node).scale = Some(DVec3::new(x, y, z));
        }
        "rotation" => {
            let rotation = DVec4::from(track(output, ROTATION)?.interpolate(time, 0, spherical));
            let unit = rotation.try_normalize().unwrap_or(DVec4::W);
            pose.of(node).rotation = Some(DQuat::from_vec4(unit));
        }
        "weights" => {
            let track = track(output, WEIGHT)?;
            output.budget.take(8 * u64::from(track.width), site)?;
            let weights = (0..track.width).map(|target| track.weight(time, target));
            pose.of(node).weights = Some(weights.collect());
        }
        VISIBLE => {
            let [visible] = track(output, WEIGHT)?.held(time);
            pose.of(node).visible = Some(visible != 0.0);
        }
        other => {
            let text = format!("an animation moves \"{}\", which is not supported and ignored", shown(other));
            output.warnings.once(text);
        }
    }
    Ok(())
}

/// Name of the property of KHR_node_visibility, among the paths of a channel.
const VISIBLE: &str = "KHR_node_visibility/visible";

/// Returns the node and the property that a pointer of these parts names; `None` for another one.
pub fn node_property<'a>(parts: &[&'a str]) -> Option<(u32, &'a str)> {
    let (node, path) = match parts {
        ["nodes", node, path @ ("translation" | "rotation" | "scale" | "weights")] => (node, *path),
        ["nodes", node, "extensions", "KHR_node_visibility", "visible"] => (node, VISIBLE),
        _ => return None,
    };
    node.parse().ok().map(|node| (node, path))
}

/// Values of a channel by time.
pub struct Track<'a> {
    times: Elements<'a>,
    values: Elements<'a>,
    curve: Interpolation,
    /// Elements of a value: 1, or the number of a mesh's weights.
    width: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Interpolation {
    Step,
    Linear,
    CubicSpline,
}

/// Place of a time among those of a track.
struct Moment {
    /// Last key that is not after it, and the next; the same beyond the ends.
    keys: [u32; 2],
    /// Part of the time between the keys, 0 to 1.
    part: f64,
    /// Seconds between the keys.
    span: f64,
}

/// Interpolates linearly, component by component.
fn linear<const N: usize>(a: [f64; N], b: [f64; N], part: f64) -> [f64; N] {
    std::array::from_fn(|axis| a[axis] + (b[axis] - a[axis]) * part)
}

/// Interpolates unit quaternions on the shorter arc.
fn spherical(a: [f64; 4], b: [f64; 4], part: f64) -> [f64; 4] {
    let unit = |q: [f64; 4]| DVec4::from(q).try_normalize().map(DQuat::from_vec4);
    match (unit(a), unit(b)) {
        (Some(a), Some(b)) => a.slerp(b, part).to_array(),
        _ => linear(a, b, part),
    }
}

impl<'a> Track<'a> {
    /// Returns the value at a time of a property of `count` numbers.
    ///
    /// # Errors
    ///
    /// * [`SceneError::Malformed`] for values of another type
    pub fn numbers(
        document: &'a Document,
        output: &mut Output,
        sampler: &ChannelSampler,
        count: usize,
        time: f64,
        site: &SourceLocation,
    ) -> Result<Vec<f64>, SceneError> {
        let kind = match count {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            _ => "VEC4",
        };
        let track = Self::open(document, output, sampler, Expected { kind, ..WEIGHT }, site)?;
        Ok(match count {
            1 => track.interpolate::<1>(time, 0, linear).to_vec(),
            2 => track.interpolate::<2>(time, 0, linear).to_vec(),
            3 => track.interpolate::<3>(time, 0, linear).to_vec(),
            _ => track.interpolate::<4>(time, 0, linear).to_vec(),
        })
    }

    fn open(
        document: &'a Document,
        output: &mut Output,
        sampler: &ChannelSampler,
        expected: Expected,
        site: &SourceLocation,
    ) -> Result<Self, SceneError> {
        let curve = match sampler.interpolation.as_deref() {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::CubicSpline,
            Some(other) => {
                let problem = format!("interpolation is \"{}\"", shown(other));
                return Err(site.malformed(problem, "it must be LINEAR, STEP or CUBICSPLINE"));
            }
        };
        let times = Elements::open(document, &mut output.budget, sampler.input, TIME, &site.member("input"))?;
        let values =
            Elements::open(document, &mut output.budget, sampler.output, expected, &site.member("output"))?;
        let parts = if curve == Interpolation::CubicSpline { 3 } else { 1 };
        let width = values.count.checked_div(times.count.saturating_mul(parts)).unwrap_or(0);
        let scalars = expected.kind == "SCALAR";
        if width == 0 || !scalars && width != 1 {
            let problem = format!("it has {} times and {} values", times.count, values.count);
            return Err(site.malformed(problem, "there must be a value for each time, 3 for CUBICSPLINE"));
        }
        Ok(Self { times, values, curve, width })
    }

    fn time(&self, key: u32) -> f64 {
        let [time] = self.times.floats(key);
        f64::from(time)
    }

    /// Finds a time; before the first key and after the last one it is that of the key.
    fn find(&self, time: f64) -> Moment {
        let (mut low, mut high) = (0, self.times.count);
        while low < high {
            let middle = low + (high - low) / 2;
            if self.time(middle) <= time {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        let last = self.times.count - 1; // there is a key: `width` is above 0
        let (from, to) = (low.saturating_sub(1).min(last), low.min(last));
        let span = self.time(to) - self.time(from);
        let part = if span > 0.0 { ((time - self.time(from)) / span).clamp(0.0, 1.0) } else { 0.0 };
        Moment { keys: [from, to], part, span: if span > 0.0 { span } else { 0.0 } }
    }

    /// Returns element `target` of a key's value; of a spline's three parts, number `part`.
    fn value<const N: usize>(&self, key: u32, part: u32, target: u32) -> [f64; N] {
        let element = match self.curve {
            Interpolation::CubicSpline => (u64::from(key) * 3 + u64::from(part)) * u64::from(self.width),
            _ => u64::from(key) * u64::from(self.width),
        };
        // Within the count, which `width` was computed from.
        let element = (element + u64::from(target)).min(u64::from(self.values.count - 1));
        self.values.floats(element as u32).map(f64::from)
    }

    /// Returns the value at a time.
    fn interpolate<const N: usize>(
        &self,
        time: f64,
        target: u32,
        mix: fn([f64; N], [f64; N], f64) -> [f64; N],
    ) -> [f64; N] {
        let Moment { keys: [from, to], part: t, span } = self.find(time);
        match self.curve {
            Interpolation::Step => self.value(from, 0, target),
            Interpolation::Linear => mix(self.value(from, 0, target), self.value(to, 0, target), t),
            Interpolation::CubicSpline => {
                // In-tangent, value and out-tangent.
                let (t2, t3) = (t * t, t * t * t);
                let (start, leaving) = (self.value::<N>(from, 1, target), self.value::<N>(from, 2, target));
                let (arriving, end) = (self.value::<N>(to, 0, target), self.value::<N>(to, 1, target));
                std::array::from_fn(|axis| {
                    (2.0 * t3 - 3.0 * t2 + 1.0) * start[axis]
                        + span * (t3 - 2.0 * t2 + t) * leaving[axis]
                        + (3.0 * t2 - 2.0 * t3) * end[axis]
                        + span * (t3 - t2) * arriving[axis]
                })
            }
        }
    }

    /// Returns the value of the last key that is not after a time, whatever the interpolation.
    fn held<const N: usize>(&self, time: f64) -> [f64; N] {
        let part = u32::from(self.curve == Interpolation::CubicSpline);
        self.value(self.find(time).keys[0], part, 0)
    }

    fn weight(&self, time: f64, target: u32) -> f64 {
        let [weight] = self.interpolate(time, target, linear);
        weight
    }
}
