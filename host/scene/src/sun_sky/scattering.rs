//! Light that was scattered more than once, or reflected by the ground: successive orders of
//! scattering in plane layers, for one height of the sun.
//!
//! The source of scattered light in a layer, J, is the scattering of sunlight, J₁, and that of the
//! light in the layer, which follows from J along all directions. Iteration adds one order at a
//! time (Lenoble, Radiative Transfer in Scattering and Absorbing Atmospheres, 1985). Sunlight is
//! attenuated by curved air; only the scattered light sees plane layers.

use super::air::{AEROSOL_ALBEDO, Air, TOP, aerosol_phase, air_phase, between, column_to_top, direction};
use super::quadrature::Gauss;
use super::spectrum::WAVELENGTHS;
use glam::DVec3;
use libm::exp;
use std::f64::consts::{PI, TAU};

/// Number of layers.
const LAYERS: usize = 20;
/// Number of layers from the ground on that have aerosol: above them is less than 1 / 4000 of it.
const HAZY: usize = 9;
/// Number of heights of directions between the horizon and straight up.
const HEIGHTS: usize = 8;
/// Number of azimuths between that of the sun and its opposite.
const AZIMUTHS: usize = 12;
/// Number of directions above the horizon on one side of the sun; as many are below.
const ABOVE: usize = HEIGHTS * AZIMUTHS;
/// Number of all directions on one side of the sun.
const DIRECTIONS: usize = 2 * ABOVE;
/// Maximum number of orders of scattering.
const ORDERS: usize = if cfg!(fuzzing) { 1 } else { 40 };
/// Iteration ends with the order that changes no radiance by more than this share.
const CONVERGED: f64 = 1e-4;

/// A number for each layer, from the ground up.
type Layers = [f64; LAYERS];

/// Returns the altitude of a border of layers in kilometres; border 0 is the ground.
fn border(index: usize) -> f64 {
    TOP * libm::pow(index as f64 / LAYERS as f64, 2.5)
}

/// Directions in which light is transported, on one side of the sun: first those above the horizon,
/// by height, then their mirror images below it.
#[derive(Debug)]
pub(super) struct Directions {
    /// Sines of the heights above the horizon.
    sines: [f64; HEIGHTS],
    /// Solid angle of each direction, with its mirror image on the other side of the sun.
    weights: [f64; HEIGHTS],
    /// Unit vectors; the sun is over -z.
    vectors: Vec<DVec3>,
    /// Row for each direction: the share of light from each other one, with its mirror image, that
    /// aerosol scatters there. Each row sums to 1.
    aerosol: Vec<f64>,
}

impl Directions {
    /// Makes the directions.
    pub fn new() -> Self {
        let gauss = Gauss::<HEIGHTS>::new();
        let (mut sines, mut weights) = ([0.0; HEIGHTS], [0.0; HEIGHTS]);
        for (i, (sine, weight)) in gauss.points().enumerate() {
            (sines[i], weights[i]) = (sine, weight * TAU / AZIMUTHS as f64);
        }
        let mut vectors = Vec::with_capacity(DIRECTIONS);
        for sign in [1.0, -1.0] {
            for sine in sines {
                let azimuth = |m: usize| PI * (m as f64 + 0.5) / AZIMUTHS as f64;
                vectors.extend((0..AZIMUTHS).map(|m| direction(sign * libm::asin(sine), azimuth(m))));
            }
        }
        let mut aerosol = Vec::with_capacity(DIRECTIONS * DIRECTIONS);
        for to in &vectors {
            let row = aerosol.len();
            aerosol.extend(vectors.iter().enumerate().map(|(index, from)| {
                let mirrored = DVec3::new(-from.x, from.y, from.z);
                let both = aerosol_phase(to.dot(*from)) + aerosol_phase(to.dot(mirrored));
                0.5 * both * weights[index % ABOVE / AZIMUTHS]
            }));
            let sum: f64 = aerosol[row..].iter().sum();
            aerosol[row..].iter_mut().for_each(|share| *share /= sum);
        }
        Self { sines, weights, vectors, aerosol }
    }
}

/// Light that was scattered more than once, for sunlight of irradiance 1 at each wavelength.
#[derive(Debug)]
pub(super) struct Scattered {
    /// Sources per wavelength, by direction and layer: the radiance that a ray gains per optical
    /// depth.
    sources: Vec<Vec<Layers>>,
    /// Altitudes of the middle of the layers.
    middles: Layers,
    /// Sines of the heights of directions.
    sines: [f64; HEIGHTS],
}

/// Optical properties of the layers at one wavelength.
struct Optics {
    /// Optical depth, straight up.
    depth: Layers,
    /// Share of extinction that is scattering by air, and by aerosol.
    scattering: [Layers; 2],
}

