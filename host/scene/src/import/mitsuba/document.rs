//! A Mitsuba scene as a tree of elements, with its defaults filled in and its includes in place.

use super::super::budget::Budget;
use super::super::files::{self, Files};
use super::super::source_location::{SourceLocation, shown};
use crate::error::SceneError;
use roxmltree::{Node, ParsingOptions};
use std::cell::Cell;
use std::collections::HashMap;
use std::rc::Rc;

/// Maximum number of elements within each other.
const MAX_DEPTH: usize = 64;

/// Maximum number of files within each other.
const MAX_INCLUDES: usize = 16;

/// Maximum number of files of a scene; each counts as often as it is included.
const MAX_FILES: usize = 1024;

/// Maximum number of nodes of a file.
const MAX_NODES: u32 = 1 << 22;

/// An element: an object, a property or a step of a transform.
#[derive(Debug)]
pub struct Element {
    /// Name of the element.
    pub tag: String,
    attributes: Vec<(String, String)>,
    /// Elements within this one.
    pub children: Vec<Rc<Element>>,
    /// Index of the file.
    source: usize,
    /// Place in the file in bytes.
    offset: usize,
    /// True once the reader has looked at it.
    is_used: Cell<bool>,
}

/// A file of the scene.
#[derive(Debug)]
struct Source {
    name: String,
    text: String,
    /// Place of each line in bytes.
    lines: Vec<usize>,
}

/// Elements of a scene and of all files that it includes.
#[derive(Debug, Default)]
pub struct Document {
    sources: Vec<Source>,
    /// Elements below the scene.
    pub children: Vec<Rc<Element>>,
    ids: HashMap<String, Rc<Element>>,
    defaults: HashMap<String, String>,
    /// True if names of properties are those of Mitsuba before version 2.
    has_old_names: bool,
    /// Features of the document itself that are ignored.
    pub ignored: Vec<(String, Rc<Element>)>,
}

impl Element {
    /// Returns an attribute.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|attribute| attribute.0 == name).map(|attribute| attribute.1.as_str())
    }

    /// Returns the type of the object.
    pub fn kind(&self) -> &str {
        self.attribute("type").unwrap_or_default()
    }

    /// Returns the property of this name, and marks it as used.
    pub fn property(&self, name: &str) -> Option<&Rc<Self>> {
        let found = self.children.iter().find(|child| child.attribute("name") == Some(name))?;
        found.mark();
        Some(found)
    }

    /// Marks the element as used.
    pub fn mark(&self) {
        self.is_used.set(true);
    }

    /// Returns the children that nothing has marked.
    pub fn unused(&self) -> impl Iterator<Item = &Rc<Self>> {
        self.children.iter().filter(|child| !child.is_used.get())
    }

    /// Returns a name for messages.
    pub fn label(&self) -> String {
        match (self.attribute("type"), self.attribute("name")) {
            (Some(kind), _) => format!("<{} type=\"{}\">", shown(&self.tag), shown(kind)),
            (None, Some(name)) => format!("<{} name=\"{}\">", shown(&self.tag), shown(name)),
            (None, None) => format!("<{}>", shown(&self.tag)),
        }
    }
}

impl Document {
    /// Reads a scene from `bytes` and the files that it includes from `files`.
    pub fn read(
        bytes: &[u8],
        name: &str,
        files: &mut dyn Files,
        budget: &mut Budget,
    ) -> Result<Self, SceneError> {
        let mut document = Self::default();
        document.children = document.file(bytes, name, (files, budget), 0)?;
        Ok(document)
    }

    /// Returns the element of this id.
    pub fn by_id(&self, id: &str) -> Option<&Rc<Element>> {
        self.ids.get(id)
    }

    /// Returns line and column of an element, counted from 1; columns in characters.
    fn position(&self, element: &Element) -> (&Source, usize, usize) {
        let source = &self.sources[element.source];
        let line = source.lines.partition_point(|&start| start <= element.offset).max(1);
        let start = source.lines[line - 1];
        let before = source.text.get(start..element.offset).unwrap_or_default();
        (source, line, 1 + before.chars().count())
    }

    /// Returns an error at an element.
    pub fn error(&self, element: &Element, message: impl Into<String>) -> SceneError {
        let (source, line, column) = self.position(element);
        SceneError::at(&source.name, &source.text, line, column, message.into())
    }

