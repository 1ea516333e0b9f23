//! Pages and sections that are made from the program and its sources, so that they cannot drift.
//!
//! A test compares them. With `UPDATE_DOCS` set it writes them instead.

use super::text;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use trisect_kernels::{SCENE_BINDINGS, is_level, workgroup};
use trisect_shared::bsdf;
use trisect_shared::features::{CHOICES, NAMES, STRATEGY};
use trisect_tests::program::trisect;
use trisect_tests::root;

/// Compares a page with what it should be, or writes it.
pub(super) fn compare(page: &str, wanted: &str) {
    let path = root().join(page);
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(&path, wanted).unwrap();
    }
    let found = text(&path);
    let differs = found.lines().zip(wanted.lines()).position(|(a, b)| a != b);
    let line = differs.unwrap_or_else(|| found.lines().count().min(wanted.lines().count()));
    assert!(
        found == wanted,
        "{page}:{}: is {:?}, the program says {:?}; UPDATE_DOCS=1 writes it anew",
        line + 1,
        found.lines().nth(line),
        wanted.lines().nth(line)
    );
}

/// Returns `page` with the section between its markers for `name` replaced.
fn with_section(page: &str, name: &str, content: &str) -> String {
    let marker = format!("<!-- generated: {name} -->\n");
    let (before, rest) = page.split_once(&marker).unwrap_or_else(|| panic!("no section {name}"));
    let (_, after) = rest.split_once("<!-- end -->").unwrap_or_else(|| panic!("{name} has no end"));
    format!("{before}{marker}{}\n<!-- end -->{after}", content.trim_end())
}

/// Returns the help of a command and of the commands below it, as sections.
fn help(command: &[&str], page: &mut String) {
    let output = trisect(&[command, &["--help"]].concat());
    assert!(output.status.success(), "{command:?}");
    let said = String::from_utf8(output.stdout).unwrap();
    let trimmed: Vec<&str> = said.trim_end().lines().map(str::trim_end).collect();
    let level = "#".repeat(command.len().min(2) + 1);
    write!(
        page,
        "{level} `trisect{}`\n\n",
        command.iter().map(|word| format!(" {word}")).collect::<String>()
    )
    .unwrap();
    write!(page, "```text\n{}\n```\n\n", trimmed.join("\n")).unwrap();
    let below =
        said.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    for line in below.filter(|line| !line.starts_with("    ")) {
        let name = line.split_whitespace().next().unwrap_or_default();
        if name != "help" {
            help(&[command, &[name]].concat(), page);
        }
    }
}

#[test]
fn generated_command_line() {
    // The options of ranks are shown by a build that has them.
    if !trisect_tests::mpi::available() {
        return;
    }
    let mut page = String::from(
        "# Command line\n\n\
         This page is generated from the parser of a build with MPI (`--features mpi`);\n\
         a build without it shows no option of ranks.\n\
         `trisect man -o FOLDER` writes the same as manual pages, `trisect completions SHELL` completes it.\n\n",
    );
    help(&[], &mut page);
    compare("docs/reference/command-line.md", &(page.trim_end().to_owned() + "\n"));
}

/// Returns the table of features: name, kind, and what the source says of it.
fn features() -> String {
    let source = text(&root().join("shared/src/features.rs"));
    let mut table = String::from("| feature | | content |\n|---|---|---|");
    for (feature, name) in NAMES {
        let constant = format!("pub const {}: Features = ", name.to_uppercase().replace('-', "_"));
        let (before, _) = source.split_once(&constant).unwrap_or_else(|| panic!("no constant for {name}"));
        let lines: Vec<&str> = before.lines().rev().map_while(|line| line.strip_prefix("/// ")).collect();
        let about = lines.into_iter().rev().collect::<Vec<_>>().join(" ").replace("](crate::slabs)", "]");
        let about = about.replace("(crate::aovs::AovSums)", "").replace(['[', ']'], "");
        let kind = match feature {
            feature if feature & CHOICES != 0 => "choice",
            feature if feature & STRATEGY != 0 => "method",
            _ => "need",
        };
        write!(table, "\n| `{name}` | {kind} | {about} |").unwrap();
    }
    for (_, name) in bsdf::NAMES {
        write!(table, "\n| `{name}` | need | Material of this kind. |").unwrap();
    }
    table
}

/// Returns the body of a macro of a source.
fn body<'a>(source: &'a str, name: &str) -> &'a str {
    let start = source.find(&format!("macro_rules! {name} {{")).unwrap_or_else(|| panic!("no macro {name}"));
    let rest = &source[start..];
    rest[1..].find("macro_rules!").map_or(rest, |end| &rest[..=end])
}

