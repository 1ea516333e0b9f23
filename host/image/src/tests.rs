//! Tests of reading images: files of a few bytes whose headers claim gigabytes, and valid files.

use super::*;
use crate::output::{Encoding, Picture};

fn read(name: &str, bytes: &[u8]) -> Result<Image, ImageError> {
    let path = std::env::temp_dir().join(format!("trisect-image-{}-{name}", std::process::id()));
    std::fs::write(&path, bytes).unwrap();
    let image = Image::read(&path);
    std::fs::remove_file(path).unwrap();
    image
}

fn encode(image: &Image, extension: &str) -> Vec<u8> {
    Picture::from(image).encode(format!("a.{extension}").as_ref(), &Encoding::default()).unwrap()
}

fn small(extension: &str) -> Vec<u8> {
    let pixels = (0..12).map(|i| [i as f32, 1.0, 0.5]).collect();
    encode(&Image { width: 4, height: 3, pixels }, extension)
}

/// Writes numbers into an attribute of an EXR file, `at` bytes after its name, type and size.
fn patched(mut file: Vec<u8>, attribute: &str, at: usize, numbers: &[i32]) -> Vec<u8> {
    let attribute = attribute.as_bytes();
    let start = file.windows(attribute.len()).position(|part| part == attribute).unwrap();
    let start = start + attribute.len() + 4 + at;
    for (number, bytes) in numbers.iter().zip(file[start..].chunks_exact_mut(4)) {
        bytes.copy_from_slice(&number.to_le_bytes());
    }
    file
}

fn renamed(mut file: Vec<u8>, from: &[u8], to: &[u8]) -> Vec<u8> {
    let start = file.windows(from.len()).position(|part| part == from).unwrap();
    file[start..start + to.len()].copy_from_slice(to);
    file
}

const DATA: &str = "dataWindow\0box2i\0";
const DISPLAY: &str = "displayWindow\0box2i\0";

#[test]
fn short_files_with_many_pixels_are_refused() {
    let cut = |name: &str, bytes: &[u8]| {
        let error = read(name, bytes).unwrap_err();
        assert!(matches!(error, ImageError::Cut { .. }), "{error}");
        assert!(error.to_string().contains(name) && error.to_string().contains("cut off"), "{error}");
    };
    cut("a.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16000 +X 20000\n");
    // Without this attribute, the number of chunks follows from the size.
    let file = renamed(small("exr"), b"chunkCount", b"chunkCounX");
    for (width, height) in [(20_000, 20_000), (1 << 29, 1), (1, 1 << 29)] {
        let window = [0, 0, width - 1, height - 1];
        cut("a.exr", &patched(patched(file.clone(), DATA, 0, &window), DISPLAY, 0, &window));
    }
    let mut file = small("png");
    file[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]);
    cut("a.png", &file);
    // Width and height of a TIFF, entries of 12 bytes with a tag, a type and a count of 1.
    let mut tiff = small("tif");
    for (tag, size) in [(256u16, 30_000u32), (257, 30_000)] {
        let entry = [&tag.to_le_bytes()[..], &[4, 0, 1, 0, 0, 0]].concat();
        let place = tiff.windows(8).position(|part| part == entry).unwrap() + 8;
        tiff[place..place + 4].copy_from_slice(&size.to_le_bytes());
    }
    cut("a.tif", &tiff);
    // One row, for which a decoder allocates memory before it reads pixels.
    file[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0, 0, 0, 1]);
    cut("a.png", &file);
}

#[test]
fn a_display_window_that_is_blank_is_refused() {
    let error = read("b.exr", &patched(small("exr"), DISPLAY, 0, &[0, 0, 19_999, 19_999])).unwrap_err();
    assert!(matches!(error, ImageError::Blank { given: 12, .. }), "{error}");
}

/// Checks that the layer is placed in the display window by its data window, and that pixels
/// outside are dropped.
#[test]
fn an_exr_is_what_its_display_window_shows() {
    let whole = read("c.exr", &small("exr")).unwrap();
    let image = read("d.exr", &patched(small("exr"), DISPLAY, 0, &[-1, 1, 2, 3])).unwrap();
    assert_eq!((image.width, image.height), (4, 3));
    for (i, pixel) in image.pixels.iter().enumerate() {
        let (x, y) = (i % 4, i / 4 + 1);
        let expected = if x == 0 || y > 2 { [0.0; 3] } else { whole.pixels[y * 4 + x - 1] };
        assert_eq!(*pixel, expected, "{x}, {y}");
    }
}

/// The negative control: images of one colour, whose files are the shortest of their size, are
/// read.
#[test]
fn blank_images_are_read() {
    let image = Image { width: 4096, height: 2048, pixels: vec![[0.25; 3]; 4096 * 2048] };
    for format in ["png", "hdr", "exr", "jpg", "tif"] {
        let found = read(&format!("e.{format}"), &encode(&image, format)).unwrap();
        assert_eq!((found.width, found.height), (4096, 2048), "{format}");
    }
}

#[test]
fn what_is_no_file_is_not_opened() {
    let folder = std::env::temp_dir().join(format!("trisect-image-{}-folder.pfm", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let error = Image::read(&folder).unwrap_err().to_string();
    std::fs::remove_dir(&folder).unwrap();
    assert!(error.contains("this is a folder"), "{error}");
    for extension in ["exr", "hdr", "png", "jpg", "tif"] {
        let bytes = small(extension);
        let error = read(&format!("f.{extension}"), &bytes[..bytes.len() / 2]).unwrap_err();
        assert!(matches!(error, ImageError::Codec { .. }), "{error}");
    }
}

/// Bytes in memory are the image of the file that holds them.
#[test]
fn bytes_are_decoded_as_files_are() {
    for format in ["png", "exr", "hdr", "pfm", "jpg", "tif"] {
        let (name, bytes) = (format!("a.{format}"), small(format));
        let decoded = Image::decode(&bytes, Path::new(&name)).unwrap();
        assert_eq!(decoded, read(&name, &bytes).unwrap(), "{name}");
        let cut = Image::decode(&bytes[..bytes.len() / 2], Path::new(&name));
        assert!(cut.is_err(), "{name}");
    }
}
