//! Test 18 without samples: reciprocals and square roots of all 2³² numbers.

use glam::UVec4;
use trisect_probes::arithmetic::*;
use trisect_probes::record::{Input, Output};
use trisect_tests::BackendUnderTest;
use trisect_tests::probe::Prober;
use trisect_tests::report::{Outcome, report};

/// CUDA computes reciprocals and square roots by instructions of ours, not the driver's
/// (`trisect_kernels::specialise::ptx`). For each number, each sign and each NaN they have the
/// CPU's bits.
#[test]
fn t18_all_numbers_cuda() {
    let Some(mut cuda) = Prober::new(BackendUnderTest::Cuda) else { return };
    let mut cpu = Prober::new(BackendUnderTest::Cpu).expect("the CPU");
    let range = |first| Input { a: UVec4::new(first, 0, 0, 0), ..Input::default() };
    let ranges: Vec<Input> = (0..=u32::MAX / RANGE).map(|index| range(index * RANGE)).collect();
    let differing = |a: &[Output], b: &[Output]| a.iter().zip(b).filter(|(a, b)| a.b.x != b.b.x).count();
    for operation in [RECIPROCALS, ROOTS, RECIPROCALS_OF_ROOTS] {
        let [got, want] =
            [&mut cuda, &mut cpu].map(|prober| prober.ask("probe_arithmetic", operation, &ranges));
        assert_eq!(differing(&got, &want), 0, "operation {operation}: ranges of {RANGE} numbers");
        // Negative control: each range's neighbour. (Roots of half of the numbers are NaN.)
        assert!(differing(&got[1..], &want) > ranges.len() / 4, "negative control not detected");
        if operation == RECIPROCALS {
            let approximate = cuda.ask("probe_arithmetic", APPROXIMATE_RECIPROCALS, &ranges);
            assert!(differing(&approximate, &want) > ranges.len() / 4, "negative control not detected");
        }
    }
    report(
        18,
        BackendUnderTest::Cuda,
        Outcome::Passed,
        "1 / x, √x and 1 / √x of all 2³² numbers have the CPU's bits",
    );
}
