//! One image by each traversal, each schedule and each size of tiles of a backend: its own by the binary tree and lanes that go on at once, bit for bit.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::path::Path;
use trisect::render::{Schedule, Settings, Traversal};
use trisect::scene::Scene;
use trisect_tests::renders::{brighter, differing, film};
use trisect_tests::{Subject, for_each_backend};

/// Spheres by Schlick's and by Fresnel's reflectance; quads and a light; all kinds of shapes and textures.
const SCENES: [&str; 4] = ["rtiow_final.ron", "three_spheres.ron", "cornell_box.ron", "next_week.ron"];

fn one_image_by_each_method(subject: Subject) {
    for name in SCENES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name);
        let scene = Scene::load(&path).unwrap();
        let settings = Settings { width: 36, height: 20, samples: 3, seed: 9, ..scene.settings() };
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let mut by =
            |traversal, schedule| film(&mut renderer, &Settings { traversal, schedule, ..settings.clone() });
        let want = by(Some(Traversal::Stack), Some(Schedule::Regenerate));
        assert_eq!((want.counts().rejected, want.counts().unwritten), (0, 0), "{name}");
        for (traversal, schedule) in [
            (None, None),
            (Some(Traversal::Stack), Some(Schedule::Pixel)),
            (Some(Traversal::Stack), Some(Schedule::Persistent)),
            (Some(Traversal::Linear), None),
        ] {
            if subject == Subject::WgpuNaga && schedule == Some(Schedule::Persistent) {
                continue; // refused, below
            }
            let got = by(traversal, schedule);
            assert_eq!(differing(&got, &want), 0, "{name} by {traversal:?}, {schedule:?}");
        }
        for (tile, schedule) in
            [(0, None), (4, Schedule::Pixel.into()), (16, Schedule::Regenerate.into()), (1024, None)]
        {
            let tiles = Settings {
                traversal: Some(Traversal::Stack),
                schedule,
                tile: Some(tile),
                ..settings.clone()
            };
            assert_eq!(
                differing(&film(&mut renderer, &tiles), &want),
                0,
                "{name}, tiles of {tile} pixels, {schedule:?}"
            );
        }
        // The twin: a hundredth more light.
        let mut other = subject.renderer(&brighter(&scene)).unwrap();
        let twin = Settings { schedule: Some(Schedule::Pixel), ..settings.clone() };
        assert!(differing(&film(&mut other, &twin), &want) > 0, "{name}: the comparison sees nothing");
    }
}

/// A launch of a part of the rows, and one that goes on where another ended: a queue of few pixels, and sums taken up again.
fn queues_of_parts(subject: Subject) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/rtiow_final.ron");
    let scene = Scene::load(&path).unwrap();
    let settings = Settings { width: 21, height: 13, samples: 9, seed: 9, ..scene.settings() };
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let want = film(&mut renderer, &Settings { schedule: Some(Schedule::Regenerate), ..settings.clone() });
    let persistent = Settings { schedule: Some(Schedule::Persistent), ..settings };
    if subject == Subject::WgpuNaga {
        let refused = renderer.render(&persistent, &mut ()).map(|_| ()).map_err(|error| error.to_string());
        assert!(refused.as_ref().is_err_and(|text| text.contains("--schedule persistent")), "{refused:?}");
        return;
    }
    for (samples, tile) in [(1, None), (21 * 5, Some(0)), (21 * 13 * 4, Some(4))] {
        renderer.limit_submissions(Some(samples));
        let got = film(&mut renderer, &Settings { tile, ..persistent.clone() });
        assert_eq!(differing(&got, &want), 0, "submissions of {samples} samples, tile {tile:?}");
    }
}

for_each_backend!(one_image_by_each_method, queues_of_parts);