impl Scattered {
    /// Computes the light under a sun whose height above the horizon, at the ground, has this sine.
    pub fn new(air: &Air, directions: &Directions, sun_sine: f64, ground_albedo: f64) -> Self {
        let sun = direction(libm::asin(sun_sine), 0.0);
        let middles: Layers = std::array::from_fn(|k| 0.5 * (border(k) + border(k + 1)));
        let columns: [_; LAYERS] = std::array::from_fn(|k| between(border(k), border(k + 1)));
        let sunlit = middles.map(|altitude| column_to_top(altitude, sun_sine));
        let ground = column_to_top(0.0, sun_sine);
        let sources = (0..WAVELENGTHS).map(|index| {
            let depths = air.depths[index];
            let pass =
                |column| exp(-depths.iter().zip(column).map(|(depth, part)| depth * part).sum::<f64>());
            let of = |k: usize, kind: usize| depths[kind] * columns[k][kind];
            let depth: Layers = std::array::from_fn(|k| of(k, 0) + of(k, 1) + of(k, 2));
            let share = |kind: usize, albedo: f64| std::array::from_fn(|k| albedo * of(k, kind) / depth[k]);
            let optics = Optics { depth, scattering: [share(0, 1.0), share(1, AEROSOL_ALBEDO)] };
            let sunlight = sunlit.map(|column| column.map_or(0.0, pass));
            let reflected = ground_albedo / PI;
            let from_ground = reflected * sun_sine.max(0.0) * ground.map_or(0.0, pass);
            optics.solve(directions, sun, &sunlight, (from_ground, reflected))
        });
        Self { sources: sources.collect(), middles, sines: directions.sines }
    }

    /// Returns where the sources for a ray are found: at an altitude, along a direction with this
    /// sine of its height, and this angle from the sun about the vertical, from 0 to π.
    pub fn place(&self, altitude: f64, sine: f64, azimuth: f64) -> Place {
        let (low, up) = position(&self.middles, altitude);
        let (height, higher) = position(&self.sines, sine.abs());
        let around = (azimuth / PI * AZIMUTHS as f64 - 0.5).clamp(0.0, (AZIMUTHS - 1) as f64);
        let side = (around as usize).min(AZIMUTHS - 2);
        let first = if sine < 0.0 { ABOVE } else { 0 };
        Place {
            layer: low,
            up,
            direction: first + height * AZIMUTHS + side,
            higher,
            around: around - side as f64,
        }
    }

    /// Returns the source at a place: the radiance that a ray gains per optical depth.
    pub fn source(&self, wavelength: usize, place: &Place) -> f64 {
        let sources = &self.sources[wavelength];
        let at = |direction: usize| {
            let layers = &sources[direction];
            layers[place.layer] + (layers[place.layer + 1] - layers[place.layer]) * place.up
        };
        let along = |direction: usize| at(direction) + (at(direction + 1) - at(direction)) * place.around;
        let (low, high) = (along(place.direction), along(place.direction + AZIMUTHS));
        low + (high - low) * place.higher
    }
}

/// Place between layers and directions.
#[derive(Debug)]
pub(super) struct Place {
    /// Layer below, and how far the place is towards the one above.
    layer: usize,
    up: f64,
    /// Direction below and nearer to the sun, and how far the place is towards those above and
    /// farther from it.
    direction: usize,
    higher: f64,
    around: f64,
}

/// Returns the index of the number at or below `x`, which has one above it, and how far `x` is
/// towards that, from 0 to 1.
fn position(ascending: &[f64], x: f64) -> (usize, f64) {
    let above = ascending.partition_point(|&number| number <= x).clamp(1, ascending.len() - 1);
    let (low, high) = (ascending[above - 1], ascending[above]);
    (above - 1, ((x - low) / (high - low)).clamp(0.0, 1.0))
}

impl Optics {
    /// Returns the source of light that was scattered at least twice, or reflected by the ground
    /// before, by direction and layer. `sunlight` is that in the layers, `ground` what the ground
    /// reflects of the sun, and the share of the sky's irradiance that it reflects.
    fn solve(
        &self,
        directions: &Directions,
        sun: DVec3,
        sunlight: &Layers,
        ground: (f64, f64),
    ) -> Vec<Layers> {
        let vectors = &directions.vectors;
        let first = vectors.iter().map(|view| {
            let cosine = view.dot(sun);
            let (air, aerosol) = (air_phase(cosine), aerosol_phase(cosine));
            std::array::from_fn(|k| {
                sunlight[k] * (self.scattering[0][k] * air + self.scattering[1][k] * aerosol)
            })
        });
        let first: Vec<Layers> = first.collect();
        let mut more = vec![[0.0; LAYERS]; vectors.len()];
        for _ in 0..ORDERS {
            let light = self.transport(directions, &first, &more, ground);
            let next = self.scatter(directions, &light);
            let change = next.iter().flatten().zip(more.iter().flatten()).map(|(a, b)| (a - b).abs());
            let (change, most) =
                (change.fold(0.0, f64::max), next.iter().flatten().copied().fold(0.0, f64::max));
            more = next;
            if change <= CONVERGED * most {
                break;
            }
        }
        more
    }

