//! Tests of each instruction set against arrays.

use super::*;

const NUMBERS: [f32; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.5,
    1e-45,
    -1e-40,
    3.4e38,
    -2.5e38,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
    0.1,
    1.0 + f32::EPSILON,
    16_777_217.0,
    1e-20,
    7.25,
];

/// Returns rows in which each pair of numbers stands in some lane.
fn rows() -> impl Iterator<Item = (SimdRow<f32>, SimdRow<f32>)> {
    (0..2 * NUMBERS.len()).map(|shift| {
        let first = shift / NUMBERS.len() * LANES;
        (
            SimdRow(core::array::from_fn(|i| NUMBERS[first + i])),
            SimdRow(core::array::from_fn(|i| NUMBERS[(first + i + shift) % NUMBERS.len()])),
        )
    })
}

fn same(a: SimdRow<f32>, b: SimdRow<f32>) -> bool {
    (0..LANES).all(|i| a.0[i].to_bits() == b.0[i].to_bits() || (a.0[i].is_nan() && b.0[i].is_nan()))
}

/// Returns whether `l` gives the results of arrays.
fn agrees<L: Simd>(l: L) -> bool {
    let p = Portable;
    rows().all(|(x, y)| {
        let (a, b) = (l.load(&x), l.load(&y));
        let numbers = [
            (l.add(a, b), p.add(x.0, y.0)),
            (l.sub(a, b), p.sub(x.0, y.0)),
            (l.mul(a, b), p.mul(x.0, y.0)),
            (l.div(a, b), p.div(x.0, y.0)),
            (l.sqrt(a), p.sqrt(x.0)),
            (l.neg(a), p.neg(x.0)),
            (l.splat(x.0[3]), p.splat(x.0[3])),
            (l.select(l.lt(a, b), a, b), p.select(p.lt(x.0, y.0), x.0, y.0)),
        ];
        let words = SimdRow(x.0.map(f32::to_bits));
        let truths = [
            (l.lt(a, b), p.lt(x.0, y.0)),
            (l.le(a, b), p.le(x.0, y.0)),
            (l.eq(a, b), p.eq(x.0, y.0)),
            (l.eq_u32(&words, words.0[2]), p.eq_u32(&words, words.0[2])),
            (l.or(l.lt(a, b), l.eq(a, b)), p.or(p.lt(x.0, y.0), p.eq(x.0, y.0))),
            (l.and(l.le(a, b), l.eq(a, b)), p.and(p.le(x.0, y.0), p.eq(x.0, y.0))),
            (l.and_not(l.eq(a, b), l.le(a, b)), p.and_not(p.eq(x.0, y.0), p.le(x.0, y.0))),
            (l.splat_mask(true), p.splat_mask(true)),
            (l.splat_mask(false), p.splat_mask(false)),
        ];
        let sizes = |row: SimdRow<f32>| row.0.map(|x| if x.is_nan() { 0.0 } else { x.abs() });
        let (c, d) = (sizes(x), sizes(y));
        let (lc, ld) = (l.load(&SimdRow(c)), l.load(&SimdRow(d)));
        let ordered = same(l.store(l.max(lc, ld)), SimdRow(p.max(c, d)))
            && same(l.store(l.min(lc, ld)), SimdRow(p.min(c, d)));
        let negative = l.store(l.min(lc, l.neg(l.splat(1.0)))).0.iter().all(|x| *x < 0.0);
        let positive = (0..LANES).all(|i| {
            let bound = l.store(l.max(lc, l.neg(ld))).0[i];
            bound == c[i] // of 0 and -0 either
        });
        numbers.into_iter().all(|(got, want)| same(l.store(got), SimdRow(want)))
            && truths.into_iter().all(|(got, want)| l.bits(got) == p.bits(want))
            && ordered
            && negative
            && positive
            && pushes(l, x, y) == pushes(p, x, y)
    })
}

fn pushes<L: Simd>(l: L, entry: SimdRow<f32>, exit: SimdRow<f32>) -> (u32, [u32; LANES], [u32; LANES]) {
    let (mut entries, mut children) = ([0.0; LANES], [0; LANES]);
    let order = [5, 3, 7, 0, 2, 6, 1, 4].iter().rev().fold(0, |order, lane| order << 3 | lane);
    let words = SimdRow([10, 11, 12, 13, 14, 15, 16, 17]);
    let top = StackTop { entries: &mut entries, children: &mut children };
    let count = l.push_sorted(l.load(&entry), l.load(&exit), &words, order, top);
    // Entries beyond the count may hold anything.
    entries[count as usize..].fill(0.0);
    children[count as usize..].fill(0);
    (count, entries.map(f32::to_bits), children)
}

#[test]
fn arrays_push_in_order() {
    let entry = SimdRow([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    let exit = SimdRow([9.0, 0.0, 9.0, 9.0, 0.0, 5.0, 0.0, 9.0]);
    assert_eq!(pushes(Portable, entry, exit).2, [15, 13, 17, 10, 12, 0, 0, 0]);
    assert!(agrees(Portable));
}

#[cfg(all(feature = "std", target_arch = "x86_64"))]
#[test]
#[allow(unsafe_code, reason = "the CPU's features are checked first")]
fn each_instruction_set_does_what_arrays_do() {
    if std::is_x86_feature_detected!("avx2") {
        // SAFETY: the CPU has it.
        assert!(agrees(unsafe { Avx2::assume() }));
    } else {
        std::eprintln!("skipped: no AVX2");
    }
    if std::is_x86_feature_detected!("avx512vl") {
        // SAFETY: as above.
        assert!(agrees(unsafe { Avx512::assume() }));
    } else {
        std::eprintln!("skipped: no AVX-512");
    }
}
