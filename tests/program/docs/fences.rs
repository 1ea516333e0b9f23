//! Fenced code blocks of Markdown.

/// A fenced block.
#[derive(Debug, PartialEq, Eq)]
pub struct Fence {
    /// The words after the three backticks, such as `sh needs=cuda`.
    pub info: String,
    /// Its lines.
    pub text: String,
    /// Line of the opening fence, from 1.
    pub line: usize,
}

impl Fence {
    /// Returns the value of `key=value` among the words after the backticks.
    pub fn option(&self, key: &str) -> Option<&str> {
        self.info.split_whitespace().find_map(|word| word.strip_prefix(key)?.strip_prefix('='))
    }

    /// Returns the language: the first word after the backticks.
    pub fn language(&self) -> &str {
        self.info.split_whitespace().next().unwrap_or_default()
    }
}

/// Returns the fenced blocks of a page, in order.
pub fn fences(page: &str) -> Vec<Fence> {
    let mut found = Vec::new();
    let mut open: Option<Fence> = None;
    for (index, line) in page.lines().enumerate() {
        match (line.trim_start().strip_prefix("```"), &mut open) {
            (Some(_), Some(_)) => found.extend(open.take()),
            (Some(info), None) => {
                open = Some(Fence { info: info.trim().to_owned(), text: String::new(), line: index + 1 });
            }
            (None, Some(fence)) => {
                fence.text.push_str(line);
                fence.text.push('\n');
            }
            (None, None) => {}
        }
    }
    assert!(open.is_none(), "a fence is not closed: {open:?}");
    found
}

#[test]
fn blocks_and_options_are_found() {
    let page = "a\n```sh needs=cuda\nx\ny\n```\n```ron file=s.ron\nz\n```\n";
    let found = fences(page);
    assert_eq!(found.len(), 2);
    assert_eq!((found[0].language(), found[0].option("needs"), found[0].line), ("sh", Some("cuda"), 2));
    assert_eq!(found[0].text, "x\ny\n");
    assert_eq!((found[1].option("file"), found[1].option("needs")), (Some("s.ron"), None));
}
