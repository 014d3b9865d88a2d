//! A reproduction as Markdown.

use super::reproduction::number_text;
use super::{Column, Exhibit, ReproducedRow, Reproduction};
use crate::tables::{self, Cell, Row, Table, escape_markdown, to_markdown};

impl Reproduction {
    /// A section in Markdown: the table with published and own values, what differs, and what
    /// became of the claims.
    pub fn to_markdown(&self, exhibit: &Exhibit) -> String {
        let mut notes = vec![exhibit.shows.clone()];
        notes.extend(exhibit.machine.iter().map(|machine| format!("Published on: {machine}.")));
        notes.extend(exhibit.notes.iter().cloned());
        let head = exhibit.columns.iter().flat_map(|column| self.titles(column));
        let mut columns = vec![tables::Column::text("model"), tables::Column::text("ours on")];
        columns.extend(head.map(tables::Column::number));
        columns.push(tables::Column::text("what differs"));
        let rows = self.rows.iter().map(|row| self.cells(exhibit, row)).collect();
        let mut text = to_markdown(&Table { caption: self.source.clone(), notes, columns, rows });
        let remarks = self.rows.iter().flat_map(|row| {
            row.remarks.iter().map(move |remark| format!("- {}: {remark}", row.id))
        });
        let remarks: Vec<String> = remarks.map(|line| escape_markdown(&line)).collect();
        if !remarks.is_empty() {
            text.push_str(&format!("\nRemarks:\n\n{}\n", remarks.join("\n")));
        }
        for verdict in &self.verdicts {
            let word = match verdict.holds {
                Some(true) => "Holds",
                Some(false) => "Does not hold",
                None => "Not decided",
            };
            let because: Vec<String> = verdict
                .because
                .iter()
                .map(|line| format!("- {}\n", escape_markdown(line)))
                .collect();
            let says = escape_markdown(&verdict.says);
            text.push_str(&format!("\n**{word}:** {says}\n\n{}", because.concat()));
            if let Some(reason) = &verdict.reason {
                text.push_str(&format!("\nWhy not: {}\n", escape_markdown(reason)));
            }
        }
        text
    }

    /// Whether the paper has any value of a column.
    fn is_published(&self, column: &Column) -> bool {
        self.rows.iter().any(|row| row.published.contains_key(&column.key))
    }

    fn titles(&self, column: &Column) -> Vec<String> {
        let Column { title, unit, .. } = column;
        let title = if unit.is_empty() { title.clone() } else { format!("{title}, {unit}") };
        if self.is_published(column) {
            vec![format!("{title}: published"), "ours".to_owned()]
        } else {
            vec![title]
        }
    }

    fn cells(&self, exhibit: &Exhibit, row: &ReproducedRow) -> Row {
        let mut cells = vec![Cell::new(&row.model), Cell::new(&row.input)];
        for column in &exhibit.columns {
            if self.is_published(column) {
                cells.push(value(row.published.get(&column.key)));
            }
            cells.push(value(row.ours.get(&column.key)));
        }
        cells.push(Cell::new(&row.differs));
        Row { cells, starts_group: false }
    }
}

fn value(value: Option<&f64>) -> Cell {
    Cell::new(value.map_or_else(|| "-".to_owned(), |&v| number_text(v)))
}
