//! Test 18: maximum error of each operation, and how often it is exact, over 2²⁰ stratified inputs.

use glam::UVec4;
use trisect_probes::arithmetic::*;
use trisect_probes::functions;
use trisect_probes::record::{Input, Output};
use trisect_shared::rng::{Words, pcg4d};
use trisect_tests::probe::Prober;
use trisect_tests::report::{Outcome, report};
use trisect_tests::ulp::error;
use trisect_tests::{BackendUnderTest, for_each_route};

/// Number of inputs of each operation.
const COUNT: u32 = 1 << 20;

fn random(i: u32, salt: u32) -> Words {
    pcg4d(Words { x: i, y: salt, z: 18, w: 0 })
}

/// Returns a number of stratum `i` of 2²⁰ strata of bit patterns, which cover every sign, exponent
/// and upper mantissa; the lower bits are random.
fn pattern(i: u32, salt: u32) -> f32 {
    f32::from_bits(i << 12 | random(i, salt).x & 0xfff)
}

/// Returns three operands, of which an operation may use fewer. The first is of stratum `i`. The
/// others are random bit patterns for even `i`, and within 2⁶ of the first for odd `i`, where sums
/// round and cancel.
fn operands(i: u32) -> [f32; 3] {
    let r = random(i, 1);
    let x = pattern(i, 0);
    let near = |bits: u32| {
        let exponent = (x.to_bits() >> 23 & 0xff) as i32 + (bits >> 23) as i32 % 7 - 3;
        f32::from_bits(bits & 0x807f_ffff | (exponent.clamp(0, 254) as u32) << 23)
    };
    let [y, z] = if i & 1 == 0 { [f32::from_bits(r.y), f32::from_bits(r.z)] } else { [near(r.y), near(r.z)] };
    [x, y, z]
}

/// Results of an operation for one class of inputs.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    count: u32,
    exact: u32,
    worst: f64,
}

impl Tally {
    fn add(&mut self, got: f32, want: f64) {
        self.count += 1;
        let rounded = want as f32;
        let same = got.to_bits() == rounded.to_bits() || got.is_nan() && rounded.is_nan();
        self.exact += u32::from(same);
        self.worst = self.worst.max(error(got, want));
    }

    fn is_exact(&self) -> bool {
        self.exact == self.count
    }
}

/// An operation and its expected results.
struct Row {
    name: &'static str,
    operation: u32,
    /// The result in f64. For + - * / and the square root of f32 numbers it rounds to the same f32
    /// as the true value (Figueroa, "When is double rounding innocuous?", 1995).
    exactly: fn([f32; 3]) -> f64,
    /// Maximum error in ULP for normal numbers (Vulkan specification, "Precision of Core SPIR-V
    /// Instructions"). A square root is 1 / InverseSqrt (2 ULP), so its bound is that of both
    /// operations.
    vulkan: f64,
}

const ROWS: [Row; 8] = [
    Row { name: "x + y", operation: ADD, exactly: |v| f64::from(v[0]) + f64::from(v[1]), vulkan: 0.5 },
    Row { name: "x - y", operation: SUBTRACT, exactly: |v| f64::from(v[0]) - f64::from(v[1]), vulkan: 0.5 },
    Row { name: "x y", operation: MULTIPLY, exactly: |v| f64::from(v[0]) * f64::from(v[1]), vulkan: 0.5 },
    Row { name: "x / y", operation: DIVIDE, exactly: |v| f64::from(v[0]) / f64::from(v[1]), vulkan: 2.5 },
    Row { name: "1 / x", operation: RECIPROCAL, exactly: |v| 1.0 / f64::from(v[0]), vulkan: 2.5 },
    Row { name: "sqrt x", operation: ROOT, exactly: |v| f64::from(v[0]).sqrt(), vulkan: 4.5 },
    Row {
        name: "x y + z",
        operation: MULTIPLY_ADD,
        exactly: |v| f64::from(v[0] * v[1]) + f64::from(v[2]),
        vulkan: 0.5,
    },
    Row {
        name: "(x + y) - x",
        operation: ADD_SUBTRACT,
        exactly: |v| f64::from(v[0] + v[1]) - f64::from(v[0]),
        vulkan: 0.5,
    },
];

fn is_denormal(x: f32) -> bool {
    x != 0.0 && x.abs() < f32::MIN_POSITIVE
}

/// Results by class of inputs, as the specifications distinguish them.
#[derive(Debug, Default)]
struct Classes {
    /// Operands, intermediate values and result are normal, or zero.
    normal: Tally,
    /// One of them is denormal, or the reciprocal of the divisor is.
    denormal: Tally,
    /// One of them is infinite or NaN.
    infinite: Tally,
}

