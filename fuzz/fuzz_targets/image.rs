//! Fuzz target: images. The first byte selects the kind: PFM as bytes; HDR, EXR and PFM as
//! panoramas; PNG, JPEG, WebP and KTX2 as textures; PNG for comparisons. What can be read must be
//! writable. All but the first are read from files only, so the input is written to one.

#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::Path;
use trisect::image::Image;
use trisect::output::{Format, encode, pfm};
use trisect::scene::{Scene, import};
use trisect_fuzz::{bounded, enter_folder, scene, small};

const FRAME: &str = "version: 1, image: (width: 8, height: 4), camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 40), \
                     objects: [], materials: {},";

fuzz_target!(
    init: { enter_folder(); },
    |bytes: &[u8]| bounded(bytes.len(), || read(bytes))
);

fn read(bytes: &[u8]) {
    let [kind, bytes @ ..] = bytes else { return };
    if *kind == b'0' {
        if let Ok(image) = pfm::decode(bytes) {
            let again =
                pfm::decode(&encode(&image, Format::Pfm).expect("PFM takes everything")).expect("it is PFM");
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
                for format in [Format::Png, Format::Exr, Format::Hdr] {
                    encode(&image, format).expect("what was read can be written");
                }
            }
        }
    }
}
