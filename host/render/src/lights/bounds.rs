//! Bounds of lights: where they are, where they point, and how strong they are.

use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Bounds of one or more lights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Least corner of their box; of infinitely far lights, of the unit vectors towards them.
    pub low: DVec3,
    /// Greatest corner of their box.
    pub high: DVec3,
    pub cone: Cone,
    /// Greatest angle, in radians, to its normal at which a light sends light.
    pub end: f64,
    /// Sum of their radiant intensities along their normals; of infinitely far lights, of their
    /// irradiances.
    pub strength: f64,
}

impl Bounds {
    /// Returns the bounds of what two bounds hold.
    pub fn and(&self, other: &Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            cone: self.cone.and(&other.cone),
            end: self.end.max(other.end),
            strength: self.strength + other.strength,
        }
    }

    /// Returns the middle of the box.
    pub fn middle(&self) -> DVec3 {
        0.5 * (self.low + self.high)
    }

    /// Returns what the lights may cost as one group: strength, times a measure of their box, times
    /// a measure of the directions that they light (Conty Estevez and Kulla 2018, section 4.4).
    pub fn cost(&self) -> f64 {
        let size = self.high - self.low;
        let area = size.x * size.y + size.y * size.z + size.z * size.x;
        // Lights on a line have no area.
        let measure = area + 0.01 * size.length_squared();
        self.strength * measure * self.cone.measure(self.end)
    }
}

/// Cone of directions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    /// Unit vector.
    pub axis: DVec3,
    /// Angle from the axis to the border, in radians: 0 to π.
    pub angle: f64,
}

impl Cone {
    /// All directions.
    pub const ALL: Self = Self { axis: DVec3::Z, angle: PI };

    /// Returns a cone that contains both.
    fn and(&self, other: &Self) -> Self {
        let (wide, narrow) = if self.angle >= other.angle { (self, other) } else { (other, self) };
        let between = wide.axis.dot(narrow.axis).clamp(-1.0, 1.0).acos();
        if (between + narrow.angle).min(PI) <= wide.angle {
            return *wide;
        }
        let angle = 0.5 * (wide.angle + between + narrow.angle);
        // Towards the other axis; none of a pair of opposite ones is nearer.
        let across = (narrow.axis - wide.axis * wide.axis.dot(narrow.axis)).normalize_or_zero();
        if angle >= PI || across == DVec3::ZERO {
            return Self { axis: wide.axis, angle: PI };
        }
        let (sine, cosine) = (angle - wide.angle).sin_cos();
        Self { axis: (wide.axis * cosine + across * sine).normalize(), angle }
    }

    /// Returns the solid angle that lights with these normals light, up to the angle `end` from
    /// each, weighted by the cosine beyond the cone (equation 1 of the paper).
    fn measure(&self, end: f64) -> f64 {
        let (o, w) = (self.angle, (self.angle + end.min(FRAC_PI_2)).min(PI));
        let beyond = 2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos();
        2.0 * PI * (1.0 - o.cos()) + FRAC_PI_2 * beyond
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_contains_both() {
        let axes =
            [DVec3::X, DVec3::Z, DVec3::NEG_Z, DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.48, -0.6, 0.64)];
        for a in axes {
            for b in axes {
                for (wide, narrow) in [(0.0, 0.0), (0.3, 0.0), (1.0, 0.7), (3.0, 0.2), (PI, 0.1)] {
                    let cones = [Cone { axis: a, angle: wide }, Cone { axis: b, angle: narrow }];
                    let both = cones[0].and(&cones[1]);
                    for cone in cones {
                        let between = both.axis.dot(cone.axis).clamp(-1.0, 1.0).acos();
                        assert!(
                            both.angle >= PI || between + cone.angle < both.angle + 1e-7,
                            "{both:?} {cone:?}"
                        );
                    }
                }
            }
        }
    }

    /// Closed forms: all directions, a hemisphere weighted by the cosine, and none.
    #[test]
    fn measures_are_those_of_the_paper() {
        let of = |angle, end| Cone { axis: DVec3::Z, angle }.measure(end);
        assert!((of(PI, 0.0) - 4.0 * PI).abs() < 1e-12);
        assert!((of(0.0, FRAC_PI_2) - PI).abs() < 1e-12, "{}", of(0.0, FRAC_PI_2));
        assert!(of(0.0, 0.0).abs() < 1e-12);
    }
}
