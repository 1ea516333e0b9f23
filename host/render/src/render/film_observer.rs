//! Observer of a film that grows part by part.

use crate::film::{Film, SampleCoverage};

/// Observer of a film that grows part by part, which may end the render.
pub trait FilmObserver: Sync {
    /// Returns whether the render continues; called before each part. If false, the render ends
    /// with the samples that the film has.
    fn should_continue(&self) -> bool {
        true
    }

    /// Returns whether to read parts that add up on the device, so that
    /// [`part_added`](Self::part_added) receives the film with all samples of `coverage`; called
    /// after each part. If false, the film is read later, at the latest when the render ends.
    fn wants_film(&self, _coverage: &SampleCoverage) -> bool {
        true
    }

    /// Receives the film after each part, or after several of them that were
    /// [not wanted](Self::wants_film) before. It is called on the thread that added the part; the
    /// next part may be rendered meanwhile.
    fn part_added(&self, _film: &Film) {}
}

/// Observer that does nothing.
impl FilmObserver for () {
    fn wants_film(&self, _: &SampleCoverage) -> bool {
        false
    }
}
