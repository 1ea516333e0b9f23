//! AOVs as layers of an OpenEXR file, beside the image.
//!
//! A layer is the part of a channel's name before the last dot ("Technical Introduction to
//! OpenEXR", section "Layers"): tools show `N.X`, `N.Y` and `N.Z` as the layer `N`. Depth is the
//! channel `Z`, as there.

use crate::camera;
use crate::film::{AovTotals, Film, PixelTotals};
use glam::DVec3;
use std::path::Path;
use trisect_image::ImageError;
use trisect_image::output::{Channel, Format, Samples, channels, color_channels};
use trisect_scene::Rebase;
use trisect_shared::camera::Camera;

/// Layer beside the image. Channels are `f32` unless stated otherwise; normals and albedo may be
/// 16-bit floats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// `N.X`, `N.Y`, `N.Z`: mean of the unit shading normals on the camera's side.
    Normal,
    /// `Ns.X`, `Ns.Y`, `Ns.Z`: the values of [`Normal`](Self::Normal), under the name that pbrt
    /// gives them.
    ShadingNormal,
    /// `Ng.X`, `Ng.Y`, `Ng.Z`: mean of the unit geometric normals on the camera's side, as
    /// [`surfaces`](crate::surfaces) finds them apart from the film.
    GeometricNormal,
    /// `P.X`, `P.Y`, `P.Z`: mean of the points hit, in the scene's own coordinates (before its
    /// field `space` is applied); 0 where nothing is hit.
    Position,
    /// `albedo.R`, `albedo.G`, `albedo.B`: mean albedo, 0 where nothing is hit.
    Albedo,
    /// `Z`: depth of the mean position along the camera's axis, in scene units; infinite where
    /// nothing is hit.
    Depth,
    /// `id`: object of the first sample that hits something, counted from 1; 0 for none. `u32`.
    Id,
    /// `variance.R`, `variance.G`, `variance.B`: estimated variance of the pixel's mean radiance;
    /// infinite with one sample.
    Variance,
    /// `samples`: number of samples of the pixel. `u32`.
    Samples,
    /// `UV.U`, `UV.V`: mean of the texture coordinates at the hits, u to the right and v upwards in
    /// an image; 0 where nothing is hit. [Rendered](crate::surfaces) apart from the film.
    Uv,
    /// `forward.u`, `forward.v`, `backward.u`, `backward.v`: mean motion of the points hit to the
    /// frames after and before, in pixels to the right and upwards; of the sky by the camera's
    /// rotation where nothing is hit; 0 for a point behind the camera of that frame.
    /// [Rendered](crate::surfaces) apart from the film.
    Motion,
    /// `CryptoObject00.R` to `CryptoMaterial02.A`: mattes of objects and materials, which are
    /// [rendered](crate::cryptomatte) apart from the film.
    Cryptomatte,
}