/// Returns the entry points that a list names, such as `for_each_pass`.
fn entry_points(list: &str) -> Vec<String> {
    let source = text(&root().join("kernels/src/lib.rs"));
    let named = body(&source, list).lines().filter_map(|line| {
        let (_, rest) = line.strip_prefix("            ")?.split_once(" \"")?;
        Some(rest.split_once("\":")?.0.to_owned())
    });
    named.collect()
}

/// Returns an element type without references, pointers, slices and the layout of SPIR-V buffers.
fn element(kind: &str) -> &str {
    let plain = ["&mut ", "&", "*mut ", "*const "].iter().fold(kind, |t, p| t.strip_prefix(p).unwrap_or(t));
    let plain = plain.trim_start_matches('[').trim_end_matches(']');
    plain.strip_prefix("Packed<").and_then(|t| t.strip_suffix('>')).unwrap_or(plain)
}

/// Returns the bindings of a macro's entry points; `records` are what stands for `$record`.
///
/// The arguments of the PTX entry points must be the same records in the same order.
fn bindings(name: &str, records: &str) -> String {
    let spirv = text(&root().join("kernels/src/spirv.rs"));
    let ptx = text(&root().join("kernels/src/ptx.rs"));
    let arguments = body(&ptx, name).split_once("extern \"ptx-kernel\" fn").unwrap().1;
    let arguments = arguments.split_once(") {").unwrap().0.lines().filter_map(|line| line.split_once(": "));
    let mut of_ptx: Vec<&str> = arguments.map(|(_, kind)| kind.trim_end_matches(',')).collect();
    let mut table = String::from("| binding | SPIR-V, set 0 | PTX argument | content |\n|---|---|---|---|");
    for line in body(&spirv, name).lines() {
        let Some((place, rest)) =
            line.trim_start().strip_prefix("#[spirv(").and_then(|l| l.split_once(")] "))
        else {
            continue;
        };
        let Some((class, number)) = place.split_once(", descriptor_set = 0, binding = ") else { continue };
        let kind = rest.split_once(": ").unwrap().1.trim_end_matches(',');
        if kind == "&SceneLaunch" {
            table.push_str(&scene_bindings(&mut of_ptx));
            continue;
        }
        if name == "entry_point" && !kind.starts_with("&mut") {
            continue; // an array of the scene
        }
        let other = of_ptx.remove(0);
        assert_eq!(element(kind), element(other), "binding {number} of {name}");
        let written = if kind.starts_with("&mut") { ", written" } else { "" };
        assert_eq!(other.starts_with("*mut"), !written.is_empty(), "binding {number} of {name}");
        let (class, by) = match class {
            "uniform" => ("uniform", "by value"),
            _ => ("storage", "pointer"),
        };
        let content = match (class, element(kind)) {
            ("uniform", record) => format!("`{record}`"),
            (_, "$record") => records.to_owned(),
            (_, record) => format!("`[{record}]`"),
        };
        write!(table, "\n| {number} | {class}{written} | {by}{written} | {content} |").unwrap();
    }
    assert!(of_ptx.is_empty(), "{name}: {of_ptx:?} are arguments without a binding");
    table
}

/// Returns the rows of the launch record and of the arrays of a scene, and takes their arguments.
fn scene_bindings(of_ptx: &mut Vec<&str>) -> String {
    let arrays = of_ptx.split_off(2);
    assert_eq!(*of_ptx, ["RenderParams", "SceneLengths"]);
    let mut rows = String::from(
        "\n| 0 | uniform | | `SceneLaunch` |\n| | | by value | `RenderParams` |\n| | | by value | `SceneLengths` |",
    );
    let joined: Vec<usize> = SCENE_BINDINGS.into_iter().flatten().copied().collect();
    assert_eq!(joined.iter().copied().collect::<BTreeSet<_>>(), (0..joined.len()).collect());
    let (of_scene, others) = arrays.split_at(joined.len());
    for (index, kind) in of_scene.iter().enumerate() {
        let binding = SCENE_BINDINGS.iter().position(|arrays| arrays.contains(&index)).unwrap();
        let place = if SCENE_BINDINGS[binding][0] == index { "" } else { ", behind others" };
        write!(rows, "\n| {} | storage{place} | pointer | `[{}]` |", binding + 1, element(kind)).unwrap();
    }
    *of_ptx = others.to_vec();
    rows
}

/// Returns the lines that name the entry points of some lists, by the size of their work groups.
fn work_groups(lists: &[&str]) -> String {
    let names: Vec<String> = lists.iter().flat_map(|list| entry_points(list)).collect();
    let (levels, others): (Vec<&String>, Vec<&String>) = names.iter().partition(|name| is_level(name));
    let mut lines = String::new();
    for group in [others, levels] {
        let Some(first) = group.first() else { continue };
        let (across, down) = workgroup(first);
        let listed: Vec<String> = group.iter().map(|name| format!("`{name}`")).collect();
        writeln!(lines, "- work group {across} x {down}: {}", listed.join(", ")).unwrap();
    }
    lines
}

