//! Arrays of numbers in the binary chunk: found, checked against its length, and decoded.

use super::GlbError;
use super::document::{Buffer, BufferView, Document};

/// Codes of the types of components.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Option<Self> {
        match code {
            5120 => Some(Self::I8),
            5121 => Some(Self::U8),
            5122 => Some(Self::I16),
            5123 => Some(Self::U16),
            5125 => Some(Self::U32),
            5126 => Some(Self::F32),
            _ => None,
        }
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// An array of the file, all of whose bytes are there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Array<'a> {
    bytes: &'a [u8],
    pub count: usize,
    stride: usize,
    component: Component,
    normalised: bool,
    components: usize,
}

impl<'a> Array<'a> {
    /// The array of an accessor.
    pub fn new(document: &Document, binary: &'a [u8], accessor: usize) -> Result<Self, GlbError> {
        let at = || format!("accessor {accessor}");
        let missing = |what, index, count| index_error(at(), what, index, count);
        let Some(wanted) = document.accessors.get(accessor) else {
            let (index, count) = (accessor, document.accessors.len());
            return Err(index_error("a primitive".to_owned(), "accessor", index, count));
        };
        if wanted.sparse.is_some() {
            let why = "it is sparse, which is not read; export it as a plain array";
            return Err(GlbError::element(at(), why));
        }
        let Some(index) = wanted.buffer_view else {
            // Zeros, as many as the count says: an array of any size in a file of any.
            return Err(GlbError::element(at(), "it has no bytes (no bufferView)"));
        };
        let views = &document.buffer_views;
        let view = views.get(index).ok_or_else(|| missing("bufferView", index, views.len()))?;
        let bytes = view_bytes(view, index, &document.buffers, binary)?;
        let component = Component::of(wanted.component_type).ok_or_else(|| {
            GlbError::element(at(), format!("no component type {}", wanted.component_type))
        })?;
        let components = match wanted.kind.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => return Err(GlbError::element(at(), "its type is not SCALAR, VEC2, VEC3 or VEC4")),
        };
        let size = (components * component.size()) as u64;
        let stride = view.byte_stride.unwrap_or(size);
        if stride < size {
            let why = format!("its elements of {size} bytes overlap: the stride is {stride}");
            return Err(GlbError::element(at(), why));
        }
        let needed = wanted.count.checked_sub(1).map_or(Some(0), |gaps| {
            gaps.checked_mul(stride)?.checked_add(size)?.checked_add(wanted.byte_offset)
        });
        let needed = needed.unwrap_or(u64::MAX);
        if needed > bytes.len() as u64 || wanted.byte_offset > bytes.len() as u64 {
            let (of, has) = (format!("bufferView {index}"), bytes.len() as u64);
            let needed = needed.max(wanted.byte_offset);
            return Err(GlbError::Range { at: at(), needed, of, has });
        }
        Ok(Self {
            bytes: &bytes[wanted.byte_offset as usize..],
            count: wanted.count as usize,
            // With a single element the stride may be anything; nothing is read there.
            stride: stride.min(bytes.len() as u64) as usize,
            component,
            normalised: wanted.normalized,
            components,
        })
    }

    /// The array as `N` numbers for each element.
    pub fn numbers<const N: usize>(
        self,
        at: &str,
    ) -> Result<impl Iterator<Item = [f64; N]> + 'a, GlbError> {
        if self.components != N {
            let why = format!("it has {} numbers for each vertex instead of {N}", self.components);
            return Err(GlbError::element(at, why));
        }
        Ok((0..self.count).map(move |i| std::array::from_fn(|k| self.number(i, k))))
    }

    /// The array as indices below `count`.
    pub fn indices(self, at: &str, count: usize) -> Result<Vec<u32>, GlbError> {
        let is_index = matches!(self.component, Component::U8 | Component::U16 | Component::U32);
        if self.components != 1 || self.normalised || !is_index {
            return Err(GlbError::element(at, "its indices are not unsigned whole numbers"));
        }
        let index = |i| {
            let index = self.number(i, 0);
            match index < count as f64 {
                true => Ok(index as u32),
                false => Err(index_error(at.to_owned(), "vertex", index as usize, count)),
            }
        };
        (0..self.count).map(index).collect()
    }

    fn number(&self, element: usize, k: usize) -> f64 {
        let from = element * self.stride + k * self.component.size();
        let bytes = &self.bytes[from..from + self.component.size()];
        let (value, largest) = match *bytes {
            [b] if self.component == Component::I8 => (f64::from(b as i8), f64::from(i8::MAX)),
            [b] => (f64::from(b), f64::from(u8::MAX)),
            [a, b] if self.component == Component::I16 => {
                (f64::from(i16::from_le_bytes([a, b])), f64::from(i16::MAX))
            }
            [a, b] => (f64::from(u16::from_le_bytes([a, b])), f64::from(u16::MAX)),
            [a, b, c, d] if self.component == Component::F32 => {
                return f64::from(f32::from_le_bytes([a, b, c, d]));
            }
            [a, b, c, d] => (f64::from(u32::from_le_bytes([a, b, c, d])), f64::from(u32::MAX)),
            _ => unreachable!("components have 1, 2 or 4 bytes"),
        };
        // The lowest signed value would be below -1.
        if self.normalised { (value / largest).max(-1.0) } else { value }
    }
}

fn view_bytes<'a>(
    view: &BufferView,
    index: usize,
    buffers: &[Buffer],
    binary: &'a [u8],
) -> Result<&'a [u8], GlbError> {
    let at = || format!("bufferView {index}");
    let buffer = buffers
        .get(view.buffer)
        .ok_or_else(|| index_error(at(), "buffer", view.buffer, buffers.len()))?;
    if view.buffer != 0 || buffer.uri.is_some() {
        let why = "its bytes are not in this file; export everything into one .glb";
        return Err(GlbError::element(format!("buffer {}", view.buffer), why));
    }
    if buffer.byte_length > binary.len() as u64 {
        let (of, has) = ("the binary chunk".to_owned(), binary.len() as u64);
        let (at, needed) = ("buffer 0".to_owned(), buffer.byte_length);
        return Err(GlbError::Range { at, needed, of, has });
    }
    let end = view.byte_offset.saturating_add(view.byte_length);
    if end > buffer.byte_length {
        let (of, has) = ("buffer 0".to_owned(), buffer.byte_length);
        return Err(GlbError::Range { at: at(), needed: end, of, has });
    }
    Ok(&binary[view.byte_offset as usize..end as usize])
}

pub(super) fn index_error(at: String, what: &'static str, index: usize, count: usize) -> GlbError {
    GlbError::Index { at, what, index: index as u64, count }
}
