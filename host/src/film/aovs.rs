//! What a film knows of the surfaces that its pixels see.

use super::ExactSum;
use bytemuck::{Pod, Zeroable};
use trisect_shared::aovs::AovSums;
use trisect_shared::bvh::NO_PRIMITIVE;

/// [`AovSums`] over all samples of one pixel. As the radiance, they do not depend on the order or grouping of chunks and films.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct AovTotals {
    /// Of the unit normals on the camera's side, over what was hit.
    normal: [ExactSum; 3],
    /// Of the albedos, over all samples; 0 where nothing was hit.
    albedo: [ExactSum; 3],
    /// Of the points that were hit.
    position: [ExactSum; 3],
    /// Of the radiance that comes from there, and of the sky where nothing was hit.
    emission: [ExactSum; 3],
    /// Of [`Guides::diffuse`].
    diffuse: ExactSum,
    /// Samples that hit something.
    pub hits: u64,
    /// Samples that hit nothing.
    pub misses: u64,
    /// What the first sample that hit something did hit.
    primitive: u32,
    /// The first sample of its chunk.
    chunk: u32,
}

impl AovTotals {
    /// No sample.
    pub(crate) const EMPTY: Self = Self {
        normal: [ExactSum::ZERO; 3],
        albedo: [ExactSum::ZERO; 3],
        position: [ExactSum::ZERO; 3],
        emission: [ExactSum::ZERO; 3],
        diffuse: ExactSum::ZERO,
        hits: 0,
        misses: 0,
        primitive: NO_PRIMITIVE,
        chunk: u32::MAX,
    };

    /// Adds the chunk of `samples` samples that begins at sample `first`; one that no kernel wrote makes the sums NaN.
    pub(crate) fn merge(&mut self, guides: &AovSums, first: u32, samples: u32) {
        if guides.hits > samples || guides.misses > samples {
            for sum in [&mut self.normal, &mut self.albedo, &mut self.position, &mut self.emission] {
                *sum = [ExactSum::NAN; 3];
            }
            self.diffuse = ExactSum::NAN;
            return;
        }
        for c in 0..3 {
            self.normal[c].add(f64::from(guides.normal[c]));
            self.albedo[c].add(f64::from(guides.albedo[c]));
            self.position[c].add(f64::from(guides.position[c]));
            self.emission[c].add(f64::from(guides.emission[c]));
        }
        self.diffuse.add(f64::from(guides.diffuse));
        self.hits += u64::from(guides.hits);
        self.misses += u64::from(guides.misses);
        if guides.hits > 0 {
            self.note_primitive(guides.primitive, first);
        }
    }

    /// Adds what `light_pdf` holds of the same pixel.
    pub(crate) fn add(&mut self, other: &Self) {
        for c in 0..3 {
            self.normal[c].merge(other.normal[c]);
            self.albedo[c].merge(other.albedo[c]);
            self.position[c].merge(other.position[c]);
            self.emission[c].merge(other.emission[c]);
        }
        self.diffuse.merge(other.diffuse);
        self.hits += other.hits;
        self.misses += other.misses;
        self.note_primitive(other.primitive, other.chunk);
    }

    fn note_primitive(&mut self, primitive: u32, chunk: u32) {
        if chunk < self.chunk {
            (self.primitive, self.chunk) = (primitive, chunk);
        }
    }

    /// As kernels write them, but of all chunks, rounded.
    pub fn sums(&self) -> AovSums {
        let round = |sums: [ExactSum; 3]| sums.map(|sum| sum.value() as f32).into();
        let count = |count| u32::try_from(count).unwrap_or(u32::MAX);
        AovSums {
            normal: round(self.normal),
            hits: count(self.hits),
            albedo: round(self.albedo),
            primitive: self.primitive,
            position: round(self.position),
            misses: count(self.misses),
            emission: round(self.emission),
            diffuse: self.diffuse.value() as f32,
        }
    }

    /// Mean of the unit normals: shorter than 1 where they differ, 0 where nothing is hit.
    pub fn normal(&self) -> [f64; 3] {
        mean(self.normal, self.hits)
    }

    /// Mean albedo; 0 where nothing is hit, NaN without samples.
    pub fn albedo(&self) -> [f64; 3] {
        self.albedo.map(|sum| sum.value() / (self.hits + self.misses) as f64)
    }

    /// Mean of the points that are hit; 0 where nothing is.
    pub fn position(&self) -> [f64; 3] {
        mean(self.position, self.hits)
    }

    /// Mean radiance of what is seen directly: lights, and the sky where nothing is hit; NaN without samples.
    pub fn emission(&self) -> [f64; 3] {
        self.emission.map(|sum| sum.value() / (self.hits + self.misses) as f64)
    }

    /// What the first sample hits that hits something.
    pub fn primitive(&self) -> Option<u32> {
        (self.primitive != NO_PRIMITIVE).then_some(self.primitive)
    }
}

fn mean(sums: [ExactSum; 3], count: u64) -> [f64; 3] {
    sums.map(|sum| sum.value() / count.max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use trisect_shared::aovs::SurfaceAovs;

    fn guides(hits: u32, primitive: u32) -> AovSums {
        let mut guides = AovSums::ZERO;
        let look = SurfaceAovs { albedo: Vec3::splat(0.5), diffuse: 1.0 };
        (0..hits).for_each(|_| guides.add_hit(primitive, Vec3::Z, look, Vec3::X, Vec3::ZERO));
        (hits..4).for_each(|_| guides.add_miss(Vec3::ONE));
        guides
    }

    #[test]
    fn order_and_grouping_do_not_show() {
        let chunks = [(guides(0, 0), 0), (guides(2, 7), 256), (guides(4, 9), 512)];
        let sum = |order: &[usize]| {
            let mut total = AovTotals::EMPTY;
            for &index in order {
                let mut one = AovTotals::EMPTY;
                one.merge(&chunks[index].0, chunks[index].1, 4);
                total.add(&one);
            }
            total
        };
        let total = sum(&[0, 1, 2]);
        assert_eq!(total, sum(&[2, 0, 1]));
        assert_eq!((total.primitive(), total.hits, total.misses), (Some(7), 6, 6));
        assert_eq!((total.normal(), total.position()), ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]));
        assert_eq!(total.albedo(), [0.25; 3]);
    }

    #[test]
    fn what_no_kernel_wrote_shows() {
        let mut total = AovTotals::EMPTY;
        total.merge(&AovSums::UNWRITTEN, 0, 4);
        assert!(total.normal()[0].is_nan() && total.albedo()[2].is_nan() && total.position()[1].is_nan());
        assert_eq!(total.primitive(), None);
    }

    #[test]
    fn without_hits() {
        let mut total = AovTotals::EMPTY;
        total.merge(&guides(0, 0), 0, 4);
        assert_eq!((total.normal(), total.position(), total.primitive()), ([0.0; 3], [0.0; 3], None));
        assert_eq!(total.albedo(), [0.0; 3]);
    }
}
