//! Layers, picks, help, radiance files, scenes that change, and scenes that are dropped.

use super::*;
use trisect_tests::BackendUnderTest;

/// Size of the image in pixels.
const SIZE: (usize, usize) = (300, 200);

const SCENE: &str = "Scene(version: 1, image: (width: 300, height: 200, samples: 4, depth: 3), \
    camera: (look_from: (0, 0, 5), look_at: (0, 0, 0), vertical_fov: 30), \
    sky: Gradient(bottom: (1, 1, 1), top: (0.5, 0.7, 1)), \
    materials: { \"paint\": Lambertian(albedo: (0.5, 0.01, 0.01)) }, \
    objects: [Sphere(center: (0, 0, 0), radius: 1, material: \"paint\", name: \"ball\")])";

/// A plate that fills the view of a camera in front of it, in OBJ.
const PLATE: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n";

impl Viewer {
    fn with_scene(backend: BackendUnderTest, name: &str) -> Option<Self> {
        let device = backend.index().to_string();
        let of_device = match backend {
            BackendUnderTest::Cpu => vec!["--backend", "cpu"],
            _ => vec!["--backend", backend.name(), "--device", &device],
        };
        let size = format!("{}x{}", SIZE.0, SIZE.1);
        let arguments = ["--resolution", &size, "--enough", "2", "--denoise", "off", "--depth", "3"];
        Self::of(SCENE.as_bytes(), (900, 700), name, &[&arguments[..], &of_device].concat())
    }

    /// Waits until the pixel in the middle of the image is `wanted`, up to `most` codes.
    fn until_middle(&mut self, what: &str, wanted: [u8; 3], most: u8) -> Capture {
        self.until_any(what, |capture| apart(middle(capture), wanted) <= most)
    }
}

/// Returns the colour in the middle of the image.
fn middle(capture: &Capture) -> [u8; 3] {
    capture.pixels.get(SIZE.1 / 2 * capture.width + SIZE.0 / 2).copied().unwrap_or_default()
}

/// Returns the greatest difference of a channel.
fn apart(a: [u8; 3], b: [u8; 3]) -> u8 {
    a.iter().zip(b).map(|(a, b)| a.abs_diff(b)).max().unwrap_or(0)
}

/// Returns whether the ball of the scene is seen.
fn is_red(capture: &Capture) -> bool {
    let [red, green, blue] = middle(capture);
    red > 100 && u16::from(green.max(blue)) * 3 < u16::from(red)
}

/// L shows what the first hits see, `?` shows the keys until Escape, a click marks what is picked,
/// and X writes radiance, on each backend.
#[test]
fn layers_picks_and_help() {
    for backend in [BackendUnderTest::Cpu, BackendUnderTest::Wgpu] {
        let Some(mut viewer) = Viewer::with_scene(backend, &format!("tools-{}", backend.name())) else {
            return;
        };
        let image = viewer.until_any("the first image", is_red);
        viewer.key(letter('l'), 30);
        // The ball faces the camera: the normal is z.
        viewer.until_middle("normals", [128, 128, 255], 2);
        viewer.key(letter('l'), 30);
        // 0.5 and 0.01 are the codes 188 and 25.
        viewer.until_middle("albedo", [188, 25, 25], 1);
        viewer.key(letter('l'), 30);
        let depths = viewer.until_any("depth", |capture| {
            let [red, green, blue] = middle(capture);
            red == green && green == blue && red > 240
        });
        assert_eq!(depths.pixels[10 * depths.width + 10], [0; 3], "the sky has no depth");
        // Objects, materials, noise, rays and nodes; then the image again.
        (0..5).for_each(|_| {
            viewer.key(letter('l'), 30);
            std::thread::sleep(Duration::from_millis(150));
        });
        assert!(viewer.program.try_wait().unwrap().is_none(), "{}", viewer.log());
        viewer.until_any("one ball enters no inner node", |capture| middle(capture) == [0, 0, 4]);
        viewer.key(letter('l'), 30);
        let again = viewer.until_any("the image again", is_red);
        assert!(again.difference(&image, 0, SIZE.0) < 3.0, "the image is another one");

        viewer.desktop.click(1, (100, 60)).unwrap();
        let at = |capture: &Capture, x: usize, y: usize| capture.pixels[y * capture.width + x];
        let marked = viewer.until_any("a click marks", |now| at(now, 105, 60) != at(&again, 105, 60));
        assert!(marked.difference(&again, 115, 200) > 5.0, "no label beside the mark");

        viewer.key(letter('?'), 30);
        viewer.until_any("? shows the keys", |now| now.difference(&marked, 0, SIZE.0) > 10.0);
        viewer.key(ESCAPE, 30);
        viewer.until_any("Escape hides them", |now| now.difference(&marked, 0, SIZE.0) < 3.0);
        assert!(viewer.program.try_wait().unwrap().is_none(), "Escape ended the program");

        viewer.key(letter('x'), 30);
        let image = Image::read(&viewer.written("exr")).unwrap();
        assert_eq!((image.width as usize, image.height as usize), SIZE);
        let [red, green, blue] = image.pixels[SIZE.1 / 2 * SIZE.0 + SIZE.0 / 2];
        assert!(red > 0.1 && green < 0.3 * red && blue < 0.3 * red, "{red} {green} {blue}");
        viewer.quit();
    }
}

