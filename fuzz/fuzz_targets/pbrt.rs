//! Fuzz target: scenes of pbrt-v4. After the first byte 0 stands the file `b.pbrt`, which the scene
//! may include; `a.png`, `m.obj`, `m.ply` and `s.pfm` are always there.

#![no_main]

use libfuzzer_sys::fuzz_target;
use trisect::scene::import::pbrt;
use trisect_fuzz::{Beside, Choices, bounded, foreign_scene, parts};

fuzz_target!(|bytes: &[u8]| {
    let (scene, included) = parts(bytes);
    let read = || pbrt::parse(scene, "fuzz.pbrt", &mut Beside(included));
    bounded(bytes.len(), || foreign_scene(read(), &Choices::of(bytes)));
});
