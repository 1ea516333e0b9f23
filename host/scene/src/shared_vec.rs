//! Arrays of records that scenes and devices share.

use std::ops::{Deref, DerefMut};
use std::sync::Arc;

/// Array whose clones share its memory. Writing to one of several clones copies the array first.
#[derive(Debug, PartialEq)]
pub struct SharedVec<T>(Arc<Vec<T>>);

impl<T> SharedVec<T> {
    /// Returns the memory that the clones share.
    pub fn shared(&self) -> Arc<Vec<T>> {
        Arc::clone(&self.0)
    }

    /// Returns whether both share their memory.
    pub fn is_shared_with(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl<T> Clone for SharedVec<T> {
    fn clone(&self) -> Self {
        Self(self.shared())
    }
}

impl<T> Default for SharedVec<T> {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl<T> From<Vec<T>> for SharedVec<T> {
    fn from(records: Vec<T>) -> Self {
        Self(Arc::new(records))
    }
}

impl<T> FromIterator<T> for SharedVec<T> {
    fn from_iter<I: IntoIterator<Item = T>>(records: I) -> Self {
        Vec::from_iter(records).into()
    }
}

impl<T> Deref for SharedVec<T> {
    type Target = Vec<T>;

    fn deref(&self) -> &Vec<T> {
        &self.0
    }
}

impl<T: Clone> DerefMut for SharedVec<T> {
    fn deref_mut(&mut self) -> &mut Vec<T> {
        Arc::make_mut(&mut self.0)
    }
}

impl<'a, T> IntoIterator for &'a SharedVec<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a, T: Clone> IntoIterator for &'a mut SharedVec<T> {
    type Item = &'a mut T;
    type IntoIter = std::slice::IterMut<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clone_is_copied_when_it_is_written() {
        let mut first: SharedVec<u32> = vec![1, 2].into();
        let second = first.clone();
        assert_eq!(first.as_ptr(), second.as_ptr());
        assert!(first.is_shared_with(&second));
        first.push(3);
        assert_eq!((first.len(), second.len()), (3, 2));
        assert!(!first.is_shared_with(&second));
        let before = first.as_ptr();
        first[0] = 7;
        assert_eq!((first.as_ptr(), first[0], second[0]), (before, 7, 1));
    }
}
