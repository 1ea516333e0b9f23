//! The traversal stack.

use crate::buffer::{load_local, store_local};
use core::mem::MaybeUninit;

/// Entries of a [`Stack`].
///
/// A ray pushes at most one child per level, so a tree with at most this many levels of inner nodes cannot overflow it; the
/// host rejects a deeper one.
pub const STACK_SIZE: usize = 64;

/// Where a [`Stack`] keeps its entries.
pub type Entries = MaybeUninit<[u32; STACK_SIZE]>;

/// A stack of words in memory of the invocation's own.
///
/// Nothing is written before it is pushed: clearing 256 bytes for each ray cost more instructions than all the boxes that it
/// tests. LLVM clears entries and length together when one record holds both, so the entries are borrowed.
pub struct Stack<'a> {
    entries: &'a mut Entries,
    length: u32,
}

impl<'a> Stack<'a> {
    /// An empty stack.
    #[inline(always)]
    pub fn new(entries: &'a mut Entries) -> Self {
        Self { entries, length: 0 }
    }

    /// Whether there is nothing to pop.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// Puts `entry` on top.
    ///
    /// # Safety
    ///
    /// Fewer than [`STACK_SIZE`] entries are on the stack.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub unsafe fn push(&mut self, entry: u32) {
        // SAFETY: the caller's promise.
        unsafe { store_local(self.entries, self.length, entry) };
        self.length += 1;
    }

    /// Takes the entry on top.
    ///
    /// # Safety
    ///
    /// The stack is not empty.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub unsafe fn pop(&mut self) -> u32 {
        self.length -= 1;
        // SAFETY: entries below `length` were written by `push`.
        unsafe { load_local(self.entries, self.length) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[allow(unsafe_code, reason = "within capacity")]
    fn last_in_first_out_up_to_capacity() {
        let mut entries = Entries::uninit();
        let mut stack = Stack::new(&mut entries);
        assert!(stack.is_empty());
        for i in 0..STACK_SIZE as u32 {
            // SAFETY: fewer than STACK_SIZE entries.
            unsafe { stack.push(i) };
        }
        for i in (0..STACK_SIZE as u32).rev() {
            // SAFETY: not empty.
            assert_eq!(unsafe { stack.pop() }, i);
        }
        assert!(stack.is_empty());
    }
}
