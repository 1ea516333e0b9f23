//! Access to arrays without bounds checks, for all modules of this crate.
//!
//! A bounds check costs a branch. On a device it also adds a path into panic code, which keeps
//! lanes apart; rust-gpu would silently end the invocation there. Kernels therefore read without
//! checks, and the host proves the indices before a launch. A debug build checks every access.
//!
//! # Invariants
//!
//! * The root and the children of each [`BvhNode`](crate::bvh::BvhNode) lie inside the node and
//!   primitive arrays, and the tree has at most [`STACK_SIZE`](crate::bvh::STACK_SIZE) levels:
//!   `trisect::bvh` checks each node of each tree that it builds.
//! * The children of each `WideNode` of the wide BVH lie inside its arrays, and packets name
//!   primitives of their kind.
//! * The other indices of a scene are in range: each primitive's material, each material's
//!   textures, each texture's texels, the aliases of the environment map; each triangle's vertices
//!   and their attributes. `trisect::scene` checks them at load, `trisect::render::Renderer` again.
//! * The media of materials, and the texels of their grids, are in range: `trisect::scene` checks
//!   them with the other indices of a scene.
//! * The primitives and aliases of lights are in range, and so are the links of their tree:
//!   `trisect::lights` numbers them itself.
//! * A pixel lies inside the film: kernels compare with
//!   [`RenderParams`](crate::params::RenderParams), and `trisect` compares its size with that of
//!   the film of the launch.
//! * The features of a kernel have each kind of primitive of the scene: a primitive's kind follows
//!   from its number only among the kinds that the kernel has. `trisect::render` selects them.
#![allow(unsafe_code, reason = "audited module: its invariants are listed above")]

use crate::buffer_layout::{Packable, PackableMut, Packed};
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
use bytemuck::Pod;
#[cfg(not(target_arch = "spirv"))]
use bytemuck::{AnyBitPattern, NoUninit};
use core::mem::MaybeUninit;
#[cfg(not(target_arch = "spirv"))]
use glam::UVec4;

/// Returns `slice[index]` by value.
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

/// Array of a scene's records. In SPIR-V it is a part of a buffer that other arrays share, because
/// WebGPU has few bindings.
#[cfg(not(target_arch = "spirv"))]
pub type RecordSlice<'a, T> = &'a [T];

#[cfg(target_arch = "spirv")]
pub use spirv::{RecordSlice, load_other, load_other_record, load_record, load_row};
#[cfg(not(target_arch = "spirv"))]
pub use {load as load_record, load_other as load_other_record};

/// Returns the record of another type that stands at `index`.
///
/// # Safety
///
/// That of [`load`]; the host put such a record there.
#[cfg(not(target_arch = "spirv"))]
#[inline(always)]
pub unsafe fn load_other<T: NoUninit, U: AnyBitPattern>(slice: &[T], index: u32) -> U {
    // SAFETY: the caller's promise.
    bytemuck::cast(unsafe { load::<T>(slice, index) })
}

/// Returns 16 bytes of an array of records that are multiples of them.
///
/// # Safety
///
/// `16 * index` is less than the bytes of the array; a debug build panics otherwise.
#[cfg(not(target_arch = "spirv"))]
#[inline(always)]
pub unsafe fn load_row<T: NoUninit>(slice: &[T], index: u32) -> UVec4 {
    const { assert!(size_of::<T>().is_multiple_of(16) && align_of::<T>() >= 16) }
    debug_assert!((index as usize) < size_of_val(slice) / 16);
    // A device loads all of it at once if the type says that it is aligned.
    #[repr(C, align(16))]
    #[derive(Clone, Copy)]
    struct Row([u32; 4]);
    // SAFETY: the caller's promise; a record is made of aligned rows, whose bits are words.
    UVec4::from_array(unsafe { *slice.as_ptr().cast::<Row>().add(index as usize) }.0)
}

/// Returns `slice[index]` by reference, for records of which a traversal reads a few rows.
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

/// Borrows eight entries from `first` on of a lane's private array, to overwrite them.
///
/// # Safety
///
/// `first + 8 <= N`; a debug build panics otherwise. An entry is written before it is read.
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

/// Writes `slice[index] = value`.
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

