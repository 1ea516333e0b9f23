//! When a device fails or is missing, another one continues, and nothing that was rendered is lost.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use trisect::checkpoint::{Checkpoint, Identity, arithmetic};
use trisect::device::cpu::Cpu;
use trisect::device::{BackendError, Device, DeviceInfo};
use trisect::film::Film;
use trisect::render::{MathMode, PreparedScene, Renderer, Settings, Summation};
use trisect::{Error, scene::Scene};
use trisect_tests::fault_injecting_backend::FaultInjectingBackend;
use trisect_tests::program::{Temporary, check_failure, trisect};
use trisect_tests::scene;

fn renderer(scene: &Scene) -> Renderer {
    Renderer::new(Cpu::open(None).unwrap(), scene).unwrap()
}

/// Returns a renderer on a backend that is lost after `left` launches.
fn failing(scene: &Scene, mut left: u32) -> Renderer {
    let lost = move || {
        left = left.checked_sub(1).ok_or_else(|| BackendError::Device {
            backend: "cpu",
            action: "waiting for a launch",
            message: "the device is lost".to_owned(),
        })?;
        Ok(())
    };
    Renderer::new(FaultInjectingBackend::new(lost), scene).unwrap()
}

#[test]
fn a_device_that_is_lost() {
    let scene = scene("three_spheres.ron");
    for (guides, sums) in [
        (false, Summation::Auto),
        (true, Summation::Auto),
        (false, Summation::Device),
        (true, Summation::Device),
    ] {
        let size = Settings { width: 32, height: 20, samples: 700, depth: 8, ..Settings::of(&scene) };
        let settings = Settings { guides, sums, ..size };
        let empty = || if guides { Film::with_aovs(32, 20) } else { Film::new(32, 20) };
        let whole = renderer(&scene).render(&settings).unwrap().film;
        for left in 0..4 {
            let (mut film, mut asked) = (empty(), Vec::new());
            let mut render = |elsewhere: &mut trisect::render::FallbackFactory<'_>| {
                let mut settings = settings.clone();
                failing(&scene, left).render_missing_with_fallback(
                    &mut film,
                    &mut settings,
                    &(0..700),
                    &(),
                    &mut (),
                    elsewhere,
                )
            };
            let mut elsewhere = |error: &BackendError, film: &Film, _: &mut Settings| {
                asked.push((error.to_string(), film.coverage.parts().len()));
                // The first renderer that continues fails, too.
                Some(Ok(if asked.len() < 2 { failing(&scene, 0) } else { renderer(&scene) }))
            };
            let stats = render(&mut elsewhere).unwrap();
            // The number of launches depends on the processor.
            if left == 0 {
                assert!(asked[0].0.contains("the device is lost") && asked[0].1 == 0, "{asked:?}");
                assert_eq!(asked.len(), 2);
            }
            assert_eq!(film, whole, "{left} {sums:?}");
            assert_eq!(stats.samples, whole.counts().samples);

            // Without a fallback, there is an error, and the film keeps what was rendered.
            let mut film = empty();
            let mut given_up = |_: &BackendError, _: &Film, _: &mut Settings| None;
            let result = failing(&scene, left).render_missing_with_fallback(
                &mut film,
                &mut settings.clone(),
                &(0..700),
                &(),
                &mut (),
                &mut given_up,
            );
            assert!(matches!(result, Err(Error::Backend(BackendError::Device { .. }))) || film == whole);
            renderer(&scene).render_missing(&mut film, &settings, &(0..700), &(), &mut ()).unwrap();
            assert_eq!(film, whole);
        }
        // Negative control: the fallback has another seed.
        let mut film = empty();
        let mut other = |_: &BackendError, _: &Film, settings: &mut Settings| {
            settings.seed += 1;
            Some(Ok(renderer(&scene)))
        };
        let settings = &mut settings.clone();
        let mut lost = failing(&scene, 1);
        lost.render_missing_with_fallback(&mut film, settings, &(0..700), &(), &mut (), &mut other).unwrap();
        assert_ne!(film, whole, "negative control not detected");
    }
}