impl Aov {
    /// Layers with their names on the command line.
    pub const ALL: [(&'static str, Self); 12] = [
        ("normal", Self::Normal),
        ("shading-normal", Self::ShadingNormal),
        ("geometric-normal", Self::GeometricNormal),
        ("position", Self::Position),
        ("albedo", Self::Albedo),
        ("depth", Self::Depth),
        ("id", Self::Id),
        ("variance", Self::Variance),
        ("samples", Self::Samples),
        ("uv", Self::Uv),
        ("motion", Self::Motion),
        ("cryptomatte", Self::Cryptomatte),
    ];

    /// Returns whether the layer needs a film with AOV sums.
    pub fn needs_aov_sums(self) -> bool {
        let is_apart = self.needs_surfaces() || self == Self::Cryptomatte;
        !is_apart && !matches!(self, Self::Variance | Self::Samples)
    }

    /// Returns whether the layer is one of the [surfaces](crate::surfaces) that camera rays see.
    pub fn needs_surfaces(self) -> bool {
        matches!(self, Self::GeometricNormal | Self::Uv | Self::Motion)
    }
}

/// Checks that the file format can hold the layers, each once.
///
/// # Errors
///
/// Returns [`ImageError::NoLayers`] if the extension is not `.exr`, [`ImageError::LayerTwice`] if a
/// layer is named twice.
pub fn check(path: &Path, aovs: &[Aov]) -> Result<(), ImageError> {
    if Format::of(path)? != Format::Exr {
        return Err(ImageError::NoLayers { path: path.to_owned() });
    }
    let is_twice = |of: &&(&'static str, Aov)| aovs.iter().filter(|aov| **aov == of.1).count() > 1;
    match Aov::ALL.iter().find(is_twice) {
        Some((layer, _)) => Err(ImageError::LayerTwice { layer }),
        None => Ok(()),
    }
}

/// Place of a film's AOVs in the scene.
pub struct FilmPlace<'a, F: Fn(Option<u32>) -> u32> {
    /// Camera of the film, in the renderer's space.
    pub camera: &'a Camera,
    /// Space in which the scene was rendered; position and depth are written in the scene's own.
    pub space: Rebase,
    /// Returns the object of a primitive.
    pub object: F,
}

/// Returns the channels of the layers `aovs` of a film, without those that
/// are rendered apart. `stops` is the exposure of
/// the image beside them, by which the variance is scaled.
///
/// # Errors
///
/// A message if the film lacks AOV sums that a layer needs.
pub fn layers(
    film: &Film,
    place: &FilmPlace<'_, impl Fn(Option<u32>) -> u32>,
    aovs: &[Aov],
    stops: f32,
) -> Result<Vec<Channel>, String> {
    let has_sums = film.aovs.len() == film.pixels.len();
    if !has_sums && aovs.iter().any(|aov| aov.needs_aov_sums()) {
        return Err("the film lacks the AOV sums that these layers need".to_owned());
    }
    Ok(aovs.iter().flat_map(|aov| layer(*aov, film, place, f64::from(stops).exp2())).collect())
}

const XYZ: [&str; 3] = ["X", "Y", "Z"];

fn layer(
    aov: Aov,
    film: &Film,
    place: &FilmPlace<'_, impl Fn(Option<u32>) -> u32>,
    factor: f64,
) -> Vec<Channel> {
    let FilmPlace { camera, space, object } = place;
    let aovs = &film.aovs;
    let short = |value: [f64; 3]| value.map(|x| x as f32);
    match aov {
        Aov::Normal => channels("N.", XYZ, &aovs.map(|aov| short(aov.normal())), Samples::Color),
        Aov::ShadingNormal => channels("Ns.", XYZ, &aovs.map(|aov| short(aov.normal())), Samples::Color),
        Aov::Position => {
            let scene_point = |g: AovTotals| match g.hits {
                0 => [0.0; 3],
                _ => (DVec3::from(g.position()) / space.scale + space.origin).to_array(),
            };
            channels("P.", XYZ, &aovs.map(|aov| short(scene_point(aov))), Samples::F32)
        }
        Aov::Albedo => color_channels("albedo.", &aovs.map(|aov| short(aov.albedo()))),
        Aov::Depth => {
            let depth = |g: AovTotals| match g.hits {
                0 => f32::INFINITY,
                _ => (camera::depth(camera, DVec3::from(g.position())) / space.scale) as f32,
            };
            vec![Channel::new("Z", Samples::F32(aovs.map(depth)))]
        }
        Aov::Id => {
            let ids = aovs.iter().map(|aov| object(aov.primitive())).collect();
            vec![Channel::new("id", Samples::U32(ids))]
        }
        Aov::Variance => {
            let variance = |pixel: PixelTotals| match pixel.samples {
                0 => [f32::NAN; 3],
                1 => [f32::INFINITY; 3],
                _ => short(pixel.variance_of_mean().map(|v| v * factor * factor)),
            };
            channels("variance.", ["R", "G", "B"], &film.pixels.map(variance), Samples::F32)
        }
        Aov::Samples => {
            let count = |n: u64| u32::try_from(n).unwrap_or(u32::MAX);
            let counts = film.pixels.map(|pixel| count(pixel.samples));
            vec![Channel::new("samples", Samples::U32(counts))]
        }
        Aov::GeometricNormal | Aov::Uv | Aov::Motion | Aov::Cryptomatte => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

    use super::*;
    use crate::render::{Renderer, Settings};
    use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};
    use trisect_device::cpu::Cpu;
    use trisect_image::Image;
    use trisect_image::output::{Encoding, Picture};
    use trisect_scene::{Scene, SceneDocument};

    /// Checks names, types and the values of a sky pixel and of a sphere pixel, read back by the
    /// crate's own reader.
    #[test]
    fn layers_by_their_names() {
        let scene = Scene::hello_world().unwrap();
        let mut renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
        let settings = Settings { width: 16, height: 9, samples: 4, guides: true, ..Settings::of(&scene) };
        let film = renderer.render(&settings).unwrap().film;
        let path = std::env::temp_dir().join(format!("trisect-{}-layers.exr", std::process::id()));
        let aovs = Aov::ALL.map(|(_, aov)| aov);
        let camera = renderer.camera(&settings);
        let object = |primitive| renderer.object(primitive);
        let place = FilmPlace { camera: &camera, space: Rebase::IDENTITY, object };
        let image = film.image();
        let picture = |layers| Picture { image: &image, alpha: None, layers };
        let layers_of = |film: &Film| layers(film, &place, &aovs, 0.0);
        picture(layers_of(&film).unwrap()).write(&path, &Encoding::default()).unwrap();
        let file = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
        let file = file.all_attributes().from_file(&path).unwrap();
        // A reader of images reads the image alone.
        assert_eq!(Image::read(&path).unwrap(), image);
        std::fs::remove_file(&path).unwrap();
        let channels = file.layer_data.channel_data.list;
        let names: Vec<String> = channels.iter().map(|channel| channel.name.to_string()).collect();
        let want = [
            "B",
            "G",
            "N.X",
            "N.Y",
            "N.Z",
            "Ns.X",
            "Ns.Y",
            "Ns.Z",
            "P.X",
            "P.Y",
            "P.Z",
            "R",
            "Z",
            "albedo.B",
            "albedo.G",
            "albedo.R",
            "id",
            "samples",
            "variance.B",
            "variance.G",
            "variance.R",
        ];
        assert_eq!(names, want);
        let number = |name: &str, pixel: usize| {
            let channel = channels.iter().find(|channel| channel.name.to_string() == name).unwrap();
            match &channel.sample_data {
                FlatSamples::F32(values) => f64::from(values[pixel]),
                FlatSamples::U32(values) => f64::from(values[pixel]),
                FlatSamples::F16(_) => panic!("{name} is of half precision"),
            }
        };
        let sky = film.aovs.iter().position(|guides| guides.hits == 0).unwrap();
        let ball = film.aovs.iter().position(|guides| guides.misses == 0).unwrap();
        assert_eq!((number("id", sky), number("Z", sky), number("N.X", sky)), (0.0, f64::INFINITY, 0.0));
        assert_eq!((number("samples", sky), number("albedo.G", sky)), (4.0, 0.0));
        assert!(number("id", ball) >= 1.0 && number("id", ball) <= scene.spheres.len() as f64);
        assert!(number("Z", ball) > 0.0 && number("variance.R", ball) >= 0.0);
        let normal = ["N.X", "N.Y", "N.Z"].map(|name| number(name, ball));
        assert!(normal.iter().map(|x| x * x).sum::<f64>() <= 1.0 + 1e-6);
        // A film without AOV sums is refused.
        let mut plain_film = Film::new(film.width, film.height);
        plain_film.pixels.clone_from(&film.pixels);
        assert!(layers_of(&plain_film).is_err());
    }

    /// Renders the scene in its own space and in one that is four times as large and moved, and
    /// compares position and depth, which are the scene's in both. The factor is a power of two, so
    /// that rounding differs by the origin only.
    #[test]
    fn position_and_depth_are_in_scene_units() {
        let layers = |space: Rebase| {
            let scene = SceneDocument::hello_world().unwrap().lower(space).unwrap();
            let mut renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
            let settings =
                Settings { width: 16, height: 9, samples: 4, guides: true, ..Settings::of(&scene) };
            let film = renderer.render(&settings).unwrap().film;
            let camera = renderer.camera(&settings);
            let of = |space| {
                let place = FilmPlace { camera: &camera, space, object: |_| 0 };
                [Aov::Position, Aov::Depth].map(|aov| layer(aov, &film, &place, 1.0)).concat()
            };
            (of(space), of(Rebase::IDENTITY))
        };
        let values = |channels: &[Channel]| -> Vec<f32> {
            let floats = |channel: &Channel| match &channel.samples {
                Samples::F32(values) => values.clone(),
                _ => panic!("position and depth are floats"),
            };
            channels.iter().flat_map(floats).collect()
        };
        // A value is within 16; the origin of the other space costs it a few units of 2^-19.
        let alike = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| a == b || (a - b).abs() < 1e-3);
        let (own, _) = layers(Rebase::IDENTITY);
        let (moved, raw) = layers(Rebase { origin: DVec3::new(2.0, -1.0, 4.0), scale: 4.0 });
        assert!(alike(&values(&moved), &values(&own)));
        // Negative control: the renderer's own numbers differ.
        assert!(!alike(&values(&raw), &values(&own)));
    }

    #[test]
    fn other_formats_have_no_layers() {
        let [normal, depth] = [Aov::Normal, Aov::Depth];
        assert!(check(Path::new("a.EXR"), &[normal, depth]).is_ok());
        assert!(matches!(check(Path::new("a.png"), &[normal]), Err(ImageError::NoLayers { .. })));
        let twice = check(Path::new("a.exr"), &[normal, depth, normal]);
        assert!(matches!(twice, Err(ImageError::LayerTwice { layer: "normal" })));
    }
}
