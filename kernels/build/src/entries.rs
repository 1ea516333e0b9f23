//! Division of a PTX module by entry points, each with the functions and variables that it needs.
//!
//! The driver compiles a whole module when it loads it, but a frame uses one kernel of many. The
//! grammar is that of NVIDIA's "PTX ISA": a module is a list of directives and statements, of which
//! only the top level matters here.

use std::collections::{BTreeSet, HashMap};

/// Statement at the top level of a module, with its text as written there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Statement<'a> {
    kind: Kind,
    text: &'a str,
}

/// Kind of a top-level statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// `.version`, `.target`, `.address_size`, `.file`: applies to the whole module; one line.
    Header,
    /// `.entry`: a kernel that the host launches.
    Entry,
    /// `.func`, a variable, or a declaration of either.
    Symbol,
    /// `.section`: debug information of all functions.
    Section,
}

/// Returns a module for each entry point of `ptx`, with the entry point's name.
pub fn split(ptx: &str) -> Vec<(String, String)> {
    let entries = statements(ptx).into_iter().filter(|statement| statement.kind == Kind::Entry);
    let named = entries.filter_map(|statement| {
        let name = *defined(statement).first()?;
        Some((name.to_owned(), entry(ptx, name)?))
    });
    named.collect()
}

/// Returns the module `ptx` with the one entry point `name`, and the functions and variables that
/// it reaches. Statements are copied verbatim, in their order, so the driver makes the same machine
/// code. Returns `None` if there is no such entry point.
fn entry(ptx: &str, name: &str) -> Option<String> {
    let statements = statements(ptx);
    // A function may be declared and then defined, so a symbol may have several statements.
    let mut places: HashMap<&str, Vec<usize>> = HashMap::new();
    for (place, statement) in statements.iter().enumerate() {
        if matches!(statement.kind, Kind::Entry | Kind::Symbol) {
            for symbol in defined(*statement) {
                places.entry(symbol).or_default().push(place);
            }
        }
    }
    let is_entry = |place: &usize| statements[*place].kind == Kind::Entry;
    let mut reached: BTreeSet<usize> = places.get(name)?.iter().copied().filter(is_entry).collect();
    if reached.is_empty() {
        return None;
    }
    let mut open: Vec<usize> = reached.iter().copied().collect();
    while let Some(place) = open.pop() {
        for symbol in identifiers(statements[place].text) {
            for &other in places.get(symbol).into_iter().flatten() {
                // No code calls an entry point of its own module: an equal name is that of a local
                // symbol.
                if !is_entry(&other) && reached.insert(other) {
                    open.push(other);
                }
            }
        }
    }
    let mut text = String::new();
    for (place, statement) in statements.iter().enumerate() {
        if statement.kind == Kind::Header || reached.contains(&place) {
            text.push_str(statement.text);
            text.push('\n');
        }
    }
    Some(text)
}

/// Returns the statements at the top level. Text that ends within a statement counts as one; the
/// driver reports the error.
fn statements(ptx: &str) -> Vec<Statement<'_>> {
    let mut statements = Vec::new();
    let mut rest = blank(ptx);
    while !rest.is_empty() {
        let kind = kind(rest);
        let (text, after) = rest.split_at(end(rest, kind));
        statements.push(Statement { kind, text: text.trim_end() });
        rest = blank(after);
    }
    statements
}

/// Returns the text after leading white space and comments.
fn blank(mut text: &str) -> &str {
    loop {
        text = text.trim_start();
        match comment(text) {
            Some(length) => text = &text[length..],
            None => return text,
        }
    }
}

/// Returns the length in bytes of the comment that the text begins with, or `None` if it begins
/// with none.
fn comment(text: &str) -> Option<usize> {
    if text.starts_with("//") {
        Some(text.find('\n').map_or(text.len(), |end| end + 1))
    } else if text.starts_with("/*") {
        Some(text.find("*/").map_or(text.len(), |end| end + 2))
    } else {
        None
    }
}

/// Returns the kind of the statement that the text begins with, from the directives before its
/// name.
fn kind(text: &str) -> Kind {
    for word in text.split_whitespace() {
        // `.func(` has no space before its return value.
        match word.split('(').next().unwrap_or_default() {
            ".version" | ".target" | ".address_size" | ".file" => return Kind::Header,
            ".entry" => return Kind::Entry,
            ".section" => return Kind::Section,
            ".visible" | ".extern" | ".weak" | ".common" => {}
            _ => return Kind::Symbol,
        }
    }
    Kind::Symbol
}

/// Returns the length in bytes of the statement that the text begins with.
fn end(text: &str, kind: Kind) -> usize {
    if kind == Kind::Header {
        return text.find('\n').unwrap_or(text.len());
    }
    // A function's body ends the statement; the braces of an initialiser do not.
    let mut initialised = false;
    let mut depth = 0usize;
    let bytes = text.as_bytes();
    let mut place = 0;
    while let Some(&byte) = bytes.get(place) {
        match byte {
            b'/' => {
                if let Some(length) = comment(&text[place..]) {
                    place += length;
                    continue;
                }
            }
            b'"' => place += text[place + 1..].find('"').map_or(0, |length| length + 1),
            b'{' => depth += 1,
            b'}' => {
                depth = depth.saturating_sub(1);
                if depth == 0 && !initialised {
                    return place + 1;
                }
            }
            b'=' if depth == 0 => initialised = true,
            b';' if depth == 0 => return place + 1,
            _ => {}
        }
        place += 1;
    }
    text.len()
}

/// Returns the names that a statement defines: that of a function, or those of variables.
fn defined(statement: Statement<'_>) -> Vec<&str> {
    let head = statement.text.split(['{', '=']).next().unwrap_or_default();
    let Some(function) = [".entry", ".func"].into_iter().find_map(|word| head.split_once(word)) else {
        return identifiers(head).collect();
    };
    // The return value precedes the name: `.func (.param .b32 result) name(...)`.
    let after = function.1.trim_start();
    let after = match after.strip_prefix('(') {
        Some(result) => result.split_once(')').map_or("", |(_, after)| after),
        None => after,
    };
    identifiers(after).take(1).collect()
}

/// Returns the identifiers in a text: no directives, which begin with a period, no registers, which
/// begin with `%`, and no numbers.
fn identifiers(text: &str) -> impl Iterator<Item = &str> {
    let follows = |character: char| character.is_ascii_alphanumeric() || matches!(character, '_' | '$');
    text.split(move |character| !follows(character) && !matches!(character, '.' | '%'))
        .map(|word| word.split('.').next().unwrap_or_default()) // `name` of `name.u32`; nothing of `.u32`
        .filter(|word| {
            word.starts_with(|first: char| first.is_ascii_alphabetic() || matches!(first, '_' | '$'))
        })
}

#[cfg(test)]
mod tests;
