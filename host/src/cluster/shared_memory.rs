//! Long messages between ranks of one host: through memory that they share, copied by several threads at each end.
//!
//! Without it Open MPI 4.1 moved 2 GB/s between two processes, with one thread each (docs/cluster.md).
#![allow(unsafe_code, reason = "other processes read what this writes; each block names why it is sound")]

use super::ClusterError;
use super::window::Window;
use ::mpi::topology::{Communicator, SimpleCommunicator};
use ::mpi::traits::CommunicatorCollectives;
use rayon::prelude::*;
use std::sync::atomic::{Ordering, fence};

/// Messages from this length on go this way: below, two more messages of a few bytes cost more.
const MIN_MESSAGE_BYTES: usize = 1 << 18;

/// Bytes in which a rank's long messages lie until they are taken.
const SHARED_BYTES_PER_RANK: usize = 1 << 25;

/// What a thread copies at a time.
const TASK: usize = 1 << 17;

/// Where a message lies in its sender's part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MessageSlot {
    first: usize,
    bytes: usize,
}

impl MessageSlot {
    /// For the message that says so.
    pub fn encode(self) -> Vec<u8> {
        [self.first as u64, self.bytes as u64].into_iter().flat_map(u64::to_ne_bytes).collect()
    }

    /// From such a message.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let word = |at: usize| Some(u64::from_ne_bytes(bytes.get(at..at + 8)?.try_into().ok()?) as usize);
        Some(Self { first: word(0)?, bytes: word(8)? })
    }
}

/// Places that are in use, in order.
#[derive(Debug, Default)]
struct SlotAllocator {
    taken: Vec<MessageSlot>,
}

impl SlotAllocator {
    /// The first gap of so many bytes among so many.
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

/// A rank's own part of the shared memory, and those of the others on its host.
pub(super) struct SharedMemoryTransport {
    _window: Window,
    /// Of all ranks: those of other hosts have none.
    parts: Vec<Option<(*mut u8, usize)>>,
    own: (*mut u8, usize),
    slots: SlotAllocator,
}

/// Pointers for several threads, which copy different bytes.
#[derive(Clone, Copy)]
struct CopyPointers(*const u8, *mut u8);

// SAFETY: as its only user says.
unsafe impl Sync for CopyPointers {}

impl CopyPointers {
    /// Copies so many bytes by all threads.
    ///
    /// # Safety
    ///
    /// Both ends have them, apart from each other, and no one else touches them meanwhile but to read the first.
    unsafe fn copy(self, bytes: usize) {
        (0..bytes.div_ceil(TASK)).into_par_iter().for_each(|task| {
            let ends = self;
            let at = task * TASK;
            // SAFETY: the caller's promise; each task has bytes of its own.
            unsafe { std::ptr::copy_nonoverlapping(ends.0.add(at), ends.1.add(at), TASK.min(bytes - at)) };
        });
    }
}

impl SharedMemoryTransport {
    /// All ranks call this. None for a rank that is alone on its host, and where there is no memory to share.
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

    /// Whether a message goes this way.
    pub fn takes(&self, to: u32, bytes: usize) -> bool {
        (MIN_MESSAGE_BYTES..=self.own.1).contains(&bytes)
            && self.parts.get(to as usize).is_some_and(Option::is_some)
    }

    /// Puts a message where its receiver finds it; none as long as others lie there.
    pub fn put(&mut self, content: &[u8]) -> Option<MessageSlot> {
        let place = self.slots.take(content.len(), self.own.1)?;
        // SAFETY: the place is within this rank's own part, and no one reads it before being told of it.
        unsafe { CopyPointers(content.as_ptr(), self.own.0.add(place.first)).copy(place.bytes) };
        fence(Ordering::SeqCst);
        Some(place)
    }

    /// Takes a message out of a rank's part; none for a place that it has not.
    pub fn take(&self, from: u32, place: MessageSlot) -> Option<Vec<u8>> {
        let (first, bytes) = (*self.parts.get(from as usize)?)?;
        if place.first.checked_add(place.bytes)? > bytes {
            return None;
        }
        fence(Ordering::SeqCst);
        let mut content = Vec::with_capacity(place.bytes);
        // SAFETY: the part has these bytes, and its rank leaves them alone until it is told that they were taken; the vector has room for as many,
        // all of which are written.
        unsafe {
            CopyPointers(first.add(place.first), content.as_mut_ptr()).copy(place.bytes);
            content.set_len(place.bytes);
        }
        Some(content)
    }

    /// The receiver has it.
    pub fn taken(&mut self, place: MessageSlot) {
        self.slots.give_back(place);
    }

    /// Messages that were not taken yet.
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
        // SAFETY: both have as many.
        unsafe { CopyPointers(from.as_ptr(), to.as_mut_ptr()).copy(from.len()) };
        assert_eq!(from, to);
    }
}
