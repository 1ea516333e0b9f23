//! Writes a scene with many small lights: a hall of spheres under lamps of different power and
//! colour.
//!
//! ```text
//! cargo generate-scene many_lights 1000 > scenes/many_lights.ron
//! ```
//!
//! The count may be 1 to 1,000,000. The area of a lamp shrinks as their number grows, so all lamps
//! together emit about the same. Half of them are spheres, half are squares that face down.

use std::error::Error;
use std::f64::consts::PI;
use std::fmt::Write;

/// Radiance of the weakest of [`LEVELS`] levels. Each further level doubles it.
const RADIANCE: f64 = 0.75;
const LEVELS: u32 = 8;
/// Half the width and depth of the hall.
const HALL: f64 = 8.0;

/// Spheres in the hall: centre, radius and material.
const SPHERES: [([f64; 3], f64, &str); 9] = [
    ([-4.5, 1.0, -2.0], 1.0, "clay"),
    ([-1.8, 1.2, -3.5], 1.2, "steel"),
    ([1.6, 1.0, -2.2], 1.0, "glass"),
    ([4.6, 1.3, -3.0], 1.3, "chalk"),
    ([-3.2, 0.7, 1.4], 0.7, "brass"),
    ([-0.4, 0.8, 0.6], 0.8, "chalk"),
    ([2.6, 0.6, 1.6], 0.6, "clay"),
    ([5.2, 0.7, 0.4], 0.7, "steel"),
    ([0.9, 0.4, 3.2], 0.4, "brass"),
];

fn main() -> Result<(), Box<dyn Error>> {
    let count = std::env::args().nth(1).ok_or("usage: many_lights COUNT")?.parse()?;
    if !(1..=1_000_000).contains(&count) {
        return Err("the count is 1 to 1,000,000".into());
    }
    print!("{}", scene(count)?);
    Ok(())
}

fn scene(count: u32) -> Result<String, std::fmt::Error> {
    // A sphere of this radius and a square of half side `side` have equal emitting areas.
    let radius = 0.03 * (1000.0 / f64::from(count)).sqrt();
    let side = radius * PI.sqrt();
    let mut lamps = String::new();
    let mut random = Random(1);
    for index in 0..count {
        let [x, y, z] = place(&mut random, radius);
        let material =
            format!("{}{}", ["warm", "white", "cold"][random.below(3) as usize], random.below(LEVELS));
        if index % 2 == 0 {
            writeln!(
                lamps,
                "        Sphere(center: ({x:.4}, {y:.4}, {z:.4}), radius: {radius:.5}, material: \"{material}\"),"
            )?;
        } else {
            let (x, z, width) = (x - side, z - side, 2.0 * side);
            writeln!(
                lamps,
                "        Quad(corner: ({x:.4}, {y:.4}, {z:.4}), u: ({width:.5}, 0, 0), v: (0, 0, {width:.5}), material: \"{material}\"),"
            )?;
        }
    }
    let mut materials = String::new();
    for (name, color) in [("warm", [1.0, 0.7, 0.4]), ("white", [1.0, 0.95, 0.9]), ("cold", [0.5, 0.75, 1.0])]
    {
        for level in 0..LEVELS {
            let [r, g, b] = color.map(|c| c * RADIANCE * f64::from(1 << level));
            writeln!(materials, "        \"{name}{level}\": Emissive(radiance: ({r}, {g}, {b})),")?;
        }
    }
    let mut spheres = String::new();
    for ([x, y, z], radius, material) in SPHERES {
        writeln!(
            spheres,
            "        Sphere(center: ({x}, {y}, {z}), radius: {radius}, material: \"{material}\"),"
        )?;
    }
    let lights = if count == 1 { "light" } else { "lights" };
    Ok(format!(
        r#"// Many small lights: how well they are chosen from. Made for this project; CC0-1.0.
// Written by cargo generate-scene many_lights with the count {count}; do not edit.
Scene(
    version: 1,
    about: "A hall with {count} {lights}.",
    image: (width: 640, height: 360, samples: 64, depth: 6),
    camera: (look_from: (0, 4.5, 11.5), look_at: (0, 1, -0.5), vertical_fov: 38),
    sky: Black,
    materials: {{
        "floor": Lambertian(albedo: (0.55, 0.53, 0.5)),
        "wall": Lambertian(albedo: (0.6, 0.6, 0.62)),
        "clay": Lambertian(albedo: (0.7, 0.3, 0.2)),
        "chalk": Lambertian(albedo: (0.8, 0.8, 0.78)),
        "glass": Dielectric(ior: 1.5),
        "steel": Conductor(fresnel: Schlick(reflectance: (0.56, 0.57, 0.58)), roughness: 0.3),
        "brass": Conductor(fresnel: Schlick(reflectance: (0.89, 0.75, 0.42)), roughness: 0.45),
{materials}    }},
    objects: [
        Quad(corner: (-{HALL}, 0, {HALL}), u: (16, 0, 0), v: (0, 0, -16), material: "floor"),
        Quad(corner: (-{HALL}, 0, -{HALL}), u: (16, 0, 0), v: (0, 6, 0), material: "wall"),
        Quad(corner: (-{HALL}, 0, {HALL}), u: (0, 0, -16), v: (0, 6, 0), material: "wall"),
        Quad(corner: ({HALL}, 0, -{HALL}), u: (0, 0, 16), v: (0, 6, 0), material: "wall"),
{spheres}{lamps}    ],
)
"#
    ))
}

/// Returns a place in the hall at which a lamp touches no sphere, floor or wall.
fn place(random: &mut Random, radius: f64) -> [f64; 3] {
    let reach = 2.0 * radius; // 1.3 times this exceeds a square lamp's half diagonal, 2.51 radii
    loop {
        let x = (random.share() * 2.0 - 1.0) * (HALL - 1.3 * reach);
        let z = (random.share() * 2.0 - 1.0) * (HALL - 1.3 * reach);
        let low = 0.1 + reach;
        let y = low + random.share() * (5.0 - low);
        let free = SPHERES.iter().all(|([a, b, c], r, _)| {
            let distance = ((x - a).powi(2) + (y - b).powi(2) + (z - c).powi(2)).sqrt();
            distance > r + 1.3 * reach
        });
        if free {
            return [x, y, z];
        }
    }
}

/// Random numbers: PCG's RXS-M-XS (O'Neill 2014) on a counter.
struct Random(u32);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((self.0 >> ((self.0 >> 28) + 4)) ^ self.0).wrapping_mul(277_803_737);
        (word >> 22) ^ word
    }

    /// Returns a uniform number in [0, 1).
    fn share(&mut self) -> f64 {
        f64::from(self.next()) / 4_294_967_296.0
    }

    fn below(&mut self, limit: u32) -> u32 {
        (self.share() * f64::from(limit)) as u32
    }
}
