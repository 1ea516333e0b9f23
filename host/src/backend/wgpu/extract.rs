//! One entry point out of a module of SPIR-V, with what it needs: a driver, and naga even more so, reads all of a module before it
//! compiles one entry point of it.

use std::collections::{HashMap, HashSet};

/// Words before the first instruction.
const HEADER: usize = 5;

/// Opcodes ("SPIR-V Specification", 3.52) by their names there.
mod op {
    pub const NAME: u16 = 5;
    pub const MEMBER_NAME: u16 = 6;
    pub const STRING: u16 = 7;
    pub const LINE: u16 = 8;
    pub const EXT_INST_IMPORT: u16 = 11;
    pub const ENTRY_POINT: u16 = 15;
    pub const EXECUTION_MODE: u16 = 16;
    pub const TYPE_VOID: u16 = 19;
    pub const TYPE_PIPE: u16 = 38;
    pub const FUNCTION: u16 = 54;
    pub const FUNCTION_END: u16 = 56;
    pub const FUNCTION_CALL: u16 = 57;
    pub const STORE: u16 = 62;
    pub const COPY_MEMORY_SIZED: u16 = 64;
    pub const DECORATE: u16 = 71;
    pub const MEMBER_DECORATE: u16 = 72;
    pub const DECORATION_GROUP: u16 = 73;
    pub const IMAGE_WRITE: u16 = 99;
    pub const CONTROL_BARRIER: u16 = 224;
    pub const MEMORY_BARRIER: u16 = 225;
    pub const ATOMIC_STORE: u16 = 228;
    pub const LOOP_MERGE: u16 = 246;
    pub const SELECTION_MERGE: u16 = 247;
    pub const LABEL: u16 = 248;
    pub const BRANCH: u16 = 249;
    pub const UNREACHABLE: u16 = 255;
    pub const NO_LINE: u16 = 317;
    pub const EXECUTION_MODE_ID: u16 = 331;
    pub const DECORATE_ID: u16 = 332;
    pub const DECORATE_STRING: u16 = 5632;
}

/// An instruction: its opcode, and its words with the first.
#[derive(Clone, Copy)]
struct Instruction<'a> {
    code: u16,
    words: &'a [u32],
}

impl Instruction<'_> {
    fn word(&self, index: usize) -> Option<u32> {
        self.words.get(index).copied()
    }

    /// The id that it defines, if it does: of what may stand in a function.
    fn result(&self) -> Option<u32> {
        match self.code {
            op::STORE..=op::COPY_MEMORY_SIZED
            | op::LOOP_MERGE
            | op::SELECTION_MERGE
            | op::BRANCH..=op::UNREACHABLE
            | op::CONTROL_BARRIER
            | op::MEMORY_BARRIER
            | op::ATOMIC_STORE
            | op::IMAGE_WRITE
            | op::LINE
            | op::NO_LINE
            | op::FUNCTION_END => None,
            op::LABEL
            | op::STRING
            | op::EXT_INST_IMPORT
            | op::DECORATION_GROUP
            | op::TYPE_VOID..=op::TYPE_PIPE => self.word(1),
            _ => self.word(2),
        }
    }
}

fn instructions(words: &[u32]) -> impl Iterator<Item = Instruction<'_>> {
    let mut rest = words.get(HEADER..).unwrap_or_default();
    std::iter::from_fn(move || {
        let first = *rest.first()?;
        let (words, after) = rest.split_at(((first >> 16).max(1) as usize).min(rest.len()));
        rest = after;
        Some(Instruction { code: first as u16, words })
    })
}

/// The name in an `OpEntryPoint`: bytes from its fourth word on, to the first zero.
fn name(entry_point: Instruction) -> Vec<u8> {
    let words = entry_point.words.get(3..).unwrap_or_default();
    words.iter().flat_map(|word| word.to_le_bytes()).take_while(|&byte| byte != 0).collect()
}