fn classify(row: &Row, inputs: &[[f32; 3]], outputs: &[Output]) -> Classes {
    let mut classes = Classes::default();
    for (v, output) in inputs.iter().zip(outputs) {
        let got = f32::from_bits(output.a.x);
        let want = (row.exactly)(*v);
        let arity = match row.operation {
            ROOT | RECIPROCAL => 1,
            MULTIPLY_ADD => 3,
            _ => 2,
        };
        let between = match row.operation {
            MULTIPLY_ADD => v[0] * v[1],
            ADD_SUBTRACT => v[0] + v[1],
            _ => 1.0,
        };
        let rounded = want as f32;
        let mut all = v[..arity].iter().copied().chain([between, rounded]);
        // Vulkan does not bound a quotient by a larger divisor, whose reciprocal is denormal.
        let divisor = match row.operation {
            DIVIDE => v[1].abs(),
            RECIPROCAL => v[0].abs(),
            _ => 1.0,
        };
        let class = if all.clone().any(|x| !x.is_finite()) {
            &mut classes.infinite
        } else if all.any(is_denormal) || rounded == 0.0 && want != 0.0 || divisor > 2f32.powi(126) {
            &mut classes.denormal
        } else {
            &mut classes.normal
        };
        class.add(got, want);
    }
    classes
}

fn inputs() -> (Vec<[f32; 3]>, Vec<Input>) {
    let values: Vec<_> = (0..COUNT).map(operands).collect();
    let rows = values.iter().map(|v| {
        let [x, y, z] = v.map(f32::to_bits);
        Input { a: UVec4::new(x, y, z, 0), ..Input::default() }
    });
    let rows = rows.collect();
    (values, rows)
}

fn line(subject: BackendUnderTest, name: &str, text: &str) {
    eprintln!("CENSUS | {} | {name} | {text}", subject.label());
}

fn summary(tally: &Tally) -> String {
    let share = 100.0 * f64::from(tally.exact) / f64::from(tally.count.max(1));
    if tally.is_exact() { "exact".to_owned() } else { format!("{:.3e} ulp, {share:.3} % exact", tally.worst) }
}

/// Each operation rounds as the backend's specification says.
///
/// CPU and PTX: IEEE 754. Vulkan: sums and products of normal numbers are correctly rounded, in
/// either direction by the specification and to nearest by every driver seen so far; quotients are
/// within 2.5 ULP where the divisor is in [2⁻¹²⁶, 2¹²⁶]; denormals may be flushed; infinities and
/// NaN may give anything.
fn t18_census(subject: BackendUnderTest) {
    let Some(mut prober) = Prober::new(subject) else { return };
    let ieee = matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda);
    let (values, questions) = inputs();
    let mut all_exact = true;
    let mut worst = ("", 0.0f64);
    for row in &ROWS {
        let outputs = prober.ask("probe_arithmetic", row.operation, &questions);
        let classes = classify(row, &values, &outputs);
        line(
            subject,
            row.name,
            &format!(
                "{} | {} | {}",
                summary(&classes.normal),
                summary(&classes.denormal),
                summary(&classes.infinite)
            ),
        );
        assert!(
            classes.normal.count > COUNT / 8 && classes.denormal.count > 1000,
            "{}: {classes:?}",
            row.name
        );
        let exact = [classes.normal, classes.denormal, classes.infinite].iter().all(Tally::is_exact);
        // naga writes no `NoContraction`, so a driver's results for these two are not bounded.
        let open =
            matches!(row.operation, MULTIPLY_ADD | ADD_SUBTRACT) && subject == BackendUnderTest::WgpuNaga;
        if ieee {
            assert!(exact, "{}: {classes:?}", row.name);
        } else if !open {
            assert!(classes.normal.worst <= row.vulkan, "{}: {classes:?}", row.name);
        }
        all_exact &= exact;
        if classes.normal.worst > worst.1 && !open {
            worst = (row.name, classes.normal.worst);
        }
    }
    // Negative control: a product and a sum as one fused operation.
    let fused: Vec<Output> = values
        .iter()
        .map(|v| Output { a: UVec4::splat(v[0].mul_add(v[1], v[2]).to_bits()), b: UVec4::ZERO })
        .collect();
    assert!(!classify(&ROWS[6], &values, &fused).normal.is_exact(), "negative control not detected");
    let figure = if all_exact {
        "each of 8 operations correctly rounded, with denormals, infinities and NaN".to_owned()
    } else {
        format!("normal numbers: at most {:.2} ulp ({}), contraction aside; see the census", worst.1, worst.0)
    };
    report(18, subject, if all_exact { Outcome::Passed } else { Outcome::Bounded }, figure);
}

