#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use super::*;
use std::collections::HashSet;
use std::process::Command;

/// Module with constructs that the kernels lack: functions, variables with and without
/// initialisers, declarations, and comments and strings with braces.
const MODULE: &str = r#"
// .entry of a comment { ;
.version 5.0
.target sm_61
.address_size 64
.file 1 "a;{.rs"
.pragma "nounroll; {";
.extern .func (.param .b32 r) declared (.param .b64 p);
.visible .global .align 4 .u32 counter;
.global .align 4 .u32 other_counter;
.const .align 4 .b8 table[8] = {1, 2, 3, 4, 5, 6, 7, 8};
.global .align 8 .u64 pointers[2] = {table, 0};
.func (.param .b32 result) twice(.param .b32 value);
.func helper() { ret; }
.func unused() { ret; }
	// .globl	first
.visible .entry first(
	.param .u64 first_param_0
)
.maxntid 64, 1, 1
{
	.reg .b64 %rd<3>;
	/* } of a comment */
	mov.u64 %rd1, pointers; { call.uni helper, (); }
	ld.global.u32 %r1, [counter+4];
$L__BB0_1:
	bra $L__BB0_1;
}
.visible .entry second() { call.uni (r), twice, (x); ret; }
.func (.param .b32 result) twice(.param .b32 value) { ret; }
.section .debug_str { .b8 1 }
"#;

/// Returns the symbols of `whole` that `part` names and does not define.
fn missing(whole: &str, part: &str) -> Vec<String> {
    let symbols = |text| -> HashSet<&str> {
        let statements = statements(text).into_iter();
        let named = statements.filter(|statement| matches!(statement.kind, Kind::Entry | Kind::Symbol));
        named.flat_map(defined).collect()
    };
    let (all, here) = (symbols(whole), symbols(part));
    identifiers(part).filter(|name| all.contains(name) && !here.contains(name)).map(str::to_owned).collect()
}

fn entries(ptx: &str) -> Vec<&str> {
    statements(ptx).into_iter().filter(|s| s.kind == Kind::Entry).flat_map(defined).collect()
}

#[test]
fn statements_of_all_kinds() {
    let kinds: Vec<Kind> = statements(MODULE).iter().map(|statement| statement.kind).collect();
    let count = |kind| kinds.iter().filter(|&&other| other == kind).count();
    let counts = [Kind::Header, Kind::Symbol, Kind::Entry, Kind::Section].map(count);
    assert_eq!(counts, [4, 10, 2, 1], "{:#?}", statements(MODULE));
}

#[test]
fn what_is_reached_stays_and_nothing_else() {
    let first = entry(MODULE, "first").unwrap();
    assert_eq!(entries(&first), ["first"]);
    for kept in [
        ".version 5.0\n",
        ".file 1",
        "pointers[2]",
        "table[8]",
        ".func helper",
        "global .align 4 .u32 counter",
    ] {
        assert!(first.contains(kept), "{kept:?} in {first}");
    }
    for gone in ["second", "twice", "unused", "other_counter", "declared", ".section"] {
        assert!(!first.contains(gone), "{gone:?} in {first}");
    }
    let second = entry(MODULE, "second").unwrap();
    assert_eq!((entries(&second), second.matches("twice(").count()), (vec!["second"], 2), "{second}");
    assert!(missing(MODULE, &first).is_empty() && missing(MODULE, &second).is_empty());
    // `missing` detects a lost function, and a lost variable that only another variable names.
    assert_eq!(missing(MODULE, &first.replace(".func helper() { ret; }", "")), ["helper"]);
    assert_eq!(missing(MODULE, &first.replace(".b8 table[8]", ".b8 chart[8]")), ["table"]);
}

#[test]
fn no_such_entry_point() {
    for name in ["", "third", "helper", "counter", "first_param_0"] {
        assert_eq!(entry(MODULE, name), None, "{name:?}");
    }
    assert_eq!(entry("", "first"), None);
}

/// The text comes from the program itself, but cut text must not make the program panic.
#[test]
fn cut_anywhere() {
    for end in 0..MODULE.len() {
        let _ = entry(&MODULE[..end], "second");
    }
}

/// Returns a module of many entry points: the probes.
fn probes() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/probes/prebuilt/probes.precise.ptx");
    std::fs::read_to_string(path).unwrap()
}

/// Each entry point is extracted with all that it needs, and without others.
#[test]
fn each_entry_point_by_itself() {
    let ptx = probes();
    let modules = split(&ptx);
    assert!(modules.len() > 5, "{}", modules.len());
    for (name, module) in modules {
        assert_eq!(entries(&module), [name.as_str()]);
        assert_eq!(missing(&ptx, &module), Vec::<String>::new(), "{name}");
        // The body is that of the original, and so is the machine code.
        let body = statements(&ptx).into_iter().find(|s| defined(*s) == [name.as_str()]).unwrap();
        assert!(module.contains(body.text), "{name}");
    }
}

/// NVIDIA's assembler accepts the extracted modules. Skipped unless `TRISECT_PTXAS` names it.
#[test]
fn ptxas_assembles_them() {
    let Some(ptxas) = std::env::var_os("TRISECT_PTXAS") else {
        eprintln!("SKIPPED: TRISECT_PTXAS names no ptxas");
        return;
    };
    let folder = std::env::temp_dir().join(format!("trisect-extract-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let assembles = |module: &str| {
        let (from, to) = (folder.join("module.ptx"), folder.join("module.cubin"));
        std::fs::write(&from, module).unwrap();
        // With the lowest optimisation: only whether it assembles matters.
        let mut command = Command::new(&ptxas);
        command.args(["-O0", "-arch=sm_90", "-o"]).arg(to).arg(from).output().unwrap().status.success()
    };
    // Two entry points only: the others have the same form, and all would take too long.
    for (name, module) in split(&probes()).into_iter().take(2) {
        assert!(assembles(&module), "{name}");
        assert!(!assembles(&module.replacen(".reg .b64", ".reg .b65", 1)), "ptxas refuses nothing");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
