//! White furnace of each material (torture test 10): the fraction of light that a white surface
//! scatters, by the viewer's angle.

use crate::materials::{self, Setup};
use crate::statistics::{Mean, SLOW, samples};
use trisect_shared::layers::{MaterialLayers, SOLID};
use trisect_shared::math::max_component;

const COSINES: [f32; 6] = [1.0, 0.9, 0.7, 0.4, 0.2, 0.05];
const ROUGHNESSES: [f32; 6] = [0.05, 0.1, 0.3, 0.5, 0.7, 1.0];

fn albedo(setup: &Setup, cos: f32) -> Mean {
    let seen = setup.view(cos);
    let mut mean = Mean::default();
    for i in 0..samples(200_000) {
        let s = seen.sample(77, i);
        mean.add(if s.absorbed { 0.0 } else { f64::from(max_component(s.weight)) });
    }
    mean
}

/// Returns whether all light is scattered, within 4.5 sigma and the rounding of the weights.
fn is_whole(mean: Mean) -> bool {
    mean.is(1.0, 1e-5)
}

/// Returns whether no light is added.
fn is_at_most_one(mean: Mean) -> bool {
    mean.value() <= 1.0 + 4.5 * mean.error() + 1e-5
}

#[test]
fn nothing_is_lost_by_what_has_one_lobe() {
    for setup in [materials::lambertian(), materials::metal(0.0)]
        .into_iter()
        .chain([(1.5, true), (1.5, false), (0.67, true)].map(|(ior, front)| materials::glass(ior, front)))
    {
        for cos in COSINES {
            assert!(is_whole(albedo(&setup, cos)), "{} at {cos}", setup.name);
        }
    }
    // Negative control: 1 % more light.
    let mut faulty = materials::lambertian();
    faulty.material.albedo *= 1.01;
    assert!(!is_at_most_one(albedo(&faulty, 0.7)));
}

/// Prints a table of losses, a row for each roughness; returns whether no light is added.
fn table(title: &str, setup: impl Fn(f32) -> Setup) -> bool {
    println!("{title}: 1 - albedo by cosine {COSINES:?}");
    let mut good = true;
    for roughness in ROUGHNESSES {
        let means = COSINES.map(|cos| albedo(&setup(roughness), cos));
        let row: Vec<String> = means.iter().map(|mean| format!("{:8.4}", 1.0 - mean.value())).collect();
        println!("{roughness:5} {}", row.join(" "));
        good &= means.into_iter().all(is_at_most_one);
    }
    good
}

/// Returns whether a white surface scatters at least 98 % of the light, and at most all.
fn keeps_light(title: &str, setup: impl Fn(f32) -> Setup) -> bool {
    let good = table(title, &setup);
    good && ROUGHNESSES.iter().all(|&roughness| {
        COSINES.iter().all(|&cos| {
            let mean = albedo(&setup(roughness), cos);
            mean.value() + 4.5 * mean.error() > 0.98
        })
    })
}

/// Single scattering alone loses up to 0.69 (1 - ln 2 remains at normal incidence and roughness 1);
/// multiple scattering gives it back, within the fits of the albedo.
#[test]
fn rough_metal_keeps_its_light() {
    assert!(keeps_light("white conductor", materials::conductor));
    assert!(keeps_light("white metal", |roughness| materials::mix(1.0, roughness, 0.0)));
    // Negative control: a metal that absorbs 3 % at each facet.
    let grey = |roughness| {
        let mut setup = materials::conductor(roughness);
        setup.material.albedo *= 0.97;
        setup
    };
    assert!(!keeps_light("grey conductor", grey));
}

/// At grazing angles the fit of a smooth boundary's albedo keeps a margin of 0.05.
#[test]
fn plastic_keeps_most_of_its_light() {
    for roughness in [0.3, 0.5, 0.7, 1.0] {
        for cos in [1.0, 0.9, 0.7, 0.4, 0.2] {
            let mean = albedo(&materials::mix(0.0, roughness, 0.0), cos);
            assert!(mean.value() + 4.5 * mean.error() > 0.97, "{roughness} {cos}: {mean:?}");
            let mean = albedo(&materials::mix(0.0, roughness, 1.0), cos);
            assert!(mean.value() + 4.5 * mean.error() > 0.98, "wall, {roughness} {cos}: {mean:?}");
        }
    }
}

