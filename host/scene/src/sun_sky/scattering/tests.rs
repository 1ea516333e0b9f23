//! Tests of the transport of light through layers.

use super::*;

/// Air alone over a white ground absorbs nothing: all light that comes in goes out again.
#[test]
fn no_light_is_lost() {
    let directions = Directions::new();
    let columns: Layers = std::array::from_fn(|k| between(border(k), border(k + 1))[0]);
    for (depth, sine) in [(0.1, 0.9), (0.5, 0.6), (1.0, 0.9)] {
        let depths = columns.map(|column| depth * column);
        let optics = Optics { depth: depths, scattering: [[1.0; LAYERS], [0.0; LAYERS]] };
        // Sunlight through plane layers, exactly averaged over each.
        let mut passed = 1.0;
        let mut sunlight = [0.0; LAYERS];
        for k in (0..LAYERS).rev() {
            let behind = passed * exp(-depths[k] / sine);
            sunlight[k] = (passed - behind) * sine / depths[k];
            passed = behind;
        }
        let sun = direction(libm::asin(sine), 0.0);
        let ground = (sine * passed / PI, 1.0 / PI);
        let more = optics.solve(&directions, sun, &sunlight, ground);
        // Light that leaves the top: what the ground sends up, and the sources of all layers.
        let mut out = 0.0;
        let mut irradiance = 0.0;
        let source = |index: usize, k: usize| {
            let cosine = directions.vectors[index].dot(sun);
            sunlight[k] * air_phase(cosine) + more[index][k]
        };
        for index in 0..ABOVE {
            let sine = directions.sines[index / AZIMUTHS];
            let weight = directions.weights[index / AZIMUTHS] * sine;
            let mut down = 0.0;
            for k in (0..LAYERS).rev() {
                let pass = exp(-depths[k] / sine);
                down = source(index, k) + (down - source(index, k)) * pass;
            }
            irradiance += weight * down;
        }
        let from_ground = ground.0 + ground.1 * irradiance;
        for index in 0..ABOVE {
            let sine = directions.sines[index / AZIMUTHS];
            let weight = directions.weights[index / AZIMUTHS] * sine;
            let mut up = from_ground;
            for (k, depth) in depths.iter().enumerate() {
                let pass = exp(-depth / sine);
                up = source(ABOVE + index, k) + (up - source(ABOVE + index, k)) * pass;
            }
            out += weight * up;
        }
        assert!((out / sine - 1.0).abs() < 3e-3, "{depth} {sine}: {}", out / sine);
    }
}

#[test]
fn positions_are_clamped() {
    let numbers = [1.0, 2.0, 4.0];
    assert_eq!(position(&numbers, 0.0), (0, 0.0));
    assert_eq!(position(&numbers, 3.0), (1, 0.5));
    assert_eq!(position(&numbers, 9.0), (1, 1.0));
}