    /// Returns the mean radiance in each layer that these sources make, by the direction from which
    /// it comes.
    fn transport(
        &self,
        directions: &Directions,
        first: &[Layers],
        more: &[Layers],
        (from_ground, reflected): (f64, f64),
    ) -> Vec<Layers> {
        let mut light = vec![[0.0; LAYERS]; DIRECTIONS];
        let mut irradiance = 0.0;
        for (height, &sine) in directions.sines.iter().enumerate() {
            let pass = self.depth.map(|depth| exp(-depth / sine));
            for index in height * AZIMUTHS..(height + 1) * AZIMUTHS {
                let mut arriving = 0.0;
                for k in (0..LAYERS).rev() {
                    let source = first[index][k] + more[index][k];
                    arriving = self.cross(k, sine, pass[k], source, arriving, &mut light[index][k]);
                }
                irradiance += arriving * sine * directions.weights[height];
            }
        }
        let ground = from_ground + reflected * irradiance;
        for (height, &sine) in directions.sines.iter().enumerate() {
            let pass = self.depth.map(|depth| exp(-depth / sine));
            for index in ABOVE + height * AZIMUTHS..ABOVE + (height + 1) * AZIMUTHS {
                let mut arriving = ground;
                for k in 0..LAYERS {
                    let source = first[index][k] + more[index][k];
                    arriving = self.cross(k, sine, pass[k], source, arriving, &mut light[index][k]);
                }
            }
        }
        light
    }

    /// Returns the radiance behind a layer for that in front of it, and sets its mean in the layer.
    fn cross(&self, k: usize, sine: f64, pass: f64, source: f64, before: f64, mean: &mut f64) -> f64 {
        let depth = self.depth[k] / sine;
        // (1 - e^-x) / x, without cancellation.
        let share = if depth < 1e-4 { 1.0 - 0.5 * depth } else { (1.0 - pass) / depth };
        *mean = source + (before - source) * share;
        source + (before - source) * pass
    }

    /// Returns the source that scattering of this light is.
    fn scatter(&self, directions: &Directions, light: &[Layers]) -> Vec<Layers> {
        let moments = Moments::of(directions, light);
        let mut sources = Vec::with_capacity(light.len());
        for (index, view) in directions.vectors.iter().enumerate() {
            let mut hazy = [0.0; HAZY];
            let row = &directions.aerosol[index * light.len()..(index + 1) * light.len()];
            for (share, light) in row.iter().zip(light) {
                for (sum, light) in hazy.iter_mut().zip(light) {
                    *sum += share * light;
                }
            }
            let mut source: Layers =
                std::array::from_fn(|k| self.scattering[0][k] * moments.scattered(k, *view));
            for (k, hazy) in hazy.iter().enumerate() {
                source[k] += self.scattering[1][k] * hazy;
            }
            sources.push(source);
        }
        sources
    }
}

/// Integrals of the light in each layer that decide how air scatters it: its phase function is one
/// of the square of the cosine.
struct Moments {
    all: Layers,
    xx: Layers,
    yy: Layers,
    zz: Layers,
    yz: Layers,
}

impl Moments {
    fn of(directions: &Directions, light: &[Layers]) -> Self {
        let none = || [0.0; LAYERS];
        let mut moments = Self { all: none(), xx: none(), yy: none(), zz: none(), yz: none() };
        for (index, (light, d)) in light.iter().zip(&directions.vectors).enumerate() {
            let weight = directions.weights[index % ABOVE / AZIMUTHS];
            for k in 0..LAYERS {
                let light = light[k] * weight;
                moments.all[k] += light;
                moments.xx[k] += light * (d.x * d.x);
                moments.yy[k] += light * (d.y * d.y);
                moments.zz[k] += light * (d.z * d.z);
                moments.yz[k] += light * (d.y * d.z);
            }
        }
        moments
    }

    /// Returns the light that air scatters into a direction.
    fn scattered(&self, k: usize, d: DVec3) -> f64 {
        let squares = d.x * d.x * self.xx[k] + d.y * d.y * self.yy[k] + d.z * d.z * self.zz[k];
        3.0 / (16.0 * PI) * (self.all[k] + squares + 2.0 * d.y * d.z * self.yz[k])
    }
}

#[cfg(test)]
mod tests;
