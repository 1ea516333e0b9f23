//! Layers of a frame that a viewer shows in place of its image: what the first hits see, noise, and
//! cost.

use crate::cryptomatte::hash_of_name;
use crate::film::TASK;
use glam::Vec3;
use rayon::prelude::*;
use trisect_image::magma;
use trisect_image::metrics::srgb;
use trisect_scene::PartName;
use trisect_shared::aovs::AovSums;
use trisect_shared::film::PixelSums;

/// Layer of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Mean shading normal: red, green and blue are x, y and z, from -1 to 1.
    Normal,
    /// Mean albedo.
    Albedo,
    /// Depth along the camera's axis, from white to dark.
    Depth,
    /// Object of the first sample that hits something, each in a colour of its own.
    Object,
    /// Material of that object.
    Material,
    /// Standard error of the pixel's mean, relative to that, before the filter.
    Noise,
    /// Number of rays of a sample.
    Rays,
    /// Number of inner nodes of the binary BVH that the ray through the pixel's middle enters
    /// before its hit.
    Nodes,
}

impl Layer {
    /// Returns whether the layer shows objects.
    pub(super) fn needs_objects(self) -> bool {
        matches!(self, Self::Object | Self::Material)
    }

    /// Layers with their names.
    pub const ALL: [(&'static str, Self); 8] = [
        ("normal", Self::Normal),
        ("albedo", Self::Albedo),
        ("depth", Self::Depth),
        ("object", Self::Object),
        ("material", Self::Material),
        ("noise", Self::Noise),
        ("rays", Self::Rays),
        ("nodes", Self::Nodes),
    ];
}

/// Picture of a layer.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerPicture {
    /// RGBA with 8 bits each, red in the lowest byte; row by row from the top.
    pub pixels: Vec<u32>,
    /// Values of the first and the last colour, for a layer of numbers.
    pub range: Option<[f64; 2]>,
}

/// Share of the values below the last colour of a range: few large ones would leave the others one
/// colour.
const IN_RANGE: f64 = 0.995;

/// Sums of a frame, and what the layers need besides them.
pub(super) struct FrameSums<'a> {
    pub sums: &'a [PixelSums],
    pub aovs: &'a [AovSums],
    /// Number of each pixel's object, from 1 on, or 0; empty unless the layer needs them.
    pub objects: &'a [u32],
    /// Returns the depth of a position.
    pub depth: &'a (dyn Fn(Vec3) -> f64 + Sync),
    /// Returns the number of nodes of a pixel.
    pub nodes: &'a (dyn Fn(usize) -> u32 + Sync),
    /// Names of the objects, from object 1 on.
    pub names: &'a [PartName],
}

impl FrameSums<'_> {
    /// Returns the picture of a layer.
    pub fn picture(&self, layer: Layer) -> LayerPicture {
        let plain = |pixels| LayerPicture { pixels, range: None };
        match layer {
            Layer::Normal => plain(self.map(|_, aov| {
                let normal = if aov.hits > 0 { aov.normal / aov.hits as f32 } else { -Vec3::ONE };
                packed(normal.to_array().map(|c| ((c * 0.5 + 0.5) * 255.0).round() as u8))
            })),
            Layer::Albedo => plain(self.map(|_, aov| {
                let albedo = aov.albedo / aov.samples().max(1) as f32;
                packed(albedo.to_array().map(srgb::encode_u8))
            })),
            Layer::Object => plain(self.colors_of(Some)),
            Layer::Material => {
                let hashes: Vec<u32> = self.names.iter().map(|name| hash_of_name(&name.material)).collect();
                plain(self.colors_of(|object| hashes.get(object as usize - 1).copied()))
            }
            Layer::Depth => self.depths(),
            Layer::Noise => heat(&self.values(|_, sums, _| relative_error(sums))),
            Layer::Rays => {
                heat(&self.values(|_, sums, _| f64::from(sums.segments) / f64::from(sums.samples.max(1))))
            }
            Layer::Nodes => heat(&self.values(|pixel, _, _| f64::from((self.nodes)(pixel)))),
        }
    }

    /// Returns a colour for each number that `number` returns for a pixel's object, and black for
    /// pixels without a number.
    fn colors_of(&self, number: impl Fn(u32) -> Option<u32>) -> Vec<u32> {
        let color = |object: &u32| match object {
            0 => BLACK,
            object => number(*object).map_or(BLACK, color_of),
        };
        self.objects.iter().map(color).collect()
    }

    /// Returns depths as greys between their range, and black where nothing is hit.
    fn depths(&self) -> LayerPicture {
        let depth = |_: usize, _: &PixelSums, aov: &AovSums| match aov.hits {
            0 => f64::NAN,
            hits => (self.depth)(aov.position / hits as f32),
        };
        let depths = self.values(depth);
        let [low, high] = range(&depths);
        let grey = |depth: &f64| match depth.is_finite() {
            false => BLACK,
            true => packed([(255.0 - 215.0 * share(*depth, [low, high])).round() as u8; 3]),
        };
        LayerPicture { pixels: depths.par_iter().map(grey).collect(), range: Some([low, high]) }
    }

    fn map(&self, color: impl Fn(&PixelSums, &AovSums) -> u32 + Sync + Send) -> Vec<u32> {
        let pairs = self.sums.par_iter().zip(self.aovs).with_min_len(TASK);
        pairs.map(|(sums, aov)| color(sums, aov)).collect()
    }

    fn values(&self, value: impl Fn(usize, &PixelSums, &AovSums) -> f64 + Sync + Send) -> Vec<f64> {
        let pairs = self.sums.par_iter().zip(self.aovs).enumerate();
        pairs.map(|(pixel, (sums, aov))| value(pixel, sums, aov)).collect()
    }
}