/// Returns entry `index` of a lane's private array, which is uninitialised until it is written.
///
/// # Safety
///
/// `index < N` (a debug build panics otherwise), and [`store_local`] wrote this entry.
#[inline(always)]
pub unsafe fn load_local<T: Copy, const N: usize>(array: &MaybeUninit<[T; N]>, index: u32) -> T {
    debug_assert!((index as usize) < N);
    // SAFETY: the caller's promise. rust-gpu has no pointer arithmetic, but indexes arrays.
    #[cfg(target_arch = "spirv")]
    return unsafe { *spirv_std::arch::IndexUnchecked::index_unchecked(&*array.as_ptr(), index as usize) };
    // SAFETY: the caller's promise.
    #[cfg(not(target_arch = "spirv"))]
    return unsafe { *array.as_ptr().cast::<T>().add(index as usize) };
}

/// Writes entry `index` of a lane's private array.
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

/// Array of records that all lanes write, each lane its own records.
#[cfg(target_arch = "spirv")]
pub type SharedSlice<'a, T> = &'a mut [Packed<T>];

/// Array of records that all lanes write, each lane its own records.
#[cfg(not(target_arch = "spirv"))]
#[derive(Debug)]
pub struct SharedSlice<'a, T> {
    first: *mut T,
    length: usize,
    lifetime: core::marker::PhantomData<&'a mut [T]>,
}

#[cfg(not(target_arch = "spirv"))]
impl<'a, T> SharedSlice<'a, T> {
    /// Creates a slice of `length` records at `first`.
    ///
    /// # Safety
    ///
    /// `length` records are valid at `first` for `'a`, and no two lanes access the same record at
    /// the same time.
    #[inline(always)]
    pub unsafe fn new(first: *mut T, length: usize) -> Self {
        Self { first, length, lifetime: core::marker::PhantomData }
    }
}

/// Returns record `index`.
///
/// # Safety
///
/// `index` is below the slice's length; a debug build panics otherwise.
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
/// `index` is below the slice's length; a debug build panics otherwise.
#[cfg(not(target_arch = "spirv"))]
#[inline(always)]
pub unsafe fn store_shared<T: Copy>(slots: &mut SharedSlice<T>, index: u32, value: T) {
    debug_assert!((index as usize) < slots.length);
    // SAFETY: the caller's promise.
    unsafe { *slots.first.add(index as usize) = value }
}

#[cfg(target_arch = "spirv")]
pub use {load as load_shared, store as store_shared};

#[cfg(target_arch = "spirv")]
mod spirv {
    use crate::buffer_layout::{Packable, Packed, ReadRows};
    use core::marker::PhantomData;
    use glam::UVec4;

    /// Array of a scene's records, which is part of a buffer.
    #[derive(Clone, Copy)]
    pub struct RecordSlice<'a, T> {
        /// Rows of the buffer.
        rows: &'a [UVec4],
        /// Index of the array's first row.
        first: u32,
        of: PhantomData<T>,
    }

    impl<'a, T> RecordSlice<'a, T> {
        /// Returns the array that begins at this row.
        #[inline(always)]
        pub fn new(rows: &'a [UVec4], first: u32) -> Self {
            Self { rows, first, of: PhantomData }
        }
    }

    /// Returns record `index`.
    ///
    /// # Safety
    ///
    /// The array has such a record.
    #[inline(always)]
    pub unsafe fn load_record<T: Packable<Rows: ReadRows>>(records: RecordSlice<'_, T>, index: u32) -> T {
        // SAFETY: the caller's promise.
        T::unpack(unsafe { Packed::<T>::read(records.rows, records.first + index * Packed::<T>::COUNT) })
    }

    /// Returns a row of an array.
    ///
    /// # Safety
    ///
    /// The array has such a row.
    #[inline(always)]
    pub unsafe fn load_row<T>(records: RecordSlice<'_, T>, index: u32) -> UVec4 {
        // SAFETY: the caller's promise.
        unsafe { *records.rows.get_unchecked((records.first + index) as usize) }
    }

    /// Returns the record of another type, with as many rows, that stands at `index`.
    ///
    /// # Safety
    ///
    /// That of [`load`](super::load); the host put such a record there.
    #[inline(always)]
    pub unsafe fn load_other<T: Packable, U: Packable<Rows = T::Rows>>(slice: &[Packed<T>], index: u32) -> U {
        // SAFETY: the caller's promise.
        unsafe { super::load::<U>(slice, index) }
    }

    /// Returns the record of another type that stands at `index`.
    ///
    /// # Safety
    ///
    /// That of [`load_record`]; the host put such a record there.
    #[inline(always)]
    pub unsafe fn load_other_record<T, U: Packable<Rows: ReadRows>>(
        records: RecordSlice<'_, T>,
        index: u32,
    ) -> U {
        // SAFETY: the caller's promise.
        unsafe { load_record(RecordSlice::<U>::new(records.rows, records.first), index) }
    }
}