/// A device that is full when a scene that moves is uploaded to it at another time.
#[test]
fn a_device_that_is_full_when_the_scene_moves() {
    let (scene, other) = (scene("three_spheres.ron"), scene("materials.ron"));
    let settings = Settings { width: 32, height: 20, samples: 16, depth: 8, ..Settings::of(&other) };
    let whole = renderer(&other).render(&settings).unwrap().film;
    let full = Arc::new(AtomicBool::new(false));
    let backend = FaultInjectingBackend::new(|| Ok(())).full_while(Arc::clone(&full));
    let mut moving = Renderer::new(backend, &scene).unwrap();
    let mut prepared = PreparedScene::new(&other, None).unwrap();
    full.store(true, Ordering::Relaxed);

    // Without a fallback, or with one that is full, too, there is an error.
    let mut said = Vec::new();
    let error = moving.set_scene_with_fallback(&mut prepared, &mut |error| {
        said.push(error.to_string());
        let again = FaultInjectingBackend::new(|| Ok(())).full_while(Arc::clone(&full));
        (said.len() < 3).then(|| Ok(Box::new(again) as Box<dyn Device>))
    });
    assert!(matches!(error, Err(Error::Backend(BackendError::Device { .. }))), "{error:?}");
    assert!(said.len() == 3 && said.iter().all(|line| line.contains("out of memory")), "{said:?}");
    assert!(moving.render(&settings).is_err(), "no scene is left");

    // With one, the image is the same.
    let open = || Ok(Box::new(Cpu::open(None)?) as Box<dyn Device>);
    moving.set_scene_with_fallback(&mut prepared, &mut |_| Some(open())).unwrap();
    assert_eq!(moving.render(&settings).unwrap().film, whole);

    // A fault of the program is no reason to continue elsewhere; nor is success.
    let never = &mut |_: &BackendError| -> Option<Result<Box<dyn Device>, Error>> { panic!("asked") };
    moving.set_scene_with_fallback(&mut prepared, never).unwrap();
    assert_eq!(moving.render(&settings).unwrap().film, whole);
}

/// A film of two devices may be continued by either of them, and by no other.
#[test]
fn roundings_of_several_devices() {
    let scene = scene("three_spheres.ron");
    let device = |backend: &'static str, name: &str| {
        let cpu = Cpu::open(None).unwrap().info().clone();
        DeviceInfo { backend, name: name.to_owned(), ..cpu }
    };
    let renderer = renderer(&scene);
    let of = |device: &DeviceInfo| {
        let any = Identity::new(&scene.digest(), &Settings::of(&scene), &renderer);
        Identity { arithmetic: arithmetic(device, MathMode::Precise), ..any }
    };
    let (cpu, one, other) = (device("cpu", ""), device("wgpu", "one"), device("wgpu", "other"));
    let mut both = of(&one);
    both.add_rounding(&arithmetic(&cpu, MathMode::Precise));
    both.add_rounding(&arithmetic(&cpu, MathMode::Precise));
    assert_eq!(both.arithmetic.matches("precise").count(), 2);
    for goes_on in [&cpu, &one] {
        assert_eq!((both.check(&of(goes_on)), of(goes_on).check(&both)), (Ok(()), Ok(())));
    }
    let refused = of(&other).check(&both).unwrap_err();
    assert_eq!(refused.field, "arithmetic");
    assert!(of(&one).check(&of(&cpu)).is_err());
    // A device with the CPU's bits is no second rounding.
    let mut same = of(&device("cuda", "any"));
    same.add_rounding(&arithmetic(&cpu, MathMode::Precise));
    assert_eq!(same, of(&cpu));
}

#[test]
fn a_device_that_is_not_there() {
    let info = trisect(&["info"]);
    if String::from_utf8_lossy(&info.stdout).contains("cuda  --device 0") {
        return eprintln!("SKIPPED: this machine has what should be missing");
    }
    let folder = Temporary::new("fallback", "missing");
    let (one, other, file) = (folder.file("one.pfm"), folder.file("other.pfm"), folder.file("a.ckpt"));
    let image = ["--resolution", "32x18", "--spp", "8", "-o"];
    assert!(trisect(&[&["render", "--backend", "cpu"], &image[..], &[&one]].concat()).status.success());
    let lost = ["render", "--backend", "cuda", "--math", "fast", "--schedule", "persistent"];
    let asked = [&lost[..], &image, &[&other]].concat();
    check_failure(&trisect(&asked), &asked, 3, &["cuda is not available"]);
    let output = trisect(&[&asked[..], &["--fallback", "cpu", "--checkpoint", &file]].concat());
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && text.contains("the CPU renders instead"), "{text}");
    assert_eq!(std::fs::read(&one).unwrap(), std::fs::read(&other).unwrap());
    assert_eq!(Checkpoint::read(file.as_ref()).unwrap().header.identity.arithmetic, "precise");
    // A device number that does not exist is a mistake, and not a failed device.
    let none = [&["render", "--backend", "cpu", "--device", "7", "--fallback", "cpu"], &image[..], &[&other]]
        .concat();
    check_failure(&trisect(&none), &none, 3, &["--device 7"]);
}
