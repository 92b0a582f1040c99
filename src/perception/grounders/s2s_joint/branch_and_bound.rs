//! Which atoms to accept so that no constraint is broken and the evidence is greatest.
//!
//! Every atom is an option of one row ("what does `a` lie on?") and may take columns that only one
//! atom may have ("what lies on `b`?"). Rows that share no column are decided apart; the others by
//! branch and bound, which is exact within [`STEPS_MAX`].

use std::collections::BTreeSet;

/// Most steps of one search. Real scenes need a few dozen; the bound is met only by many objects that
/// all look alike, and then the best choice found so far is taken.
const STEPS_MAX: u32 = 20_000;

/// What it is worth to fill a row that may not stay empty: more than any evidence that this could
/// cost, since a weight is within -2 and 2.
const FILLED: f64 = 8.0;

/// One atom that may be accepted.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Choice {
    /// Evidence for it, positive or negative.
    pub(super) weight: f64,
    /// What only one accepted atom may have, as indices below the number of columns.
    pub(super) columns: Vec<usize>,
}

/// Atoms of which at most one is accepted.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Row {
    /// The atoms.
    pub(super) choices: Vec<Choice>,
    /// The least weight at which an atom is accepted if none is better: 0, or less where exactly one
    /// atom must hold.
    pub(super) floor: f64,
}

impl Row {
    fn is_required(&self) -> bool {
        self.floor < 0.0
    }

    /// The choices that may be taken, the best one first.
    fn candidates(&self) -> Vec<usize> {
        let good = |&i: &usize| self.choices[i].weight > self.floor;
        let mut best: Vec<usize> = (0..self.choices.len()).filter(good).collect();
        best.sort_by(|&a, &b| self.choices[b].weight.total_cmp(&self.choices[a].weight));
        best
    }

    fn gain(&self, choice: usize) -> f64 {
        self.choices[choice].weight + if self.is_required() { FILLED } else { 0.0 }
    }
}

/// The accepted choice of every row: the greatest sum of weights that keeps every column single.
///
/// Ties go to the earlier choice, so the result depends on the order of rows and choices only.
pub(super) fn choose(rows: &[Row], n_columns: usize) -> Vec<Option<usize>> {
    let mut chosen = vec![None; rows.len()];
    let candidates: Vec<Vec<usize>> = rows.iter().map(Row::candidates).collect();
    for group in groups(rows, &candidates, n_columns) {
        // The clearest rows first: the first descent is then the greedy answer.
        let mut order = group;
        let best = |row: usize| candidates[row].first().map_or(0.0, |&c| rows[row].gain(c));
        order.sort_by(|&a, &b| best(b).total_cmp(&best(a)));
        let mut rest = vec![0.0; order.len() + 1];
        for (at, &row) in order.iter().enumerate().rev() {
            rest[at] = rest[at + 1] + best(row);
        }
        let search = Search { rows, candidates: &candidates, order: &order, rest: &rest };
        let mut state = State {
            taken: vec![false; n_columns],
            path: Vec::with_capacity(order.len()),
            best: None,
            steps: 0,
        };
        search.descend(&mut state, 0.0);
        for (&row, choice) in order.iter().zip(state.best.map(|(_, path)| path).unwrap_or_default())
        {
            chosen[row] = choice;
        }
    }
    chosen
}

/// Rows that compete for columns, directly or through others.
fn groups(rows: &[Row], candidates: &[Vec<usize>], n_columns: usize) -> Vec<Vec<usize>> {
    let mut rows_of_column = vec![Vec::new(); n_columns];
    let mut columns_of_row = vec![BTreeSet::new(); rows.len()];
    for (row, candidates) in candidates.iter().enumerate() {
        let columns = candidates.iter().flat_map(|&c| &rows[row].choices[c].columns);
        columns_of_row[row].extend(columns.copied());
        columns_of_row[row].iter().for_each(|&column: &usize| rows_of_column[column].push(row));
    }
    let (mut groups, mut seen) = (Vec::new(), vec![false; rows.len()]);
    for start in 0..rows.len() {
        let (mut group, mut open) = (Vec::new(), vec![start]);
        while let Some(row) = open.pop() {
            if std::mem::replace(&mut seen[row], true) {
                continue;
            }
            group.push(row);
            let columns = columns_of_row[row].iter();
            open.extend(columns.flat_map(|&column| rows_of_column[column].iter().copied()));
        }
        group.sort_unstable();
        groups.push(group);
    }
    groups
}

