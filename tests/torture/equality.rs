//! One image on all backends: instructions (17), bits (19) and first hits (20).

use crate::materials;
use crate::scattering::{question, with_materials};
use glam::UVec4;
use std::collections::HashSet;
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_probes::record::{Input, Output, row};
use trisect_probes::scatter::{EVALUATE, SAMPLE};
use trisect_shared::math::unit_sphere;
use trisect_shared::rng::PathKey;
use trisect_tests::renders::{cpu, differing, film, independent, scene_files};
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_translation};

/// Returns the first line of precise PTX that holds a forbidden instruction: contraction,
/// approximation, flushing of denormals, or a call of an external function, which no driver has.
/// Two instructions of box tests are allowed, as they decide no result.
fn forbidden(ptx: &str) -> Option<&str> {
    let of_box_test = |line: &str| {
        ["fma.rn.ftz.f32", "rcp.approx.ftz.f32"]
            .iter()
            .any(|&operation| line.trim_start().starts_with(operation))
    };
    let patterns = ["fma.", "mad.f32", "mad.rn.f32", ".approx", ".full", ".ftz", ".extern .func"];
    ptx.lines().find(|line| !of_box_test(line) && patterns.iter().any(|pattern| line.contains(pattern)))
}

#[test]
fn t17_ptx() {
    let precise = trisect_kernels::ptx_names().filter_map(|name| trisect_kernels::ptx(name, false));
    for ptx in precise.chain([trisect_probes::PTX_PRECISE.into()]) {
        assert_eq!(forbidden(&ptx), None);
    }
    let fast = trisect_kernels::ptx("render", true).unwrap();
    assert!(forbidden(&fast).is_some(), "negative control not detected");
    report(
        17,
        BackendUnderTest::Cuda,
        Outcome::Passed,
        "no fma, approximation, flushing or external function but in box tests",
    );
}

/// Returns the number of arithmetic instructions of a SPIR-V module, and the number of those that a
/// driver may contract.
fn contractible(module: &[u8]) -> (usize, usize) {
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(module);
    let (mut decorated, mut results) = (HashSet::new(), Vec::new());
    let mut at = 5;
    while at < words.len() {
        match words[at] & 0xffff {
            71 if words[at + 2] == 42 => drop(decorated.insert(words[at + 1])), // OpDecorate, NoContraction
            129 | 131 | 133 | 136 | 140..=148 => results.push(words[at + 2]), // OpFAdd to OpDot; OpFNegate is exact
            _ => (),
        }
        at += (words[at] >> 16).max(1) as usize;
    }
    (results.len(), results.iter().filter(|id| !decorated.contains(id)).count())
}

#[test]
fn t17_spirv() {
    let names = trisect_kernels::entry_points().filter(|name| !name.starts_with("d"));
    let is_integer = |name: &&str| name.starts_with("film_") && *name != trisect_kernels::FILM_NOISE;
    let (totals, names): (Vec<_>, Vec<_>) = names.partition(is_integer);
    let kernels: Vec<_> = names.into_iter().map(|name| trisect_kernels::spirv(name).unwrap()).collect();
    // Totals of the film are integers, which no driver rounds.
    for name in totals {
        assert_eq!(contractible(trisect_kernels::spirv(name).unwrap()), (0, 0), "{name}");
    }
    let probes: Vec<_> =
        trisect_probes::NAMES.iter().map(|name| trisect_probes::spirv(name).unwrap()).collect();
    for module in kernels.iter().chain(&probes) {
        let (all, bare) = contractible(module);
        assert!(all > 0 && bare == 0, "{bare} of {all}");
    }
    // Negative control: one decoration of another kind.
    let mut words: Vec<u32> = bytemuck::pod_collect_to_vec(probes[0]);
    let decoration = words.windows(3).position(|w| w[0] == 3 << 16 | 71 && w[2] == 42).unwrap();
    words[decoration + 2] = 0;
    assert_eq!(contractible(bytemuck::cast_slice(&words)).1, 1, "negative control not detected");
    let all: usize = kernels.iter().map(|module| contractible(module).0).sum();
    report(
        17,
        BackendUnderTest::Wgpu,
        Outcome::Passed,
        format!("{all} arithmetic instructions, all NoContraction"),
    );
}