    /// Returns the place of an element for messages.
    pub fn site(&self, element: &Element) -> SourceLocation<'_> {
        let (source, line, _) = self.position(element);
        SourceLocation::new(&source.name, format!("line {line}, {}", element.label()))
    }

    /// Returns the elements below the root of a file.
    fn file(
        &mut self,
        bytes: &[u8],
        name: &str,
        (files, budget): (&mut dyn Files, &mut Budget),
        depth: usize,
    ) -> Result<Vec<Rc<Element>>, SceneError> {
        let text = String::from_utf8_lossy(bytes).into_owned();
        // The text, and the place of each of its lines.
        budget.take(256 + 10 * text.len() as u64, &SourceLocation::new(name, "the text"))?;
        let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
        let parsed = roxmltree::Document::parse_with_options(&text, options).map_err(|error| {
            let position = error.pos();
            let text_of = error.to_string();
            let reason = text_of.rsplit_once(" at ").map_or(text_of.as_str(), |(reason, _)| reason);
            let message = format!("this is not XML: {reason}");
            SceneError::at(name, &text, position.row as usize, position.col as usize, shown(&message))
        })?;
        let lines = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        let source = self.sources.len();
        self.sources.push(Source { name: name.to_owned(), text: text.clone(), lines });
        let root = parsed.root_element();
        let holder = self.element(root, source);
        if root.tag_name().name() != "scene" {
            let message = format!("the root is <{}>; it must be <scene>", shown(root.tag_name().name()));
            return Err(self.error(&holder, message));
        }
        if depth == 0 {
            let version = root.attribute("version").unwrap_or("3");
            self.has_old_names = version.starts_with("0.") || version.starts_with("1.");
        }
        self.children_of(root, source, (files, budget), (depth, 0))
    }

    /// Returns an element without its children.
    fn element(&self, node: Node, source: usize) -> Element {
        let attributes = node.attributes().map(|of| {
            let mut value = self.substituted(of.value());
            if self.has_old_names && of.name() == "name" {
                value = snake_case(&value);
            }
            (of.name().to_owned(), value)
        });
        Element {
            tag: node.tag_name().name().to_owned(),
            attributes: attributes.collect(),
            children: Vec::new(),
            source,
            offset: node.range().start,
            is_used: Cell::new(false),
        }
    }

    fn children_of(
        &mut self,
        node: Node,
        source: usize,
        (files, budget): (&mut dyn Files, &mut Budget),
        (includes, depth): (usize, usize),
    ) -> Result<Vec<Rc<Element>>, SceneError> {
        let mut children = Vec::new();
        for child in node.children().filter(Node::is_element) {
            let mut element = self.element(child, source);
            if depth >= MAX_DEPTH {
                let message =
                    format!("elements are nested too deeply; at most {MAX_DEPTH} may enclose each other");
                return Err(self.error(&element, message));
            }
            let text: usize =
                element.attributes.iter().map(|(name, value)| name.len() + value.len() + 64).sum();
            budget.take((size_of::<Element>() + 32 + text) as u64, &self.site(&element))?;
            match element.tag.as_str() {
                "default" => {
                    let (Some(name), Some(value)) = (element.attribute("name"), element.attribute("value"))
                    else {
                        return Err(self.error(&element, "<default> needs the attributes name and value"));
                    };
                    let (name, value) = (name.to_owned(), value.to_owned());
                    self.defaults.entry(name).or_insert(value);
                }
                "include" => {
                    children.extend(self.include(&element, (&mut *files, &mut *budget), includes)?);
                }
                _ => {
                    let inside = (includes, depth + 1);
                    element.children =
                        self.children_of(child, source, (&mut *files, &mut *budget), inside)?;
                    let element = Rc::new(element);
                    if let Some(id) = element.attribute("id").filter(|_| element.tag != "ref") {
                        if self.ids.contains_key(id) {
                            let message = format!("the id \"{}\" occurs twice", shown(id));
                            return Err(self.error(&element, message));
                        }
                        self.ids.insert(id.to_owned(), Rc::clone(&element));
                    }
                    if matches!(element.tag.as_str(), "path" | "alias") {
                        self.ignored.push((format!("<{}>", element.tag), element));
                    } else {
                        children.push(element);
                    }
                }
            }
        }
        Ok(children)
    }

    /// Returns the elements of an included file.
    fn include(
        &mut self,
        element: &Element,
        (files, budget): (&mut dyn Files, &mut Budget),
        includes: usize,
    ) -> Result<Vec<Rc<Element>>, SceneError> {
        let Some(name) = element.attribute("filename") else {
            return Err(self.error(element, "<include> needs the attribute filename"));
        };
        if includes >= MAX_INCLUDES {
            let message =
                format!("files include each other; at most {MAX_INCLUDES} may be within each other");
            return Err(self.error(element, message));
        }
        if self.sources.len() >= MAX_FILES {
            return Err(
                self.error(element, format!("the scene includes too many files; at most {MAX_FILES}"))
            );
        }
        let bytes = files
            .read(&name.replace('\\', "/"), files::readable())
            .map_err(|error| self.site(element).resource(name, error))?;
        // A file that is included again takes from what it gave when it was read first.
        if !self.sources.iter().any(|source| source.name == *name) {
            budget.extend(bytes.len());
        }
        let name = name.to_owned();
        self.file(&bytes, &name, (files, budget), includes + 1)
    }

    /// Returns a value with `$name` replaced by the defaults: the longest name that fits counts.
    fn substituted(&self, value: &str) -> String {
        let mut result = String::new();
        let mut rest = value;
        while let Some(at) = rest.find('$') {
            result.push_str(&rest[..at]);
            let after = &rest[at + 1..];
            let known = self.defaults.iter().filter(|(name, _)| after.starts_with(name.as_str()));
            match known.max_by_key(|(name, _)| name.len()) {
                Some((name, value)) if !name.is_empty() && result.len() < (1 << 16) => {
                    result.push_str(value);
                    rest = &after[name.len()..];
                }
                _ => {
                    result.push('$');
                    rest = after;
                }
            }
        }
        result.push_str(rest);
        result
    }
}

/// Returns a name of Mitsuba 0.6 in the form of later versions: `toWorld` is `to_world`.
fn snake_case(name: &str) -> String {
    let mut result = String::new();
    for letter in name.chars() {
        if letter.is_ascii_uppercase() && !result.is_empty() {
            result.push('_');
        }
        result.push(letter.to_ascii_lowercase());
    }
    // `intIOR` has become `int_i_o_r`.
    result.replace("_i_o_r", "_ior")
}
