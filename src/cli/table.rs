//! Tables on the terminal.

use comfy_table::{
    Cell, CellAlignment, ColumnConstraint, ContentArrangement, Table, Width, presets,
};
use console::measure_text_width;

/// Columns of the terminal that comfy-table puts around a cell.
const PADDING: usize = 2;

/// An empty table without lines.
pub(super) fn plain() -> Table {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING);
    table
}

/// A number's cell.
pub(super) fn right(value: impl ToString) -> Cell {
    Cell::new(value).set_alignment(CellAlignment::Right)
}

/// A table as text, without blanks at the ends of its lines. With the columns of a terminal, titles
/// and texts are broken between words where it would be wider.
pub(super) fn text(mut table: Table, columns: Option<usize>) -> String {
    if let Some(columns) = columns {
        let longest = longest_words(&mut table);
        table.set_content_arrangement(ContentArrangement::Dynamic);
        table.set_width(u16::try_from(columns).unwrap_or(u16::MAX));
        for (column, width) in table.column_iter_mut().zip(longest) {
            let width = u16::try_from(width + PADDING).unwrap_or(u16::MAX);
            column.set_constraint(ColumnConstraint::LowerBoundary(Width::Fixed(width)));
        }
    }
    let lines: Vec<String> = table.lines().map(|line| line.trim_end().to_owned()).collect();
    lines.join("\n")
}

/// The width of the longest word in each column: breaking it would make a number unreadable.
fn longest_words(table: &mut Table) -> Vec<usize> {
    let mut longest = vec![0; table.column_count()];
    for row in table.header().into_iter().chain(table.row_iter()) {
        for (width, cell) in longest.iter_mut().zip(row.cell_iter()) {
            let words = cell.content();
            let words = words.split_whitespace().map(measure_text_width);
            *width = words.max().unwrap_or(0).max(*width);
        }
    }
    longest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seeds() -> Table {
        let mut table = plain();
        table.set_header(["seed", "verdict", "run time (s)", "decision hash"]);
        table.add_row([right(7), Cell::new("reached"), right("25.7"), Cell::new("062237fb67b6")]);
        table
    }

    #[test]
    fn titles_give_way_on_a_narrow_terminal_and_numbers_never() {
        insta::assert_snapshot!(text(seeds(), None), @r"
        seed  verdict  run time (s)  decision hash
           7  reached          25.7  062237fb67b6
        ");
        assert_eq!(text(seeds(), Some(100)), text(seeds(), None));
        insta::assert_snapshot!(text(seeds(), Some(40)), @r"
        seed  verdict  run time   decision
                       (s)        hash
           7  reached       25.7  062237fb67b6
        ");
        assert!(text(seeds(), Some(1)).contains("062237fb67b6"));
    }
}
