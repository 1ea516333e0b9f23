//! Cryptomatte: mattes of objects and materials in an EXR file (Friedman and Jones, "Fully
//! Automatic ID Mattes with Support for Motion Blur and Transparency", SIGGRAPH posters 2015;
//! format by Psyop's specification 1.2).
//!
//! A pixel has the ids of the objects that its camera rays see first, each with its share of the
//! rays.

mod coverage;
mod hash;

use crate::Error;
#[cfg(doc)]
use crate::camera_rays::MAX_SAMPLES;
use crate::camera_rays::for_each_sample;
use crate::render::{RenderObserver, Renderer, Settings};
use coverage::PixelCoverage;
pub(crate) use hash::hash_of_name;
use hash::id_of_hash;
use rayon::prelude::*;
use serde_json::{Map, Value};
use trisect_image::output::{Channel, Samples};
use trisect_scene::PartName;

/// Number of ids of a pixel that a file has: two for each of its layers.
const RANKS: usize = 6;

/// Channels and attributes of a file with mattes of objects and of materials.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cryptomatte {
    /// Channels `CryptoObject00.R` to `CryptoMaterial02.A`: R and B are ids, G and A coverage.
    pub channels: Vec<Channel>,
    /// Names and values of the attributes that say how to read them.
    pub attributes: Vec<(String, String)>,
}

/// Renders the mattes of an image: its camera rays of the first samples, at most [`MAX_SAMPLES`]
/// per pixel. `names` are those of the scene's [objects](Renderer::object), from object 1 on.
///
/// # Errors
///
/// Those of a render; [`Error::Cancelled`] if `observer` cancels it.
pub fn render(
    renderer: &mut Renderer,
    settings: &Settings,
    names: &[PartName],
    observer: &mut dyn RenderObserver,
) -> Result<Cryptomatte, Error> {
    let mut pixels = vec![PixelCoverage::default(); settings.pixels() as usize];
    let samples = for_each_sample(renderer, settings, observer, |renderer, film| {
        let primitives = film.aovs.map(|aov| aov.primitive());
        let each = pixels.iter_mut().zip(primitives);
        each.for_each(|(pixel, primitive)| pixel.add(renderer.object(primitive)));
    })?;
    let objects = matte("CryptoObject", &pixels, samples, names.iter().map(|name| name.object.as_str()));
    let materials =
        matte("CryptoMaterial", &pixels, samples, names.iter().map(|name| name.material.as_str()));
    Ok(Cryptomatte {
        channels: [objects.channels, materials.channels].concat(),
        attributes: [objects.attributes, materials.attributes].concat(),
    })
}

