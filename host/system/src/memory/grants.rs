//! Requests for memory, which seldom ask the system: a query reads several files and takes longer
//! than the render of a small image.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;
use web_time::Instant;

/// Maximum sum of requests in bytes that are granted without a query.
pub const SMALL: u64 = 4 << 20;

/// Time for which the answer of a query counts.
const VALID: Duration = Duration::from_millis(100);

/// Grants of this process.
static GRANTS: Mutex<Grants> = Mutex::new(Grants { small: 0, last: None });

/// Returns the available memory if it is less than `needed` bytes, else `None`. Requests that add
/// up to at most [`SMALL`] do not ask the system. An answer counts for 0.1 s, less what was granted
/// since; where that does not suffice, the system is asked again.
pub fn lacking(needed: u64) -> Option<u64> {
    GRANTS.lock().unwrap_or_else(PoisonError::into_inner).lacking(needed, Instant::now(), super::available)
}

/// Requests that were granted.
struct Grants {
    /// Sum of the requests that were granted without a query.
    small: u64,
    /// Time and answer of the last query, less what was granted since.
    last: Option<(Instant, u64)>,
}

impl Grants {
    fn lacking(&mut self, needed: u64, now: Instant, query: impl FnOnce() -> u64) -> Option<u64> {
        self.small = self.small.saturating_add(needed);
        if self.small <= SMALL {
            return None;
        }
        self.small = 0;
        let is_valid = |(at, left): &(Instant, u64)| now.duration_since(*at) < VALID && needed <= *left;
        let (at, left) = self.last.filter(is_valid).unwrap_or_else(|| (now, query()));
        self.last = Some((at, left.saturating_sub(needed)));
        (needed > left).then_some(left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grants_add_up_until_the_next_query() {
        let (start, none) = (Instant::now(), || panic!("no query"));
        let after = |ms| start + Duration::from_millis(ms);
        let mut grants = Grants { small: 0, last: None };
        let size = |unit: u64| unit * SMALL;
        assert_eq!(grants.lacking(size(6), start, || size(10)), None);
        assert_eq!(grants.lacking(size(3), after(50), none), None);
        // 1 is left: the system is asked again, and what it has now decides.
        assert_eq!(grants.lacking(size(3), after(51), || size(2)), Some(size(2)));
        assert_eq!(grants.lacking(size(3), after(52), || size(8)), None);
        assert_eq!(grants.lacking(size(5), after(152), || size(4)), Some(size(4)));
        assert_eq!(grants.lacking(size(5), after(153), || size(5)), None);
    }

    #[test]
    fn small_requests_ask_when_they_add_up() {
        let (now, none) = (Instant::now(), || panic!("no query"));
        let mut grants = Grants { small: 0, last: None };
        for _ in 0..4 {
            assert_eq!(grants.lacking(SMALL / 4, now, none), None);
        }
        assert_eq!(grants.lacking(SMALL / 4, now, || 0), Some(0));
        assert_eq!(grants.lacking(SMALL / 4, now, none), None);
    }

    #[test]
    fn huge_requests_are_refused() {
        assert!(lacking(u64::MAX).is_some());
    }
}
