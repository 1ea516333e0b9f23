//! The backend that a user names is the one that renders.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use trisect::device::{Choice, open};
use trisect_tests::{BackendUnderTest, for_each_route, scene};

fn the_named_backend_is_opened(subject: BackendUnderTest) {
    // Skips the test with a message, or fails, where the backend is missing.
    if subject.renderer(&scene("three_spheres.ron")).is_none() {
        return;
    }
    let choice = match subject {
        BackendUnderTest::Cpu => Choice::Cpu,
        BackendUnderTest::Wgpu | BackendUnderTest::WgpuNaga | BackendUnderTest::WgpuWgsl => Choice::Wgpu,
        BackendUnderTest::Cuda => Choice::Cuda,
    };
    let selection = open(choice, Some(0), None).unwrap();
    assert_eq!(selection.device.info().backend, subject.name());
    assert_eq!(selection.why, "", "nothing was chosen for the user");
}

for_each_route!(the_named_backend_is_opened);
