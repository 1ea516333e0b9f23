//! Records of probes: launch parameters, inputs and outputs. The tests call an input a question and
//! an output an answer.

use bytemuck::{Pod, Zeroable};
use glam::{UVec4, Vec3, Vec4};
use trisect_shared::params::RenderParams;
use trisect_shared::rng::Words;

/// Parameters of a launch. 272 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct ProbeParams {
    /// Operation: one of the probe's constants.
    pub operation: u32,
    /// Number of inputs and of outputs.
    pub count: u32,
    /// Unused. (Words, not an array: see [`RenderParams::first_planar`].)
    pub pad0: u32,
    /// Unused.
    pub pad1: u32,
    /// Root of the BVH, lights, camera and other parameters of the scene.
    pub render: RenderParams,
}

const _: () = assert!(size_of::<ProbeParams>() == 288 && align_of::<ProbeParams>() == 16);

/// Input of a probe: eight rows, whose meaning each operation states. 128 bytes. The rows are
/// integers, so that no bit pattern changes on the way.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Input {
    /// Row 0.
    pub a: UVec4,
    /// Row 1.
    pub b: UVec4,
    /// Row 2.
    pub c: UVec4,
    /// Row 3.
    pub d: UVec4,
    /// Row 4.
    pub e: UVec4,
    /// Row 5.
    pub f: UVec4,
    /// Row 6.
    pub g: UVec4,
    /// Row 7.
    pub h: UVec4,
}

const _: () = assert!(size_of::<Input>() == 128 && align_of::<Input>() == 16);

// An input is stored as its rows.
#[cfg(target_arch = "spirv")]
impl trisect_shared::buffer_layout::Packable for Input {
    type Rows = Self;
    fn unpack(rows: Self) -> Self {
        rows
    }
}

/// Output of a probe: two rows. 32 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Output {
    /// Row 0.
    pub a: UVec4,
    /// Row 1.
    pub b: UVec4,
}

// An output is stored as its rows.
#[cfg(target_arch = "spirv")]
impl trisect_shared::buffer_layout::Packable for Output {
    type Rows = Self;
    fn unpack(rows: Self) -> Self {
        rows
    }
}

#[cfg(target_arch = "spirv")]
impl trisect_shared::buffer_layout::PackableMut for Output {
    fn pack(self) -> Self {
        self
    }
}

const _: () = assert!(size_of::<Output>() == 32 && align_of::<Output>() == 16);

/// Returns the four numbers whose bits a row holds.
#[inline(always)]
pub fn floats(row: UVec4) -> Vec4 {
    Vec4::new(f32::from_bits(row.x), f32::from_bits(row.y), f32::from_bits(row.z), f32::from_bits(row.w))
}

/// Returns the first three numbers whose bits a row holds.
#[inline(always)]
pub fn vector(row: UVec4) -> Vec3 {
    Vec3::new(f32::from_bits(row.x), f32::from_bits(row.y), f32::from_bits(row.z))
}

/// Returns a row as random words.
#[inline(always)]
pub fn words(row: UVec4) -> Words {
    Words { x: row.x, y: row.y, z: row.z, w: row.w }
}

/// Returns a row of three numbers and a word.
#[inline(always)]
pub fn row(v: Vec3, w: u32) -> UVec4 {
    UVec4::new(v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), w)
}

/// Returns a row of four numbers.
#[inline(always)]
pub fn row4(x: f32, y: f32, z: f32, w: f32) -> UVec4 {
    UVec4::new(x.to_bits(), y.to_bits(), z.to_bits(), w.to_bits())
}