/// Integer operations, comparisons, minimum and maximum are exact for numbers on every backend; the
/// crate's own functions are within their stated bounds.
fn t18_functions(subject: BackendUnderTest) {
    let Some(mut prober) = Prober::new(subject) else { return };
    let ieee = matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda);
    let words = |f: &dyn Fn(u32) -> UVec4| -> Vec<Input> {
        (0..COUNT).map(|i| Input { a: f(i), ..Input::default() }).collect()
    };
    let stratified = words(&|i| UVec4::new(i << 12 | random(i, 2).x & 0xfff, 0, 0, 0));
    let mut ask = |probe, operation, questions: &[Input]| prober.ask(probe, operation, questions);

    // Conversions from integers are correctly rounded.
    type Convert = fn(u32) -> f64;
    for (name, operation, exactly) in [
        ("u32 to f32", FROM_UNSIGNED, (|bits| f64::from(bits)) as Convert),
        ("i32 to f32", FROM_SIGNED, |bits| f64::from(bits as i32)),
    ] {
        let mut tally = Tally::default();
        for (input, output) in stratified.iter().zip(ask("probe_arithmetic", operation, &stratified)) {
            tally.add(f32::from_bits(output.a.x), exactly(input.a.x));
        }
        line(subject, name, &summary(&tally));
        assert!(tally.is_exact(), "{name}: {tally:?}");
    }
    // Conversions to integers are exact within the integers' range. Beyond it the CPU saturates and
    // Vulkan leaves the result open; the crate clamps first.
    let small = words(&|i| {
        let x = pattern(i, 3);
        UVec4::splat(if x.abs() < 2e9 { x } else { x.to_bits() as f32 * 0.4 }.to_bits())
    });
    for (input, output) in small.iter().zip(ask("probe_arithmetic", TO_SIGNED, &small)) {
        let x = f32::from_bits(input.a.x);
        assert_eq!(output.b.x as i32, x as i32, "{x:e} to i32");
    }
    line(subject, "f32 to i32", "exact");
    let mut flushed = false;
    for (input, output) in small.iter().zip(ask("probe_functions", functions::FLOOR, &small)) {
        let x = f32::from_bits(input.a.x);
        if is_denormal(x) && !ieee && output.b.x == 0 {
            flushed |= x < 0.0;
            continue;
        }
        assert_eq!(output.b.x as i32, x.floor() as i32, "floor of {x:e}");
    }
    line(subject, "floor", if flushed { "exact; denormals flushed" } else { "exact" });

    // Minimum, maximum and comparisons of numbers: on Vulkan, denormals may count as zero.
    let (values, pairs) = inputs();
    let mut denormals_compared = true;
    for (operation, name) in [(MINIMUM, "min"), (MAXIMUM, "max"), (COMPARE, "comparisons")] {
        for (v, output) in values.iter().zip(ask("probe_arithmetic", operation, &pairs)) {
            let [x, y, _] = *v;
            if x.is_nan() || y.is_nan() {
                continue;
            }
            let got = f32::from_bits(output.a.x);
            let want = if (operation == MINIMUM) == (x < y) { x } else { y };
            let bits = u32::from(x < y)
                | u32::from(x <= y) << 1
                | u32::from(x == y) << 2
                | u32::from(x > y) << 4
                | u32::from(x >= y) << 5;
            let right = if operation == COMPARE { output.b.x == bits } else { got == want };
            if !right
                && (is_denormal(x) || is_denormal(y))
                && !matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda)
            {
                denormals_compared = false;
                continue;
            }
            assert!(right, "{name} of {x:e} and {y:e}: {got:e}, bits {:#b}", output.b.x);
        }
        line(subject, name, if denormals_compared { "exact" } else { "exact; denormals flushed" });
    }
    // Tests for finite numbers by their bits: every stratum's pattern, and the edges in each
    // component.
    let edges = [0x7f7f_ffff, 0x7f80_0000, 0x7f80_0001, 0xff7f_ffff, 0xff80_0000, 0xffff_ffff];
    let edges = edges.iter().flat_map(|&bits| {
        [UVec4::X, UVec4::Y, UVec4::Z].map(|axis| Input { a: axis * bits, ..Input::default() })
    });
    let patterns: Vec<Input> = stratified.iter().copied().chain(edges).collect();
    for (input, output) in patterns.iter().zip(ask("probe_functions", functions::ALL_FINITE, &patterns)) {
        let finite = [input.a.x, input.a.y, input.a.z].iter().all(|&bits| f32::from_bits(bits).is_finite());
        assert_eq!(output.b.x != 0, finite, "{:x?}", input.a.to_array());
    }
    line(subject, "all_finite", "exact");
    let integers = words(&|i| UVec4::new(random(i, 4).x, random(i, 5).x, 0, 0));
    for (input, output) in integers.iter().zip(ask("probe_functions", functions::MUL_HIGH, &integers)) {
        assert_eq!(output.b.x, ((u64::from(input.a.x) * u64::from(input.a.y)) >> 32) as u32);
    }
    line(subject, "upper word of a product", "exact");

    // Polynomials, by absolute error; each function states its bound. Vulkan's own sine is within
    // 2⁻¹¹.
    let greatest = |outputs: &[Output], inputs: &[Input], exactly: &dyn Fn(UVec4) -> [f64; 2]| {
        let mut worst = 0.0f64;
        for (input, output) in inputs.iter().zip(outputs) {
            for (got, want) in [output.a.x, output.a.y].into_iter().zip(exactly(input.a)) {
                worst = worst.max((f64::from(f32::from_bits(got)) - want).abs());
            }
        }
        worst
    };
    let turned = |turns: f64| {
        let angle = turns * std::f64::consts::TAU;
        [angle.cos(), angle.sin()]
    };
    let circle = ask("probe_functions", functions::UNIT_CIRCLE, &stratified);
    let worst = greatest(&circle, &stratified, &|row| {
        // The function's own map from bits to an angle: the upper two bits choose the quarter,
        // which is mirrored at the y axis.
        let quarter = f64::from(row.x >> 6 & 0x00ff_ffff) / f64::from(1 << 24) - 0.5;
        let [mut cos, sin] = turned(0.25 * quarter);
        if row.x >> 31 == 1 {
            cos = -cos;
        }
        if row.x >> 30 & 1 == 0 { [cos, sin] } else { [sin, cos] }
    });
    line(subject, "cos, sin of random bits", &format!("{worst:.2e} absolute"));
    assert!(worst < 2e-7, "{worst}");
    let turns = words(&|i| UVec4::splat((pattern(i, 6) % 1e6).to_bits()).min(UVec4::splat(0x4900_0000)));
    let circle = ask("probe_functions", functions::COS_SIN_TURNS, &turns);
    let worst = greatest(&circle, &turns, &|row| turned(f64::from(f32::from_bits(row.x)).rem_euclid(1.0)));
    line(subject, "cos, sin of turns", &format!("{worst:.2e} absolute"));
    assert!(worst < 3e-7, "{worst}");
    let vectors = words(&|i| UVec4::new(random(i, 7).x >> 2, random(i, 8).x >> 2, random(i, 9).x >> 2, 0));
    // No direction is in a vector of denormals, and on a device that flushes them half of one where
    // one component is denormal.
    let is_seen = |q: &Input| {
        let [y, x] = [q.a.x, q.a.y].map(|bits| f32::from_bits(bits).abs());
        y.max(x) >= if ieee { f32::MIN_POSITIVE } else { 1e-30 }
    };
    let vectors: Vec<Input> = vectors.into_iter().filter(is_seen).collect();
    let outputs = ask("probe_functions", functions::ATAN2_TURNS, &vectors);
    let worst = greatest(&outputs, &vectors, &|row| {
        let [y, x] = [row.x, row.y].map(|bits| f64::from(f32::from_bits(bits)));
        [y.atan2(x) / std::f64::consts::TAU, 0.0]
    });
    line(subject, "angle of a vector, turns", &format!("{worst:.2e} absolute"));
    assert!(worst < 1e-7, "{worst}");
    let units = words(&|i| UVec4::splat(((i + 1) as f32 / COUNT as f32).to_bits()));
    let outputs = ask("probe_functions", functions::CUBE_ROOT, &units);
    let relative = outputs.iter().zip(&units).map(|(output, input)| {
        (f64::from(f32::from_bits(output.a.x)) / f64::from(f32::from_bits(input.a.x)).cbrt() - 1.0).abs()
    });
    let worst = relative.fold(0.0, f64::max);
    line(subject, "cube root", &format!("{worst:.2e} relative"));
    assert!(worst < 5e-7, "{worst}");
    // Every half that the host stores: zero and positive normal numbers.
    let halves: Vec<Input> = (0..0x7c00)
        .filter(|&bits| bits == 0 || bits >= 0x0400)
        .map(|bits| Input { a: UVec4::splat(bits), ..Input::default() })
        .collect();
    for (input, output) in halves.iter().zip(ask("probe_functions", functions::FROM_HALF, &halves)) {
        let (exponent, fraction) = (input.a.x >> 10, input.a.x & 0x3ff);
        let want = if input.a.x == 0 {
            0.0
        } else {
            (1.0 + f64::from(fraction) / 1024.0) * 2f64.powi(exponent as i32 - 15)
        };
        assert_eq!(f64::from(f32::from_bits(output.a.x)), want);
    }
    line(subject, "half to f32", "exact");
}

for_each_route!(t18_census, t18_functions);
