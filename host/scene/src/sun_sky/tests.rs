//! Tests of the clear sky against its own integrals, closed forms and published figures.

use super::air::{Air, EARTH, direction, distance_to_top};
use super::disc::Disc;
use super::grid::Grid;
use super::panorama::build;
use super::quadrature::Gauss;
use super::radiance::ClearSky;
use super::{SunSky, angles};
use crate::builder::{Camera, SceneBuilder};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use trisect_image::Image;

/// Luminous efficacy of the unit of radiance: 683 lm/W times the integral of the luminous
/// efficiency, in nm.
const LUMENS: f64 = 683.0 * 106.857;

fn luminance(color: DVec3) -> f64 {
    color.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

fn sky(elevation: f64, turbidity: f64) -> SunSky {
    SunSky { turbidity, ..SunSky::new(0.0, elevation) }
}

/// Returns the irradiance of a surface that faces upward, without the sun.
fn irradiance(clear: &ClearSky) -> DVec3 {
    let (heights, azimuths) = (Gauss::<64>::new(), Gauss::<48>::new());
    let mut sum = DVec3::ZERO;
    for (t, weight) in heights.points() {
        let height = FRAC_PI_2 * t;
        for (u, other) in azimuths.points() {
            let cell = FRAC_PI_2 * weight * TAU * other * height.sin() * height.cos();
            sum += clear.radiance(direction(height, PI * u)) * cell;
        }
    }
    sum
}

/// Returns the irradiance of a surface that faces upward under the interpolated panorama.
fn of_panorama(image: &Image) -> DVec3 {
    const PARTS: u32 = 8;
    let mut sum = DVec3::ZERO;
    for y in 0..PARTS * image.height / 2 {
        let place = (f64::from(y) + 0.5) / f64::from(PARTS);
        let polar = PI * place / f64::from(image.height);
        let cell = PI / f64::from(PARTS * image.height) * TAU / f64::from(image.width);
        for x in 0..image.width {
            // Sums over the centres of columns are exact.
            sum += interpolated(image, f64::from(x) + 0.5, place) * (polar.cos() * polar.sin() * cell);
        }
    }
    sum
}

/// Returns the panorama at a place in texels, as kernels read it.
fn interpolated(image: &Image, x: f64, y: f64) -> DVec3 {
    let (x, y) = (x - 0.5, y - 0.5);
    let (i, j) = (x.floor(), y.floor());
    let texel = |i: f64, j: f64| {
        let column = (i as i64).rem_euclid(i64::from(image.width)) as usize;
        let row = (j as i64).clamp(0, i64::from(image.height) - 1) as usize;
        DVec3::from(image.pixels[row * image.width as usize + column].map(f64::from))
    };
    let (u, v) = (x - i, y - j);
    texel(i, j).lerp(texel(i + 1.0, j), u).lerp(texel(i, j + 1.0).lerp(texel(i + 1.0, j + 1.0), u), v)
}

/// Single scattering by thin air has a closed form, to which further orders, the ground and ozone
/// add little.
#[test]
fn the_zenith_of_pure_air_is_that_of_single_scattering() {
    let clear = ClearSky::new(&SunSky { ground_albedo: 0.0, ..sky(30.0, 1.0) });
    let green = clear.radiance(DVec3::Y).y;
    // Chandrasekhar (Radiative Transfer, 1950): transmitted light of order 1, for the sun at 60°
    // from the zenith and the optical depth 0.0973 of 550 nm, under 1.86 W m⁻² nm⁻¹.
    let (depth, sun) = (0.0973f64, 0.5f64);
    let phase = 3.0 / (16.0 * PI) * (1.0 + sun * sun);
    let single = 1.86 * phase * sun / (1.0 - sun) * ((-depth).exp() - (-depth / sun).exp());
    assert!((1.0..1.35).contains(&(green / single)), "{green} {single}");
}

/// Illuminances of a clear sky by the formulas of the Illuminating Engineering Society (Gillette,
/// Pierpoint and Treado, Journal of the IES 13, 1984): of the sun, 127.5 exp(-0.21 m) klx, and of
/// the sky, 0.8 + 15.5 √(sin h) klx. They are means over places and days of all hazes.
#[test]
fn illuminances_are_the_published_ones() {
    for elevation in [15.0f64, 30.0, 45.0, 60.0, 80.0] {
        let sine = elevation.to_radians().sin();
        let clear = ClearSky::new(&sky(elevation, 2.0));
        let sun = luminance(clear.sun_irradiance) * LUMENS / 1e3;
        let diffuse = luminance(irradiance(&clear)) * LUMENS / 1e3;
        let published = (127.5 * (-0.21 / sine).exp(), 0.8 + 15.5 * sine.sqrt());
        assert!((sun / published.0 - 1.0).abs() < 0.15, "{elevation}: {sun} {}", published.0);
        assert!((diffuse / published.1 - 1.0).abs() < 0.3, "{elevation}: {diffuse} {}", published.1);
        // Negative control: thick haze is not a clear sky.
        let hazy = ClearSky::new(&sky(elevation, 8.0));
        assert!(luminance(hazy.sun_irradiance) * LUMENS / 1e3 < 0.8 * published.0);
    }
}

/// A clear zenith is blue, haze whitens it, a low sun is orange, and the horizon is brighter than
/// the zenith away from the sun.
#[test]
fn colours_are_those_of_the_sky() {
    let blue = |color: DVec3| color.z / color.x;
    for elevation in [5.0, 30.0, 60.0] {
        let [pure, clear, hazy] = [1.0, 3.0, 10.0].map(|t| ClearSky::new(&sky(elevation, t)));
        let zenith = [&pure, &clear, &hazy].map(|sky| blue(sky.radiance(DVec3::Y)));
        assert!(zenith[0] > 1.3 * zenith[1] && zenith[1] > 1.1 * zenith[2], "{elevation}: {zenith:?}");
        assert!(zenith[1] > 1.5 && blue(clear.sun_irradiance) < 0.75, "{elevation}");
        let away = luminance(pure.radiance(direction(0.05, PI))) / luminance(pure.radiance(DVec3::Y));
        assert!((2.0..20.0).contains(&away), "{elevation}: {away}");
    }
    let low = ClearSky::new(&sky(3.0, 2.0)).sun_irradiance;
    assert!(low.x > 2.0 * low.y && low.y > 2.0 * low.z, "{low}");
}

/// The furnace: the panorama has the irradiance of the sky that it shows, with the sun at any
/// height, and the ground is lit by both.
#[test]
fn the_panorama_has_the_irradiance_of_the_model() {
    for (elevation, disc) in [(0.0, false), (7.3, true), (35.0, false), (35.0, true), (90.0, true)] {
        let sky = SunSky { sun_disc: disc, ..sky(elevation, 3.0) };
        let clear = ClearSky::new(&sky);
        let image = build(&sky);
        let sun = clear.sun_irradiance * f64::to_radians(elevation).sin();
        let want = irradiance(&clear) + if disc { sun } else { DVec3::ZERO };
        let is = of_panorama(&image);
        let error = ((is - want) / want).abs().max_element();
        assert!(error < 5e-3, "{elevation}: {is} {want}");
        // Negative control: the sun is missed.
        assert!(!disc || ((is - irradiance(&clear)) / want).abs().max_element() > 0.1);
        let ground = DVec3::from(image.pixels[image.pixels.len() - 1].map(f64::from));
        let lit = (irradiance(&clear) + sun) * (0.3 / PI);
        // Half of the sun is above the horizon at 0°, but it lights no level ground.
        assert!(((ground - lit) / lit).abs().max_element() < 5e-3, "{elevation}: {ground} {lit}");
    }
}

/// The interpolated disc has the sun's irradiance, place and width: what decides shadows.
#[test]
fn the_disc_is_that_of_the_sun() {
    for (degrees, elevation) in [
        (0.2665f64, 0.0f64),
        (0.2665, 3.0),
        (0.2665, 35.17),
        (0.2665, 70.0),
        (0.2665, 89.6),
        (0.2665, 90.0),
        (0.2, 20.0),
        (2.0, 50.0),
    ] {
        let toward = direction(elevation.to_radians(), 0.0);
        let disc = Disc { toward, radius: degrees.to_radians(), irradiance: DVec3::new(3.0, 2.0, 1.0) };
        let grid = Grid { width: 2048, height: 1024 };
        let mut image = Image { width: 2048, height: 1024, pixels: vec![[0.0; 3]; 2048 * 1024] };
        for (index, radiance) in disc.texels(grid) {
            image.pixels[index] = radiance.as_vec3().to_array();
        }
        // Integrals over the interpolated texels: irradiance, mean direction and width.
        let (mut sum, mut mean, mut square) = (0.0, DVec3::ZERO, 0.0);
        const ACROSS: u32 = 4;
        const DOWN: u32 = 16;
        for y in 0..DOWN * 520 {
            let row = &image.pixels[(y / DOWN) as usize * 2048..][..2048];
            let near = (y / DOWN).saturating_sub(1) as usize * 2048;
            let rows = &image.pixels[near..(near + 3 * 2048).min(image.pixels.len())];
            if row.iter().chain(rows).all(|texel| texel[0] == 0.0) {
                continue;
            }
            let y = (f64::from(y) + 0.5) / f64::from(DOWN);
            for x in 0..ACROSS * 2048 {
                let x = (f64::from(x) + 0.5) / f64::from(ACROSS);
                let (radiance, d) = (interpolated(&image, x, y).x, grid.direction(x, y));
                let weight = radiance * (PI * y / 1024.0).sin() * (PI / 1024.0).powi(2);
                let weight = weight / f64::from(ACROSS * DOWN);
                sum += weight;
                mean += d * weight;
                square += weight * (d - toward).length_squared();
            }
        }
        let want = disc.visible_irradiance().x;
        assert!((sum / want - 1.0).abs() < 2e-3, "{elevation}: {sum} {want}");
        let share = disc.visible_share();
        assert!(if elevation == 0.0 { (share - 0.5).abs() < 1e-9 } else { share > 0.999 }, "{share}");
        if elevation > 1.0 {
            let off = (mean / sum - toward).length().to_degrees();
            assert!(off < 0.03, "{elevation}: {off}");
            // Of a uniform disc the mean square of the distance from the centre is half the square
            // of the radius.
            let width = (2.0 * square / sum).sqrt().to_degrees();
            assert!((width / degrees - 1.0).abs() < 0.07, "{elevation}: {width} {degrees}");
        }
    }
}

/// The panorama follows the model, above a border of a texel at the horizon.
#[test]
fn the_panorama_follows_the_model() {
    let mut most = 0f64;
    for (elevation, turbidity) in [(1.0, 3.0), (20.0, 1.0), (45.0, 10.0)] {
        let sky = SunSky { sun_disc: false, ..sky(elevation, turbidity) };
        let (clear, image) = (ClearSky::new(&sky), build(&sky));
        let grid = Grid { width: image.width, height: image.height };
        for i in 0..4000u32 {
            let (u, v) = (f64::from(i) * 0.754_877_666_246_692_7, f64::from(i) * 0.569_840_290_998_053_3);
            let (x, y) =
                (u.fract() * f64::from(image.width), v.fract() * (f64::from(image.height) / 2.0 - 1.0));
            let (is, want) =
                (luminance(interpolated(&image, x, y)), luminance(clear.radiance(grid.direction(x, y))));
            let error = (is / want - 1.0).abs();
            most = most.max(error);
        }
    }
    assert!(most < 0.01, "{most}");
}

#[test]
fn a_sky_has_the_same_bits_each_time() {
    let sky = sky(12.0, 4.0);
    let bits = |image: &Image| image.pixels.as_flattened().iter().map(|c| c.to_bits()).collect::<Vec<_>>();
    let first = build(&sky);
    assert_eq!(bits(&first), bits(&build(&sky)));
    assert_ne!(bits(&first), bits(&build(&SunSky { elevation: 12.000_001, ..sky })));
    assert!(first.pixels.as_flattened().iter().all(|c| c.is_finite() && *c >= 0.0));
}

/// Every corner of the ranges gives numbers.
#[test]
fn all_skies_are_finite() {
    for elevation in [0.0, 1e-9, 45.0, 90.0] {
        for (turbidity, ground_albedo) in [(1.0, 1.0), (10.0, 0.0)] {
            let sky = SunSky { ground_albedo, sun_radius: 5.0, ..sky(elevation, turbidity) };
            sky.check().unwrap();
            let image = build(&sky);
            assert!(image.pixels.as_flattened().iter().all(|c| c.is_finite() && *c >= 0.0), "{sky:?}");
            assert!(image.pixels.iter().any(|pixel| pixel[0] > 0.0), "{sky:?}");
        }
    }
}

/// The sun of a scene stands where its azimuth says, as that of the command line.
#[test]
fn azimuths_go_clockwise_from_minus_z() {
    let brightest = |sky: SunSky| {
        let mut scene = SceneBuilder::new();
        scene.sky(sky).camera(Camera::look_at([0.0, 0.0, 1.0], [0.0; 3]));
        let environment = scene.build().unwrap().environment.unwrap();
        let (index, _) = environment.texels.iter().enumerate().fold((0, 0.0), |best, (index, texel)| {
            if texel.radiance.x > best.1 { (index, texel.radiance.x) } else { best }
        });
        let grid = Grid { width: environment.width, height: environment.height };
        let (x, y) = (index as u32 % grid.width, index as u32 / grid.width);
        let d = grid.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let (s, c) = environment.rotation.sin_cos();
        DVec3::new(d.x * c + d.z * s, d.y, d.z * c - d.x * s)
    };
    let toward = [(0.0, DVec3::NEG_Z), (90.0, DVec3::X), (180.0, DVec3::Z), (270.0, DVec3::NEG_X)];
    for (azimuth, toward) in toward {
        assert!(
            (brightest(SunSky { turbidity: 1.0, ..SunSky::new(azimuth, 0.0) }) - toward).length() < 0.006,
            "{azimuth}"
        );
        assert!((brightest(SunSky::new(azimuth, 90.0)) - DVec3::Y).length() < 0.006, "{azimuth}");
    }
    let toward = DVec3::new(1.0, 2.0, -3.0);
    assert!((brightest(SunSky::toward(toward)) - toward.normalize()).length() < 0.006);
    assert_eq!(angles(DVec3::new(0.0, 2.0, 0.0)), (0.0, 90.0));
    assert_eq!(angles(DVec3::new(-3.0, 0.0, 0.0)), (-90.0, 0.0));
}

#[test]
fn numbers_out_of_range_are_refused() {
    let good = SunSky::new(30.0, 40.0);
    assert!(good.check().is_ok());
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for (name, sky) in [
            ("azimuth", SunSky { azimuth: bad, ..good }),
            ("elevation", SunSky { elevation: bad, ..good }),
            ("turbidity", SunSky { turbidity: bad, ..good }),
            ("ground_albedo", SunSky { ground_albedo: bad, ..good }),
            ("sun_radius", SunSky { sun_radius: bad, ..good }),
            ("scale", SunSky { scale: bad, ..good }),
        ] {
            assert!(sky.check().unwrap_err().starts_with(name), "{sky:?}");
            let mut scene = SceneBuilder::new();
            scene.sky(sky).camera(Camera::look_at([0.0, 0.0, 1.0], [0.0; 3]));
            let error = scene.build().unwrap_err().to_string();
            assert!(error.contains(&format!("the sky: {name}")), "{error}");
        }
    }
    for sky in [
        SunSky { elevation: -0.1, ..good },
        SunSky { elevation: 90.1, ..good },
        SunSky { turbidity: 0.9, ..good },
        SunSky { turbidity: 10.1, ..good },
        SunSky { ground_albedo: 1.1, ..good },
        SunSky { sun_radius: 0.1, ..good },
        SunSky { sun_radius: 5.1, ..good },
        SunSky { scale: -1.0, ..good },
        SunSky::toward([0.0, -1.0, 1.0]),
    ] {
        assert!(sky.check().is_err(), "{sky:?}");
    }
}

/// A ray to the horizon leaves the atmosphere where the sphere does.
#[test]
fn distances_are_those_of_a_sphere() {
    let top = EARTH + 80.0;
    assert!((distance_to_top(0.0, 1.0) - 80.0).abs() < 1e-9);
    assert!((distance_to_top(0.0, 0.0) - (top * top - EARTH * EARTH).sqrt()).abs() < 1e-9);
    assert!((distance_to_top(80.0, -1.0) - 2.0 * top).abs() < 1e-6);
    assert!(Air::new(1.0).sunlight_at(0.0, -0.1).is_none());
}
