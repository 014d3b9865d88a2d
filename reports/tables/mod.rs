//! Tables: what stands in them, apart from the format they are written in.

mod csv;
mod latex;
mod markdown;
mod per_mesh;
mod summary;

pub(crate) use self::csv::{to_csv, warnings};
pub(crate) use self::latex::to_latex;
pub(crate) use self::markdown::{escape as escape_markdown, to_markdown};
pub(crate) use self::per_mesh::{Best, mesh_table, remark, topology_verdict};
pub(crate) use self::summary::summary_tables;

/// A table before it takes a format.
pub(crate) struct Table {
    /// One sentence above the table.
    pub(crate) caption: String,
    /// How it was made, units, and what bold means.
    pub(crate) notes: Vec<String>,
    pub(crate) columns: Vec<Column>,
    pub(crate) rows: Vec<Row>,
}

/// The head of a column.
pub(crate) struct Column {
    pub(crate) title: String,
    /// Numbers are set flush right.
    pub(crate) number: bool,
}

impl Column {
    pub(crate) fn text(title: impl Into<String>) -> Self {
        Self { title: title.into(), number: false }
    }

    pub(crate) fn number(title: impl Into<String>) -> Self {
        Self { title: title.into(), number: true }
    }
}

/// A row; `starts_group` asks for a rule above it.
pub(crate) struct Row {
    pub(crate) cells: Vec<Cell>,
    pub(crate) starts_group: bool,
}

/// One cell.
#[derive(Clone, Default)]
pub(crate) struct Cell {
    pub(crate) text: String,
    /// The best of its group.
    pub(crate) best: bool,
}

impl Cell {
    pub(crate) fn new(text: impl Into<String>) -> Self {
        Self { text: text.into(), best: false }
    }

    /// A dash where there is nothing.
    pub(crate) fn optional(text: Option<String>) -> Self {
        Self::new(text.unwrap_or_else(|| "–".to_owned()))
    }
}
