//! Values of a BSDF: for a direction that is sampled, and for one that is given.

use glam::Vec3;

/// Direction in which the path continues. (Vectors begin rows of 16 bytes: naga lays records out
/// so.)
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Unit vector, in world coordinates.
    pub direction: Vec3,
    /// pdf of the direction, per steradian; 0 for a delta lobe, which light sampling cannot find.
    pub pdf: f32,
    /// Value times |cosine| over pdf: factor on the throughput.
    pub weight: Vec3,
    /// True if the direction is on the other side of the surface than the viewer.
    pub transmitted: bool,
    /// True if the path ends here.
    pub absorbed: bool,
}

impl BsdfSample {
    /// Sets weight and pdf of a direction with this value and pdf.
    #[inline(always)]
    pub(super) fn weigh(&mut self, BsdfEval { value, pdf }: BsdfEval) {
        // Written so that a pdf of NaN also ends the path.
        if pdf > 0.0 {
            (self.weight, self.pdf) = (value * (1.0 / pdf), pdf);
        } else {
            self.absorbed = true;
        }
    }
}

/// Value of a BSDF for one direction, and pdf of sampling that direction.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub struct BsdfEval {
    /// Value times |cosine| by channel; zero where the surface does not scatter.
    pub value: Vec3,
    /// pdf of sampling this direction, per steradian.
    pub pdf: f32,
}

pub(super) const ZERO_EVAL: BsdfEval = BsdfEval { value: Vec3::ZERO, pdf: 0.0 };
