//! Long messages between ranks of one host: through shared memory, copied by several threads at
//! each end.
//!
//! Open MPI 4.1 alone copies such messages with one thread for each process
//! (docs/notebook/cluster.md has the rates).
#![allow(unsafe_code, reason = "other processes read what this writes; each block says why it is sound")]

use super::window::Window;
use crate::ClusterError;
use ::mpi::topology::{Communicator, SimpleCommunicator};
use ::mpi::traits::CommunicatorCollectives;
use rayon::prelude::*;
use std::sync::atomic::{Ordering, fence};

/// Minimum size in bytes of a message in shared memory. Below it, the two short messages that
/// announce and release its slot cost more than they save.
const MIN_MESSAGE_BYTES: usize = 1 << 18;

/// Bytes of a rank's part of the shared memory, which holds its long messages until they are taken.
const SHARED_BYTES_PER_RANK: usize = 1 << 25;

/// Bytes that a thread copies at a time.
const TASK: usize = 1 << 17;

/// Position of a message in its sender's part of the shared memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MessageSlot {
    first: usize,
    bytes: usize,
}

impl MessageSlot {
    /// Encodes the slot as the content of a message.
    pub fn encode(self) -> Vec<u8> {
        [self.first as u64, self.bytes as u64].into_iter().flat_map(u64::to_ne_bytes).collect()
    }

    /// Decodes a slot; `None` if the message is too short.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let word = |at: usize| Some(u64::from_ne_bytes(bytes.get(at..at + 8)?.try_into().ok()?) as usize);
        Some(Self { first: word(0)?, bytes: word(8)? })
    }
}

/// Slots in use, in the order of their positions.
#[derive(Debug, Default)]
struct SlotAllocator {
    taken: Vec<MessageSlot>,
}

impl SlotAllocator {
    /// Allocates the first gap of `bytes` bytes, at a multiple of 64, in a part of `of` bytes;
    /// `None` if there is no such gap.
    fn take(&mut self, bytes: usize, of: usize) -> Option<MessageSlot> {
        let mut first = 0;
        let mut index = 0;
        while let Some(next) = self.taken.get(index).filter(|next| next.first < first + bytes) {
            first = (next.first + next.bytes).next_multiple_of(64);
            index += 1;
        }
        let place = MessageSlot { first, bytes };
        (first.checked_add(bytes)? <= of).then(|| {
            self.taken.insert(index, place);
            place
        })
    }

    fn give_back(&mut self, place: MessageSlot) {
        self.taken.retain(|taken| *taken != place);
    }
}

/// This rank's part of the shared memory, and those of the other ranks on its host.
pub(super) struct SharedMemoryTransport {
    _window: Window,
    /// First byte and size of each rank's part; `None` for ranks on other hosts.
    parts: Vec<Option<(*mut u8, usize)>>,
    own: (*mut u8, usize),
    slots: SlotAllocator,
}

/// Source and destination for several threads, which copy different bytes.
#[derive(Clone, Copy)]
struct CopyPointers(*const u8, *mut u8);

// SAFETY: the only user, `copy`, gives each thread its own bytes.
unsafe impl Sync for CopyPointers {}

impl CopyPointers {
    /// Copies `bytes` bytes with all threads.
    ///
    /// # Safety
    ///
    /// Source and destination have `bytes` bytes and do not overlap. Meanwhile no one else accesses
    /// the destination, and others only read the source.
    unsafe fn copy(self, bytes: usize) {
        (0..bytes.div_ceil(TASK)).into_par_iter().for_each(|task| {
            let ends = self;
            let at = task * TASK;
            // SAFETY: the caller guarantees valid memory; each task has its own bytes.
            unsafe { std::ptr::copy_nonoverlapping(ends.0.add(at), ends.1.add(at), TASK.min(bytes - at)) };
        });
    }
}

