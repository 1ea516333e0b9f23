//! Sharing of packets: leaves with few triangles fill what others leave free.

use trisect_shared::simd::LANES;

/// Places of leaves in packets, in the order in which they are made.
#[derive(Clone, Debug, Default)]
pub(super) struct PacketPlaces {
    /// Number of packets so far.
    pub packets: usize,
    /// Latest packet that has this many free lanes; older ones are far from the next leaf in space.
    open: [Option<usize>; LANES],
}

impl PacketPlaces {
    /// Returns packet and first lane for the next leaf, of 1 to 8 primitives: in the packet with
    /// the fewest free lanes that suffice, or in a new one.
    pub fn place(&mut self, count: usize) -> (usize, usize) {
        let fits = (count..LANES).find_map(|free| self.open[free].take().map(|packet| (packet, free)));
        let (packet, free) = fits.unwrap_or_else(|| {
            self.packets += 1;
            (self.packets - 1, LANES)
        });
        if free > count {
            self.open[free - count] = Some(packet);
        }
        (packet, LANES - free)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_share_packets_and_no_lane() {
        let counts = [5, 6, 3, 2, 8, 1, 1, 7, 4, 4, 4, 2, 2, 5, 1];
        let mut places = PacketPlaces::default();
        let mut lanes = vec![[false; LANES]; counts.len()];
        for count in counts {
            let (packet, first) = places.place(count);
            for lane in &mut lanes[packet][first..first + count] {
                assert!(!std::mem::replace(lane, true));
            }
        }
        let sum: usize = counts.iter().sum();
        assert_eq!(lanes.iter().flatten().filter(|taken| **taken).count(), sum);
        assert_eq!(places.packets, sum.div_ceil(LANES));
    }
}
