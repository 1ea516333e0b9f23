//! The one place of unchecked access.
//!
//! A bounds check costs a branch and, on a device, a path into panic code that keeps lanes apart; rust-gpu ends
//! the invocation silently there. So kernels read without checks, and the host proves the indices before a launch:
//!
//! * a [`BvhNode`](crate::bvh::BvhNode)'s children and the root lie inside the node and primitive arrays, and the tree is no
//!   deeper than [`STACK_SIZE`](crate::bvh::STACK_SIZE): `trisect::bvh` checks each node of each tree it makes;
//! * the same holds for the children of a `WideNode` of the wide tree, and its packets name primitives of their kind;
//! * a [`Sphere`](crate::sphere::Sphere)'s material index is below the number of materials: `trisect::scene` resolves
//!   names to indices, and `trisect::render::Renderer` checks them again;
//! * a pixel lies inside the film: the kernels' guards compare with [`RenderParams`](crate::params::RenderParams), and each
//!   backend allocates its film from the same record.
//!
//! A debug build checks every access.
#![allow(unsafe_code, reason = "the audited module: the invariants stand above")]

use crate::buffer_layout::{Packable, PackableMut, Packed};
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
use bytemuck::Pod;
use core::mem::MaybeUninit;

/// `slice[index]`, by value.
///
/// # Safety
///
/// `index < slice.len()`; a debug build panics otherwise.
#[inline(always)]
pub unsafe fn load<T: Packable>(slice: &[Packed<T>], index: u32) -> T {
    debug_assert!((index as usize) < slice.len());
    // SAFETY: the caller's promise.
    T::unpack(unsafe { *slice.get_unchecked(index as usize) })
}

/// `slice[index]`, by reference: for a record of which a traversal reads a few rows.
///
/// # Safety
///
/// `index < slice.len()`; a debug build panics otherwise.
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
#[inline(always)]
pub unsafe fn borrow<T>(slice: &[T], index: u32) -> &T {
    debug_assert!((index as usize) < slice.len());
    // SAFETY: the caller's promise.
    unsafe { slice.get_unchecked(index as usize) }
}

/// Eight entries from `first` on of an array of this invocation's own, to be overwritten.
///
/// # Safety
///
/// `first + 8 <= N`; a debug build panics otherwise. What is read of them was written before.
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
#[inline(always)]
pub unsafe fn eight_local<T: Pod, const N: usize>(
    array: &mut MaybeUninit<[T; N]>,
    first: u32,
) -> &mut [T; 8] {
    debug_assert!(first as usize + 8 <= N);
    // SAFETY: the caller's promise.
    unsafe { &mut *array.as_mut_ptr().cast::<T>().add(first as usize).cast::<[T; 8]>() }
}

/// `slice[index] = value`.
///
/// # Safety
///
/// `index < slice.len()`; a debug build panics otherwise.
#[inline(always)]
pub unsafe fn store<T: PackableMut>(slice: &mut [Packed<T>], index: u32, value: T) {
    debug_assert!((index as usize) < slice.len());
    // SAFETY: the caller's promise.
    unsafe { *slice.get_unchecked_mut(index as usize) = value.pack() }
}

/// Entry `index` of an array of this invocation's own, of which each entry is written before it is read.
///
/// # Safety
///
/// `index < N` (a debug build panics otherwise), and [`store_local`] wrote this entry.
#[inline(always)]
pub unsafe fn load_local<T: Copy, const N: usize>(array: &MaybeUninit<[T; N]>, index: u32) -> T {
    debug_assert!((index as usize) < N);
    // SAFETY: the caller's promise. rust-gpu knows no pointer arithmetic, but its own access to arrays.
    #[cfg(target_arch = "spirv")]
    return unsafe { *spirv_std::arch::IndexUnchecked::index_unchecked(&*array.as_ptr(), index as usize) };
    // SAFETY: the caller's promise.
    #[cfg(not(target_arch = "spirv"))]
    return unsafe { *array.as_ptr().cast::<T>().add(index as usize) };
}

/// Writes entry `index` of an array of this invocation's own.
///
/// # Safety
///
/// `index < N`; a debug build panics otherwise.
#[inline(always)]
pub unsafe fn store_local<T: Copy, const N: usize>(array: &mut MaybeUninit<[T; N]>, index: u32, value: T) {
    debug_assert!((index as usize) < N);
    // SAFETY: the caller's promise.
    #[cfg(target_arch = "spirv")]
    unsafe {
        let array = &mut *array.as_mut_ptr();
        *spirv_std::arch::IndexUnchecked::index_unchecked_mut(array, index as usize) = value;
    }
    // SAFETY: the caller's promise.
    #[cfg(not(target_arch = "spirv"))]
    unsafe {
        array.as_mut_ptr().cast::<T>().add(index as usize).write(value);
    }
}

/// Records of a buffer that all lanes write, each its own.
#[cfg(target_arch = "spirv")]
pub type SharedSlice<'a, T> = &'a mut [Packed<T>];

/// Records of a buffer that all lanes write, each its own.
#[cfg(not(target_arch = "spirv"))]
#[derive(Debug)]
pub struct SharedSlice<'a, T> {
    first: *mut T,
    length: usize,
    lifetime: core::marker::PhantomData<&'a mut [T]>,
}

#[cfg(not(target_arch = "spirv"))]
impl<'a, T> SharedSlice<'a, T> {
    /// Those at `first`.
    ///
    /// # Safety
    ///
    /// `length` records are there for `'a`, and no two lanes use the same at the same time.
    #[inline(always)]
    pub unsafe fn new(first: *mut T, length: usize) -> Self {
        Self { first, length, lifetime: core::marker::PhantomData }
    }
}

/// Record `index`.
///
/// # Safety
///
/// `index` is below their number.
#[cfg(not(target_arch = "spirv"))]
#[inline(always)]
pub unsafe fn load_shared<T: Copy>(slots: &SharedSlice<T>, index: u32) -> T {
    debug_assert!((index as usize) < slots.length);
    // SAFETY: the caller's promise.
    unsafe { *slots.first.add(index as usize) }
}

/// Writes record `index`.
///
/// # Safety
///
/// `index` is below their number.
#[cfg(not(target_arch = "spirv"))]
#[inline(always)]
pub unsafe fn store_shared<T: Copy>(slots: &mut SharedSlice<T>, index: u32, value: T) {
    debug_assert!((index as usize) < slots.length);
    // SAFETY: the caller's promise.
    unsafe { *slots.first.add(index as usize) = value }
}

#[cfg(target_arch = "spirv")]
pub use {load as load_shared, store as store_shared};
