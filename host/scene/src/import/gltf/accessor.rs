//! Accessors: typed elements in buffer views. Opening an accessor checks all its bounds.

use super::super::budget::Budget;
use super::super::source_location::{SourceLocation, shown};
use super::Document;
use super::buffers::get;
use super::json::Accessor;
use crate::error::SceneError;

/// Type of one number of an element in a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

/// The elements that the user of an accessor accepts.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// glTF's `type` of an element: `SCALAR`, `VEC2`, `VEC3`, `VEC4` or `MAT4`.
    pub kind: &'static str,
    pub components: &'static [Component],
}

/// The elements of an accessor.
#[derive(Debug)]
pub struct Elements<'a> {
    /// Number of elements.
    pub count: u32,
    /// Name for messages, such as `accessors[7]`.
    pub place: String,
    component: Component,
    normalized: bool,
    base: Option<Strided<'a>>,                                  // `None`: all are 0
    sparse: Option<(Strided<'a>, Component, Strided<'a>, u32)>, // indices, their type, values, count
}

/// An attribute of all vertices that was decompressed.
#[derive(Debug)]
pub struct Attribute {
    /// Numbers of the vertices, one after the other.
    pub bytes: Vec<u8>,
    /// Type of a number.
    pub component: Component,
    /// Numbers of a vertex.
    pub width: usize,
    /// True if integers stand for 0 to 1, or -1 to 1.
    pub normalized: bool,
}

/// Elements at a constant stride in bytes.
#[derive(Clone, Copy, Debug)]
struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl Expected {
    /// Returns the numbers of an element.
    fn width(self) -> usize {
        match self.kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC4" => 4,
            "MAT4" => 16,
            _ => 3,
        }
    }
}