#[test]
fn layers_invent_nothing() {
    for base in materials::layers() {
        let setup = |roughness: f32| {
            let mut setup = base.clone();
            setup.material.roughness = roughness;
            setup
        };
        assert!(table(&base.name, setup));
    }
    // Negative control: a colour of the base above 1.
    let mut faulty = materials::layers().remove(0);
    faulty.material.albedo *= 1.04;
    assert!(!is_at_most_one(albedo(&faulty, 1.0)) || SLOW);
}

#[test]
fn rough_glass_invents_nothing() {
    assert!(table("glass 1.5 from outside", |roughness| materials::rough_glass(1.5, roughness, true)));
    assert!(table("glass 1.5 from inside", |roughness| materials::rough_glass(1.5, roughness, false)));
    let mut faulty = materials::rough_glass(1.5, 0.05, true);
    faulty.material.albedo *= 1.01;
    assert!(!is_at_most_one(albedo(&faulty, 1.0)) || SLOW);
}

/// Single scattering loses up to 0.58 from inside at roughness 1.
#[test]
fn rough_glass_keeps_its_light() {
    let glass = |ior, front| move |roughness| materials::rough_glass(ior, roughness, front);
    assert!(keeps_light("glass 1.5 from outside", glass(1.5, true)));
    assert!(keeps_light("glass 1.5 from inside", glass(1.5, false)));
    let solid = |front| {
        move |roughness: f32| {
            let none = MaterialLayers { flags: SOLID, ..MaterialLayers::NONE };
            Setup { front, ..materials::layered(materials::mix(0.0, roughness, 1.0), "solid", none) }
        }
    };
    assert!(keeps_light("solid from outside", solid(true)));
    assert!(keeps_light("solid from inside", solid(false)));
    // Negative control: what facets send to others is lost.
    let single = |roughness| materials::single_scattering_glass(1.5, roughness, true);
    assert!(!keeps_light("glass that scatters once", single));
}

/// Metals that are stretched by all strengths, from all sides. The fit is up to 0.004 above.
#[test]
fn stretched_metal_keeps_its_light() {
    let mut losses = vec![];
    for (anisotropy, azimuth) in
        [0.3f32, 0.6, 0.8, 1.0].into_iter().flat_map(|a| [0.0f32, 0.4, 0.8, 1.2, 1.57].map(|z| (a, z)))
    {
        let (anisotropy_cos, anisotropy_sin) = (azimuth.cos(), azimuth.sin());
        let layers = MaterialLayers { anisotropy, anisotropy_cos, anisotropy_sin, ..MaterialLayers::NONE };
        for (roughness, cos) in ROUGHNESSES.into_iter().flat_map(|r| COSINES.map(|cos| (r, cos))) {
            let setup = materials::layered(materials::mix(1.0, roughness, 0.0), "stretched", layers);
            let mean = albedo(&setup, cos);
            let (kept, noise) = (mean.value(), 4.5 * mean.error());
            losses.push((1.0 - kept, anisotropy, azimuth, roughness, cos));
            assert!((0.965 - noise..1.004 + noise).contains(&kept), "{:?}", losses.last());
        }
    }
    losses.sort_by(|a, b| a.0.total_cmp(&b.0));
    println!("loss, anisotropy, azimuth, roughness, cosine: {:?} to {:?}", losses.first(), losses.last());
    let mean = losses.iter().map(|loss| loss.0).sum::<f64>() / losses.len() as f64;
    println!("mean {mean:.4}");
    assert!((0.0..0.01).contains(&mean), "{mean}");
    // Negative control: a metal that absorbs a tenth.
    let mut grey = materials::layered(
        materials::mix(1.0, 0.3, 0.0),
        "stretched",
        MaterialLayers { anisotropy: 1.0, ..MaterialLayers::NONE },
    );
    grey.material.albedo *= 0.9;
    assert!(albedo(&grey, 0.7).value() < 0.965);
}

#[test]
fn plastic_invents_nothing() {
    assert!(table("white plastic", |roughness| materials::mix(0.0, roughness, 0.0)));
    assert!(table("half metal", |roughness| materials::mix(0.5, roughness, 0.0)));
    assert!(table("white metal", |roughness| materials::mix(1.0, roughness, 0.0)));
    assert!(table("half film", |roughness| materials::mix(0.0, roughness, 0.5)));
    let mut faulty = materials::mix(1.0, 0.05, 0.0);
    faulty.material.albedo *= 1.01;
    assert!(!is_at_most_one(albedo(&faulty, 0.9)) || SLOW);
}
