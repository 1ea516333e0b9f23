//! Makes scenes of any number of spheres, all seen by the same camera.

use super::BenchError;
use glam::DVec3;
use trisect::render::Fresnel;
use trisect::scene::description::{
    Description, Dielectric, Lambertian, Material, Metal, Shape, ShapeKind, Sky,
};
use trisect::scene::{CameraPose, ImageSettings, SceneDocument};

/// Maximum number of spheres of a scene.
pub const MAX_COUNT: u32 = 10_000_000;

/// Half the side of the square on which the small spheres stand, as in the book ("Ray Tracing in
/// One Weekend").
const HALF_SIDE: f64 = 11.0;

/// Radius of the ground sphere.
const GROUND: f64 = 1000.0;

/// Number of materials of the small spheres. It is fixed, so that the size of the table does not
/// vary with the number of spheres.
const PALETTE: u64 = 256;

/// Positions along x of the three large spheres, which stand on the ground in a row.
const LARGE: [f64; 3] = [0.0, -4.0, 4.0];

/// Returns a scene of `count` spheres like the final scene of "Ray Tracing in One Weekend": the
/// ground, three large spheres (glass, diffuse, metal), and small ones on a jittered grid, four
/// fifths diffuse, the others metal and glass. The more small spheres there are, the smaller they
/// are: they cover the same share of the same square. The camera is the book's. So the parts of the
/// image keep their size, and a path has about as many segments for each count. Equal counts make
/// equal scenes, bit by bit.
///
/// # Errors
///
/// [`BenchError::SphereCount`] unless `count` is 1 to [`MAX_COUNT`].
pub fn sphere_scene(count: u32) -> Result<SceneDocument, BenchError> {
    if count == 0 || count > MAX_COUNT {
        return Err(BenchError::SphereCount { count, greatest: MAX_COUNT });
    }
    let sphere = |center, radius, material| Shape { kind: ShapeKind::Sphere { center, radius }, material };
    let mut shapes = vec![sphere(DVec3::new(0.0, -GROUND, 0.0), GROUND, 0)];
    shapes.extend((1..).zip(LARGE).map(|(material, x)| sphere(on_ground(x, 0.0, 1.0), 1.0, material)));
    shapes.truncate(count as usize);
    let small = count as usize - shapes.len();
    let places = places(small);
    // Takes places at even distances in the list, so that unused places are spread over the square.
    for index in 0..small {
        let (center, radius, cell) = places[index * places.len() / small];
        let material = fixed_materials().len() + (hash(cell, 2) % PALETTE) as usize;
        shapes.push(sphere(center, radius, material));
    }
    let mut materials = fixed_materials();
    materials.extend((0..PALETTE).map(palette));
    let description = Description {
        cameras: vec![("book".to_owned(), camera())],
        materials,
        shapes,
        sky: Some(Sky::Gradient { bottom: DVec3::ONE, top: DVec3::new(0.5, 0.7, 1.0) }),
        ..Description::default()
    };
    let image = ImageSettings { width: 1280, height: 720, samples: 16, depth: 50, fresnel: Fresnel::Schlick };
    Ok(SceneDocument::of_description(description, image, &format!("{count} spheres")))
}

/// Returns centre, radius and cell of at least `count` small spheres that do not touch the large
/// ones, on a grid that is little finer than necessary for that.
fn places(count: usize) -> Vec<(DVec3, f64, u64)> {
    let mut side = (count as f64).sqrt().ceil() as u64;
    loop {
        let cell = 2.0 * HALF_SIDE / side.max(1) as f64;
        let radius = 0.2 * cell;
        let mut places = Vec::with_capacity((side * side) as usize);
        for index in 0..side * side {
            // The jitter keeps each sphere within its cell, as in the book.
            let place =
                |column: u64, draw| (column as f64 + 0.2 + 0.6 * unit(index, draw)) * cell - HALF_SIDE;
            let center = on_ground(place(index % side, 0), place(index / side, 1), radius);
            let clear = LARGE.iter().all(|&x| center.distance(on_ground(x, 0.0, 1.0)) > 1.0 + radius);
            if clear {
                places.push((center, radius, index));
            }
        }
        if places.len() >= count {
            return places;
        }
        side += 1 + side / 200;
    }
}

/// Returns the centre of a sphere that touches the ground sphere below (x, z).
fn on_ground(x: f64, z: f64, radius: f64) -> DVec3 {
    let reach = GROUND + radius;
    DVec3::new(x, (reach * reach - x * x - z * z).sqrt() - GROUND, z)
}

/// Returns the book's four fixed materials: ground, glass, brown, mirror.
fn fixed_materials() -> Vec<Material> {
    vec![
        Material::from(Lambertian::rgb(0.5, 0.5, 0.5)).named("ground"),
        Material::from(Dielectric { ior: 1.5 }).named("glass"),
        Material::from(Lambertian::rgb(0.4, 0.2, 0.1)).named("brown"),
        Material::from(Metal { albedo: DVec3::new(0.7, 0.6, 0.5), fuzz: 0.0 }).named("mirror"),
    ]
}

/// Returns the material `index` of the small spheres, in the book's shares: 80 % diffuse, 15 %
/// metal, 5 % glass.
fn palette(index: u64) -> Material {
    let seed = index + (1 << 40); // differs from the seed of each cell
    let random = |draw| DVec3::new(unit(seed, draw), unit(seed, draw + 1), unit(seed, draw + 2));
    let material = match index as f64 / PALETTE as f64 {
        share if share < 0.8 => Material::from(Lambertian { albedo: random(0) * random(3), texture: None }),
        share if share < 0.95 => {
            Material::from(Metal { albedo: 0.5 + 0.5 * random(0), fuzz: 0.5 * unit(seed, 3) })
        }
        _ => Material::from(Dielectric { ior: 1.5 }),
    };
    material.named(format!("small-{index:03}"))
}

fn camera() -> CameraPose {
    CameraPose {
        look_from: DVec3::new(13.0, 2.0, 3.0),
        look_at: DVec3::ZERO,
        vertical_fov: 20f64.to_radians(),
        defocus_angle: 0.6f64.to_radians(),
        focus_distance: 10.0,
        ..CameraPose::PINHOLE
    }
}

/// Returns a uniform number in [0, 1) that depends on nothing but `index` and `draw`.
fn unit(index: u64, draw: u64) -> f64 {
    (hash(index, draw) >> 11) as f64 / (1u64 << 53) as f64
}

/// Returns a hash of `index` and `draw`, with eight draws per index: SplitMix64's output function
/// (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014).
fn hash(index: u64, draw: u64) -> u64 {
    let mut z = (8 * index + draw + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests;
