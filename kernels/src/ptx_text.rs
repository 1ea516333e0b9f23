//! PTX as text: the parts of an instruction.

/// Returns an instruction's operation, the register that it writes and its next operand, or empty
/// texts for those that it lacks.
pub(crate) fn instruction(line: &str) -> (&str, &str, &str) {
    let (operation, operands) = line.trim().split_once(char::is_whitespace).unwrap_or_default();
    let mut operands = operands.trim_end_matches(';').split(',').map(str::trim);
    (operation, operands.next().unwrap_or_default(), operands.next().unwrap_or_default())
}