/// Returns the sections on bindings.
fn all_bindings() -> String {
    let (across, down) = workgroup("render");
    format!(
        "### Render kernels and `first_hit`\n\n- work group {across} x {down}: {}, `first_hit`\n\n{}\n\n\
         ### Passes of the filter\n\n{}\n{}\n\n\
         ### Sums of frames\n\n{}\n{}\n\n\
         ### Passes over the history\n\n{}\n{}\n\n\
         ### Totals of the film\n\n{}\n{}\n\n\
         ### Display\n\n{}\n{}",
        entry_points("for_each_render").iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "),
        bindings("entry_point", "`[PixelSums]` or `[FirstHit]`"),
        work_groups(&["for_each_pass", "for_each_level"]),
        bindings("pass", ""),
        work_groups(&["for_each_accumulation"]),
        bindings("accumulations", ""),
        work_groups(&["for_each_temporal"]),
        bindings("temporal", ""),
        work_groups(&["for_each_total"]),
        bindings("totals", ""),
        work_groups(&["for_each_display"]),
        bindings("displays", ""),
    )
}

/// Returns the table of records: bytes, alignment, and the item that has one.
fn records() -> String {
    use trisect_shared::{
        aovs::AovSums,
        attributes::{MeshVertex, VertexAttributes},
        bvh::BvhNode,
        camera::Camera,
        denoise::{DenoiseParams, FilteredPixel, GBufferTexel, HistoryPixel, PinholeView},
        display::DisplayParams,
        environment::EnvironmentTexel,
        film::{Compensation, PixelSums},
        light::Light,
        material::Material,
        params::RenderParams,
        path::FirstHit,
        planar::Planar,
        scene::{FirstRows, SceneLaunch, SceneLengths},
        sky::Sky,
        sphere::Sphere,
        texture::{Texel, Texture},
        totals::TotalsParams,
        triangle::Triangle,
        wide::{SpherePacket, TrianglePacket, WideNode},
    };
    let mut table = String::from("| record | bytes | alignment | one for each |\n|---|---|---|---|");
    macro_rules! rows {
        ($($record:ident $each:literal,)*) => {$(
            let (size, align) = (size_of::<$record>(), align_of::<$record>());
            write!(table, "\n| `{}` | {size} | {align} | {} |", stringify!($record), $each).unwrap();
        )*};
    }
    rows! {
        RenderParams "launch of a render kernel",
        Camera "part of `RenderParams`",
        Sky "part of `RenderParams`",
        SceneLengths "launch, PTX only",
        SceneLaunch "launch of a render kernel, SPIR-V only",
        FirstRows "part of `SceneLaunch`",
        Sphere "primitive",
        Planar "primitive",
        Triangle "primitive",
        MeshVertex "vertex of a mesh instance",
        VertexAttributes "vertex with a tangent, a colour or second texture coordinates",
        Material "material",
        Light "light",
        Texture "use of an image",
        Texel "texel of a texture",
        EnvironmentTexel "texel of the environment map",
        BvhNode "inner node of the binary BVH, and tile entry",
        WideNode "node of the wide BVH",
        TrianglePacket "up to 8 triangles",
        SpherePacket "up to 8 spheres",
        PixelSums "pixel",
        Compensation "pixel",
        AovSums "pixel",
        FirstHit "pixel",
        DenoiseParams "launch of a denoising pass",
        PinholeView "part of `DenoiseParams`, twice",
        FilteredPixel "pixel",
        GBufferTexel "pixel",
        HistoryPixel "pixel, of live frames",
        TotalsParams "launch over a film's totals",
        DisplayParams "launch of `display`",
    }
    table
}

#[test]
fn generated_kernels() {
    let page = "docs/reference/kernels.md";
    let found = text(&root().join(page));
    let wanted = [("features", features()), ("bindings", all_bindings()), ("records", records())]
        .iter()
        .fold(found, |page, (name, content)| with_section(&page, name, content));
    compare(page, &wanted);
}

/// The negative control: another content is another page, and one without markers is refused.
#[test]
fn a_changed_section_is_noticed() {
    let page = "a\n<!-- generated: x -->\nold\n<!-- end -->\nb\n";
    assert_eq!(with_section(page, "x", "old\n"), page);
    assert_ne!(with_section(page, "x", "new"), page);
    assert!(std::panic::catch_unwind(|| with_section(page, "y", "")).is_err());
}
