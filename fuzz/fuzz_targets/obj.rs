//! Fuzz target: OBJ and MTL, separated by the first byte 0. Every file that they name is the MTL.

#![no_main]

use libfuzzer_sys::fuzz_target;
use trisect::scene::import::obj;
use trisect_fuzz::{Choices, Same, bounded, model};

fuzz_target!(|bytes: &[u8]| {
    let mut parts = bytes.splitn(2, |byte| *byte == 0);
    let (geometry, library) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    let read = || obj::parse(geometry, "fuzz.obj", &mut Same(library));
    bounded(bytes.len(), || model(read(), &Choices::of(bytes)));
});