/// Returns the channels and attributes of one kind of names, which are those of objects 1 and on.
fn matte<'a>(
    layer: &str,
    pixels: &[PixelCoverage],
    samples: u32,
    names: impl Iterator<Item = &'a str>,
) -> Cryptomatte {
    let names: Vec<&str> = names.collect();
    let hashes: Vec<u32> = names.iter().map(|name| hash_of_name(name)).collect();
    let rank = |pixel: &PixelCoverage| pixel.ranks::<RANKS>(&hashes, samples);
    let ranks: Vec<[(u32, f32); RANKS]> = pixels.par_iter().map(rank).collect();
    let mut channels = Vec::new();
    for number in 0..RANKS / 2 {
        for (name, rank, is_id) in [
            ("R", 2 * number, true),
            ("G", 2 * number, false),
            ("B", 2 * number + 1, true),
            ("A", 2 * number + 1, false),
        ] {
            let sample = |ranks: &[(u32, f32); RANKS]| {
                let (hash, coverage) = ranks[rank];
                if is_id { id_of_hash(hash) } else { coverage }
            };
            let samples = Samples::F32(ranks.par_iter().map(sample).collect());
            channels.push(Channel::new(format!("{layer}{number:02}.{name}"), samples));
        }
    }
    let manifest: Map<String, Value> = names
        .iter()
        .zip(&hashes)
        .map(|(name, hash)| ((*name).to_owned(), Value::from(format!("{:08x}", id_of_hash(*hash).to_bits()))))
        .collect();
    let key = format!("{:08x}", hash_of_name(layer));
    let attribute = |name: &str, value: String| (format!("cryptomatte/{}/{name}", &key[..7]), value);
    let attributes = vec![
        attribute("name", layer.to_owned()),
        attribute("hash", "MurmurHash3_32".to_owned()),
        attribute("conversion", "uint32_to_float32".to_owned()),
        attribute("manifest", Value::from(manifest).to_string()),
    ];
    Cryptomatte { channels, attributes }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

    use super::*;
    use std::ops::ControlFlow;
    use trisect_device::cpu::Cpu;
    use trisect_scene::{Rebase, Scene, SceneDocument};

    const SCENE: &str = "Scene(version: 1, image: (width: 32, height: 16, samples: 16, depth: 2), \
        camera: (look_from: (0, 0, 5), look_at: (0, 0, 0), vertical_fov: 30), \
        sky: Uniform(radiance: (1, 1, 1)), \
        materials: { \"red\": Lambertian(albedo: (0.5, 0, 0)), \"grey\": Lambertian(albedo: (0.5, 0.5, 0.5)) }, \
        objects: [\
            Quad(corner: (-9, -9, -2), u: (9, 0, 0), v: (0, 18, 0), material: \"grey\", name: \"left wall\"), \
            Sphere(center: (0, 0, 0), radius: 1, material: \"red\"), \
            Box(min: (1.5, -0.5, 0), max: (2, 0.5, 1), material: \"red\", name: \"box\")])";

    fn values<'a>(matte: &'a Cryptomatte, name: &str) -> &'a [f32] {
        let channel = matte.channels.iter().find(|channel| channel.name == name).unwrap();
        let Samples::F32(values) = &channel.samples else { panic!("{name} has 16 bits") };
        values
    }

    /// Coverage adds up to what camera rays see, and ids are those of the manifest.
    #[test]
    fn ids_and_coverage_of_a_small_scene() {
        let document = SceneDocument::parse(SCENE, "a.ron").unwrap();
        let names = document.part_names();
        let scene = document.lower(Rebase::IDENTITY).unwrap();
        let mut renderer = Renderer::new(Cpu::open(Some(2)).unwrap(), &scene).unwrap();
        let settings = Settings::of(&scene);
        let matte = render(&mut renderer, &settings, &names, &mut ()).unwrap();
        let manifest = &matte.attributes.iter().find(|(name, _)| name.ends_with("/manifest")).unwrap().1;
        let manifest: Map<String, Value> = serde_json::from_str(manifest).unwrap();
        assert_eq!(manifest.keys().collect::<Vec<_>>(), ["box", "left wall", "objects[1]"]);
        let id = |name: &str| u32::from_str_radix(manifest[name].as_str().unwrap(), 16).unwrap();
        let first = values(&matte, "CryptoObject00.R");
        let middle = 8 * 32 + 16;
        assert_eq!(first[middle].to_bits(), id("objects[1]"));
        assert_eq!(first[8 * 32 + 2].to_bits(), id("left wall"));
        assert_eq!(first[31], 0.0, "the sky has no id");
        let covered = ["00.G", "00.A", "01.G", "01.A", "02.G", "02.A"].map(|n| format!("CryptoObject{n}"));
        let film = renderer.render(&Settings { guides: true, ..settings.clone() }).unwrap().film;
        for (pixel, aov) in film.aovs.iter().enumerate() {
            let sum: f32 = covered.iter().map(|name| values(&matte, name)[pixel]).sum();
            let seen = aov.hits as f32 / 16.0;
            assert!((sum - seen).abs() < 1e-6, "pixel {pixel}: {sum} for {seen}");
        }
        // At the edge of the ball before the wall, two objects share a pixel.
        let edges = values(&matte, "CryptoObject00.A").iter().filter(|share| **share > 0.0).count();
        assert!(edges > 4, "{edges}");
        // Ball and box have one material.
        let material = values(&matte, "CryptoMaterial00.R");
        assert_ne!(first[middle].to_bits(), material[middle].to_bits());
        let of_box = first.iter().position(|of| of.to_bits() == id("box")).unwrap();
        assert_eq!(material[of_box], material[middle]);
    }

    #[test]
    fn a_render_may_be_cancelled() {
        struct Cancels;
        impl RenderObserver for Cancels {
            fn progress(&mut self, _: u64, _: u64) -> ControlFlow<()> {
                ControlFlow::Break(())
            }
        }
        let scene = Scene::hello_world().unwrap();
        let mut renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
        let settings = Settings { width: 8, height: 8, ..Settings::of(&scene) };
        let rendered = render(&mut renderer, &settings, &[], &mut Cancels);
        assert!(matches!(rendered, Err(Error::Cancelled)));
    }
}
