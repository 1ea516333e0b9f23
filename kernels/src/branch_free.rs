//! Correctly rounded reciprocals and square roots in PTX without branches.
//!
//! `ptxas` tests the operand of each and branches to a function for those out of range. Branches
//! split the code that it schedules: kernels without them, and without divisions, take 0.75 to 0.95
//! of the time (docs/notebook/cuda-arithmetic.md).

use crate::ptx_text::instruction;

/// Reciprocal of `$x` into `$d`, for any number.
///
/// The operand is scaled into the range of the approximation, and one Newton step with fused
/// products, e = 1 - x y and y + y (e + e²), rounds correctly, also where the result is denormal.
/// For zero, an infinite number and NaN, e is no number below 1, and the approximation is exact.
const RECIPROCAL: &str = "\
{ .reg .f32 %size, %scale, %y, %e, %more; .reg .pred %small, %valid;
abs.f32 %size, $x;
setp.lt.f32 %small, %size, 0f3F800000;
selp.f32 %scale, 0f4F800000, 0f2F800000, %small;
mul.rn.f32 %y, $x, %scale;
rcp.approx.ftz.f32 %y, %y;
mul.rn.f32 %y, %y, %scale;
neg.f32 %e, $x;
fma.rn.f32 %e, %e, %y, 0f3F800000;
abs.f32 %size, %e;
setp.lt.f32 %valid, %size, 0f3F800000;
fma.rn.f32 %more, %e, %e, %e;
@%valid fma.rn.f32 %y, %y, %more, %y;
mov.b32 $d, %y; }
";

/// Reciprocal of `$x` into `$d`, where `$x` is a square root: 0, infinite, NaN, or far from both
/// ends of the range, so that it needs no scale.
const RECIPROCAL_OF_ROOT: &str = "\
{ .reg .f32 %size, %y, %e; .reg .pred %valid;
rcp.approx.ftz.f32 %y, $x;
neg.f32 %e, $x;
fma.rn.f32 %e, %e, %y, 0f3F800000;
abs.f32 %size, %e;
setp.lt.f32 %valid, %size, 0f3F800000;
@%valid fma.rn.f32 %y, %y, %e, %y;
mov.b32 $d, %y; }
";

/// Square root of `$x` into `$d`, for any number.
///
/// A number below 2⁻⁹⁶ is scaled, so that the remainder x - g² of the root's approximation g is
/// exact. Zero and infinity are their own roots; NaN comes from the approximation.
const ROOT: &str = "\
{ .reg .f32 %x, %y, %g, %h, %e; .reg .pred %small, %valid;
mov.b32 %x, $x;
setp.lt.f32 %small, %x, 0f0F800000;
@%small mul.rn.f32 %x, %x, 0f5F800000;
rsqrt.approx.ftz.f32 %y, %x;
mul.rn.f32 %g, %x, %y;
mul.rn.f32 %h, %y, 0f3F000000;
neg.f32 %e, %g;
fma.rn.f32 %e, %e, %g, %x;
setp.neu.f32 %valid, %x, 0f00000000;
setp.neu.and.f32 %valid, %x, 0f7F800000, %valid;
@%valid fma.rn.f32 %x, %e, %h, %g;
@%small mul.rn.f32 %x, %x, 0f2F800000;
mov.b32 $d, %x; }
";

