//! Completes a state by `:derived` rules.

use std::collections::BTreeSet;

use super::semantics::{Bindings, Universe, evaluate};
use super::strata::{Stratum, stratify};
use super::{Atom, Axiom, Condition, Literal, Name, Term, Typed};
use crate::scene::{Facts, Truth};

/// The facts with every head predicate of `axioms` recomputed from the rest.
///
/// Whatever `base` says of a head predicate is dropped. The rules may be recursive; a head holds
/// only where the rules make it so (least fixpoint, stratum by stratum), and is unknown where that
/// depends on unknown facts. Rules that are not stratified are computed as one stratum; the parser
/// refuses such rules.
pub fn derive(axioms: &[Axiom], universe: &Universe<'_>, base: &Facts) -> Facts {
    let heads: BTreeSet<&Name> = axioms.iter().map(|a| &a.head.name).collect();
    let mut facts = base.clone();
    facts.known.retain(|atom| !heads.contains(&atom.predicate));
    facts.unknown.retain(|atom| !heads.contains(&atom.predicate));
    let one_stratum = |_| vec![Stratum { rules: (0..axioms.len()).collect(), recursive: true }];
    for stratum in stratify(axioms).unwrap_or_else(one_stratum) {
        let rules: Vec<Rule> = stratum.rules.iter().map(|&idx| Rule::new(&axioms[idx])).collect();
        // Values only rise, from false over unknown to true, so this comes to an end.
        while pass(&rules, universe, &mut facts) && stratum.recursive {}
    }
    facts
}

/// Applies each rule once to the facts as they are; returns whether anything rose.
fn pass(rules: &[Rule], universe: &Universe<'_>, facts: &mut Facts) -> bool {
    let (mut unknown, mut known) = (Vec::new(), Vec::new());
    for rule in rules {
        let mut join = Join::new(rule, universe, facts);
        join.start();
        unknown.append(&mut join.unknown);
        known.append(&mut join.known);
    }
    let any = !(unknown.is_empty() && known.is_empty());
    // Sets are made and joined as wholes: rules may give very many atoms, mostly in order.
    facts.unknown.append(&mut BTreeSet::from_iter(unknown));
    facts.known.append(&mut BTreeSet::from_iter(known));
    let Facts { known, unknown } = facts;
    unknown.retain(|atom| !known.contains(atom));
    any
}

/// A rule as a join: its body's conjuncts, with existential quantifiers lifted to further variables.
struct Rule {
    head: Name,
    /// The head's parameters, then those of existential quantifiers.
    variables: Vec<Typed>,
    n_params: usize,
    /// Positive atoms; they are matched with the facts.
    atoms: Vec<Pattern>,
    /// Everything else, with the variables each part needs.
    rest: Vec<(Condition, Vec<usize>)>,
}

/// An atom over the rule's variables, by their place.
struct Pattern {
    predicate: Name,
    args: Vec<Arg>,
}

/// An argument of a [`Pattern`].
enum Arg {
    Variable(usize),
    Object(Name),
}

impl Rule {
    fn new(axiom: &Axiom) -> Self {
        let mut rule = Self {
            head: axiom.head.name.clone(),
            variables: axiom.head.params.clone(),
            n_params: axiom.head.params.len(),
            atoms: Vec::new(),
            rest: Vec::new(),
        };
        rule.split(&axiom.body, &Bindings::new());
        rule
    }

    fn split(&mut self, condition: &Condition, renaming: &Bindings) {
        match condition {
            Condition::And(parts) => {
                for part in parts {
                    self.split(part, renaming);
                }
            }
            Condition::Exists(variables, inner) => {
                let mut renaming = renaming.clone();
                for Typed { name, types } in variables {
                    // No name that was read contains a parenthesis, so this one is new.
                    let fresh = Name::new(format!("{name}({})", self.variables.len()));
                    self.variables.push(Typed { name: fresh.clone(), types: types.clone() });
                    renaming.insert(name.clone(), fresh);
                }
                self.split(inner, &renaming);
            }
            Condition::Atom(literal) => {
                let pattern = self.pattern(&renamed_literal(literal, renaming));
                self.atoms.push(pattern);
            }
            Condition::True
            | Condition::False
            | Condition::Equal(..)
            | Condition::Not(_)
            | Condition::Or(_)
            | Condition::Forall(..) => {
                let condition = renamed(condition, renaming);
                let mut needed = BTreeSet::new();
                free_variables(&condition, &mut needed);
                let needed = needed.iter().filter_map(|name| self.place(name)).collect();
                self.rest.push((condition, needed));
            }
        }
    }