impl SharedMemoryTransport {
    /// Opens the shared memory; all ranks call this. Returns `None` for a rank that is alone on its
    /// host, or if there is not enough shared memory.
    pub fn open(world: &SimpleCommunicator) -> Result<Option<Self>, ClusterError> {
        let host = world.split_shared(world.rank());
        if host.size() < 2 {
            return Ok(None);
        }
        let Some(window) = Window::allocate(&host, SHARED_BYTES_PER_RANK)? else { return Ok(None) };
        let mut ranks = vec![0i32; host.size().unsigned_abs() as usize];
        host.all_gather_into(&world.rank(), &mut ranks[..]);
        let mut parts = vec![None; world.size().unsigned_abs() as usize];
        for (of_host, &rank) in (0..).zip(&ranks) {
            if let Some(part) = parts.get_mut(rank.unsigned_abs() as usize) {
                *part = Some(window.part(of_host)?);
            }
        }
        let own = window.part(host.rank())?;
        Ok(Some(Self { _window: window, parts, own, slots: SlotAllocator::default() }))
    }

    /// Returns whether a message of `bytes` bytes to rank `to` goes through shared memory.
    pub fn takes(&self, to: u32, bytes: usize) -> bool {
        (MIN_MESSAGE_BYTES..=self.own.1).contains(&bytes)
            && self.parts.get(to as usize).is_some_and(Option::is_some)
    }

    /// Copies a message to a free slot of this rank's part; `None` while no slot is free.
    pub fn put(&mut self, content: &[u8]) -> Option<MessageSlot> {
        let place = self.slots.take(content.len(), self.own.1)?;
        // SAFETY: the slot is within this rank's own part, and no one reads it before the message
        // that announces it.
        unsafe { CopyPointers(content.as_ptr(), self.own.0.add(place.first)).copy(place.bytes) };
        fence(Ordering::SeqCst);
        Some(place)
    }

    /// Copies a message out of a rank's part; `None` if the slot is outside the part.
    pub fn take(&self, from: u32, place: MessageSlot) -> Option<Vec<u8>> {
        let (first, bytes) = (*self.parts.get(from as usize)?)?;
        if place.first.checked_add(place.bytes)? > bytes {
            return None;
        }
        fence(Ordering::SeqCst);
        let mut content = Vec::with_capacity(place.bytes);
        // SAFETY: the part has these bytes, and its rank does not change them until a message says
        // that they were taken. The vector has the capacity for them, and all of them are written.
        unsafe {
            CopyPointers(first.add(place.first), content.as_mut_ptr()).copy(place.bytes);
            content.set_len(place.bytes);
        }
        Some(content)
    }

    /// Frees a slot whose message the receiver has taken.
    pub fn taken(&mut self, place: MessageSlot) {
        self.slots.give_back(place);
    }

    /// Returns the number of messages that were not taken yet.
    pub fn waiting(&self) -> usize {
        self.slots.taken.len()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    #[test]
    fn places_do_not_overlap() {
        let mut room = SlotAllocator::default();
        let sizes = [300, 200, 400, 100, 250, 64, 1];
        let mut taken: Vec<MessageSlot> = Vec::new();
        for round in 0..2000usize {
            if let Some(place) = room.take(sizes[round * 7 % sizes.len()], 1024) {
                assert!(place.first + place.bytes <= 1024);
                for other in &taken {
                    assert!(
                        place.first >= other.first + other.bytes || other.first >= place.first + place.bytes
                    );
                }
                taken.push(place);
            }
            if round % 3 > 0 && !taken.is_empty() {
                room.give_back(taken.swap_remove(round * 5 % taken.len()));
            }
        }
        taken.drain(..).for_each(|place| room.give_back(place));
        assert_eq!(room.take(1024, 1024), Some(MessageSlot { first: 0, bytes: 1024 }));
        assert_eq!(room.take(1, 1024), None);
        assert_eq!(room.take(usize::MAX, 1024), None);
    }

    #[test]
    fn places_as_messages() {
        let place = MessageSlot { first: 1 << 20, bytes: 123_456 };
        assert_eq!(MessageSlot::decode(&place.encode()), Some(place));
        assert_eq!(MessageSlot::decode(&[0; 15]), None);
    }

    #[test]
    fn copies_are_whole() {
        let from: Vec<u8> = (0..3 * TASK as u32 + 5).map(|at| (at * 7 % 251) as u8).collect();
        let mut to = vec![0; from.len()];
        // SAFETY: both have the same length, and they do not overlap.
        unsafe { CopyPointers(from.as_ptr(), to.as_mut_ptr()).copy(from.len()) };
        assert_eq!(from, to);
    }
}
