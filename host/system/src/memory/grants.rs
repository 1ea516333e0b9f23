//! Requests for memory, which seldom ask the system: a query reads several files and takes longer
//! than the render of a small image.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Maximum number of bytes that are granted without a query.
pub const SMALL: u64 = 64 << 20;

/// Time for which the answer of a query counts.
const VALID: Duration = Duration::from_millis(100);

/// Grants of this process.
static GRANTS: Mutex<Grants> = Mutex::new(Grants { last: None });

/// Returns the available memory if it is less than `needed` bytes, above [`SMALL`]; `None` if the
/// bytes can be allocated. What was granted within the last 0.1 s counts as allocated.
pub fn lacking(needed: u64) -> Option<u64> {
    if needed <= SMALL {
        return None;
    }
    GRANTS.lock().unwrap_or_else(PoisonError::into_inner).lacking(needed, Instant::now(), super::available)
}

/// Answer of the last query, less what was granted since.
struct Grants {
    last: Option<(Instant, u64)>,
}

impl Grants {
    fn lacking(&mut self, needed: u64, now: Instant, query: impl FnOnce() -> u64) -> Option<u64> {
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
        let mut grants = Grants { last: None };
        assert_eq!(grants.lacking(600, start, || 1000), None);
        assert_eq!(grants.lacking(300, after(50), none), None);
        // 100 are left: the system is asked again, and what it has now decides.
        assert_eq!(grants.lacking(200, after(51), || 150), Some(150));
        assert_eq!(grants.lacking(200, after(52), || 500), None);
        assert_eq!(grants.lacking(300, after(152), || 299), Some(299));
        assert_eq!(grants.lacking(300, after(153), || 300), None);
    }

    #[test]
    fn small_requests_are_granted_and_huge_ones_are_not() {
        assert_eq!(lacking(SMALL), None);
        assert!(lacking(u64::MAX).is_some());
    }
}
