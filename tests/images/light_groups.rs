//! The images of light groups add up to the image.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use trisect::light_groups;
use trisect::output::{Channel, Samples};
use trisect::render::Settings;
use trisect::scene::{LightGroup, Rebase, SceneDocument};
use trisect_tests::{BackendUnderTest, for_each_backend};

for_each_backend!(groups_add_up_to_the_image);

/// A floor and a ball under a lamp, a point light, and a sky.
const SCENE: &str = "Scene(version: 1, image: (width: 24, height: 16, samples: 256, depth: 4), \
    camera: (look_from: (0, 2, 6), look_at: (0, 0.5, 0), vertical_fov: 40), \
    sky: Gradient(bottom: (0.1, 0.1, 0.1), top: (0.2, 0.3, 0.5)), \
    materials: { \"grey\": Lambertian(albedo: (0.6, 0.6, 0.6)), \"lamp\": Emissive(radiance: (4, 3, 2)) }, \
    objects: [\
        Plane(point: (0, 0, 0), normal: (0, 1, 0), material: \"grey\"), \
        Sphere(center: (0, 0.7, 0), radius: 0.7, material: \"grey\"), \
        Quad(corner: (-1, 3, -1), u: (2, 0, 0), v: (0, 0, 2), material: \"lamp\", name: \"lamp\")], \
    lights: [Point(position: (3, 2, 2), intensity: (6, 6, 6))])";

/// Returns the mean of a channel.
fn mean(channels: &[Channel], name: &str) -> f64 {
    let channel = channels.iter().find(|channel| channel.name == name).unwrap();
    let Samples::Color(values) = &channel.samples else { panic!("{name} is no colour") };
    values.iter().map(|value| f64::from(*value)).sum::<f64>() / values.len() as f64
}

fn groups_add_up_to_the_image(subject: BackendUnderTest) {
    let document = SceneDocument::parse(SCENE, "groups.ron").unwrap();
    let groups = ["key=lamp", "point=lights[0]"].map(|text| text.parse::<LightGroup>().unwrap());
    let scene = document.clone().lower(Rebase::IDENTITY).unwrap();
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = Settings::of(&scene);
    let image = renderer.render(&settings).unwrap().image();
    let of_groups = (&document, &groups[..], None);
    let channels = light_groups::render(&mut renderer, &settings, of_groups, (None, 0.5), &mut ()).unwrap();
    let names: Vec<&str> = channels.iter().map(|channel| channel.name.as_ref()).collect();
    assert_eq!(names.len(), 9);
    assert!(names.contains(&"light_key.R") && names.contains(&"light_rest.B"), "{names:?}");
    for (channel, name) in ["R", "G", "B"].into_iter().enumerate() {
        let whole = image.pixels.iter().map(|pixel| f64::from(pixel[channel])).sum::<f64>() / 384.0;
        let parts =
            ["key", "point", "rest"].map(|group| 2.0 * mean(&channels, &format!("light_{group}.{name}")));
        let sum: f64 = parts.iter().sum();
        // 98,304 samples of a relative deviation of about 2 are off by 0.7 %.
        assert!((sum / whole - 1.0).abs() < 0.03, "{name}: {sum} of {whole}, {parts:?}");
        // Negative control: each group counts.
        assert!(parts.iter().all(|part| part / whole > 0.06), "{name}: {parts:?} of {whole}");
    }
}
