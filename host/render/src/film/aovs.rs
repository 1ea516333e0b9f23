//! AOV totals of a film: exact sums over the AOV sums that kernels write chunk by chunk.

use super::ExactSum;
use bytemuck::{Pod, Zeroable};
use trisect_shared::aovs::AovSums;
use trisect_shared::bvh::NO_PRIMITIVE;

/// Totals of [`AovSums`] over all samples of one pixel. Like the radiance, they do not depend on
/// the order or grouping of chunks and films.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct AovTotals {
    /// Sum of the unit shading normals at the hits, on the camera's side.
    normal: [ExactSum; 3],
    /// Sum of the albedos over all samples; a miss adds 0.
    albedo: [ExactSum; 3],
    /// Sum of the positions of the hits, in scene units.
    position: [ExactSum; 3],
    /// Sum of the radiance emitted towards the camera: by the surface at a hit, by the sky at a
    /// miss.
    emission: [ExactSum; 3],
    /// Sum of [`AovSums::diffuse`].
    diffuse: ExactSum,
    /// Number of samples that hit a primitive.
    pub hits: u64,
    /// Number of samples that hit nothing.
    pub misses: u64,
    /// Primitive that the first sample with a hit hits, or [`NO_PRIMITIVE`].
    primitive: u32,
    /// First sample of the chunk that `primitive` is from; `u32::MAX` without one.
    chunk: u32,
}

impl AovTotals {
    /// Totals over no samples.
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

    /// Adds a chunk of `samples` samples that begins at sample `first`. A chunk that no kernel
    /// wrote makes the sums NaN.
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

    /// Adds the totals that another film has of the same pixel.
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

    /// Returns the totals over all chunks in the kernels' format, rounded to f32.
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

    /// Returns the mean of the unit normals: shorter than 1 if they differ, 0 if nothing is hit.
    pub fn normal(&self) -> [f64; 3] {
        mean(self.normal, self.hits)
    }

    /// Returns the mean albedo: 0 if nothing is hit, NaN without samples.
    pub fn albedo(&self) -> [f64; 3] {
        self.albedo.map(|sum| sum.value() / (self.hits + self.misses) as f64)
    }

    /// Returns the mean position of the hits; 0 if nothing is hit.
    pub fn position(&self) -> [f64; 3] {
        mean(self.position, self.hits)
    }

    /// Returns the mean radiance that is seen directly: of emissive surfaces, and of the sky where
    /// nothing is hit; NaN without samples.
    pub fn emission(&self) -> [f64; 3] {
        self.emission.map(|sum| sum.value() / (self.hits + self.misses) as f64)
    }

    /// Returns the share of the samples that hit something; 0 without samples.
    pub fn alpha(&self) -> f32 {
        (self.hits as f64 / (self.hits + self.misses).max(1) as f64) as f32
    }

    /// Returns the primitive that the first sample with a hit hits; `None` without hits.
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