/// Compares first hits (primitive, distance, normal) and the radiance of one sample with the CPU's,
/// bit by bit, in each scene.
///
/// CUDA must have the CPU's bits. Vulkan's division may be off by 2.5 ULP, so differing bits are
/// counted there, and 0.01 % of its hits may be of other primitives.
fn t19_t20_bits(subject: BackendUnderTest) {
    let (mut rays, mut ids, mut hits, mut pixels, mut radiance) = (0, 0, 0, 0, 0);
    for path in scene_files() {
        let scene = Scene::load(&path).unwrap();
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let mut cpu = cpu(&scene);
        let many = Settings { width: 160, height: 120, ..independent(&scene) };
        let (got, want) = (renderer.first_hits(&many, 0).unwrap(), cpu.first_hits(&many, 0).unwrap());
        rays += got.len();
        ids += got.iter().zip(&want).filter(|(a, b)| a.primitive != b.primitive).count();
        hits +=
            got.iter().zip(&want).filter(|(a, b)| bytemuck::bytes_of(*a) != bytemuck::bytes_of(*b)).count();
        let few = Settings { width: 16, height: 12, samples: 1, ..independent(&scene) };
        pixels += few.pixels() as usize;
        radiance += differing(&film(&mut renderer, &few), &film(&mut cpu, &few));
    }
    if subject == BackendUnderTest::Cpu {
        // Negative control: the rays of another sample.
        let scene = trisect_tests::scene("cornell_box.ron");
        let mut cpu = cpu(&scene);
        let few = Settings { width: 16, height: 12, samples: 1, ..independent(&scene) };
        assert_ne!(cpu.first_hits(&few, 0).unwrap(), cpu.first_hits(&few, 1).unwrap());
        return;
    }
    let same = hits == 0 && radiance == 0;
    let outcome = if same { Outcome::Passed } else { Outcome::Bounded };
    let text = format!(
        "{hits} of {rays} first hits and {radiance} of {pixels} pixels of one sample differ in a bit"
    );
    if subject == BackendUnderTest::Cuda {
        assert!(same, "{text}");
    }
    report(19, subject, outcome, text);
    assert!(ids * 10_000 <= rays, "{ids} of {rays} first hits are of another primitive");
    report(20, subject, Outcome::Passed, format!("{ids} of {rays} first hits are of another primitive"));
}

/// Compares sampling and evaluation of each material with the CPU's, bit by bit, and prints the
/// ones that differ. It asserts nothing: it shows where a difference of images comes from.
fn t19_functions(subject: BackendUnderTest) {
    let setups = [
        materials::lambertian(),
        materials::metal(0.5),
        materials::glass(1.5, true),
        materials::glass(1.5, false),
        materials::conductor(0.3),
        materials::copper(0.5),
        materials::rough_glass(1.5, 0.5, true),
        materials::rough_glass(1.5, 0.5, false),
        materials::mix(0.5, 0.6, 0.0),
        materials::mix(0.2, 0.4, 0.6),
    ];
    let (Some(mut device), Some(mut cpu)) =
        (with_materials(subject, &setups), with_materials(BackendUnderTest::Cpu, &setups))
    else {
        return;
    };
    let mut all = 0;
    for (index, setup) in setups.iter().enumerate() {
        let mut questions = Vec::new();
        for i in 0..4096u32 {
            let seen = setup.view(((i % 64) as f32 + 0.5) / 64.0);
            let w = PathKey { seed: 19, pixel: i, sample: 0 }.words(0);
            let words = UVec4::new(w.x, w.y, w.z, w.w);
            questions.push(question(index, seen.viewer, seen.normal, setup.front, words));
        }
        let evaluations: Vec<Input> =
            questions.iter().map(|q| Input { c: row(unit_sphere(q.c.x, q.c.y), 0), ..*q }).collect();
        for (operation, questions) in [(SAMPLE, &questions), (EVALUATE, &evaluations)] {
            let got = device.ask("probe_scatter", operation, questions);
            let want = cpu.ask("probe_scatter", operation, questions);
            let parts = |o: &Output| [&o.a.to_array()[..], &o.b.to_array()].concat();
            let mut off = [0; 8];
            for (g, w) in got.iter().zip(&want) {
                for (k, (g, w)) in parts(g).iter().zip(parts(w)).enumerate() {
                    off[k] += usize::from(*g != w);
                }
            }
            if off.iter().any(|&n| n > 0) {
                println!("{subject:?} {} operation {operation}: {off:?}", setup.name);
            }
            all += off.iter().sum::<usize>();
        }
    }
    println!("{all}");
}

for_each_translation!(t19_t20_bits, t19_functions);