impl Component {
    fn of(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

impl<'a> Elements<'a> {
    /// Opens the accessor `index`, which `user` names.
    pub fn open(
        document: &'a Document,
        budget: &mut Budget,
        index: u32,
        expected: Expected,
        user: &SourceLocation,
    ) -> Result<Self, SceneError> {
        let accessor = get(&document.root.accessors, index, "accessors", user)?;
        let site = document.site(format!("accessors[{index}]"));
        let width = expected.width();
        let component = Component::of(accessor.component_type);
        let component = component.filter(|found| expected.components.contains(found));
        let Some(component) = component.filter(|_| accessor.kind == expected.kind) else {
            let found = format!("{} of componentType {}", shown(&accessor.kind), accessor.component_type);
            return Err(site.malformed(
                format!("it is {found}"),
                format!("{} takes {} of {:?}", user.place, expected.kind, expected.components),
            ));
        };
        let count = u32::try_from(accessor.count)
            .map_err(|_| site.too_large(format!("count is {}", accessor.count), u32::MAX.to_string()))?;
        let size = component.size() * width;
        let base = match accessor.buffer_view {
            Some(view) => Some(Strided::open(document, view, accessor.byte_offset, count, size, &site)?),
            None => None,
        };
        let mut elements = Self {
            count,
            component,
            normalized: accessor.normalized,
            base,
            sparse: None,
            place: site.place.clone(),
        };
        elements.open_sparse(document, budget, accessor, size, &site)?;
        Ok(elements)
    }

    /// Opens an attribute that was decompressed; `place` stands for it in messages.
    pub fn of_attribute(
        attribute: &'a Attribute,
        count: u32,
        expected: Expected,
        user: &SourceLocation,
    ) -> Result<Self, SceneError> {
        let Attribute { ref bytes, component, width, normalized } = *attribute;
        if !expected.components.contains(&component) || width != expected.width() {
            let problem = format!("its Draco data has {width} numbers of {component:?} for each vertex");
            let remedy = format!("it takes {} of {:?}", expected.kind, expected.components);
            return Err(user.malformed(problem, remedy));
        }
        let base = Some(Strided { bytes, stride: width * component.size() });
        Ok(Self { count, component, normalized, base, sparse: None, place: user.place.clone() })
    }

    /// Opens the sparse part of an accessor, and checks that its indices ascend and are in range.
    fn open_sparse(
        &mut self,
        document: &'a Document,
        budget: &mut Budget,
        accessor: &Accessor,
        size: usize,
        site: &SourceLocation,
    ) -> Result<(), SceneError> {
        let Some(sparse) = accessor.sparse.as_deref() else { return Ok(()) };
        let site = site.member("sparse");
        let Some(count) = u32::try_from(sparse.count).ok().filter(|count| *count <= self.count) else {
            let problem = format!("count is {}, the accessor's {}", sparse.count, self.count);
            return Err(site.malformed(problem, "it must not be greater"));
        };
        let code = sparse.indices.component_type;
        let unsigned = [Component::U8, Component::U16, Component::U32];
        let Some(kind) = Component::of(code).filter(|kind| unsigned.contains(kind)) else {
            return Err(site.malformed(
                format!("the indices' componentType is {code}"),
                "it must be 5121, 5123 or 5125",
            ));
        };
        let (view, offset) = (sparse.indices.buffer_view, sparse.indices.byte_offset);
        let indices = Strided::open(document, view, offset, count, kind.size(), &site.member("indices"))?;
        let (view, offset) = (sparse.values.buffer_view, sparse.values.byte_offset);
        let values = Strided::open(document, view, offset, count, size, &site.member("values"))?;
        budget.take(u64::from(count), &site)?; // no memory but time, if many primitives name this accessor
        let mut least = 0;
        for element in 0..count {
            let index = indices.integer(element, kind);
            if index < least || index >= self.count {
                return Err(site.malformed(
                    format!("index {element} is {index}"),
                    format!("indices must ascend and be below {}", self.count),
                ));
            }
            least = index + 1; // no overflow: index < count
        }
        self.sparse = Some((indices, kind, values, count));
        Ok(())
    }

    /// Returns an element as floats, by the specification's rules for normalized integers.
    pub fn floats<const N: usize>(&self, element: u32) -> [f32; N] {
        self.locate(element).map_or([0.0; N], |(source, element)| {
            std::array::from_fn(|axis| source.float(element, axis, self.component, self.normalized))
        })
    }

    /// Returns an element of unsigned integers.
    pub fn integers<const N: usize>(&self, element: u32) -> [u32; N] {
        self.locate(element).map_or([0; N], |(source, element)| {
            std::array::from_fn(|axis| source.component(element, axis, self.component))
        })
    }

    /// Returns an element that is one unsigned integer.
    pub fn integer(&self, element: u32) -> u32 {
        self.locate(element).map_or(0, |(source, element)| source.integer(element, self.component))
    }

    /// Returns where an element is stored: among the sparse values if its index is listed, else in
    /// the base view. `None` stands for 0.
    fn locate(&self, element: u32) -> Option<(Strided<'a>, u32)> {
        let replaced = self.sparse.and_then(|(indices, kind, values, count)| {
            // Binary search for the first index that is not below `element`.
            let (mut low, mut high) = (0, count);
            while low < high {
                let middle = low + (high - low) / 2;
                if indices.integer(middle, kind) < element {
                    low = middle + 1;
                } else {
                    high = middle;
                }
            }
            (low < count && indices.integer(low, kind) == element).then_some((values, low))
        });
        replaced.or(self.base.map(|base| (base, element)))
    }
}

impl<'a> Strided<'a> {
    /// Opens `count` elements of `size` bytes from byte `offset` of a view.
    fn open(
        document: &'a Document,
        view: u32,
        offset: u64,
        count: u32,
        size: usize,
        site: &SourceLocation,
    ) -> Result<Self, SceneError> {
        let (bytes, stride) = document.buffers.view(&document.root, view, site)?;
        let stride = stride.unwrap_or(size as u64);
        if stride < size as u64 {
            let problem =
                format!("bufferViews[{view}].byteStride is {stride}, and an element has {size} bytes");
            return Err(site.malformed(problem, "elements must not overlap"));
        }
        let span = u64::from(count)
            .saturating_sub(1)
            .checked_mul(stride)
            .and_then(|span| span.checked_add(size as u64));
        let span = if count == 0 { Some(0) } else { span };
        let end = span.and_then(|span| span.checked_add(offset)).filter(|end| *end <= bytes.len() as u64);
        let (Some(_), Some(bytes)) = (end, bytes.get(offset as usize..)) else {
            let problem = format!(
                "{count} elements of {size} bytes, {stride} apart, from byte {offset} reach beyond bufferViews[{view}] of {}",
                bytes.len()
            );
            return Err(site.malformed(problem, "count, byteOffset and byteStride must stay within the view"));
        };
        Ok(Self { bytes, stride: stride as usize })
    }

    /// Returns the bytes of a number; the caller has checked that `element` is in range.
    fn number<const N: usize>(&self, element: u32, axis: usize) -> [u8; N] {
        let at = element as usize * self.stride + axis * N;
        self.bytes.get(at..).and_then(|bytes| bytes.first_chunk().copied()).unwrap_or([0; N])
    }

    fn float(&self, element: u32, axis: usize, component: Component, normalized: bool) -> f32 {
        let (value, greatest) = match component {
            Component::I8 => (f32::from(i8::from_le_bytes(self.number(element, axis))), 127.0),
            Component::U8 => (f32::from(u8::from_le_bytes(self.number(element, axis))), 255.0),
            Component::I16 => (f32::from(i16::from_le_bytes(self.number(element, axis))), 32767.0),
            Component::U16 => (f32::from(u16::from_le_bytes(self.number(element, axis))), 65535.0),
            Component::U32 => (u32::from_le_bytes(self.number(element, axis)) as f32, u32::MAX as f32),
            Component::F32 => return f32::from_le_bytes(self.number(element, axis)),
        };
        if normalized { (value / greatest).max(-1.0) } else { value }
    }

    fn integer(&self, element: u32, component: Component) -> u32 {
        self.component(element, 0, component)
    }

    fn component(&self, element: u32, axis: usize, component: Component) -> u32 {
        match component.size() {
            1 => u8::from_le_bytes(self.number(element, axis)).into(),
            2 => u16::from_le_bytes(self.number(element, axis)).into(),
            _ => u32::from_le_bytes(self.number(element, axis)),
        }
    }
}