/// The module with the one entry point of this name, the functions that it reaches and all types, constants and variables. `None` where
/// there is no such entry point.
pub(super) fn entry(words: &[u32], wanted: &str) -> Option<Vec<u32>> {
    let named = |i: &Instruction| i.code == op::ENTRY_POINT && name(*i) == wanted.as_bytes();
    let id = instructions(words).find(named)?.word(2)?;
    let kept = reached(words, id);

    let mut gone = HashSet::new();
    let mut function = None;
    for instruction in instructions(words) {
        if instruction.code == op::FUNCTION {
            function = instruction.word(2);
        }
        if function.is_some_and(|function| !kept.contains(&function)) {
            gone.extend(instruction.result());
        }
        if instruction.code == op::FUNCTION_END {
            function = None;
        }
    }

    let mut text = words.get(..HEADER)?.to_vec();
    let mut function = None;
    for instruction in instructions(words) {
        if instruction.code == op::FUNCTION {
            function = instruction.word(2);
        }
        let keep = match instruction.code {
            op::ENTRY_POINT => named(&instruction),
            op::EXECUTION_MODE | op::EXECUTION_MODE_ID => instruction.word(1) == Some(id),
            op::NAME
            | op::MEMBER_NAME
            | op::DECORATE
            | op::MEMBER_DECORATE
            | op::DECORATE_ID
            | op::DECORATE_STRING => instruction.word(1).is_none_or(|target| !gone.contains(&target)),
            _ => function.is_none_or(|function| kept.contains(&function)),
        };
        if keep {
            text.extend(instruction.words);
        }
        if instruction.code == op::FUNCTION_END {
            function = None;
        }
    }
    Some(text)
}

