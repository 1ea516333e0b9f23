//! Votes and a work queue for the lanes of a warp on CUDA; on other targets each lane is its own
//! warp.
//!
//! The results decide what a lane does next, never the value of a sample, so the image does not
//! depend on which lanes share a warp. On CUDA all lanes of a warp that have not ended must call a
//! function together, because it waits for each of them. Vulkan's subgroups do not promise that:
//! around each ballot in a loop NVIDIA's compiler inserts instructions that find the active lanes,
//! which costs more than votes save (docs/notebook/vulkan.md). Called by [`crate::path`].
#![allow(unsafe_code, reason = "intrinsics; each block says why it is sound")]

#[cfg(target_arch = "nvptx64")]
mod intrinsics {
    unsafe extern "C" {
        #[link_name = "llvm.nvvm.vote.ballot.sync"]
        pub fn ballot(lanes: i32, predicate: bool) -> i32;
        #[link_name = "llvm.nvvm.shfl.sync.idx.i32"]
        pub fn shuffle(lanes: i32, value: i32, from: i32, clamp: i32) -> i32;
        #[link_name = "llvm.nvvm.read.ptx.sreg.lanemask.lt"]
        pub fn lanes_before() -> i32;
    }
}

/// Returns a bit for each lane, set where `predicate` holds.
#[cfg(target_arch = "nvptx64")]
#[inline(always)]
fn ballot(predicate: bool) -> u32 {
    // SAFETY: all lanes that have not ended are here, as the module requires.
    unsafe { intrinsics::ballot(-1, predicate) as u32 }
}

/// Waits for the other lanes of the warp, on CUDA; does nothing elsewhere.
#[inline(always)]
pub fn sync_warp() {
    #[cfg(target_arch = "nvptx64")]
    ballot(true);
}

/// True if lanes can vote on what they do next and so do it together: on CUDA, and trivially on the
/// CPU.
pub const HAS_WARP_VOTES: bool = cfg!(not(target_arch = "spirv"));

/// Returns whether `predicate` holds in any lane.
#[inline(always)]
pub fn any(predicate: bool) -> bool {
    if HAS_WARP_VOTES { count(predicate) > 0 } else { predicate }
}

/// Returns the number of lanes where `predicate` holds.
#[inline(always)]
pub fn count(predicate: bool) -> u32 {
    #[cfg(target_arch = "nvptx64")]
    return ballot(predicate).count_ones();
    #[cfg(not(target_arch = "nvptx64"))]
    return predicate as u32;
}

/// Returns the number of lanes before this one where `predicate` holds.
#[inline(always)]
fn rank(predicate: bool) -> u32 {
    #[cfg(target_arch = "nvptx64")]
    // SAFETY: reads a special register.
    return (ballot(predicate) & unsafe { intrinsics::lanes_before() } as u32).count_ones();
    #[cfg(not(target_arch = "nvptx64"))]
    return {
        let _ = predicate;
        0
    };
}

/// Counter that all lanes of a launch share.
#[cfg(target_arch = "spirv")]
pub type Counter<'a> = &'a mut [u32];
/// Counter that all lanes of a launch share.
#[cfg(not(target_arch = "spirv"))]
pub type Counter<'a> = &'a core::sync::atomic::AtomicU32;

/// Adds `n` to the counter, on CUDA once for the warp, and returns its previous value.
#[inline(always)]
fn advance(counter: &mut Counter, n: u32) -> u32 {
    #[cfg(target_arch = "nvptx64")]
    // SAFETY: reads a special register. All lanes that have not ended are here, and no lane of a
    // warp ends before the others.
    return unsafe {
        let mut before = 0;
        if intrinsics::lanes_before() == 0 {
            before = counter.fetch_add(n, core::sync::atomic::Ordering::Relaxed);
        }
        intrinsics::shuffle(-1, before as i32, 0, 31) as u32
    };
    #[cfg(target_arch = "spirv")]
    return {
        use spirv_std::memory::{Scope, Semantics};
        // SAFETY: the counter is a word of a storage buffer with one word.
        unsafe {
            spirv_std::arch::atomic_i_add::<u32, { Scope::QueueFamily as u32 }, { Semantics::NONE.bits() }>(
                &mut counter[0],
                n,
            )
        }
    };
    #[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
    return counter.fetch_add(n, core::sync::atomic::Ordering::Relaxed);
}

/// Numbers that a warp has taken from the counter and not yet given to a lane.
#[derive(Clone, Copy, Debug)]
pub struct Batch {
    next: u32,
    end: u32,
}

impl Batch {
    /// A batch without numbers.
    pub const EMPTY: Self = Self { next: 0, end: 0 };
}

/// Result of [`take`] for a lane that gets no number.
pub const NO_WORK: u32 = u32::MAX;

/// Numbers that a warp takes at a time. With more, the last warps hold more of the work
/// (docs/notebook/kernels-and-schedules.md).
const BATCH: u32 = 32;

/// Returns the next number of the queue to each lane that wants one, or [`NO_WORK`] if there is
/// none for it this time.
///
/// On Vulkan a lane takes its own numbers, one at a time: NVIDIA's compiler combines what lanes add
/// at the same time.
#[inline(always)]
pub fn take(counter: &mut Counter, batch: &mut Batch, wants: bool) -> u32 {
    if !HAS_WARP_VOTES {
        return if wants { advance(counter, 1) } else { NO_WORK };
    }
    let wanted = count(wants);
    if wanted == 0 {
        return NO_WORK;
    }
    if batch.next == batch.end {
        batch.next = advance(counter, BATCH);
        batch.end = batch.next + BATCH;
    }
    let mine = batch.next + rank(wants);
    let given = wants && mine < batch.end;
    batch.next = if batch.next + wanted < batch.end { batch.next + wanted } else { batch.end };
    if given { mine } else { NO_WORK }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::sync::atomic::AtomicU32;

    #[test]
    fn a_lone_lane_takes_each_number_once() {
        let counter = AtomicU32::new(0);
        let (mut a, mut b) = (Batch::EMPTY, Batch::EMPTY);
        let mut taken = [false; 8 * BATCH as usize];
        for turn in 0..taken.len() {
            let number = take(&mut &counter, if turn % 3 == 0 { &mut a } else { &mut b }, true) as usize;
            if let Some(seen) = taken.get_mut(number) {
                assert!(!core::mem::replace(seen, true), "{number} twice");
            }
            assert_eq!(take(&mut &counter, &mut a, false), NO_WORK);
        }
        let count = taken.iter().filter(|&&seen| seen).count();
        assert!(count >= taken.len() - BATCH as usize, "{count}");
    }
}