    fn place(&self, variable: &Name) -> Option<usize> {
        self.variables.iter().position(|v| v.name == *variable)
    }

    fn pattern(&self, literal: &Literal) -> Pattern {
        let arg = |term: &Term| match term {
            Term::Object(name) => Arg::Object(name.clone()),
            // An unbound variable, which the parser refuses, matches no object.
            Term::Var(name) => {
                self.place(name).map_or_else(|| Arg::Object(name.clone()), Arg::Variable)
            }
        };
        let args = literal.args.iter().map(arg).collect();
        Pattern { predicate: literal.predicate.clone(), args }
    }
}

/// One evaluation of a rule over the facts so far.
struct Join<'a> {
    rule: &'a Rule,
    universe: &'a Universe<'a>,
    facts: &'a Facts,
    /// The objects each variable ranges over.
    ranges: Vec<BTreeSet<&'a Name>>,
    binding: Vec<Option<&'a Name>>,
    /// Heads that have risen to unknown.
    unknown: Vec<Atom>,
    /// Heads that have risen to true.
    known: Vec<Atom>,
}

impl<'a> Join<'a> {
    fn new(rule: &'a Rule, universe: &'a Universe<'a>, facts: &'a Facts) -> Self {
        let ranges = rule.variables.iter().map(|v| universe.of(&v.types).collect()).collect();
        let binding = vec![None; rule.variables.len()];
        let (unknown, known) = (Vec::new(), Vec::new());
        Self { rule, universe, facts, ranges, binding, unknown, known }
    }

    fn start(&mut self) {
        let atoms: Vec<usize> = (0..self.rule.atoms.len()).collect();
        let rest: Vec<usize> = (0..self.rule.rest.len()).collect();
        self.extend(&atoms, &rest, Truth::True);
    }

    /// Extends a partial binding under which the conjuncts handled so far have the value `truth`.
    fn extend(&mut self, atoms: &[usize], rest: &[usize], truth: Truth) {
        let mut truth = truth;
        let mut open = Vec::new();
        for &idx in rest {
            let (condition, needed) = &self.rule.rest[idx];
            if needed.iter().all(|&v| self.binding[v].is_some()) {
                truth = truth.min(self.evaluate(condition));
            } else {
                open.push(idx);
            }
        }
        if truth.is_false() {
            return;
        }
        // The atom with the fewest free variables is matched next; the first one on a tie.
        let next = atoms.iter().copied().min_by_key(|&idx| self.n_free(&self.rule.atoms[idx]));
        if let Some(idx) = next {
            let others: Vec<usize> = atoms.iter().copied().filter(|&a| a != idx).collect();
            self.match_atom(&self.rule.atoms[idx], &others, &open, truth);
            return;
        }
        let Some(free) = self.binding.iter().position(Option::is_none) else {
            self.emit(truth);
            return;
        };
        for object in self.ranges[free].clone() {
            self.binding[free] = Some(object);
            self.extend(&[], &open, truth);
        }
        self.binding[free] = None;
    }

    fn evaluate(&self, condition: &Condition) -> Truth {
        let bound = self.rule.variables.iter().zip(&self.binding);
        let bindings: Bindings =
            bound.filter_map(|(v, o)| Some((v.name.clone(), (*o)?.clone()))).collect();
        evaluate(condition, &bindings, self.universe, &|atom| self.facts.truth(atom))
    }

