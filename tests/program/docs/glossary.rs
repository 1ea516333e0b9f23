//! The glossary: at most 60 terms, in order, each defined.

use super::text;
use trisect_tests::root;

#[test]
fn terms_are_few_ordered_and_defined() {
    let page = text(&root().join("docs/reference/glossary.md"));
    let sections: Vec<&str> = page.split("\n### ").skip(1).collect();
    let terms: Vec<String> =
        sections.iter().filter_map(|section| section.lines().next()).map(str::to_lowercase).collect();
    assert!((20..=60).contains(&terms.len()), "{} terms", terms.len());
    assert!(terms.is_sorted(), "{terms:?}");
    for section in sections {
        let (term, definition) = section.split_once('\n').unwrap_or((section, ""));
        assert!(definition.trim().len() > 30, "{term} is not defined");
    }
}
