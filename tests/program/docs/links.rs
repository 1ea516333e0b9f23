//! Every relative link of a page leads to a file, and to a heading where it names one.

use super::{files, name, text};
use std::collections::HashSet;
use std::path::Path;
use trisect_tests::root;

/// Returns the anchor that a heading gets: lower case, spaces as hyphens, no punctuation.
fn anchor(heading: &str) -> String {
    let plain = heading.trim().trim_start_matches('#').trim().to_lowercase();
    let kept = plain.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// Returns the anchors of all headings of a page, repeated ones numbered.
fn anchors(page: &str) -> HashSet<String> {
    let mut found = HashSet::new();
    let mut fenced = false;
    for line in page.lines() {
        fenced ^= line.trim_start().starts_with("```");
        if line.starts_with('#') && !fenced {
            let base = anchor(line);
            let mut new = base.clone();
            let mut count = 0;
            while !found.insert(new.clone()) {
                count += 1;
                new = format!("{base}-{count}");
            }
        }
    }
    found
}

/// Returns the targets of links and images, outside of code.
fn targets(page: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut fenced = false;
    for (index, line) in page.lines().enumerate() {
        fenced ^= line.trim_start().starts_with("```");
        if fenced || line.starts_with("    ") {
            continue;
        }
        // Code spans may hold what looks like a link.
        let prose: String = line.split('`').step_by(2).collect::<Vec<_>>().join("`");
        for rest in prose.split("](").skip(1) {
            if let Some((target, _)) = rest.split_once(')') {
                found.push((index + 1, target.to_owned()));
            }
        }
    }
    found
}

/// Returns a message for each link of `page`, which lies at `path`, that leads nowhere.
fn broken(path: &Path, page: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (line, target) in targets(page) {
        if target.contains("://") || target.starts_with("mailto:") {
            continue;
        }
        let (file, heading) = target.split_once('#').unwrap_or((&target, ""));
        let linked = if file.is_empty() { path.to_owned() } else { path.parent().unwrap().join(file) };
        let place = format!("{}:{line}: {target}", name(path));
        if !file.is_empty() && !linked.exists() {
            found.push(format!("{place}: no such file"));
        } else if !heading.is_empty() {
            let own = if file.is_empty() { page.to_owned() } else { text(&linked) };
            if !anchors(&own).contains(heading) {
                found.push(format!("{place}: no such heading"));
            }
        }
    }
    found
}

#[test]
fn links_lead_somewhere() {
    let pages = files(&[".md"]);
    assert!(pages.len() > 30, "{} pages", pages.len());
    let all: Vec<String> = pages.iter().flat_map(|path| broken(path, &text(path))).collect();
    assert!(all.is_empty(), "{}", all.join("\n"));
}

/// The negative control: three links that lead nowhere, and three that do.
#[test]
fn broken_links_are_found() {
    let page = "# A b\n[1](missing.md) [2](#a-b) [3](#a-c) [4](README.md) ![5](docs/none.png)\n`[6](x)`\n";
    let found = broken(&root().join("page.md"), page);
    let said: Vec<&str> = found.iter().filter_map(|line| line.rsplit(": ").next()).collect();
    assert_eq!(said, ["no such file", "no such heading", "no such file"], "{found:?}");
}

/// Sources, scripts and messages name pages of the documentation that exist.
#[test]
fn sources_name_pages_that_exist() {
    let mut missing = Vec::new();
    let mut named = 0;
    for path in files(&[".rs", ".py", ".toml", ".ron"]) {
        for (index, line) in text(&path).lines().enumerate() {
            for (at, _) in line.match_indices("docs/") {
                let rest = &line[at..];
                let end = rest.find(|c: char| !(c.is_alphanumeric() || "/-_.".contains(c)));
                let page = rest[..end.unwrap_or(rest.len())].trim_end_matches('.');
                if page.ends_with(".md") {
                    named += 1;
                    if !root().join(page).exists() {
                        missing.push(format!("{}:{}: {page}", name(&path), index + 1));
                    }
                }
            }
        }
    }
    assert!(named > 10, "{named} pages named");
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// No page is out of reach of the index.
#[test]
fn the_index_has_every_page() {
    let index = text(&root().join("docs/README.md"));
    for path in files(&[".md"]) {
        let page = name(&path);
        let Some(page) = page.strip_prefix("docs/") else { continue };
        let parts: Vec<&str> = page.split('/').collect();
        // A folder below a part of the documentation, and the notebook, have an index of their own.
        let inner = parts.len() > 2 || parts[0] == "notebook" && parts[1] != "README.md";
        if page != "README.md" && !inner {
            assert!(index.contains(&format!("({page})")), "docs/README.md does not link {page}");
        }
        if inner && !page.ends_with("README.md") {
            let folder = path.parent().unwrap().join("README.md");
            let file = parts[parts.len() - 1];
            assert!(text(&folder).contains(&format!("({file})")), "{} does not link {file}", name(&folder));
        }
    }
}
