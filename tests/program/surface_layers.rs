//! Layers of surfaces in .exr files, as users ask for them: texture coordinates, geometric and
//! shading normals, motion.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};
use std::collections::BTreeMap;
use std::fs;
use trisect_tests::models::sliding_square;
use trisect_tests::program::{Temporary, fails, trisect};

type Layers = BTreeMap<String, Vec<f32>>;

/// Renders a scene of the folder with options, and returns the channels of `image`.
fn layers(folder: &Temporary, scene: &str, image: &str, options: &[&str]) -> Layers {
    let (scene, output) = (folder.file(scene), folder.file("a.exr"));
    let arguments = [&["render", &scene, "-o", &output, "--backend", "cpu", "-q"], options].concat();
    let output = trisect(&arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    let file = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let file = file.all_attributes().from_file(folder.path(image)).unwrap();
    let values = |samples: FlatSamples| samples.values_as_f32().collect();
    let channels = file.layer_data.channel_data.list.into_iter();
    channels.map(|channel| (channel.name.to_string(), values(channel.sample_data))).collect()
}

/// A texture is what it is at the texture coordinates: red grows with u, green falls with v.
#[test]
fn texture_coordinates_find_the_texel() {
    let folder = Temporary::new("surfaces", "uv");
    let texture = image::RgbImage::from_fn(256, 256, |x, y| image::Rgb([x as u8, y as u8, 0]));
    texture.save(folder.path("map.png")).unwrap();
    let square =
        "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    fs::write(folder.path("square.obj"), square).unwrap();
    let scene = "Scene(version: 1, image: (width: 64, height: 32, samples: 1, depth: 2), \
        camera: (look_from: (0, 0, 12), look_at: (0, 0, 0), vertical_fov: 30), \
        sky: Uniform(radiance: (1, 1, 1)), textures: { \"map\": (file: \"map.png\") }, \
        materials: { \"map\": Lambertian(albedo: (1, 1, 1), texture: \"map\") }, objects: [ \
            Sphere(center: (-3, 0, 0), radius: 1.2, material: \"map\"), \
            Quad(corner: (-1, -1, 0), u: (2, 0, 0), v: (0, 2, 0), material: \"map\"), \
            Mesh(file: \"square.obj\", transform: [Translate((3, 0, 0))], material: \"map\"), \
        ])";
    fs::write(folder.path("a.ron"), scene).unwrap();
    for instances in ["copy", "share"] {
        let options = ["--aov", "uv,albedo,normal,shading-normal", "--float", "--instances", instances];
        let layers = layers(&folder, "a.ron", "a.exr", &options);
        // The curve of sRGB.
        let linear = |x: f32| if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
        let mut worst = (0.0f32, 0.0f32);
        let hit = |pixel: usize| layers["N.Z"][pixel] != 0.0;
        for pixel in (0..64 * 32).filter(|pixel| hit(*pixel)) {
            let (u, v) = (layers["UV.U"][pixel], layers["UV.V"][pixel]);
            let (red, green) = (layers["albedo.R"][pixel], layers["albedo.G"][pixel]);
            let wrong = (red - linear(u)).abs().max((green - linear(1.0 - v)).abs());
            worst = (worst.0.max(wrong), worst.1.max((green - linear(v)).abs()));
        }
        // A texel is 1/256 wide, and the curve at most 2.3 steep. Negative control: v downwards.
        assert!(worst.0 < 0.02 && worst.1 > 0.5, "{instances}: {worst:?}");
        assert_eq!(layers["N.Z"], layers["Ns.Z"]);
        assert!((0..64 * 32).filter(|pixel| hit(*pixel)).count() > 300);
    }
}

/// The square slides to the right, or to the right and twice as fast up.
#[test]
fn motion_is_in_pixels_to_the_frames_beside() {
    let folder = Temporary::new("surfaces", "motion");
    let view = [
        "--look-from",
        "0,0,5",
        "--look-at",
        "0,0,0",
        "--fov",
        "60",
        "--resolution",
        "64x64",
        "--ground",
        "off",
    ];
    let frames = ["--frames", "1..2", "--fps", "4", "--spp", "4", "--aov", "motion,geometric-normal,id"];
    let options = [&view[..], &frames].concat();
    for (end, up) in [([1.0, -0.5, 0.0], 0.0), ([0.0, 1.5, 0.0], 2.0)] {
        fs::write(folder.path("a.gltf"), sliding_square(end)).unwrap();
        let layers = layers(&folder, "a.gltf", "a.0001.exr", &options);
        // In a quarter of a second, and a pixel's width at the square's depth.
        let right = (end[0] + 1.0) / 4.0 / (2.0 * 30f32.to_radians().tan() * 5.0 / 64.0);
        let (mut hits, mut still) = (0, 0);
        for (pixel, id) in layers["id"].iter().enumerate() {
            let value = |of: &str| layers[of][pixel];
            let motion = ["forward.u", "forward.v", "backward.u", "backward.v"].map(value);
            if *id == 0.0 {
                still += u32::from(motion == [0.0; 4]);
                continue;
            }
            hits += 1;
            let want = [right, up * right, -right, -up * right];
            let wrong = motion.iter().zip(want).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(wrong < 1e-3, "pixel {pixel}: {motion:?}, not {want:?}");
            assert!((value("Ng.Z") - 1.0).abs() < 1e-3);
        }
        assert!(hits > 50 && still == 64 * 64 - hits, "{hits} {still}");
    }
}

#[test]
fn motion_needs_frames() {
    let folder = Temporary::new("surfaces", "refused");
    fs::write(folder.path("a.gltf"), sliding_square([1.0, -0.5, 0.0])).unwrap();
    let render = |options: &[&'static str]| {
        let (scene, image) = (folder.file("a.gltf"), folder.file("a.exr"));
        [
            vec!["render".to_owned(), scene, "-o".to_owned(), image],
            options.iter().map(|of| (*of).to_owned()).collect(),
        ]
        .concat()
    };
    for (options, wanted) in [
        (&["--aov", "motion"][..], "--aov motion is the motion between frames; add --frames"),
        (
            &["--aov", "motion", "--frames", "0..1", "--shutter", "0.5"],
            "--aov motion cannot be combined with --shutter",
        ),
        (&["--aov", "uv", "--shutter", "0.5"], "--aov uv cannot be combined with --shutter"),
    ] {
        let words = render(options);
        fails(&words.iter().map(String::as_str).collect::<Vec<_>>(), 2, &[wanted]);
    }
}