/// One search over the rows of a group.
struct Search<'a> {
    rows: &'a [Row],
    candidates: &'a [Vec<usize>],
    order: &'a [usize],
    /// The most that the rows from here on can add.
    rest: &'a [f64],
}

struct State {
    taken: Vec<bool>,
    path: Vec<Option<usize>>,
    best: Option<(f64, Vec<Option<usize>>)>,
    steps: u32,
}

impl Search<'_> {
    /// Tries every choice of the next row, then none.
    fn descend(&self, state: &mut State, sum: f64) {
        state.steps += 1;
        let at = state.path.len();
        let is_beaten = state.best.as_ref().is_some_and(|(best, _)| sum + self.rest[at] <= *best);
        if is_beaten || state.steps > STEPS_MAX && state.best.is_some() {
            return;
        }
        let Some(&row) = self.order.get(at) else {
            state.best = Some((sum, state.path.clone()));
            return;
        };
        for &choice in &self.candidates[row] {
            let columns = &self.rows[row].choices[choice].columns;
            if columns.iter().any(|&column| state.taken[column]) {
                continue;
            }
            for &column in columns {
                state.taken[column] = true;
            }
            state.path.push(Some(choice));
            self.descend(state, sum + self.rows[row].gain(choice));
            state.path.pop();
            for &column in columns {
                state.taken[column] = false;
            }
        }
        state.path.push(None);
        self.descend(state, sum);
        state.path.pop();
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn row(floor: f64, choices: &[(f64, &[usize])]) -> Row {
        let choice =
            |&(weight, columns): &(f64, &[usize])| Choice { weight, columns: columns.to_vec() };
        Row { choices: choices.iter().map(choice).collect(), floor }
    }

    #[test]
    fn the_sum_counts_not_the_single_best_atom() {
        let rows = [row(0.0, &[(0.9, &[0]), (0.8, &[1])]), row(0.0, &[(0.85, &[0]), (0.1, &[1])])];
        assert_eq!(choose(&rows, 2), [Some(1), Some(0)]);
    }

    #[test]
    fn only_a_row_that_must_be_filled_takes_a_negative_atom() {
        assert_eq!(choose(&[row(0.0, &[(-0.1, &[])])], 0), [None]);
        assert_eq!(choose(&[row(-0.3, &[(-0.1, &[])])], 0), [Some(0)]);
        assert_eq!(choose(&[row(-0.3, &[(-0.4, &[])])], 0), [None]);
    }

    #[test]
    fn many_equal_rows_end_within_the_bound() {
        let choices: Vec<(f64, Vec<usize>)> = (0..40).map(|c| (0.5, vec![c % 39])).collect();
        let choices: Vec<(f64, &[usize])> = choices.iter().map(|(w, c)| (*w, &c[..])).collect();
        let rows = vec![row(0.0, &choices); 40];
        assert_eq!(choose(&rows, 39).iter().flatten().count(), 39);
    }

    proptest! {
        /// Against every combination of two rows and two columns.
        #[test]
        fn the_choice_is_the_best_there_is(
            weights in prop::collection::vec(-1.0..1.0_f64, 4), floor in -1.0..=0.0_f64,
        ) {
            let two = |a: f64, b: f64| row(floor, &[(a, &[0][..]), (b, &[1][..])]);
            let rows = [two(weights[0], weights[1]), two(weights[2], weights[3])];
            let worth = |picks: &[Option<usize>]| -> f64 {
                picks.iter().zip(&rows).filter_map(|(pick, row)| Some(row.gain((*pick)?))).sum()
            };
            let found = choose(&rows, 2);
            let all = [None, Some(0), Some(1)];
            let pairs = all.iter().flat_map(|a| all.iter().map(move |b| [*a, *b]));
            let allowed = pairs.filter(|[a, b]| a.is_none() || a != b).filter(|picks| {
                picks.iter().zip(&rows).all(|(p, r)| p.is_none_or(|c| r.choices[c].weight > floor))
            });
            let best = allowed.map(|picks| worth(&picks)).fold(0.0, f64::max);
            prop_assert!((worth(&found) - best).abs() < 1e-9, "{found:?}");
        }
    }
}