    fn value(&self, arg: &'a Arg) -> Option<&'a Name> {
        match arg {
            Arg::Variable(place) => self.binding[*place],
            Arg::Object(name) => Some(name),
        }
    }

    fn n_free(&self, pattern: &'a Pattern) -> usize {
        pattern.args.iter().filter(|arg| self.value(arg).is_none()).count()
    }

    fn match_atom(&mut self, pattern: &'a Pattern, atoms: &[usize], rest: &[usize], truth: Truth) {
        let facts = self.facts;
        let args: Option<Vec<Name>> =
            pattern.args.iter().map(|arg| self.value(arg).cloned()).collect();
        if let Some(args) = args {
            let truth =
                truth.min(facts.truth(&Atom { predicate: pattern.predicate.clone(), args }));
            if !truth.is_false() {
                self.extend(atoms, rest, truth);
            }
            return;
        }
        let known = of_predicate(&facts.known, &pattern.predicate).map(|a| (a, truth));
        let unknown = of_predicate(&facts.unknown, &pattern.predicate);
        for (atom, truth) in known.chain(unknown.map(|a| (a, Truth::Unknown))) {
            let mut bound = Vec::new();
            if self.unify(pattern, atom, &mut bound) {
                self.extend(atoms, rest, truth);
            }
            for place in bound {
                self.binding[place] = None;
            }
        }
    }

    /// Binds the pattern's free variables so that it becomes the atom; notes them in `bound`.
    fn unify(&mut self, pattern: &'a Pattern, atom: &'a Atom, bound: &mut Vec<usize>) -> bool {
        pattern.args.len() == atom.args.len()
            && pattern.args.iter().zip(&atom.args).all(|(arg, object)| {
                if let Some(value) = self.value(arg) {
                    return value == object;
                }
                let Arg::Variable(place) = *arg else { return false };
                self.binding[place] = Some(object);
                bound.push(place);
                self.ranges[place].contains(object)
            })
    }

    fn emit(&mut self, truth: Truth) {
        let args = self.binding[..self.rule.n_params].iter();
        let args = args.flatten().map(|&object| object.clone()).collect();
        let atom = Atom { predicate: self.rule.head.clone(), args };
        if truth > self.facts.truth(&atom) {
            let risen = if truth.is_true() { &mut self.known } else { &mut self.unknown };
            risen.push(atom);
        }
    }
}

/// The atoms of one predicate.
fn of_predicate<'a>(
    atoms: &'a BTreeSet<Atom>,
    predicate: &'a Name,
) -> impl Iterator<Item = &'a Atom> {
    let first = Atom { predicate: predicate.clone(), args: Vec::new() };
    atoms.range(first..).take_while(move |atom| atom.predicate == *predicate)
}

fn renamed_term(term: &Term, renaming: &Bindings) -> Term {
    match term {
        Term::Var(name) => Term::Var(renaming.get(name).unwrap_or(name).clone()),
        Term::Object(name) => Term::Object(name.clone()),
    }
}

fn renamed_literal(literal: &Literal, renaming: &Bindings) -> Literal {
    let args = literal.args.iter().map(|t| renamed_term(t, renaming)).collect();
    Literal { predicate: literal.predicate.clone(), args }
}

/// The condition with its free variables renamed.
fn renamed(condition: &Condition, renaming: &Bindings) -> Condition {
    let of = |inner: &Condition| renamed(inner, renaming);
    let below = |variables: &[Typed], inner: &Condition| {
        let mut visible = renaming.clone();
        visible.retain(|name, _| variables.iter().all(|v| v.name != *name));
        Box::new(renamed(inner, &visible))
    };
    match condition {
        Condition::True => Condition::True,
        Condition::False => Condition::False,
        Condition::Atom(literal) => Condition::Atom(renamed_literal(literal, renaming)),
        Condition::Equal(a, b) => {
            Condition::Equal(renamed_term(a, renaming), renamed_term(b, renaming))
        }
        Condition::Not(inner) => Condition::Not(Box::new(of(inner))),
        Condition::And(parts) => Condition::And(parts.iter().map(of).collect()),
        Condition::Or(parts) => Condition::Or(parts.iter().map(of).collect()),
        Condition::Exists(vars, inner) => Condition::Exists(vars.clone(), below(vars, inner)),
        Condition::Forall(vars, inner) => Condition::Forall(vars.clone(), below(vars, inner)),
    }
}

