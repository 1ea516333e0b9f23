//! Objects that the camera rays of a pixel see.

/// Objects of a pixel, each with the number of its samples. Most pixels have one object, which
/// takes no memory of its own.
#[derive(Clone, Debug, Default)]
pub struct PixelCoverage {
    first: (u32, u32),
    others: Vec<(u32, u32)>,
}

impl PixelCoverage {
    /// Adds a sample that sees an object, from 1 on, or nothing, 0.
    pub fn add(&mut self, object: u32) {
        if object == 0 {
            return;
        }
        if self.first.1 == 0 {
            self.first = (object, 0);
        }
        if self.first.0 == object {
            self.first.1 += 1;
        } else if let Some((_, count)) = self.others.iter_mut().find(|(other, _)| *other == object) {
            *count += 1;
        } else {
            self.others.push((object, 1));
        }
    }

    /// Returns the hashes with the largest coverage, a share of `samples`, in descending order.
    /// Hash 0 and coverage 0 fill the rest. `hashes` are those of objects 1 and on; objects of one
    /// hash count together.
    pub fn ranks<const N: usize>(&self, hashes: &[u32], samples: u32) -> [(u32, f32); N] {
        let mut by_hash: Vec<(u32, u32)> = Vec::new();
        for (object, count) in
            std::iter::once(&self.first).chain(&self.others).filter(|(_, count)| *count > 0)
        {
            let Some(hash) = hashes.get((*object as usize).wrapping_sub(1)) else { continue };
            match by_hash.iter_mut().find(|(other, _)| other == hash) {
                Some((_, sum)) => *sum += count,
                None => by_hash.push((*hash, *count)),
            }
        }
        // Equal counts are in the order of their hashes, whatever the order of samples.
        by_hash.sort_unstable_by_key(|(hash, count)| (std::cmp::Reverse(*count), *hash));
        let mut ranks = [(0, 0.0); N];
        for (rank, (hash, count)) in ranks.iter_mut().zip(by_hash) {
            *rank = (hash, count as f32 / samples as f32);
        }
        ranks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_of_one_name_count_together() {
        let mut pixel = PixelCoverage::default();
        for object in [0, 3, 1, 2, 3, 0, 1, 3] {
            pixel.add(object);
        }
        assert_eq!(pixel.ranks(&[7, 9, 7], 8), [(7, 0.625), (9, 0.125), (0, 0.0)]);
        assert_eq!(pixel.ranks::<1>(&[5, 6, 7], 8), [(7, 0.375)]);
        assert_eq!(PixelCoverage::default().ranks(&[7], 8), [(0, 0.0); 2]);
    }
}
