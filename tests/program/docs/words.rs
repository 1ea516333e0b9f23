//! Wording: what makes comments and pages hard to read is counted, and must not come back.

use super::{files, name, text};
use trisect_tests::root;

/// Maximum columns of a comment's line.
const MAX_COMMENT: usize = 100;
/// Maximum columns of a line of prose in Markdown.
const MAX_PROSE: usize = 120;

/// First words of a doc summary that is a noun clause, or lacks a subject, or points at its
/// neighbour.
const CLAUSES: &[&str] = &[
    "What ",
    "Who ",
    "Which ",
    "Whether ",
    "Where ",
    "How ",
    "Of ",
    "Those ",
    "Both ",
    "None ",
    "In which ",
    "For the ",
    "By ",
    "The same",
    "As ",
    "Likewise",
];

/// Returns the line, from 1, and a message for each line of Rust that breaks a rule.
fn faults(source: &str) -> Vec<(usize, &'static str)> {
    let mut found = Vec::new();
    let mut follows_doc = false;
    for (index, line) in source.lines().enumerate() {
        let trimmed = line.trim_start();
        let doc = trimmed.strip_prefix("///").or_else(|| trimmed.strip_prefix("//!"));
        if let Some(doc) = doc {
            let summary = doc.trim_start();
            let clause = CLAUSES.iter().any(|words| summary.starts_with(words));
            if !follows_doc && clause {
                found.push((
                    index + 1,
                    "a summary that does not name the thing or say what the function does",
                ));
            }
        }
        let table = doc.is_some_and(|doc| doc.trim_start().starts_with('|'));
        if trimmed.starts_with("//") && !table && line.chars().count() > MAX_COMMENT {
            found.push((index + 1, "a comment beyond 100 columns"));
        }
        let constant = trimmed.contains("const ") || trimmed.contains("static ");
        if constant && ["GREATEST_", "LEAST_", "MOST_"].iter().any(|p| trimmed.contains(&format!(" {p}"))) {
            found.push((index + 1, "MAX_ and MIN_ are the usual prefixes"));
        }
        follows_doc = doc.is_some();
    }
    found
}

/// Returns the numbers, from 1, of the lines of prose that are too wide. Tables, code, headings and
/// images are exempt.
fn wide(page: &str) -> Vec<usize> {
    let mut found = Vec::new();
    let mut fenced = false;
    for (index, line) in page.lines().enumerate() {
        fenced ^= line.trim_start().starts_with("```");
        let aside =
            ["|", "    ", "#", "!["].iter().any(|start| line.trim_start_matches(' ').starts_with(start))
                || line.starts_with("    ");
        if !fenced && !aside && line.chars().count() > MAX_PROSE {
            found.push(index + 1);
        }
    }
    found
}

#[test]
fn comments_are_plain() {
    let all: Vec<String> = files(&[".rs"])
        .iter()
        .flat_map(|path| {
            let place = name(path);
            faults(&text(path)).into_iter().map(move |(line, fault)| format!("{place}:{line}: {fault}"))
        })
        .collect();
    assert!(all.is_empty(), "{} places\n{}", all.len(), all.join("\n"));
}

#[test]
fn prose_fits() {
    let all: Vec<String> = files(&[".md"])
        .iter()
        .flat_map(|path| {
            let place = name(path);
            wide(&text(path)).into_iter().map(move |line| format!("{place}:{line}"))
        })
        .collect();
    assert!(all.is_empty(), "{} lines beyond {MAX_PROSE} columns\n{}", all.len(), all.join("\n"));
}

/// The negative control: each fault is found where it is, and nothing else.
#[test]
fn faults_are_found() {
    let long = "x".repeat(MAX_COMMENT);
    let source = format!(
        "/// What it is.\n/// Whether more.\nfn a() {{}}\n// {long}\n/// Returns it.\nconst {}_SIZE: u32 = 1;\n",
        "LEAST"
    );
    let lines: Vec<usize> = faults(&source).into_iter().map(|(line, _)| line).collect();
    assert_eq!(lines, [1, 4, 6]);
    let page = format!("{}\n| {0} |\n```\n{0}\n```\n", "y".repeat(MAX_PROSE + 1));
    assert_eq!(wide(&page), [1]);
}

/// The README fits on two screens.
#[test]
fn the_readme_is_short() {
    let lines = text(&root().join("README.md")).lines().count();
    assert!(lines <= 90, "{lines} lines");
}