/// Collects the variables that a condition needs from outside.
fn free_variables(condition: &Condition, free: &mut BTreeSet<Name>) {
    let mut add = |term: &Term| {
        if let Term::Var(name) = term {
            free.insert(name.clone());
        }
    };
    match condition {
        Condition::True | Condition::False => {}
        Condition::Atom(literal) => literal.args.iter().for_each(add),
        Condition::Equal(left, right) => {
            add(left);
            add(right);
        }
        Condition::Not(inner) => free_variables(inner, free),
        Condition::And(parts) | Condition::Or(parts) => {
            for part in parts {
                free_variables(part, free);
            }
        }
        Condition::Exists(variables, inner) | Condition::Forall(variables, inner) => {
            let mut inside = BTreeSet::new();
            free_variables(inner, &mut inside);
            inside.retain(|name| variables.iter().all(|v| v.name != *name));
            free.extend(inside);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pddl::{SourceText, parse_domain};

    /// The derived atoms of `(edge …)` facts over the objects a b c, as text.
    fn derived(rules: &str, known: &[[&str; 2]], unknown: &[[&str; 2]]) -> (String, String) {
        let text = format!(
            "(define (domain d) (:requirements :adl :derived-predicates) (:types node)
              (:predicates (edge ?x ?y - node) (path ?x ?y - node) (cut ?x - node) (any))
              {rules})"
        );
        let domain = parse_domain(&SourceText::new("d", text));
        let domain = domain.unwrap_or_else(|e| panic!("{}", e.render())).value;
        let objects = ["a", "b", "c"].map(|name| Typed::new(name, "node"));
        let universe = Universe { types: &domain.types, objects: &objects };
        let edges = |list: &[[&str; 2]]| list.iter().map(|e| Atom::new("edge", e)).collect();
        let mut base = Facts { known: edges(known), unknown: edges(unknown) };
        // What was believed of a head before is of no interest.
        base.known.insert(Atom::new("path", &["c", "c"]));
        base.unknown.insert(Atom::new("cut", &["a"]));
        let facts = derive(&domain.axioms, &universe, &base);
        let show = |atoms: &BTreeSet<Atom>| {
            let heads = atoms.iter().filter(|a| a.predicate != "edge");
            heads.map(ToString::to_string).collect::<String>()
        };
        (show(&facts.known), show(&facts.unknown))
    }

    const PATH: &str = "(:derived (path ?x ?y - node) (or (edge ?x ?y)
        (exists (?z - node) (and (edge ?x ?z) (path ?z ?y)))))";
    const PATH_IN_TWO: &str = "(:derived (path ?x ?y - node) (edge ?x ?y))
        (:derived (path ?x ?y - node) (exists (?z - node) (and (path ?x ?z) (path ?z ?y))))";
    const CUT: &str = "(:derived (cut ?x - node) (not (exists (?y - node) (path ?x ?y))))";

    #[test]
    fn recursive_rules_reach_their_fixpoint() {
        for rules in [PATH, PATH_IN_TWO] {
            let (known, unknown) = derived(rules, &[["a", "b"], ["b", "c"]], &[]);
            assert_eq!(known, "(path a b)(path a c)(path b c)");
            assert_eq!(unknown, "(cut a)", "no rule for it");
            let (known, _) = derived(rules, &[["a", "b"], ["b", "a"]], &[]);
            assert_eq!(known, "(path a a)(path a b)(path b a)(path b b)");
        }
    }

    #[test]
    fn negation_sees_the_finished_stratum_below() {
        let rules = format!("{CUT}{PATH}");
        let (known, unknown) = derived(&rules, &[["a", "b"]], &[]);
        assert_eq!((known.as_str(), unknown.as_str()), ("(cut b)(cut c)(path a b)", ""));
    }

    #[test]
    fn what_hangs_on_an_unknown_fact_is_unknown() {
        for rules in [PATH, PATH_IN_TWO] {
            let rules = format!("{rules}{CUT}");
            let (known, unknown) = derived(&rules, &[["a", "b"]], &[["b", "c"]]);
            assert_eq!(known, "(cut c)(path a b)");
            assert_eq!(unknown, "(cut b)(path a c)(path b c)");
        }
    }

    #[test]
    fn a_quantifier_may_hide_a_parameter() {
        let rules = "(:derived (cut ?x - node) (and (edge ?x ?x)
            (exists (?x ?y - node) (and (edge ?x ?y) (not (= ?x ?y))))))";
        // No rule says anything of `path`, so it stays as it was.
        assert_eq!(derived(rules, &[["a", "a"]], &[]).0, "(path c c)");
        assert_eq!(derived(rules, &[["a", "a"], ["b", "c"]], &[]).0, "(cut a)(path c c)");
    }

    #[test]
    fn zero_arity_heads_and_unbound_parameters_work() {
        let rules = "(:derived (any) (exists (?x ?y - node) (edge ?x ?y)))
            (:derived (path ?x ?y - node) (and (any) (not (edge ?x ?y)) (not (edge ?y ?x))))";
        let (known, _) = derived(rules, &[["a", "b"]], &[]);
        let pairs = "(path a a)(path a c)(path b b)(path b c)(path c a)(path c b)(path c c)";
        assert_eq!(known, format!("(any){pairs}"));
    }
}
