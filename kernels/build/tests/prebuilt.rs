//! The committed kernels match the committed sources.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::path::Path;
use trisect_kernels_build::error::Error;
use trisect_kernels_build::manifest;

fn root() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn sources_match_the_manifest() {
    let manifest = manifest::read(&root()).unwrap();
    if let Err(error) = manifest::check_sources(&root(), &manifest) {
        panic!("{error}");
    }
}

#[test]
fn negative_control_each_kind_of_change_is_found() {
    let mutants: [fn(&mut manifest::Manifest); 5] = [
        |m| drop(m.sources.insert("shared/src/bvh.rs".into(), "another hash".into())),
        |m| drop(m.sources.insert("shared/src/gone.rs".into(), "a file that is no more".into())),
        |m| drop(m.packages.insert("glam".into(), "0.34.2".into())),
        |m| drop(m.settings.insert("ptx".into(), "sm_50".into())),
        |m| drop(m.artifacts.insert("kernels/prebuilt/spirv/render.spv".into(), "other bytes".into())),
    ];
    for (i, damage) in mutants.into_iter().enumerate() {
        let mut manifest = manifest::read(&root()).unwrap();
        damage(&mut manifest);
        let result = manifest::check_sources(&root(), &manifest);
        assert!(matches!(result, Err(Error::Stale { .. })), "change {i} went unnoticed");
    }
}
