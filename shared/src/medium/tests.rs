use super::*;

#[test]
fn boundaries_nest() {
    let inside = MediumStack::EMPTY.cross(1, true).cross(2, true).cross(3, true);
    assert_eq!(inside.innermost(), 3);
    assert_eq!(inside.cross(3, false).innermost(), 2);
    // Overlapping boundaries may be left in any order.
    assert_eq!(inside.cross(1, false), MediumStack::EMPTY.cross(2, true).cross(3, true));
    assert_eq!(inside.cross(2, false), MediumStack::EMPTY.cross(1, true).cross(3, true));
    let deep = inside.cross(4, true);
    assert_eq!(deep.cross(1, false), MediumStack::EMPTY.cross(2, true).cross(3, true).cross(4, true));
    // One that is not closed, or bounds nothing, changes nothing.
    for id in [0, 7] {
        assert_eq!(inside.cross(id, false), inside);
    }
    assert_eq!(inside.cross(0, true), inside);
    assert_eq!(inside.cross(CLEAR, true).innermost(), 0);
    assert_eq!(inside.cross(CLEAR, true).cross(CLEAR, false), inside);
}

#[test]
fn a_fifth_medium_replaces_the_outermost() {
    let mut stack = MediumStack::EMPTY;
    for id in 1..=5 {
        stack = stack.cross(id, true);
    }
    assert_eq!(stack.innermost(), 5);
    for id in [5, 4, 3, 2] {
        stack = stack.cross(id, false);
    }
    assert_eq!(stack, MediumStack::EMPTY);
}

/// Extinctions from none to that of a wall give finite weights of the channels that carry light.
#[test]
fn weights_are_finite() {
    let sizes = [0.0, 1e-18, 1e-3, 1.0, 1e9, 1e18];
    for red in sizes {
        for green in sizes {
            for carries in [Vec3::ONE, Vec3::new(1.0, 1e-20, 0.0), Vec3::ZERO, Vec3::splat(1e30)] {
                for random in [0, 0x5555_5555, 0xaaaa_aaaa, u32::MAX] {
                    let extinction = Vec3::new(red, green, 0.5);
                    let hero = Hero::choose(extinction, carries, random);
                    let ways = [(0.0, 0.0), (1e30, 0.0), (1e-9, 1.0), (1.0, 1.0), (3.0, 1024.0)];
                    // A channel without extinction has no collisions.
                    let possible = if hero.extinction > 0.0 { &ways } else { &ways[..2] };
                    for &(depth, collisions) in possible {
                        let weight = hero.weight(extinction, depth, collisions);
                        assert!(weight.is_finite() && weight.min_element() >= 0.0, "{extinction} {weight}");
                    }
                }
            }
        }
    }
}

#[test]
fn transmittance_is_an_exponential() {
    for (sigma, distance) in [(0.5f32, 2.0f32), (3.0, 0.7), (1e-3, 10.0), (20.0, 1.0)] {
        let want = libm::exp(-f64::from(sigma) * f64::from(distance));
        let got = f64::from(transmittance(Vec3::splat(sigma), distance).x);
        assert!((got / want - 1.0).abs() < 1e-5, "{sigma} {distance}: {got} {want}");
    }
    assert_eq!(transmittance(Vec3::ZERO, 1e30), Vec3::ONE);
    assert!(transmittance(Vec3::splat(1e9), 1.0).x < 1e-37);
}