const BLACK: u32 = 0xff00_0000;

fn packed([red, green, blue]: [u8; 3]) -> u32 {
    u32::from_le_bytes([red, green, blue, 255])
}

/// Returns a colour for a number, never a dark one.
fn color_of(number: u32) -> u32 {
    let mixed = number.wrapping_mul(0x9e37_79b1).rotate_left(15).wrapping_mul(0x85eb_ca6b);
    let [red, green, blue, _] = (mixed ^ mixed >> 15).to_le_bytes();
    packed([red, green, blue].map(|c| 64 + (c >> 2) * 3))
}

/// Returns the standard error of a pixel's mean radiance over all channels, relative to the mean;
/// NaN with fewer than two samples, 0 for black.
fn relative_error(sums: &PixelSums) -> f64 {
    let n = f64::from(sums.samples);
    if sums.samples < 2 {
        return f64::NAN;
    }
    let (mut variance, mut total) = (0.0, 0.0);
    for c in 0..3 {
        let mean = f64::from(sums.radiance[c]) / n;
        variance += (f64::from(sums.squares[c]) / n - mean * mean).max(0.0) / (n - 1.0);
        total += mean;
    }
    if total > 0.0 { variance.sqrt() / total } else { 0.0 }
}

/// Returns minimum and a high quantile of the finite values; 0 and 0 without any.
fn range(values: &[f64]) -> [f64; 2] {
    let mut finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let Some(last) = finite.len().checked_sub(1) else { return [0.0; 2] };
    let place = (last as f64 * IN_RANGE) as usize;
    let low = finite.iter().copied().fold(f64::INFINITY, f64::min);
    let (_, high, _) = finite.select_nth_unstable_by(place, f64::total_cmp);
    [low, *high]
}

/// Returns the place of a value in a range, 0 to 1; 0 in an empty one.
fn share(value: f64, [low, high]: [f64; 2]) -> f64 {
    if high > low { ((value - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 }
}

/// Returns values as colours from 0 on; one that is not finite is black.
fn heat(values: &[f64]) -> LayerPicture {
    let range = [0.0, range(values)[1]];
    let color = |value: &f64| match value.is_finite() {
        true => packed(magma::color(share(*value, range))),
        false => BLACK,
    };
    LayerPicture { pixels: values.par_iter().map(color).collect(), range: Some(range) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_ignore_what_is_rare_or_not_finite() {
        let mut values = vec![1.0; 999];
        values.extend([f64::NAN, f64::INFINITY, 0.5, 1e9]);
        assert_eq!(range(&values), [0.5, 1.0]);
        assert_eq!(range(&[f64::NAN]), [0.0; 2]);
        let picture = heat(&[0.0, 2.0, f64::NAN]);
        assert_eq!(picture.range, Some([0.0, 0.0]), "the larger of two values is above the quantile");
        assert_eq!(heat(&[2.0; 3]).pixels, [packed([252, 253, 191]); 3]);
        assert_eq!(picture.pixels[2], BLACK);
        assert_eq!((share(3.0, [1.0, 5.0]), share(9.0, [1.0, 5.0]), share(1.0, [1.0, 1.0])), (0.5, 1.0, 0.0));
    }

    #[test]
    fn errors_are_those_of_the_mean() {
        let sums = |samples: u32, radiance: f32, squares: f32| PixelSums {
            radiance: Vec3::splat(radiance),
            samples,
            squares: Vec3::splat(squares),
            segments: 0,
        };
        // Samples 1 and 3: mean 2, variance of the mean 1 in each of three channels.
        assert!((relative_error(&sums(2, 4.0, 10.0)) - 3.0f64.sqrt() / 6.0).abs() < 1e-12);
        assert_eq!(relative_error(&sums(2, 0.0, 0.0)), 0.0);
        assert!(relative_error(&sums(1, 1.0, 1.0)).is_nan());
    }

    #[test]
    fn neighbouring_objects_differ() {
        let colors: Vec<u32> = (1..200).map(color_of).collect();
        let mut sorted = colors.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert!(sorted.len() > 190, "{}", sorted.len());
        let apart = |a: u32, b: u32| {
            a.to_le_bytes().iter().zip(b.to_le_bytes()).map(|(a, b)| u32::from(a.abs_diff(b))).sum::<u32>()
        };
        assert!(colors.windows(2).all(|pair| apart(pair[0], pair[1]) > 30));
    }
}
