//! Small files for tests, and ways to damage them.

use super::Files;
use crate::Rebase;
use crate::description::Description;
use glam::{DVec3, Vec3};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::collections::{BTreeSet, HashMap};
use std::io::{Error, ErrorKind, Result};

/// Files in memory, by path.
#[derive(Debug, Default)]
pub struct Memory(pub HashMap<&'static str, Vec<u8>>);

impl Files for Memory {
    fn read(&mut self, path: &str, limit: u64) -> Result<Vec<u8>> {
        let bytes = self.0.get(path).ok_or_else(|| Error::new(ErrorKind::NotFound, "no such file"))?;
        if bytes.len() as u64 > limit { Err(ErrorKind::FileTooLarge.into()) } else { Ok(bytes.clone()) }
    }

    fn list(&mut self, folder: &str) -> Vec<String> {
        let inner = |path: &&'static str| match folder {
            "" => Some(*path),
            folder => path.strip_prefix(folder)?.strip_prefix('/'),
        };
        let name = |path: &'static str| path.split('/').next().unwrap_or(path).to_owned();
        let names: BTreeSet<String> = self.0.keys().filter_map(inner).map(name).collect();
        names.into_iter().collect()
    }
}

/// Returns a PNG file with 8 bits of red, green, blue and alpha.
pub fn png(width: u32, height: u32, texels: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(texels.as_flattened(), width, height, ExtendedColorType::Rgba8)
        .unwrap();
    bytes
}

/// Returns the checksum of a PNG chunk.
pub fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, byte: &u8| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 })
    };
    !bytes.iter().fold(!0, step)
}

/// Returns a GLB file.
pub fn glb(json: &str, binary: Option<&[u8]>) -> Vec<u8> {
    let chunk = |kind: &[u8; 4], content: &[u8], filler: u8| {
        let mut content = content.to_vec();
        content.resize(content.len().next_multiple_of(4), filler);
        [&(content.len() as u32).to_le_bytes()[..], kind, &content].concat()
    };
    let mut chunks = chunk(b"JSON", json.as_bytes(), b' ');
    if let Some(binary) = binary {
        chunks.extend(chunk(b"BIN\0", binary, 0));
    }
    [b"glTF", &2u32.to_le_bytes()[..], &(chunks.len() as u32 + 12).to_le_bytes(), &chunks].concat()
}

/// Returns floats as bytes.
pub fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Returns short integers as bytes.
pub fn shorts(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Random number generator (splitmix64).
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % end.max(1) as u64) as usize
    }

    /// Changes random bytes, numbers or ranges of a file.
    pub fn mutate(&mut self, bytes: &mut Vec<u8>) {
        const WORDS: [&str; 16] = [
            "0",
            "-1",
            "1e999",
            "1e39",
            "nan",
            "inf",
            "4294967295",
            "99999999999999999999",
            "{}",
            "[]",
            "null",
            "\"\"",
            "1e18",
            "-0",
            "\n",
            "\\",
        ];
        for _ in 0..=self.below(3) {
            let at = self.below(bytes.len());
            let length = self.below(8).min(bytes.len() - at);
            match self.below(7) {
                0 if at < bytes.len() => bytes[at] = self.below(256) as u8,
                1 if at < bytes.len() => bytes[at] ^= 1 << self.below(8),
                2 => bytes.truncate(at),
                3 => drop(bytes.drain(at..at + length)),
                4 => {
                    let copied = bytes[at..at + length].to_vec();
                    let to = self.below(bytes.len());
                    drop(bytes.splice(to..to, copied));
                }
                5 => bytes[at..at + length].fill([0, 0x7f, 0x80, 0xff][self.below(4)]),
                _ => {
                    // Replace a number in a text by another word.
                    let digit = |byte: &u8| byte.is_ascii_digit();
                    let start = bytes[at..].iter().position(digit).map_or(at, |start| at + start);
                    let end =
                        bytes[start..].iter().position(|byte| !digit(byte)).map_or(start, |end| start + end);
                    drop(bytes.splice(start..end, WORDS[self.below(WORDS.len())].bytes()));
                }
            }
        }
    }
}

/// Centre of a model far from the origin.
pub const FAR: DVec3 = DVec3::new(1e5, -2e5, 3.0);

/// Vertices of a model of size 1e-3 about [`FAR`].
pub const DETAILS: [DVec3; 4] =
    [DVec3::ZERO, DVec3::new(1e-3, 0.0, 0.0), DVec3::new(1e-3, 7e-4, 0.0), DVec3::new(3e-4, 1e-3, 2.5e-4)];

/// Returns [`FAR`] + [`DETAILS`] as text, after `prefix`, one vertex a line.
pub fn far_vertices(prefix: &str) -> String {
    DETAILS.iter().map(|&detail| FAR + detail).map(|p| format!("{prefix}{} {} {}\n", p.x, p.y, p.z)).collect()
}

/// Moves [`FAR`] to the renderer's origin, and returns the largest error of a vertex there, rounded
/// to f32 as in the renderer, relative to the model's size. The first instance shows [`DETAILS`] in
/// their order.
pub fn error_in_space(mut scene: Description) -> f64 {
    scene.move_to(Rebase { origin: FAR, scale: 1.0 }).unwrap();
    let instance = &scene.instances[0];
    let positions = &scene.meshes[instance.mesh].positions;
    assert_eq!(positions.len(), DETAILS.len());
    let errors = positions.iter().zip(DETAILS).map(|(&p, detail)| {
        let world = instance.transform.transform_point3(Vec3::from(p).as_dvec3());
        (world.as_vec3().as_dvec3() - detail).abs().max_element()
    });
    errors.fold(0.0, f64::max) / 1e-3
}

/// Rounding error of a model of size 1 that is rounded to f32 about its centre, and once more in
/// the renderer.
pub const ROUNDED: f64 = 1.0 / (1 << 22) as f64;

/// Returns a scene with its positions rounded to f32 in world coordinates: the negative control of
/// [`error_in_space`].
pub fn rounded_in_world(mut scene: Description) -> Description {
    let instance = &mut scene.instances[0];
    let transform = std::mem::take(&mut instance.transform);
    for p in &mut scene.meshes[instance.mesh].positions {
        *p = transform.transform_point3(Vec3::from(*p).as_dvec3()).as_vec3().into();
    }
    scene
}
