//! Fast arithmetic in PTX, made from the precise kernels when a module is loaded, so that one
//! compiled form of a kernel serves both.

use crate::ptx_text::instruction;
use std::collections::HashMap;

/// Instructions of the precise kernels, and what the fast ones have instead. Without `.rn` the
/// driver may fuse a product and a sum; `div.full` is within 2 ULP; `.ftz` takes denormal numbers
/// as zero, without which the driver scales each operand.
pub const FAST_MATH: [(&str, &str); 6] = [
    ("mul.rn.f32", "mul.f32"),
    ("add.rn.f32", "add.f32"),
    ("sub.rn.f32", "sub.f32"),
    ("div.rn.f32", "div.full.ftz.f32"),
    (SQUARE_ROOT, "sqrt.approx.ftz.f32"),
    (RECIPROCAL, "rcp.approx.ftz.f32"),
];

const SQUARE_ROOT: &str = "sqrt.rn.f32";
const RECIPROCAL: &str = "rcp.rn.f32";

/// Instruction in place of a reciprocal of a square root.
const RECIPROCAL_ROOT: &str = "rsqrt.approx.ftz.f32";

/// Returns a precise PTX module with fast arithmetic.
pub(crate) fn fast(module: &str) -> String {
    let mut text = String::with_capacity(module.len());
    // Radicand of each root that is in a register.
    let mut radicands: HashMap<&str, &str> = HashMap::new();
    for line in module.lines() {
        let (operation, result, operand) = instruction(line);
        match radicands.get(operand).filter(|_| operation == RECIPROCAL) {
            Some(radicand) => text.push_str(&format!("{RECIPROCAL_ROOT} {result},{radicand};")),
            None => match FAST_MATH.iter().find(|(precise, _)| *precise == operation) {
                Some((precise, fast)) => text.push_str(&line.replacen(precise, fast, 1)),
                None => text.push_str(line),
            },
        }
        text.push('\n');
        // A label begins a block, and an assignment ends what was known of the register.
        if result.is_empty() {
            radicands.clear();
        } else {
            radicands.retain(|root, radicand| *root != result && *radicand != result);
        }
        if operation == SQUARE_ROOT && result != operand {
            radicands.insert(result, operand);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ptxas::Ptxas;

    /// Returns the fast form of some instructions.
    fn of(lines: &[&str]) -> Vec<String> {
        fast(&lines.join("\n")).lines().map(str::to_owned).collect()
    }

    #[test]
    fn roundings_become_free() {
        let precise =
            ["\tmul.rn.f32 \t%f1, %f2, %f3;", "div.rn.f32 %f1,%f2,%f3;", "fma.rn.f32 %f1,%f2,%f3,%f4;"];
        let fast =
            ["\tmul.f32 \t%f1, %f2, %f3;", "div.full.ftz.f32 %f1,%f2,%f3;", "fma.rn.f32 %f1,%f2,%f3,%f4;"];
        assert_eq!(of(&precise), fast);
    }

    #[test]
    fn reciprocals_of_roots_are_one_instruction() {
        let (root, reciprocal) = ("sqrt.rn.f32 %f1,%f2;", "rcp.rn.f32 %f3,%f1;");
        assert_eq!(of(&[root, reciprocal])[1], "rsqrt.approx.ftz.f32 %f3,%f2;");
        // Not if a register changes in between, or in another block.
        for between in ["mov.b32 %f2,%f9;", "add.rn.f32 %f1,%f1,%f2;", "$L__BB0_1:", "}"] {
            assert_eq!(of(&[root, between, reciprocal])[2], "rcp.approx.ftz.f32 %f3,%f1;", "{between}");
        }
        assert_eq!(of(&["sqrt.rn.f32 %f2,%f2;", "rcp.rn.f32 %f3,%f2;"])[1], "rcp.approx.ftz.f32 %f3,%f2;");
    }

    /// No kernel has correctly rounded operations left, and roots' reciprocals were found.
    #[test]
    fn kernels_are_fast() {
        let mut reciprocal_roots = 0;
        for name in crate::ptx_names() {
            let module = crate::ptx(name, true).unwrap_or_default();
            for (precise, _) in FAST_MATH {
                assert!(!module.contains(precise), "{name}: {precise}");
            }
            reciprocal_roots += module.matches(RECIPROCAL_ROOT).count();
        }
        assert!(reciprocal_roots > 30, "{reciprocal_roots}");
    }

    /// The assembler accepts the fast kernels.
    #[test]
    fn ptxas_assembles_them() {
        let Some(ptxas) = Ptxas::find() else { return };
        for name in crate::ptx_names() {
            let module = crate::ptx(name, true).unwrap_or_default();
            assert!(ptxas.assemble(&module).is_some(), "{name}");
        }
        let module = crate::ptx("display", true).unwrap_or_default();
        assert_eq!(ptxas.assemble(&module.replacen("mul.f32", "mul.no", 1)), None);
    }
}
