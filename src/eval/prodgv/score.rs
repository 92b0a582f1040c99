//! Counts of right, wrong and missing facts.

use std::collections::BTreeSet;

use super::matching::{Matching, renamed_atom};
use crate::logic::Truth;
use crate::pddl::{Atom, Name};
use crate::perception::grounders::{Basis, Judged};

/// One judged state against the true one.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Score {
    /// Predicted atoms that hold.
    pub tp: usize,
    /// Predicted atoms that do not hold, or use a detection that stands for nothing; with the
    /// names of the detections.
    pub wrong: Vec<Atom>,
    /// Listed observed facts that are not predicted, with the true names; one that is listed twice
    /// is missing twice.
    pub missing: Vec<Atom>,
    /// Tuples of which the grounder says that it does not know. They are not predicted.
    pub unknown: usize,
    /// Predicted atoms that rest on a constraint.
    pub inferred: usize,
}

impl Score {
    /// Whether every fact is right.
    pub fn is_exact(&self) -> bool {
        self.wrong.is_empty() && self.missing.is_empty()
    }
}

/// Scores what was judged. `truth` is the true state as it is listed, `observed` the predicates
/// that count.
pub fn score(
    judged: &[Judged],
    matching: &Matching,
    truth: &[Atom],
    observed: &BTreeSet<Name>,
) -> Score {
    let mut score = Score::default();
    let mut predicted: BTreeSet<Atom> = BTreeSet::new();
    for judged in judged.iter().filter(|judged| observed.contains(&judged.atom.predicate)) {
        match judged.truth {
            Truth::False => continue,
            Truth::Unknown => {
                score.unknown += 1;
                continue;
            }
            Truth::True => score.inferred += usize::from(judged.basis == Basis::Constrained),
        }
        match renamed_atom(&judged.atom, &|name| matching.get(name).cloned()) {
            Ok(atom) if truth.contains(&atom) => {
                score.tp += 1;
                predicted.insert(atom);
            }
            Ok(_) | Err(_) => score.wrong.push(judged.atom.clone()),
        }
    }
    let counts = |atom: &&Atom| observed.contains(&atom.predicate) && !predicted.contains(*atom);
    score.missing = truth.iter().filter(counts).cloned().collect();
    score
}

/// Sums over the pairs of a domain.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FactCounts {
    /// Pairs.
    pub pairs: usize,
    /// Predicted atoms that hold.
    pub tp: usize,
    /// Predicted atoms that do not.
    pub fp: usize,
    /// Listed facts that are not predicted.
    pub fn_: usize,
    /// States without a wrong or missing fact.
    pub exact: usize,
    /// Judged tuples that are unknown.
    pub unknown: usize,
    /// Predicted atoms that rest on a constraint.
    pub inferred: usize,
}

impl FactCounts {
    /// Adds one pair.
    pub fn add(&mut self, score: &Score) {
        self.pairs += 1;
        self.tp += score.tp;
        self.fp += score.wrong.len();
        self.fn_ += score.missing.len();
        self.exact += usize::from(score.is_exact());
        self.unknown += score.unknown;
        self.inferred += score.inferred;
    }

    /// Share of the predicted atoms that hold; `None` when nothing is predicted.
    pub fn precision(&self) -> Option<f64> {
        share(self.tp, self.tp + self.fp)
    }

    /// Share of the facts that are predicted; `None` when there are none.
    pub fn recall(&self) -> Option<f64> {
        share(self.tp, self.tp + self.fn_)
    }

    /// Harmonic mean of precision and recall.
    pub fn f1(&self) -> Option<f64> {
        share(2 * self.tp, 2 * self.tp + self.fp + self.fn_)
    }
}

fn share(part: usize, whole: usize) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    use crate::perception::grounders::Evidence;

    fn judged(args: &[&str], truth: Truth, basis: Basis) -> Judged {
        let atom = Atom::new("on", args);
        let evidence = Arc::new(Evidence { exemplar: String::new(), atom: atom.clone() });
        let (nearest_pos, nearest_neg) = (Arc::clone(&evidence), evidence);
        Judged { atom, truth, basis, d_pos: 1.0, d_neg: 2.0, nearest_pos, nearest_neg }
    }

    fn scored(list: &[(&[&str], Truth)], truth: &[[&str; 2]]) -> Score {
        let list: Vec<Judged> = list.iter().map(|(a, t)| judged(a, *t, Basis::Observed)).collect();
        let names = [("x", "a"), ("y", "b"), ("z", "c")];
        let matching = names.map(|(d, o)| (d.into(), o.into())).into();
        let mut listed: Vec<Atom> = truth.iter().map(|pair| Atom::new("on", pair)).collect();
        listed.push(Atom::new("clear", &["a"]));
        score(&list, &matching, &listed, &BTreeSet::from(["on".into()]))
    }

    #[test]
    fn right_wrong_and_missing_facts_are_told_apart() {
        let score =
            scored(&[(&["x", "y"], Truth::True), (&["y", "z"], Truth::True)], &[["a", "b"]]);
        assert_eq!((score.tp, score.wrong.len(), score.missing.len()), (1, 1, 0));
        assert_eq!(score.wrong, [Atom::new("on", &["y", "z"])]);
        let score = scored(&[], &[["a", "b"]]);
        assert_eq!(score.missing, [Atom::new("on", &["a", "b"])], "derived facts do not count");
    }

    #[test]
    fn a_fact_with_a_detection_that_stands_for_nothing_is_wrong() {
        // `w` is matched with nothing, and the truth has an object of that very name.
        let score = scored(&[(&["w", "y"], Truth::True)], &[["w", "b"]]);
        assert_eq!((score.tp, score.wrong.len(), score.missing.len()), (0, 1, 1));
    }

    #[test]
    fn a_fact_that_is_listed_twice_is_found_once_or_missing_twice() {
        let twice = [["a", "b"], ["a", "b"]];
        let found = scored(&[(&["x", "y"], Truth::True)], &twice);
        assert_eq!((found.tp, found.missing.len(), found.is_exact()), (1, 0, true));
        assert_eq!(scored(&[], &twice).missing.len(), 2);
    }

    #[test]
    fn what_is_unknown_is_not_predicted() {
        let score = scored(&[(&["x", "y"], Truth::Unknown)], &[["a", "b"]]);
        assert_eq!((score.tp, score.unknown, score.missing.len()), (0, 1, 1));
        assert!(!score.is_exact());
    }

    #[test]
    fn without_predictions_there_is_no_precision() {
        let counts = FactCounts::default();
        assert_eq!((counts.precision(), counts.recall(), counts.f1()), (None, None, None));
        let counts = FactCounts { tp: 3, fp: 1, fn_: 3, ..counts };
        assert_eq!((counts.precision(), counts.recall()), (Some(0.75), Some(0.5)));
        assert_eq!(counts.f1(), Some(0.6));
    }
}
