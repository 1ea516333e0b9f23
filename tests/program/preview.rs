//! `--watch` renders again after changes, and `--display` sends images to a viewer.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use std::fs;
use std::io::Read;
use std::net::TcpListener;
use std::process::Output;
use trisect_tests::program::{Temporary, fails, trisect};
use trisect_tests::running::{Running, program};

const SCENE: &str = r#"Scene(
    version: 1,
    image: (width: 8, height: 6, samples: 4, depth: 2),
    camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40),
    sky: Uniform(radiance: (RADIANCE)),
    materials: {}, objects: [],
)"#;

fn scene(radiance: &str) -> String {
    SCENE.replace("RADIANCE", radiance)
}

/// Returns the path of a scene of the project.
fn scene_file(name: &str) -> String {
    trisect_tests::root().join("scenes").join(name).display().to_string()
}

/// The image follows the scene file, also over an error in it.
#[test]
fn a_watched_scene_is_rendered_again() {
    let folder = Temporary::new(file!(), "watch");
    let (path, image) = (folder.file("scene.ron"), folder.file("image.pfm"));
    fs::write(&path, scene("1, 0, 0")).unwrap();
    let mut running =
        Running::start(&mut program(&["render", &path, "-o", &image, "--backend", "cpu", "--watch"]));
    running.until("watching 1 file;");
    let red = fs::read(&image).unwrap();
    fs::write(&path, scene("1, 0")).unwrap();
    running.until("scene.ron was written");
    running.until("error: ");
    running.until("watching 1 file;");
    // A scene with an error leaves the image.
    assert_eq!(fs::read(&image).unwrap(), red);
    // Editors remove a file before they replace it.
    fs::remove_file(&path).unwrap();
    std::thread::sleep(std::time::Duration::from_millis(600));
    fs::write(&path, scene("0, 0, 1")).unwrap();
    running.until("watching 1 file;");
    let blue = fs::read(&image).unwrap();
    assert_ne!(blue, red);
    running.signal("INT");
    assert_eq!(running.end().status.code(), Some(130));
    // It is the image of the changed scene.
    let once = folder.file("once.pfm");
    assert!(trisect(&["render", &path, "-o", &once, "--backend", "cpu"]).status.success());
    assert_eq!(fs::read(&once).unwrap(), blue);
}

#[test]
fn what_cannot_be_watched_is_refused() {
    let folder = Temporary::new(file!(), "refused");
    let checkpoint = folder.file("a.film");
    let scene = &*scene_file("cornell_box.ron");
    fails(&["render", scene, "--watch", "-o", "-"], 2, &["--watch", "standard output", "-o"]);
    fails(&["render", scene, "--watch", "--checkpoint", &checkpoint], 2, &["--watch", "--checkpoint"]);
    fails(&["render", "--watch"], 2, &["--watch", "built-in scene", "name a scene"]);
    let scene = &*scene_file("cornell_box.ron");
    fails(&["render", scene, "--watch", "--backend", "wgpu", "--device", "99"], 3, &["99"]);
    fails(&["render", scene, "--watch", "-o", "a.gif"], 2, &["gif"]);
}

/// Packet of tev's protocol, without its length.
struct Packet(Vec<u8>);

impl Packet {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        self.0.drain(..N).collect::<Vec<_>>().try_into().unwrap()
    }

    fn number(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn long(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }

    fn text(&mut self) -> String {
        let end = self.0.iter().position(|byte| *byte == 0).unwrap();
        let text = self.0.drain(..=end).take(end).collect();
        String::from_utf8(text).unwrap()
    }
}

/// Returns the size of the image that a client creates, and its last pixels.
fn receive(listener: &TcpListener, name: &str) -> ((u32, u32), Vec<f32>) {
    let (mut stream, _) = listener.accept().unwrap();
    let (mut size, mut pixels) = ((0, 0), Vec::new());
    loop {
        let mut length = [0; 4];
        if stream.read_exact(&mut length).is_err() {
            return (size, pixels);
        }
        let mut bytes = vec![0; u32::from_le_bytes(length) as usize - 4];
        stream.read_exact(&mut bytes).unwrap();
        let mut packet = Packet(bytes);
        let [kind, _grabs_focus] = packet.take();
        assert_eq!(packet.text(), name);
        match kind {
            4 => {
                size = (packet.number(), packet.number());
                pixels = vec![f32::NAN; (size.0 * size.1 * 3) as usize];
                assert_eq!(packet.number(), 3);
                assert_eq!([packet.text(), packet.text(), packet.text()], ["R", "G", "B"]);
            }
            6 => {
                assert_eq!(packet.number(), 3);
                assert_eq!([packet.text(), packet.text(), packet.text()], ["R", "G", "B"]);
                let [x, y, width, height] = std::array::from_fn(|_| packet.number());
                assert_eq!((x, width), (0, size.0));
                assert_eq!(std::array::from_fn(|_| packet.long()), [0, 1, 2, 3, 3, 3]);
                let values: Vec<f32> =
                    packet.0.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
                let first = (y * width * 3) as usize;
                assert_eq!(values.len(), (width * height * 3) as usize);
                pixels[first..first + values.len()].copy_from_slice(&values);
            }
            other => panic!("packet of kind {other}"),
        }
    }
}

/// Renders an image of `size` pixels, such as 40x30, with further options.
fn render(image: &str, size: &str, more: &[&str]) -> Output {
    let scene = scene_file("cornell_box.ron");
    let arguments = ["render", &scene, "-o", image, "--backend", "cpu", "--resolution", size];
    trisect(&[&arguments[..], more].concat())
}

/// A viewer has the written image at the end, also a denoised one, and one of a goal.
#[test]
fn a_viewer_gets_the_image() {
    let folder = Temporary::new(file!(), "display");
    let image = folder.file("image.pfm");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tev://{}", listener.local_addr().unwrap());
    let mut listener = Some(listener);
    let ways = [&["--spp", "300"][..], &["--spp", "4", "--denoise", "svgf"], &["--budget", "0.3s"]];
    for way in ways {
        let (name, open) = (image.clone(), listener.take().unwrap());
        let viewer = std::thread::spawn(move || (receive(&open, &name), open));
        let output = render(&image, "40x30", &[way, &["--display", &address]].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let ((size, shown), open) = viewer.join().unwrap();
        listener = Some(open);
        let written = trisect::image::Image::read(image.as_ref()).unwrap();
        let written = written.pixels.as_flattened();
        assert_eq!((size, shown.len()), ((40, 30), written.len()));
        assert!(shown.iter().zip(written).all(|(a, b)| a.to_bits() == b.to_bits()), "{way:?}");
    }
    // Without a viewer nothing is rendered, and the remedy is named.
    drop(listener);
    fs::remove_file(&image).unwrap();
    let output = render(&image, "40x30", &["--spp", "1", "--display", &address]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("start tev first") && !fs::exists(&image).unwrap(), "{text}");
}

/// A viewer that ends is no reason to end the render.
#[test]
fn a_viewer_may_end() {
    let folder = Temporary::new(file!(), "ended");
    let image = folder.file("image.pfm");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tev://{}", listener.local_addr().unwrap());
    let viewer = std::thread::spawn(move || drop(listener.accept().unwrap()));
    let output = render(&image, "400x300", &["--spp", "8", "--display", &address]);
    viewer.join().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && fs::exists(&image).unwrap(), "{text}");
}
