//! One evaluation of a rule over the relations as they are.

use super::rule::{Arg, Pattern, Rule, Step};
use super::{Extension, Symbols};
use crate::logic::{Bindings, Truth, Universe, evaluate};

/// What a rule gives: heads, row by row, with their truth values.
#[derive(Debug, Default)]
pub(super) struct Heads {
    pub(super) args: Vec<u32>,
    pub(super) truths: Vec<Truth>,
}

/// A join that is under way.
pub(super) struct Join<'a> {
    rule: &'a Rule,
    extension: &'a Extension,
    universe: &'a Universe<'a>,
    /// The objects each variable ranges over, in order.
    ranges: Vec<Vec<u32>>,
    /// Whether object `o` may stand for variable `v`, at `[v][o]`.
    allowed: Vec<Vec<bool>>,
    /// Places known to each step, for its index.
    places: &'a [Vec<usize>],
    binding: Vec<u32>,
    heads: Heads,
}

/// The heads that a rule makes true or unknown.
pub(super) fn heads(rule: &Rule, extension: &Extension, universe: &Universe<'_>) -> Heads {
    let symbols = &extension.symbols;
    let ranges: Vec<Vec<u32>> =
        rule.variables.iter().map(|v| objects(symbols, universe, &v.types)).collect();
    let allowed = ranges.iter().map(|range| {
        let mut allowed = vec![false; symbols.objects.len()];
        for &object in range {
            allowed[object as usize] = true;
        }
        allowed
    });
    let places: Vec<Vec<usize>> = rule.steps.iter().map(known_places).collect();
    let mut join = Join {
        rule,
        extension,
        universe,
        allowed: allowed.collect(),
        places: &places,
        ranges,
        binding: vec![0; rule.variables.len()],
        heads: Heads::default(),
    };
    join.extend(0, Truth::True);
    join.heads
}

/// The places of a step's atom that are known when it is reached.
pub(super) fn known_places(step: &Step) -> Vec<usize> {
    match step {
        Step::Match(pattern) => pattern.known.iter().map(|(place, _)| *place).collect(),
        Step::Check(_) | Step::Range(_) => Vec::new(),
    }
}

fn objects(symbols: &Symbols, universe: &Universe<'_>, types: &[crate::pddl::Name]) -> Vec<u32> {
    universe.of(types).filter_map(|name| symbols.known_object(name)).collect()
}

impl Join<'_> {
    /// Goes on from a step, under a binding for which all steps before have the value `truth`.
    fn extend(&mut self, at: usize, truth: Truth) {
        let (rule, places) = (self.rule, self.places);
        let Some(step) = rule.steps.get(at) else { return self.emit(truth) };
        match step {
            Step::Check(condition) => {
                let symbols = &self.extension.symbols;
                let bound = rule.variables.iter().zip(&self.binding);
                let bindings: Bindings = bound
                    .map(|(v, &object)| (v.name.clone(), symbols.objects[object as usize].clone()))
                    .collect();
                let value = evaluate(condition, &bindings, self.universe, &|atom| {
                    self.extension.truth(atom)
                });
                let truth = truth.min(value);
                if !truth.is_false() {
                    self.extend(at + 1, truth);
                }
            }
            Step::Range(variable) => {
                for idx in 0..self.ranges[*variable].len() {
                    self.binding[*variable] = self.ranges[*variable][idx];
                    self.extend(at + 1, truth);
                }
            }
            Step::Match(pattern) => {
                let relation = &self.extension.relations[pattern.relation];
                if pattern.known.is_empty() {
                    for row in 0..relation.len() {
                        self.match_row(pattern, row, (at, truth));
                    }
                    return;
                }
                let value = |arg: &Arg| match *arg {
                    Arg::Variable(variable) => self.binding[variable],
                    Arg::Object(object) => object,
                };
                let objects: Vec<u32> = pattern.known.iter().map(|(_, arg)| value(arg)).collect();
                for &row in relation.group(&places[at], &objects) {
                    self.match_row(pattern, row as usize, (at, truth));
                }
            }
        }
    }

    /// Goes on from step `at` with one row of its relation, if that agrees with the binding.
    fn match_row(&mut self, pattern: &Pattern, row: usize, (at, truth): (usize, Truth)) {
        let relation = &self.extension.relations[pattern.relation];
        let tuple = relation.tuple(row);
        for &(place, variable) in &pattern.free {
            if !self.allowed[variable][tuple[place] as usize] {
                return;
            }
            self.binding[variable] = tuple[place];
        }
        if pattern.again.iter().all(|&(place, v)| tuple[place] == self.binding[v]) {
            self.extend(at + 1, truth.min(relation.truth_of_row(row)));
        }
    }

    fn emit(&mut self, truth: Truth) {
        let Heads { args, truths } = &mut self.heads;
        let head = &self.binding[..self.rule.n_params];
        // Bindings that differ in other variables only often follow each other.
        let repeated = truths.last() == Some(&truth) && args.ends_with(head);
        if !repeated {
            args.extend_from_slice(head);
            truths.push(truth);
        }
    }
}