/// A scene that is written again is shown again; one with an error leaves the image as it is. A
/// model that is dropped on the window takes its place.
#[test]
fn changed_and_dropped_scenes() {
    let Some(mut viewer) = Viewer::with_scene(BackendUnderTest::Cpu, "reload") else { return };
    viewer.until_any("the first image", is_red);
    viewer.key(letter('l'), 30);
    viewer.key(letter('l'), 30);
    viewer.until_middle("albedo", [188, 25, 25], 1);
    let write = |viewer: &Viewer, text: &str| std::fs::write(viewer.folder.join("book.ron"), text).unwrap();
    write(&viewer, &SCENE.replace("0.5, 0.01, 0.01", "0.01, 0.5, 0.01"));
    let green = viewer.until_middle("another albedo", [25, 188, 25], 1);
    write(&viewer, &SCENE.replace("Sphere(", "Spear("));
    let start = Instant::now();
    while !viewer.log().contains("Spear") {
        assert!(start.elapsed() < LIMIT, "no error: {}", viewer.log());
        std::thread::sleep(Duration::from_millis(50));
    }
    let kept = viewer.until_middle("the last good scene", [25, 188, 25], 1);
    assert!(kept.difference(&green, 0, SIZE.0) < 3.0);
    // The camera of the file is taken only if it is another one.
    viewer.key(RIGHT, 300);
    write(&viewer, &SCENE.replace("0.5, 0.01, 0.01", "0.01, 0.01, 0.5"));
    let turned = viewer.until_middle("the error is repaired", [25, 25, 188], 1);
    write(&viewer, &SCENE.replace("0.5, 0.01, 0.01", "0.01, 0.01, 0.5").replace("(0, 0, 5)", "(0, 0, 9)"));
    viewer.until_any("the file has another camera", |now| now.difference(&turned, 0, SIZE.0) > 5.0);

    let text = viewer.folder.join("notes.txt");
    std::fs::write(&text, "no scene").unwrap();
    viewer.desktop.drop_file(viewer.window, &text, (100, 100)).unwrap();
    let start = Instant::now();
    while !viewer.log().contains("notes.txt") {
        assert!(start.elapsed() < LIMIT, "no error: {}", viewer.log());
        std::thread::sleep(Duration::from_millis(50));
    }
    // The scene that is shown is followed still.
    write(&viewer, &SCENE.replace("0.5, 0.01, 0.01", "0.5, 0.5, 0.01"));
    viewer.until_middle("a change after a file that is no scene", [188, 188, 25], 1);
    let model = viewer.folder.join("plate.obj");
    std::fs::write(&model, PLATE).unwrap();
    viewer.desktop.drop_file(viewer.window, &model, (100, 100)).unwrap();
    // An OBJ without materials has the albedo 0.8: the code 231.
    viewer.until_middle("the model", [231, 231, 231], 1);
    viewer.quit();
}