/// Returns a precise module without branches for reciprocals and square roots. Its results are the
/// same.
pub(crate) fn branch_free(module: &str) -> String {
    let mut text = String::with_capacity(2 * module.len());
    // Registers that hold a root.
    let mut roots: Vec<&str> = Vec::new();
    for line in module.lines() {
        let (operation, result, operand) = instruction(line);
        let template = match operation {
            "rcp.rn.f32" if roots.contains(&operand) => Some(RECIPROCAL_OF_ROOT),
            "rcp.rn.f32" => Some(RECIPROCAL),
            "sqrt.rn.f32" => Some(ROOT),
            _ => None,
        };
        match template {
            Some(template) => text.push_str(&template.replace("$x", operand).replace("$d", result)),
            None => text.extend([line, "\n"]),
        }
        // A label begins a block, and an assignment ends what was known of the register.
        if result.is_empty() {
            roots.clear();
        } else {
            roots.retain(|root| *root != result);
        }
        if operation == "sqrt.rn.f32" {
            roots.push(result);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ptxas::Ptxas;
    use std::collections::HashMap;

    /// Returns `x`, or zero of its sign if it is denormal.
    fn flushed(x: f32) -> f32 {
        if x.abs() < f32::MIN_POSITIVE { 0.0f32.copysign(x) } else { x }
    }

    /// Returns an approximation that is `off` representable numbers from the rounded value. It
    /// is the rounded value if that is the next above a power of two, just above a tie: the
    /// driver's own instructions need that, too.
    fn approximation(exact: f64, off: i32) -> f32 {
        let rounded = exact as f32;
        let is_above_tie = rounded.to_bits() & 0x007f_ffff == 1;
        let is_exact = !rounded.is_finite() || rounded == 0.0 || is_above_tie;
        flushed(if is_exact { rounded } else { f32::from_bits(rounded.to_bits().wrapping_add_signed(off)) })
    }

    /// Returns register `%out` after the instructions with `x` in register `%in`; approximations
    /// are off by `off`.
    fn run(text: &str, x: f32, off: i32) -> f32 {
        let mut numbers = HashMap::from([("%in", x)]);
        let mut predicates: HashMap<&str, bool> = HashMap::new();
        for line in text.lines().filter(|line| !line.starts_with('{')) {
            let line = line.trim_end_matches(" }").trim_end_matches(';');
            let (guard, line) = match line.strip_prefix('@') {
                Some(rest) => rest.split_once(' ').expect("an instruction"),
                None => ("", line),
            };
            if !guard.is_empty() && !predicates[guard] {
                continue;
            }
            let (operation, operands) = line.split_once(' ').expect("operands");
            let list: Vec<&str> = operands.split(", ").collect();
            let number = |index: usize| match list[index].strip_prefix("0f") {
                Some(bits) => f32::from_bits(u32::from_str_radix(bits, 16).expect("bits")),
                None => numbers[list[index]],
            };
            let result = match operation {
                "abs.f32" => number(1).abs(),
                "neg.f32" => -number(1),
                "mov.b32" => number(1),
                "mul.rn.f32" => number(1) * number(2),
                "fma.rn.f32" => number(1).mul_add(number(2), number(3)),
                "rcp.approx.ftz.f32" => approximation(1.0 / f64::from(flushed(number(1))), off),
                "rsqrt.approx.ftz.f32" => approximation(1.0 / f64::from(flushed(number(1))).sqrt(), off),
                "selp.f32" => number(if predicates[list[3]] { 1 } else { 2 }),
                "setp.lt.f32" | "setp.neu.f32" | "setp.neu.and.f32" => {
                    let (a, b) = (number(1), number(2));
                    let holds = if operation == "setp.lt.f32" { a < b } else { a != b };
                    predicates.insert(list[0], holds && list.get(3).is_none_or(|other| predicates[other]));
                    continue;
                }
                _ => panic!("{operation}"),
            };
            numbers.insert(list[0], result);
        }
        numbers["%out"]
    }

    /// Returns how many numbers do not have the rounded result whatever the approximations' error:
    /// 2¹⁶ over all bit patterns, and the ends of the ranges.
    fn wrong(template: &str, exact: fn(f32) -> f32, operand: fn(f32) -> f32) -> usize {
        let text = template.replace("$x", "%in").replace("$d", "%out");
        let numbers = (0..1u32 << 16).map(|index| index << 16 | index.wrapping_mul(0x9e37_79b9) >> 16);
        let ends = [0, 1, 0x007f_ffff, 0x0080_0000, 0x7e80_0001, 0x7f7f_ffff, 0x7f80_0000, 0x7fc0_0000];
        let signed = ends.into_iter().flat_map(|bits| [bits, bits | 1 << 31]);
        let same = |a: f32, b: f32| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan();
        let all = numbers.chain(signed).map(|bits| operand(f32::from_bits(bits)));
        all.filter(|&x| (-1..=1).any(|off| !same(run(&text, x, off), exact(x)))).count()
    }

    #[test]
    fn results_are_correctly_rounded() {
        let reciprocal: fn(f32) -> f32 = |x| 1.0 / x;
        assert_eq!(wrong(RECIPROCAL, reciprocal, |x| x), 0);
        assert_eq!(wrong(RECIPROCAL_OF_ROOT, reciprocal, f32::sqrt), 0);
        assert_eq!(wrong(ROOT, f32::sqrt, |x| x), 0);
        // Negative controls: no scale, no Newton step, no test for zero and infinity.
        assert!(wrong(RECIPROCAL_OF_ROOT, reciprocal, |x| x) > 100);
        let approximate = RECIPROCAL.replace("%y, %more, %y", "%y, 0f00000000, %y");
        assert!(wrong(&approximate, reciprocal, |x| x) > 10_000);
        assert!(wrong(&ROOT.replace("@%valid ", ""), f32::sqrt, |x| x) > 3);
        assert!(wrong(&ROOT.replace("@%small ", ""), f32::sqrt, |x| x) > 1000);
    }

    /// Returns what some instructions become.
    fn of(lines: &[&str]) -> String {
        branch_free(&lines.join("\n"))
    }

    #[test]
    fn reciprocals_of_roots_need_no_scale() {
        let (root, reciprocal) = ("\tsqrt.rn.f32 \t%f1, %f2;", "\trcp.rn.f32 \t%f3, %f1;");
        let both = of(&[root, reciprocal]);
        assert!(both.contains("rsqrt.approx") && both.contains("mov.b32 %f1, %x;"), "{both}");
        assert!(both.contains("rcp.approx") && both.contains("mov.b32 %f3, %y;"), "{both}");
        assert!(!both.contains("%scale,"), "{both}");
        // Not if the register changes in between, or in another block.
        for between in ["add.rn.f32 %f1,%f1,%f2;", "$L__BB0_1:", "}"] {
            assert!(of(&[root, between, reciprocal]).contains("%scale,"), "{between}");
        }
        assert_eq!(of(&["div.rn.f32 %f1,%f2,%f3;"]), "div.rn.f32 %f1,%f2,%f3;\n");
    }

    /// Render kernels have no operation that branches: their sources multiply by reciprocals.
    #[test]
    fn render_kernels_have_no_branching_operation() {
        for name in crate::ptx_names().filter(|name| name.starts_with("render")) {
            let module = branch_free(&crate::ptx(name, false).expect(name));
            for operation in ["rcp.rn.f32", "sqrt.rn.f32", "div.rn.f32"] {
                assert!(!module.contains(operation), "{name}: {operation}");
            }
        }
        let others = crate::ptx("denoise_reproject", false).expect("a pass");
        assert!(branch_free(&others).contains("div.rn.f32"), "negative control");
    }

    /// The assembler accepts the kernels.
    #[test]
    fn ptxas_assembles_them() {
        let Some(ptxas) = Ptxas::find() else { return };
        for name in crate::ptx_names() {
            let module = branch_free(&crate::ptx(name, false).expect(name));
            assert!(ptxas.assemble(&module).is_some(), "{name}");
        }
        let module = branch_free(&crate::ptx("display", false).expect("a kernel"));
        assert_eq!(ptxas.assemble(&module.replace("%valid fma", "%unknown fma")), None);
    }
}
