//! Fuzz target: images. The first byte selects the kind: PFM as bytes; HDR, EXR and PFM as
//! panoramas; PNG, JPEG, WebP and KTX2 as textures; PNG, JPEG and TIFF for comparisons. What can be
//! read must be writable. All but the first are read from files only, so the input is written to
//! one.

#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;
use trisect::image::Image;
use trisect::output::{Encoding, Picture, pfm};
use trisect::scene::{Scene, import};
use trisect_fuzz::{bounded, enter_folder, scene, small};

const FRAME: &str = "version: 1, image: (width: 8, height: 4), camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40), \
                     objects: [], materials: {},";

fuzz_target!(
    init: { enter_folder(); },
    |bytes: &[u8]| bounded(bytes.len(), || read(bytes))
);

/// Returns the file of an image that was read.
fn encoded(image: &Image, name: &str) -> Vec<u8> {
    Picture::from(image).encode(Path::new(name), &Encoding::default()).expect("what was read can be written")
}

fn read(bytes: &[u8]) {
    let [kind, bytes @ ..] = bytes else { return };
    if *kind == b'0' {
        if let Ok(image) = pfm::decode(bytes) {
            let again = pfm::decode(&encoded(&image, "a.pfm")).expect("it is PFM");
            assert_eq!((again.width, again.height), (image.width, image.height));
        }
        return;
    }
    if !small(bytes) {
        return;
    }
    let name = match kind {
        b'1' => "a.hdr",
        b'2' => "a.exr",
        b'3' => "a.pfm",
        b'6' => "a.jpg",
        b'7' => "a.tif",
        _ => "a.png",
    };
    std::fs::write(name, bytes).expect("the folder can be written to");
    match kind {
        b'1'..=b'3' => {
            scene(Scene::parse(&format!("Scene({FRAME} sky: Image(file: \"{name}\"))"), "fuzz.ron"));
        }
        b'4' => drop(import::texture(Path::new(name), false)),
        _ => {
            if let Ok(image) = Image::read(Path::new(name)) {
                for name in ["b.png", "b.exr", "b.hdr", "b.jpg", "b.tif"] {
                    encoded(&image, name);
                }
            }
        }
    }
}
