//! Rows of pixels have the bits of single pixels, by each instruction set.
#![allow(unsafe_code, reason = "instruction sets, and records without bounds checks")]

extern crate std;

use super::*;
use crate::denoise::variance::neighbourhood_stats;
use crate::denoise::{
    DenoiseParams, FilteredPixel, GBufferTexel, NeighbourhoodStats, PIXELS_PER_THREAD, PinholeView,
    atrous_level,
};
use crate::math::normalize;
use crate::rng::{Words, pcg4d};
use crate::simd::{Portable, Simd};
use bytemuck::Zeroable;
use glam::Vec3;
use std::vec;
use std::vec::Vec;

/// An image with edges, dark and bright pixels, pixels without a colour, and sky.
struct Picture {
    params: DenoiseParams,
    from: Vec<FilteredPixel>,
    edges: Vec<GBufferTexel>,
}

fn unit(word: u32) -> f32 {
    (word >> 8) as f32 / 16_777_216.0
}

impl Picture {
    fn new(width: u32, height: u32, step: u32) -> Self {
        let view = PinholeView {
            first_pixel: Vec3::new(-1.0, 0.6, -1.0),
            right: Vec3::new(2.0 / width as f32, 0.0, 0.01),
            down: Vec3::new(0.0, -1.2 / height as f32, 0.02),
            axis: Vec3::NEG_Z,
            ..PinholeView::zeroed()
        };
        let params = DenoiseParams {
            view,
            width,
            height,
            step,
            color_factor: 2.0,
            normal_factor: 3.0,
            depth_factor: 40.0,
            trusted_samples: 4,
            ..DenoiseParams::zeroed()
        };
        let random = |pixel: u32, salt| pcg4d(Words { x: pixel, y: salt, z: width, w: step });
        let of = |pixel| {
            let (r, s) = (random(pixel, 1), random(pixel, 2));
            let bright = if s.x % 13 == 0 { 1e18 } else { 1.0 };
            let color = Vec3::new(unit(r.x), unit(r.y), unit(r.z)) * bright;
            let known = s.y % 7 != 0;
            let lit = if known {
                FilteredPixel { color, variance: unit(r.w) * bright }
            } else {
                FilteredPixel::UNKNOWN
            };
            let normal = normalize(Vec3::new(unit(s.z) * 0.2 - 0.1, unit(s.w) * 0.2 - 0.1, 1.0));
            let edge = GBufferTexel { normal, inverse_depth: 0.5 + 0.1 * unit(s.x) };
            (lit, if s.w % 11 == 0 { GBufferTexel::NONE } else { edge })
        };
        let (from, edges) = (0..width * height).map(of).unzip();
        Self { params, from, edges }
    }

    fn bits(pixel: FilteredPixel) -> [u32; 4] {
        [pixel.color.x, pixel.color.y, pixel.color.z, pixel.variance].map(f32::to_bits)
    }

    fn level<const BY_VARIANCE: bool>(&self) -> Vec<[u32; 4]> {
        let Self { params, from, edges } = self;
        let of = |pixel: u32| {
            // SAFETY: the pixel lies inside the image.
            unsafe {
                atrous_level::<BY_VARIANCE>(params, from, edges, pixel % params.width, pixel / params.width)
            }
        };
        (0..params.width * params.height).map(|pixel| Self::bits(of(pixel))).collect()
    }

    /// Returns the next level by rows, in spans of `span` columns.
    fn level_by_rows<const BY_VARIANCE: bool, L: Simd>(&self, l: L, span: u32) -> Vec<[u32; 4]> {
        let Self { params, from, edges } = self;
        let mut to = vec![[u32::MAX; 4]; from.len()];
        let sets = params.height.div_ceil(PIXELS_PER_THREAD * params.step) * params.step;
        let mut numbers = vec![f32::NAN; level_numbers(params, &(0..span))];
        for row in 0..sets {
            for first in (0..params.width).step_by(span as usize) {
                let span = first..params.width.min(first + span);
                let write = |index: u32, pixel| {
                    let before = core::mem::replace(&mut to[index as usize], Self::bits(pixel));
                    assert_eq!(before, [u32::MAX; 4], "pixel {index} is written twice");
                };
                atrous_rows::<BY_VARIANCE, L>(l, params, from, edges, span, row, &mut numbers, write);
            }
        }
        to
    }

    fn stats(&self) -> Vec<NeighbourhoodStats> {
        let Self { params, from, edges } = self;
        let of = |pixel: usize| {
            let (x, y) = (pixel as u32 % params.width, pixel as u32 / params.width);
            // SAFETY: the pixel lies inside the image.
            unsafe { neighbourhood_stats(params, from, edges, from[pixel], edges[pixel], x, y) }
        };
        (0..from.len()).map(of).collect()
    }

    fn stats_by_rows<L: Simd>(&self, l: L) -> Vec<NeighbourhoodStats> {
        let Self { params, from, edges } = self;
        let span = 0..params.width;
        let mut numbers = vec![f32::NAN; neighbourhood_numbers(&span)];
        let mut all = Vec::new();
        for y in 0..params.height {
            let mut row = NeighbourhoodRow::new(l, params, from, edges, span.clone(), y, &mut numbers);
            all.extend(span.clone().map(|x| row.stats(x)));
        }
        all
    }
}

/// Compares rows by an instruction set with single pixels. Returns the number of comparisons.
fn compare<L: Simd>(l: L) -> usize {
    let sizes = [(1, 1, 1), (7, 5, 1), (8, 3, 2), (33, 19, 1), (33, 19, 4), (61, 37, 16), (20, 50, 64)];
    for (width, height, step) in sizes {
        let picture = Picture::new(width, height, step);
        for span in [1, 8, 13, 64] {
            assert!(
                picture.level::<false>() == picture.level_by_rows::<false, L>(l, span),
                "{width} {step} {span}"
            );
            assert!(
                picture.level::<true>() == picture.level_by_rows::<true, L>(l, span),
                "{width} {step} {span}"
            );
        }
        let bits = |all: Vec<NeighbourhoodStats>| -> Vec<[u32; 6]> {
            let of = |s: &NeighbourhoodStats| {
                [s.mean.x, s.mean.y, s.mean.z, s.variance.x, s.variance.y, s.variance.z].map(f32::to_bits)
            };
            all.iter().map(of).collect()
        };
        assert!(bits(picture.stats()) == bits(picture.stats_by_rows(l)), "{width}x{height}");
    }
    sizes.len()
}

#[test]
fn rows_have_the_bits_of_pixels() {
    assert_eq!(compare(Portable), 7);
    #[cfg(target_arch = "x86_64")]
    {
        use crate::simd::{Avx2, Avx512};
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            compare(unsafe { Avx2::assume() });
        }
        if std::arch::is_x86_feature_detected!("avx512vl") && std::arch::is_x86_feature_detected!("avx512dq")
        {
            // SAFETY: the processor has AVX-512.
            compare(unsafe { Avx512::assume() });
        }
    }
}

/// Negative control: another step, another pixel.
#[test]
fn another_image_has_other_bits() {
    let mut picture = Picture::new(33, 19, 2);
    let (level, stats) = (picture.level::<true>(), picture.stats());
    picture.from[200].color.x += 0.5;
    assert!(
        level != picture.level_by_rows::<true, _>(Portable, 33) && stats != picture.stats_by_rows(Portable)
    );
    picture.from[200].color.x -= 0.5;
    picture.params.step = 3;
    assert!(level != picture.level_by_rows::<true, _>(Portable, 33));
}
