//! Fuzz target: scenes of Mitsuba 3. After the first byte 0 stands the file `b.xml`, which the
//! scene may include; `a.png`, `m.obj`, `m.ply` and `s.pfm` are always there.

#![no_main]

use libfuzzer_sys::fuzz_target;
use trisect::scene::import::mitsuba;
use trisect_fuzz::{Beside, Choices, bounded, foreign_scene, parts};

fuzz_target!(|bytes: &[u8]| {
    let (scene, included) = parts(bytes);
    let read = || mitsuba::parse(scene, "fuzz.xml", &mut Beside(included));
    bounded(bytes.len(), || foreign_scene(read(), &Choices::of(bytes)));
});
