//! Three spheres at both ends of the supported range: where `trisect check` finds nothing the image
//! is the same, and where it finds something, `--write` restores the image.

use std::fs;
use trisect::image::Image;
use trisect::metrics::{ImageView, compare};
use trisect_tests::program::{Temporary, trisect};

/// Returns the three spheres beside a box and a lamp, with each length multiplied by `scale` and
/// each place moved by `offset`.
fn scene(offset: f64, scale: f64) -> String {
    let length = |x: f64| x * scale;
    let at = |x: f64, y: f64, z: f64| {
        format!("({:?}, {:?}, {:?})", offset + x * scale, offset + y * scale, offset + z * scale)
    };
    format!(
        "Scene(
    version: 1,
    image: (width: 64, height: 36, samples: 64, depth: 8),
    camera: (look_from: {}, look_at: {}, vertical_fov: 30, defocus_angle: 0.5, focus_distance: {:?}),
    sky: Gradient(bottom: (1, 1, 1), top: (0.5, 0.7, 1)),
    materials: {{
        \"ground\": Lambertian(albedo: (0.6, 0.65, 0.4)),
        \"clay\": Lambertian(albedo: (0.7, 0.25, 0.2)),
        \"glass\": Dielectric(ior: 1.5),
        \"brass\": Metal(albedo: (0.85, 0.65, 0.3), fuzz: 0.1),
        \"lamp\": Emissive(radiance: (4, 4, 4)),
    }},
    objects: [
        Sphere(center: {}, radius: {:?}, material: \"ground\"),
        Sphere(center: {}, radius: {:?}, material: \"clay\"),
        Sphere(center: {}, radius: {:?}, material: \"glass\"),
        Sphere(center: {}, radius: {:?}, material: \"brass\"),
        Box(min: {}, max: {}, material: \"clay\"),
        Quad(corner: {}, u: ({:?}, 0, 0), v: (0, 0, {:?}), material: \"lamp\"),
    ],
)
",
        at(-2.0, 1.5, 3.0),
        at(0.0, 0.25, -0.5),
        length(4.2),
        at(0.0, -100.0, -0.5),
        length(100.0),
        at(0.0, 0.5, -0.5),
        length(0.5),
        at(-1.05, 0.5, -0.2),
        length(0.5),
        at(1.05, 0.5, -0.6),
        length(0.5),
        at(-0.4, 0.0, 0.2),
        at(-0.1, 0.3, 0.5),
        at(-1.0, 2.0, -1.5),
        length(1.0),
        length(1.0),
    )
}

struct Bench(Temporary);

impl Bench {
    fn render(&self, scene: &str, more: &[&str]) -> Image {
        let image = self.0.file("image.pfm");
        let arguments = ["render", scene, "--backend", "cpu", "--quiet", "-o", &image];
        let output = trisect(&[&arguments[..], more].concat());
        assert!(output.status.success(), "{output:?}");
        Image::read(image.as_ref()).unwrap()
    }

    fn scene(&self, offset: f64, scale: f64) -> String {
        let path = self.0.file(&format!("{offset:e}-{scale:e}.ron"));
        fs::write(&path, scene(offset, scale)).unwrap();
        path
    }
}

/// Returns relMSE of an image against another.
fn error(image: &Image, reference: &Image) -> f64 {
    let [image, reference] = [image, reference]
        .map(|image| ImageView::new(image.width as usize, image.height as usize, &image.pixels).unwrap());
    compare(&image, &reference).unwrap().rel_mse
}

#[test]
fn both_ends_of_the_range() {
    let bench = Bench(Temporary::new("limits", "ends"));
    let home = bench.scene(0.0, 1.0);
    let want = bench.render(&home, &[]);
    // Rounding sends only few paths another way, so the images differ far less than two seeds do.
    let noise = error(&bench.render(&home, &["--seed", "1"]), &want);
    let tolerance = 0.1 * noise;

    // Tiny and huge scenes near the origin: nothing is found.
    for scale in [1e-15, 1e14] {
        let path = bench.scene(0.0, scale);
        let checked = trisect(&["check", &path]);
        assert_eq!(checked.status.code(), Some(0), "{scale:e}: {}", String::from_utf8_lossy(&checked.stdout));
        let found = error(&bench.render(&path, &[]), &want);
        eprintln!("times {scale:e}: relMSE {found:.2e}, of noise {noise:.2e}");
        assert!(found < tolerance, "{scale:e}: {found:e}, noise {noise:e}");
    }
    // Scenes far from the origin for their size, with units of a thousandth and of 1e8: found, and
    // mended.
    for (offset, scale) in [(1e5, 1e-3), (1e16, 1e8)] {
        let path = bench.scene(offset, scale);
        let copy = path.replace(".ron", "-mended.ron");
        let checked = trisect(&["check", &path, "--write", &copy]);
        let said = String::from_utf8_lossy(&checked.stdout).into_owned();
        assert_eq!(checked.status.code(), Some(6), "{said}");
        for object in 1..=5 {
            let line = format!("small for its distance from the origin: objects[{object}]");
            assert!(said.contains(&line) && said.contains("check --write"), "{line}: {said}");
        }
        let again = trisect(&["check", &copy]);
        assert_eq!(again.status.code(), Some(0), "{}", String::from_utf8_lossy(&again.stdout));
        let [mended, broken] = [&copy, &path].map(|path| error(&bench.render(path, &[]), &want));
        eprintln!("{scale:e} at {offset:e}: relMSE {mended:.2e} mended, {broken:.2e} before");
        assert!(mended < tolerance, "{offset:e}: {mended:e}, noise {noise:e}");
        // Negative control: the scene as it was has another image.
        assert!(broken > 10.0 * noise, "{offset:e}: {broken:e}, noise {noise:e}");
    }
}
