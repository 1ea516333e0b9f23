//! Outlining of correctly rounded divisions and square roots in PTX: a kernel calls one function
//! for all places of an operation. Large kernels, which do not fit a GPU's instruction cache, are
//! faster with it, small ones slower (docs/notebook/cuda-arithmetic.md).

use std::fmt::Write;

/// Operations that are outlined, with the names of their functions. `ptxas` expands each to 8 to 10
/// instructions at each place.
const OPERATIONS: [(&str, &str); 3] =
    [("div.rn.f32", "outlined_div"), ("rcp.rn.f32", "outlined_rcp"), ("sqrt.rn.f32", "outlined_sqrt")];

/// Returns the module of one entry point with these operations outlined. Their results are the
/// same. Operations under a predicate stay, as does a module without an entry point.
pub(crate) fn outlined(module: &str) -> String {
    let Some(entry) = module.find(".visible .entry") else { return module.to_owned() };
    let (head, body) = module.split_at(entry);
    let mut text = String::with_capacity(module.len() + module.len() / 4);
    text.push_str(head);
    for (operation, name) in OPERATIONS {
        if body.contains(operation) {
            text.push_str(&function(operation, name));
        }
    }
    for line in body.lines() {
        text.push_str(&call(line).unwrap_or_else(|| line.to_owned()));
        text.push('\n');
    }
    text
}

/// Returns the function of an operation.
fn function(operation: &str, name: &str) -> String {
    let operands: &[&str] = if operation.starts_with("div") { &["a", "b"] } else { &["a"] };
    let list = |item: fn(&str) -> String, between: &str| {
        operands.iter().map(|operand| item(operand)).collect::<Vec<_>>().join(between)
    };
    format!(
        ".func (.param .b32 r) {name}({})\n{{\n\t.reg .b32 %a, %b, %r;\n{}\t{operation} %r, {};\n\tst.param.b32 [r], %r;\n\tret;\n}}\n",
        list(|operand| format!(".param .b32 {operand}"), ", "),
        list(|operand| format!("\tld.param.b32 %{operand}, [{operand}];\n"), ""),
        list(|operand| format!("%{operand}"), ", "),
    )
}

/// Returns the call in place of a line with an operation; `None` for other lines.
fn call(line: &str) -> Option<String> {
    let (operation, rest) = line.trim_start().split_once(char::is_whitespace)?;
    let (_, name) = OPERATIONS.into_iter().find(|(known, _)| *known == operation)?;
    let mut registers = rest.trim_end().strip_suffix(';')?.split(',').map(str::trim);
    let result = registers.next()?;
    let (mut text, mut list) = ("\t{ .param .b32 r; ".to_owned(), String::new());
    for (index, operand) in registers.enumerate() {
        // Writing to a string does not fail.
        let _ = write!(text, ".param .b32 p{index}; st.param.b32 [p{index}], {operand}; ");
        let _ = write!(list, "{}p{index}", if index > 0 { ", " } else { "" });
    }
    let _ = write!(text, "call.uni (r), {name}, ({list}); ld.param.b32 {result}, [r]; }}");
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ptxas::Ptxas;

    const MODULE: &str = ".version 6.0\n.visible .entry kernel()\n{\n\tdiv.rn.f32 \t%f1, %f2, 0f3F800000;\n\
        \t@%p1 sqrt.rn.f32 \t%f3, %f1;\n\trcp.rn.f32 %f4, %f3;\n\tmul.rn.f32 %f5, %f4, %f4;\n}\n";

    #[test]
    fn operations_become_calls() {
        let text = outlined(MODULE);
        let (functions, body) = text.split_at(text.find(".visible .entry").expect("an entry point"));
        assert_eq!(functions.matches(".func").count(), 3);
        assert!(functions.contains("div.rn.f32 %r, %a, %b;") && functions.contains("rcp.rn.f32 %r, %a;"));
        assert!(body.contains("st.param.b32 [p1], 0f3F800000; call.uni (r), outlined_div, (p0, p1);"));
        assert!(body.contains("call.uni (r), outlined_rcp, (p0); ld.param.b32 %f4, [r]; }"));
        assert!(body.contains("@%p1 sqrt.rn.f32 \t%f3, %f1;") && body.contains("mul.rn.f32 %f5"));
        assert!(!body.contains("div.rn.f32") && !body.contains("rcp.rn.f32"));
    }

    #[test]
    fn other_modules_stay() {
        for module in ["", "div.rn.f32 %f1, %f2, %f3;", ".visible .entry kernel()\n{\n}\n"] {
            assert_eq!(outlined(module), module);
        }
    }

    /// The assembler accepts the largest kernel with calls, which shrink it.
    #[test]
    fn ptxas_assembles_calls() {
        let Some(ptxas) = Ptxas::find() else { return };
        let module = crate::ptx("render_persistent", false).expect("a kernel");
        let (inline, calls) = (ptxas.assemble(&module), ptxas.assemble(&outlined(&module)));
        assert!(calls.is_some() && calls < inline, "{calls:?} {inline:?}");
        assert_eq!(ptxas.assemble(&outlined(&module).replace("outlined_div,", "no_such_function,")), None);
    }
}
