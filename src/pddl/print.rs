//! Trees to text. What is printed reads back as the same tree.

use std::fmt::{self, Write as _};

use super::check::term_text;
use super::{
    Action, Axiom, Condition, CostTerm, Domain, Effect, Literal, Name, Problem, Signature, Typed,
};

/// A domain as PDDL text.
pub fn print_domain(domain: &Domain) -> String {
    domain.to_string()
}

/// A problem as PDDL text.
pub fn print_problem(problem: &Problem) -> String {
    problem.to_string()
}

impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "(define (domain {})", self.name)?;
        if !self.requirements.is_empty() {
            writeln!(f, "  (:requirements{})", spaced(&self.requirements))?;
        }
        if !self.types.parents.is_empty() {
            let types = self.types.parents.iter();
            let types =
                types.map(|(name, types)| Typed { name: name.clone(), types: types.clone() });
            writeln!(f, "  (:types{})", typed_list(&types.collect::<Vec<_>>(), ""))?;
        }
        if !self.constants.is_empty() {
            writeln!(f, "  (:constants{})", typed_list(&self.constants, ""))?;
        }
        section(f, ":predicates", &self.predicates, signature)?;
        section(f, ":functions", &self.functions, |s| format!("{} - number", signature(s)))?;
        for Axiom { head, body } in &self.axioms {
            writeln!(f, "  (:derived {}\n    {body})", signature(head))?;
        }
        for Action { name, params, precondition, effect } in &self.actions {
            writeln!(f, "  (:action {name}\n    :parameters ({})", variables(params))?;
            writeln!(f, "    :precondition {precondition}\n    :effect {effect})")?;
        }
        writeln!(f, ")")
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "(define (problem {})\n  (:domain {})", self.name, self.domain)?;
        if !self.objects.is_empty() {
            writeln!(f, "  (:objects{})", typed_list(&self.objects, ""))?;
        }
        write!(f, "  (:init")?;
        for atom in &self.init {
            write!(f, "\n    {atom}")?;
        }
        for (atom, value) in &self.costs {
            write!(f, "\n    (= {atom} {value})")?;
        }
        writeln!(f, ")\n  (:goal {})", self.goal)?;
        if self.minimise_cost {
            writeln!(f, "  (:metric minimize (total-cost))")?;
        }
        writeln!(f, ")")
    }
}

fn section<T>(
    f: &mut fmt::Formatter<'_>,
    keyword: &str,
    items: &[T],
    text: impl Fn(&T) -> String,
) -> fmt::Result {
    if items.is_empty() {
        return Ok(());
    }
    write!(f, "  ({keyword}")?;
    for item in items {
        write!(f, "\n    {}", text(item))?;
    }
    writeln!(f, ")")
}

fn spaced<'a>(names: impl IntoIterator<Item = &'a Name>) -> String {
    names.into_iter().flat_map(|n| [" ", n.as_str()]).collect()
}

fn signature(signature: &Signature) -> String {
    format!("({}{})", signature.name, typed_list(&signature.params, "?"))
}

/// The variables of a quantifier or action, without a leading space.
fn variables(params: &[Typed]) -> String {
    typed_list(params, "?").trim_start().to_owned()
}

/// Each name with its own type, so that none takes over its neighbour's.
fn typed_list(items: &[Typed], sigil: &str) -> String {
    let typed = |Typed { name, types }: &Typed| match types.as_slice() {
        [] => format!(" {sigil}{name} - object"),
        [one] => format!(" {sigil}{name} - {one}"),
        several => format!(" {sigil}{name} - (either{})", spaced(several)),
    };
    items.iter().map(typed).collect()
}

impl fmt::Display for Literal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "({}", self.predicate)?;
        for arg in &self.args {
            write!(f, " {}", term_text(arg))?;
        }
        f.write_char(')')
    }
}

impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::True => f.write_str("(and)"),
            Self::False => f.write_str("(or)"),
            Self::Atom(literal) => write!(f, "{literal}"),
            Self::Equal(a, b) => write!(f, "(= {} {})", term_text(a), term_text(b)),
            Self::Not(inner) => write!(f, "(not {inner})"),
            Self::And(parts) => write_all(f, "and", parts),
            Self::Or(parts) => write_all(f, "or", parts),
            Self::Exists(vars, inner) => write!(f, "(exists ({}) {inner})", variables(vars)),
            Self::Forall(vars, inner) => write!(f, "(forall ({}) {inner})", variables(vars)),
        }
    }
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::And(parts) => write_all(f, "and", parts),
            Self::Add(literal) => write!(f, "{literal}"),
            Self::Delete(literal) => write!(f, "(not {literal})"),
            Self::When(condition, effect) => write!(f, "(when {condition} {effect})"),
            Self::Forall(vars, effect) => write!(f, "(forall ({}) {effect})", variables(vars)),
            Self::Cost(CostTerm::Number(n)) => write!(f, "(increase (total-cost) {n})"),
            Self::Cost(CostTerm::Function(l)) => write!(f, "(increase (total-cost) {l})"),
        }
    }
}

fn write_all<T: fmt::Display>(f: &mut fmt::Formatter<'_>, head: &str, parts: &[T]) -> fmt::Result {
    write!(f, "({head}")?;
    for part in parts {
        write!(f, " {part}")?;
    }
    f.write_char(')')
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::pddl::Number;
    use crate::pddl::{Atom, SourceText, Term, Types, parse_domain, parse_problem};

    const PREDICATES: [(&str, &[&str]); 4] =
        [("p", &[]), ("q", &["t"]), ("r", &["object", "u"]), ("at", &["t", "t"])];

    fn vocabulary() -> Domain {
        let types = [("t", vec![]), ("u", vec!["t"]), ("v", vec!["t", "u"])];
        let names = |list: &[&str]| list.iter().map(|&n| Name::from(n)).collect::<Vec<_>>();
        let parents = types.into_iter().map(|(t, p)| (Name::from(t), names(&p))).collect();
        let signature = |(name, types): &(&str, &[&str])| {
            let params = types.iter().zip(["a", "b"]).map(|(t, param)| Typed {
                name: param.into(),
                types: if *t == "object" { vec![] } else { vec![Name::from(*t)] },
            });
            Signature { name: Name::from(*name), params: params.collect() }
        };
        let cost = Signature { name: "total-cost".into(), params: vec![] };
        let far = Signature { name: "far".into(), params: vec![Typed::new("x", "t")] };
        Domain {
            name: "d".into(),
            requirements: [Name::from(":adl"), Name::from(":typing")].into(),
            types: Types { parents },
            constants: vec![Typed::new("c", "v"), Typed::new("k", "u")],
            predicates: PREDICATES.iter().map(signature).collect(),
            functions: vec![cost, far],
            axioms: vec![],
            actions: vec![],
        }
    }

    /// A term that fits everywhere.
    fn term(variables: Vec<Name>) -> impl Strategy<Value = Term> {
        let constants = [Term::Object("c".into())];
        let terms = variables.into_iter().map(Term::Var).chain(constants).collect::<Vec<_>>();
        prop::sample::select(terms)
    }

    fn literal(variables: Vec<Name>) -> impl Strategy<Value = Literal> {
        (0..PREDICATES.len(), term(variables.clone()), term(variables)).prop_map(|(idx, a, b)| {
            let (name, types) = PREDICATES[idx];
            let args = [a, b].into_iter().take(types.len()).collect();
            Literal { predicate: name.into(), args }
        })
    }

    /// Quantified variables, which may hide outer ones.
    fn quantified() -> impl Strategy<Value = Vec<Typed>> {
        let names = prop::sample::subsequence(vec!["x", "y", "z"], 1..=2);
        names.prop_map(|names| names.into_iter().map(|n| Typed::new(n, "v")).collect())
    }

    fn visible(outer: &[Name], inner: &[Typed]) -> Vec<Name> {
        outer.iter().chain(inner.iter().map(|t| &t.name)).cloned().collect()
    }

    fn condition(variables: Vec<Name>, depth: u32) -> BoxedStrategy<Condition> {
        let terms = (term(variables.clone()), term(variables.clone()));
        let leaf = prop_oneof![
            Just(Condition::True),
            Just(Condition::False),
            literal(variables.clone()).prop_map(Condition::Atom),
            terms.prop_map(|(a, b)| Condition::Equal(a, b)),
        ];
        if depth == 0 {
            return leaf.boxed();
        }
        let parts = prop::collection::vec(condition(variables.clone(), depth - 1), 1..3);
        let below = quantified().prop_flat_map(move |inner| {
            let names = visible(&variables, &inner);
            (Just(inner), condition(names, depth - 1).prop_map(Box::new), any::<bool>())
        });
        prop_oneof![
            leaf,
            parts.clone().prop_map(Condition::And),
            parts.clone().prop_map(Condition::Or),
            parts.prop_map(|mut p| Condition::Not(Box::new(p.swap_remove(0)))),
            below.prop_map(|(vars, inner, exists)| {
                if exists { Condition::Exists(vars, inner) } else { Condition::Forall(vars, inner) }
            }),
        ]
        .boxed()
    }

    fn effect(variables: Vec<Name>, depth: u32) -> BoxedStrategy<Effect> {
        let leaf = prop_oneof![
            literal(variables.clone()).prop_map(Effect::Add),
            literal(variables.clone()).prop_map(Effect::Delete),
            Just(Effect::And(vec![])),
        ];
        if depth == 0 {
            return leaf.boxed();
        }
        let parts = prop::collection::vec(effect(variables.clone(), depth - 1), 0..3);
        let when = (condition(variables.clone(), 1), effect(variables.clone(), depth - 1));
        let below = quantified().prop_flat_map(move |inner| {
            let names = visible(&variables, &inner);
            (Just(inner), effect(names, depth - 1).prop_map(Box::new))
        });
        prop_oneof![
            leaf,
            parts.prop_map(Effect::And),
            when.prop_map(|(condition, effect)| Effect::When(condition, Box::new(effect))),
            below.prop_map(|(vars, inner)| Effect::Forall(vars, inner)),
        ]
        .boxed()
    }

    fn action() -> impl Strategy<Value = Action> {
        let params = [Typed::new("x", "v"), Typed { name: "w".into(), types: vec![] }];
        let names = vec![Name::from("x")];
        let either = Typed { name: "e".into(), types: vec!["u".into(), "v".into()] };
        let far = Literal { predicate: "far".into(), args: vec![Term::Var("x".into())] };
        let costs = [
            CostTerm::Number(Number::new(25, 1)),
            CostTerm::Number(Number::default()),
            CostTerm::Function(far),
        ];
        let costs = prop::sample::select(costs.map(Effect::Cost).to_vec());
        (condition(names.clone(), 3), effect(names, 3), costs).prop_map(move |(c, e, cost)| {
            Action {
                name: "act".into(),
                params: params.iter().cloned().chain([either.clone()]).collect(),
                precondition: c,
                effect: Effect::And(vec![e, cost]),
            }
        })
    }

    fn reads_back(domain: &Domain) {
        let source = SourceText::new("printed", print_domain(domain));
        let read = parse_domain(&source).unwrap_or_else(|e| panic!("{}", e.render()));
        assert_eq!(read.value, *domain, "{}", source.text);
    }

    proptest! {
        #[test]
        fn a_printed_domain_reads_back(action in action()) {
            reads_back(&Domain { actions: vec![action], ..vocabulary() });
        }

        #[test]
        fn a_printed_rule_reads_back(body in condition(vec![Name::from("a")], 3)) {
            let head = Signature { name: "q".into(), params: vec![Typed::new("a", "v")] };
            let axiom = Axiom { head, body };
            // A rule that depends on its own negation is refused when it is read.
            prop_assume!(crate::pddl::stratify(std::slice::from_ref(&axiom)).is_ok());
            reads_back(&Domain { axioms: vec![axiom], ..vocabulary() });
        }

        #[test]
        fn a_printed_problem_reads_back(goal in condition(vec![], 4), (mantissa, decimals) in (any::<i64>(), 0..20_u32)) {
            let domain = vocabulary();
            let problem = Problem {
                name: "one".into(),
                domain: "d".into(),
                objects: vec![Typed::new("o", "t"), Typed { name: "any".into(), types: vec![] }],
                init: [Atom::new("p", &[]), Atom::new("at", &["o", "c"])].into(),
                costs: [(Atom::new("far", &["o"]), Number::new(mantissa.into(), decimals))].into(),
                goal,
                minimise_cost: mantissa > 1,
            };
            let source = SourceText::new("printed", print_problem(&problem));
            let read = parse_problem(&source, &domain);
            let read = read.unwrap_or_else(|e| panic!("{}", e.render())).value;
            prop_assert_eq!(read, problem);
        }
    }
}
