//! Triangles of any size have the same hits (torture test 8).

use crate::mesh::{crystal, rays};
use crate::statistics::{SLOW, samples};
use trisect_shared::sphere::MISS;
use trisect_shared::triangle::{Shear, Triangle};

/// The bits are the same at every scale, down to where the product of three lengths underflows:
/// 2e-10 for triangles an eighth as large.
#[test]
fn scales() {
    let mesh = crystal();
    for (origin, direction) in
        rays(&mesh, 0.57, samples(40_000), 1).into_iter().step_by(if SLOW { 1000 } else { 100 })
    {
        for t in mesh.triangles() {
            let want = t.hit(origin, &Shear::new(direction));
            for k in [-32, -20, 20, 40] {
                let scale = (k as f32).exp2();
                let scaled = Triangle { a: t.a * scale, b: t.b * scale, c: t.c * scale, ..t };
                let got = scaled.hit(origin * scale, &Shear::new(direction));
                let distance = if want.distance < MISS { want.distance * scale } else { MISS };
                assert_eq!((got.distance, got.weight_b), (distance, want.weight_b), "2^{k}: {t:?} {origin}");
            }
        }
    }
}