/// The function with this id, and those that it calls, and so on.
fn reached(words: &[u32], id: u32) -> HashSet<u32> {
    let mut calls: HashMap<u32, Vec<u32>> = HashMap::new();
    let mut function = 0;
    for instruction in instructions(words) {
        match (instruction.code, instruction.word(2), instruction.word(3)) {
            (op::FUNCTION, Some(id), _) => function = id,
            (op::FUNCTION_CALL, _, Some(callee)) => calls.entry(function).or_default().push(callee),
            _ => {}
        }
    }
    let (mut kept, mut open) = (HashSet::from([id]), vec![id]);
    while let Some(function) = open.pop() {
        for &callee in calls.get(&function).into_iter().flatten() {
            if kept.insert(callee) {
                open.push(callee);
            }
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use std::io::Write;
    use std::process::{Command, Stdio};
    use trisect_kernels::{FIRST_HIT, SPIRV, VARIANTS};

    fn module() -> Vec<u32> {
        bytemuck::pod_collect_to_vec(SPIRV)
    }

    fn count(words: &[u32], code: u16) -> usize {
        instructions(words).filter(|instruction| instruction.code == code).count()
    }

    /// Ids that annotations name and nothing defines.
    fn orphans(words: &[u32]) -> usize {
        let annotates =
            |code| matches!(code, op::NAME..=op::MEMBER_NAME | op::DECORATE..=op::MEMBER_DECORATE);
        let header = |code| matches!(code, op::ENTRY_POINT..=op::EXECUTION_MODE);
        let defined: HashSet<u32> = instructions(words)
            .filter(|i| !annotates(i.code) && !header(i.code))
            .filter_map(|i| i.result())
            .collect();
        instructions(words).filter(|i| annotates(i.code) && !defined.contains(&i.words[1])).count()
    }

    fn valid(words: &[u32]) -> Option<bool> {
        let mut command = Command::new("spirv-val");
        command.args(["--target-env", "vulkan1.2", "-"]).stdin(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().ok()?;
        // It may refuse a module before it has read all of it.
        let _ = child.stdin.take().unwrap().write_all(bytemuck::cast_slice(words));
        Some(child.wait().unwrap().success())
    }

    #[test]
    fn each_kernel_by_itself() {
        let whole = module();
        for entry_point in VARIANTS.iter().map(|variant| variant.name).chain([FIRST_HIT]) {
            let words = entry(&whole, entry_point).unwrap();
            assert_eq!([op::ENTRY_POINT, op::EXECUTION_MODE].map(|code| count(&words, code)), [1, 1]);
            assert!(
                instructions(&words).any(|i| i.code == op::ENTRY_POINT && name(i) == entry_point.as_bytes())
            );
            assert_eq!(orphans(&words), 0, "{entry_point}");
            assert!(words.len() < whole.len() / 2, "{entry_point}");
            match valid(&words) {
                Some(valid) => assert!(valid, "{entry_point}"),
                None => eprintln!("SKIPPED: no spirv-val (Debian: spirv-tools)"),
            }
        }
    }

    /// Sabotage: what an extraction could forget is found, by the count of orphans and by the validator.
    #[test]
    fn leftovers_are_found() {
        let whole = module();
        let words = entry(&whole, FIRST_HIT).unwrap();
        let lost: Vec<u32> = {
            let mut lost = words[..HEADER].to_vec();
            let body = instructions(&words).filter(|i| i.code != op::LABEL);
            body.for_each(|i| lost.extend(i.words));
            lost
        };
        let render =
            instructions(&whole).find(|i| i.code == op::ENTRY_POINT && name(*i) == b"render").unwrap();
        let decoration = [3 << 16 | u32::from(op::DECORATE), render.words[2], 42];
        let before = instructions(&words).take_while(|i| i.code != op::DECORATE);
        let place = HEADER + before.map(|i| i.words.len()).sum::<usize>();
        let mut orphaned = words.clone();
        orphaned.splice(place..place, decoration);
        assert_eq!((orphans(&words), orphans(&orphaned)), (0, 1));
        for broken in [lost, orphaned] {
            assert_ne!(valid(&broken), Some(true));
        }
    }

    /// `first` calls `second`, and `third` nothing: functions of one block, ids 1 to 6 types and functions.
    #[test]
    fn calls_are_followed() {
        let word = |code: u16, operands: &[u32]| {
            let mut words = vec![(operands.len() as u32 + 1) << 16 | u32::from(code)];
            words.extend(operands);
            words
        };
        let text = |name: &str| u32::from_le_bytes([name.as_bytes()[0], 0, 0, 0]);
        let function = |id: u32, label: u32, body: Vec<u32>| {
            [
                word(op::FUNCTION, &[1, id, 0, 2]),
                word(op::LABEL, &[label]),
                body,
                word(253, &[]),
                word(op::FUNCTION_END, &[]),
            ]
            .concat()
        };
        let whole = [
            vec![0x0723_0203, 0x0001_0500, 0, 20, 0],
            word(op::ENTRY_POINT, &[5, 3, text("a")]),
            word(op::ENTRY_POINT, &[5, 5, text("b")]),
            word(op::NAME, &[12, text("l")]),
            word(op::NAME, &[11, text("m")]),
            word(op::TYPE_VOID, &[1]),
            function(3, 10, word(op::FUNCTION_CALL, &[1, 13, 4])),
            function(4, 11, Vec::new()),
            function(5, 12, Vec::new()),
        ]
        .concat();
        let counts = |name| {
            let words = entry(&whole, name).unwrap();
            ([op::FUNCTION, op::NAME, op::FUNCTION_CALL].map(|code| count(&words, code)), orphans(&words))
        };
        assert_eq!(counts("a"), ([2, 1, 1], 0));
        assert_eq!(counts("b"), ([1, 1, 0], 0));
        assert!(entry(&whole, "c").is_none() && entry(&whole, "").is_none() && entry(&[], "a").is_none());
        for end in 0..whole.len() {
            let _ = entry(&whole[..end], "a"); // cut anywhere, without a panic
        }
    }
}
