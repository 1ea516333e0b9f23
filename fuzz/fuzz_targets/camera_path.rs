//! Fuzz target: files of camera paths, and the poses at and between their keys.

#![no_main]

use libfuzzer_sys::fuzz_target;
use trisect::view::CameraPath;
use trisect_fuzz::bounded;

fuzz_target!(|text: &str| {
    bounded(text.len(), || {
        let Ok(path) = CameraPath::parse(text, "fuzz.ron") else { return };
        let last = path.last();
        for frame in [0, 1, last / 3, last / 2, last.saturating_sub(1), last, u32::MAX] {
            if let Ok(pose) = path.pose(frame) {
                let _ = pose.check();
            }
        }
    });
});
