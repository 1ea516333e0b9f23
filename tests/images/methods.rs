//! Each traversal, schedule and tile size of a backend gives the same image, bit by bit, as its
//! binary BVH with the `regenerate` schedule.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use std::path::Path;
use std::time::Duration;
use trisect::device::cpu::Cpu;
use trisect::device::{BackendError, Buffer, Command, Device, DeviceInfo, MathMode};
use trisect::render::{Renderer, Schedule, Settings, Traversal};
use trisect::scene::Scene;
use trisect_kernels::EntryPoint;
use trisect_tests::renders::{brighter, differing, film};
use trisect_tests::{BackendUnderTest, for_each_route};

/// Scenes of each kernel: spheres with Schlick's and with Fresnel's reflectance; quads and a light;
/// all kinds of shapes and textures.
const SCENES: [&str; 4] = ["rtiow_final.ron", "three_spheres.ron", "cornell_box.ron", "next_week.ron"];

fn one_image_by_each_method(subject: BackendUnderTest) {
    for name in SCENES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name);
        let scene = Scene::load(&path).unwrap();
        let settings = Settings { width: 36, height: 20, samples: 3, seed: 9, ..Settings::of(&scene) };
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let mut by =
            |traversal, schedule| film(&mut renderer, &Settings { traversal, schedule, ..settings.clone() });
        let want = by(Some(Traversal::Stack), Some(Schedule::Regenerate));
        assert_eq!((want.counts().rejected, want.counts().unwritten), (0, 0), "{name}");
        for (traversal, schedule) in [
            (None, None),
            (Some(Traversal::Stack), Some(Schedule::Pixel)),
            (Some(Traversal::Stack), Some(Schedule::Persistent)),
            (Some(Traversal::Stack), Some(Schedule::Interleaved)),
            (Some(Traversal::Linear), Some(Schedule::Interleaved)),
            (Some(Traversal::Linear), None),
        ] {
            let queue = matches!(schedule, Some(Schedule::Persistent | Schedule::Interleaved));
            if subject == BackendUnderTest::WgpuNaga && queue {
                continue; // refused: see `queues_of_parts`
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
        // Negative control: 1 % more albedo.
        let mut other = subject.renderer(&brighter(&scene)).unwrap();
        let twin = Settings { schedule: Some(Schedule::Pixel), ..settings.clone() };
        assert!(differing(&film(&mut other, &twin), &want) > 0, "{name}: negative control not detected");
    }
}

/// A device without memory for tile entries.
struct OutOfTileMemory(Box<dyn Device>);

impl Device for OutOfTileMemory {
    fn info(&self) -> &DeviceInfo {
        self.0.info()
    }

    fn allocate(&mut self, bytes: u64, what: &'static str) -> Result<Buffer, BackendError> {
        match what {
            "the BVH's tile entries" => {
                Err(BackendError::TooLarge { backend: "full", what, needed: bytes, limit: 0 })
            }
            _ => self.0.allocate(bytes, what),
        }
    }

    fn write(&mut self, to: &Buffer, first: u64, bytes: &[u8]) -> Result<(), BackendError> {
        self.0.write(to, first, bytes)
    }

    fn compile(&mut self, entry_point: EntryPoint, math: MathMode) -> Result<(), BackendError> {
        self.0.compile(entry_point, math)
    }

    #[allow(unsafe_code, reason = "the contract of the trait")]
    unsafe fn run(&mut self, commands: Vec<Command<'_>>) -> Result<Vec<Duration>, BackendError> {
        // SAFETY: the caller's promise.
        unsafe { self.0.run(commands) }
    }
}

#[test]
fn tiles_without_memory_are_named() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/rtiow_final.ron");
    let scene = Scene::load(&path).unwrap();
    let settings = Settings { width: 36, height: 20, samples: 3, tile: Some(8), ..Settings::of(&scene) };
    let open = || Cpu::open(Some(1)).unwrap();
    let settings = Settings { traversal: Some(Traversal::Stack), ..settings };
    let mut full = Renderer::new(OutOfTileMemory(Box::new(open())), &scene).unwrap();
    let mut other = Renderer::new(open(), &scene).unwrap();
    let [full, other] = [&mut full, &mut other].map(|r| r.render(&settings).unwrap());
    assert_eq!(differing(&full.film, &other.film), 0);
    let [warning] = &full.stats.warnings()[..] else { panic!("{:?}", full.stats.warnings()) };
    assert!(warning.starts_with("rendered without tiles") && warning.contains("full allows 0"), "{warning}");
    assert_eq!((full.stats.tile, other.stats.tile), (None, Some(8)));
    assert!(other.stats.warnings().is_empty() && other.stats.tiles_refused.is_none());
}

/// The schedules with a queue give the same image if a launch renders few rows, and if it continues
/// the sums of an earlier launch.
fn queues_of_parts(subject: BackendUnderTest) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/rtiow_final.ron");
    let scene = Scene::load(&path).unwrap();
    let settings = Settings { width: 21, height: 13, samples: 9, seed: 9, ..Settings::of(&scene) };
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let want = film(&mut renderer, &Settings { schedule: Some(Schedule::Regenerate), ..settings.clone() });
    for schedule in [Schedule::Persistent, Schedule::Interleaved] {
        let queue = Settings { schedule: Some(schedule), ..settings.clone() };
        if subject == BackendUnderTest::WgpuNaga {
            let refused = renderer.render(&queue).map(|_| ()).map_err(|error| error.to_string());
            assert!(
                refused.as_ref().is_err_and(|text| text.contains("`schedule` persistent")),
                "{refused:?}"
            );
            continue;
        }
        for (samples, tile) in [(1, None), (21 * 5, Some(0)), (21 * 13 * 4, Some(4))] {
            renderer.limit_submissions(Some(samples));
            let got = film(&mut renderer, &Settings { tile, ..queue.clone() });
            assert_eq!(
                differing(&got, &want),
                0,
                "{schedule:?}, submissions of {samples} samples, tile {tile:?}"
            );
        }
    }
}

for_each_route!(one_image_by_each_method, queues_of_parts);
