//! Problems, goals, facts and plans.

use std::collections::{BTreeMap, BTreeSet};

use super::super::check::{Scope, Vocabulary, did_you_mean, type_text};
use super::super::error::{Parsed, PddlError, SourcePosition, SourceText, Span};
use super::super::sexpr::{Node, read};
use super::super::{Atom, Condition, Domain, Literal, Name, Number, Problem, Term, Typed};
use super::requirements::Feature;
use super::typed::Kind;
use super::{Body, Reader, tail};

/// Reads and checks a problem of `domain`.
///
/// # Errors
/// The first mistake in the text, among them another domain's name.
pub fn parse_problem(source: &SourceText, domain: &Domain) -> Result<Parsed<Problem>, PddlError> {
    let forms = read(source)?;
    let mut reader = Reader::new(source);
    let (name, sections) = reader.define(&forms, "problem")?;
    let sections = reader.sections(sections, PROBLEM_SECTIONS)?;
    let section = |keyword: &str| sections.iter().find(|(k, _)| k == keyword).map(|(_, n)| *n);
    reader.check_domain_name(&forms[0], section(":domain"), domain)?;
    let mut requirements = domain.requirements.clone();
    if let Some(node) = section(":requirements") {
        requirements.extend(reader.requirements(tail(node.list().unwrap_or_default()))?);
    }
    let objects = match section(":objects") {
        Some(node) => reader.within("objects", |r| r.objects(node, domain))?,
        None => Vec::new(),
    };
    let vocabulary = Vocabulary::new(domain, &objects);
    let mut init = Init::default();
    if let Some(node) = section(":init") {
        let nodes = tail(node.list().unwrap_or_default());
        init = reader.within("init", |r| r.init(nodes, &vocabulary, domain))?;
    }
    let Some(goal) = section(":goal") else {
        return Err(reader.syntax(forms[0].span, "expected a `(:goal …)`, got none"));
    };
    let goal = reader.within("goal", |r| r.goal(goal, &vocabulary))?;
    let minimise_cost = match section(":metric") {
        Some(node) => reader.within("metric", |r| r.metric(node))?,
        None => false,
    };
    reader.warn_of_undeclared(&requirements);
    let Init { facts, costs } = init;
    let domain = domain.name.clone();
    let problem = Problem { name, domain, objects, init: facts, costs, goal, minimise_cost };
    Ok(Parsed { value: problem, warnings: reader.into_warnings() })
}

/// Reads a goal over `objects`: a condition, or the same inside `(:goal …)`.
///
/// # Errors
/// The first mistake in the text, among them objects that are neither given nor constants.
pub fn parse_goal(
    source: &SourceText,
    domain: &Domain,
    objects: &[Typed],
) -> Result<Condition, PddlError> {
    let forms = read(source)?;
    let mut reader = Reader::new(source);
    let form = reader.single(&forms, "a goal")?;
    let vocabulary = Vocabulary::new(domain, objects);
    reader.within("goal", |r| {
        if form.head().as_deref() == Some(":goal") {
            r.goal(form, &vocabulary)
        } else {
            r.closed_condition(form, &vocabulary)
        }
    })
}

/// Reads facts over `objects`: ground atoms one after the other, an `(:init …)` form, or a whole
/// problem, of which only the `:init` is read.
///
/// # Errors
/// The first mistake in the text.
pub fn parse_facts(
    source: &SourceText,
    domain: &Domain,
    objects: &[Typed],
) -> Result<Parsed<BTreeSet<Atom>>, PddlError> {
    let forms = read(source)?;
    let mut reader = Reader::new(source);
    let is = |node: &Node<'_>, head: &str| node.head().as_deref() == Some(head);
    let nodes = match forms.as_slice() {
        [form] if is(form, "define") => {
            let init = form.list().and_then(|l| l.iter().find(|n| is(n, ":init")));
            match init.and_then(Node::list) {
                Some(members) => tail(members),
                None => return Err(reader.syntax(form.span, "expected an `(:init …)`, got none")),
            }
        }
        [form] if is(form, ":init") => tail(form.list().unwrap_or_default()),
        forms => forms,
    };
    let vocabulary = Vocabulary::new(domain, objects);
    let init = reader.within("facts", |r| r.init(nodes, &vocabulary, domain))?;
    Ok(Parsed { value: init.facts, warnings: reader.into_warnings() })
}

const PROBLEM_SECTIONS: &[&str] =
    &[":domain", ":requirements", ":objects", ":init", ":goal", ":metric", ":length"];

/// What an `:init` says.
#[derive(Default)]
struct Init {
    facts: BTreeSet<Atom>,
    costs: BTreeMap<Atom, Number>,
}

impl<'s> Reader<'s> {
    fn check_domain_name(
        &self,
        form: &Node<'s>,
        section: Option<&Node<'s>>,
        domain: &Domain,
    ) -> Result<(), PddlError> {
        let Some(section) = section else {
            return Err(self.syntax(form.span, "expected a `(:domain …)`, got none"));
        };
        let Some([_, node]) = section.list() else {
            return Err(self.syntax(section.span, "expected `(:domain name)`"));
        };
        let name = self.name(node, "the domain's name")?;
        if name == domain.name {
            return Ok(());
        }
        let message = format!("expected the domain `{}`, got `{name}`", domain.name);
        let mut error = self.semantics(node.span, message);
        error.help = Some(format!(
            "the domain file that was read defines `{}`; give the one this problem belongs to",
            domain.name
        ));
        Err(error)
    }

    /// The objects of a problem. One that repeats a constant or an earlier object is left out.
    fn objects(&mut self, node: &Node<'s>, domain: &Domain) -> Result<Vec<Typed>, PddlError> {
        let vocabulary = Vocabulary::new(domain, &[]);
        let nodes = tail(node.list().unwrap_or_default());
        let list = self.checked_typed_list(nodes, Kind::Name, "object", &vocabulary)?;
        let mut known: BTreeMap<Name, Vec<Name>> = BTreeMap::new();
        for constant in &domain.constants {
            known.insert(constant.name.clone(), constant.types.clone());
        }
        let mut objects = Vec::with_capacity(list.items.len());
        for (object, span) in list.items.into_iter().zip(list.spans) {
            let Some(types) = known.get(&object.name) else {
                known.insert(object.name.clone(), object.types.clone());
                objects.push(object);
                continue;
            };
            let is_constant = domain.constants.iter().any(|c| c.name == object.name);
            let what = if is_constant { "is already a constant" } else { "is declared twice" };
            let message = format!("the object `{}` {what}", object.name);
            let fits = vocabulary.object_fits(types, &object.types)
                || vocabulary.object_fits(&object.types, types);
            if !fits {
                let (expected, got) = (type_text(types), type_text(&object.types));
                let message = format!("{message}, of type `{expected}`, not `{got}`");
                return Err(self.semantics(span, message));
            }
            self.warn("object declared twice", span, message);
        }
        Ok(objects)
    }

    fn init(
        &mut self,
        nodes: &[Node<'s>],
        vocabulary: &Vocabulary,
        domain: &Domain,
    ) -> Result<Init, PddlError> {
        let mut init = Init::default();
        // What is said to hold, and what is said not to, each where it was said first.
        let mut said: [BTreeMap<Atom, Span>; 2] = Default::default();
        for node in nodes {
            let head = node.head().unwrap_or_default();
            let members = node.list().unwrap_or_default();
            match head.as_str() {
                // False facts need not be said.
                "not" if members.len() == 2 => {
                    let atom = self.fact(&members[1], vocabulary)?;
                    said[0].entry(atom).or_insert(node.span);
                }
                "=" => self.value(node, vocabulary, &mut init.costs)?,
                "at" if is_timed(members) => {
                    return Err(self.unsupported(node.span, "timed initial literals"));
                }
                _ => {
                    let atom = self.fact(node, vocabulary)?;
                    if domain.axioms.iter().any(|a| a.head.name == atom.predicate) {
                        let message = format!("`{atom}` is derived; its initial value is not used");
                        self.warn("derived fact", node.span, message);
                    }
                    said[1].entry(atom.clone()).or_insert(node.span);
                    if !init.facts.insert(atom) {
                        self.warn("fact given twice", node.span, "this fact is given twice");
                    }
                }
            }
        }
        let both = said[1].iter().filter_map(|(atom, &holds)| {
            said[0].get(atom).map(|&fails| (holds.max(fails), holds.min(fails), atom))
        });
        match both.min() {
            None => Ok(init),
            Some((span, other, atom)) => Err(self.said_both_ways(span, other, atom)),
        }
    }

    fn said_both_ways(&self, span: Span, other: Span, atom: &Atom) -> PddlError {
        let place = SourcePosition::new(self.source, other);
        let message = format!("`{atom}` is said to hold and not to hold");
        let mut error = self.semantics(span, message);
        error.help = Some(format!(
            "the other is at line {}, column {}: leave out one of them",
            place.line, place.column
        ));
        error
    }

    /// A ground atom.
    fn fact(&mut self, node: &Node<'s>, vocabulary: &Vocabulary) -> Result<Atom, PddlError> {
        let derived = BTreeSet::new();
        let scope = Scope::default();
        let literal = Body { reader: self, vocabulary, scope, derived: &derived }.literal(node)?;
        Ok(ground(literal))
    }

    /// `(= (function object …) number)`.
    fn value(
        &mut self,
        node: &Node<'s>,
        vocabulary: &Vocabulary,
        costs: &mut BTreeMap<Atom, Number>,
    ) -> Result<(), PddlError> {
        let expected = "expected `(= (function object …) number)`";
        let Some([_, function, amount]) = node.list() else {
            return Err(self.syntax(node.span, expected));
        };
        let Some([first, args @ ..]) = function.list() else {
            return Err(self.syntax(function.span, expected));
        };
        self.uses(Feature::ActionCosts, node.span);
        let name = self.name(first, "a function")?;
        let derived = BTreeSet::new();
        let mut body =
            Body { reader: &mut *self, vocabulary, scope: Scope::default(), derived: &derived };
        let signature = body.function(&name, first)?;
        let args = body.arguments(function, args, &signature)?;
        let atom = ground(Literal { predicate: name, args });
        let value = self.number(amount, self.word(amount, "a number")?)?;
        if costs.insert(atom, value).is_some_and(|before| before != value) {
            return Err(self.semantics(node.span, "a second value for the same function"));
        }
        Ok(())
    }

    fn goal(&mut self, node: &Node<'s>, vocabulary: &Vocabulary) -> Result<Condition, PddlError> {
        match node.list() {
            Some([_, condition]) => self.closed_condition(condition, vocabulary),
            _ => Err(self.syntax(node.span, "expected `(:goal condition)`")),
        }
    }

    /// A condition without free variables.
    fn closed_condition(
        &mut self,
        node: &Node<'s>,
        vocabulary: &Vocabulary,
    ) -> Result<Condition, PddlError> {
        let derived = BTreeSet::new();
        Body { reader: self, vocabulary, scope: Scope::default(), derived: &derived }
            .condition(node)
    }

    /// `(:metric minimize (total-cost))`.
    fn metric(&mut self, node: &Node<'s>) -> Result<bool, PddlError> {
        let Some([_, direction, quantity]) = node.list() else {
            return Err(self.syntax(node.span, "expected `(:metric minimize (total-cost))`"));
        };
        if !direction.is("minimize") {
            let known = [Name::from("minimize")];
            if direction.is("maximize") {
                return Err(self.unsupported(node.span, "metrics to maximize"));
            }
            let message = format!("expected `minimize`, got {}", direction.describe());
            let mut error = self.syntax(direction.span, message);
            error.help = direction.word().and_then(|w| did_you_mean(&Name::new(w), known.iter()));
            return Err(error);
        }
        let is_total_cost = quantity.is("total-cost")
            || quantity.head().as_deref() == Some("total-cost")
                && quantity.list().is_some_and(|l| l.len() == 1);
        if !is_total_cost {
            return Err(self.unsupported(quantity.span, "metrics other than total-cost"));
        }
        self.uses(Feature::ActionCosts, node.span);
        Ok(true)
    }
}

/// Whether an `at` is a timed literal (`(at 5 (fact))`) and not an atom of a predicate `at`.
fn is_timed(members: &[Node<'_>]) -> bool {
    matches!(members, [_, time, fact] if time.word().is_some_and(|w| w.parse::<f64>().is_ok())
        && fact.list().is_some())
}

/// Turns a literal that was read without variables in scope into an atom.
fn ground(literal: Literal) -> Atom {
    let name = |term| match term {
        Term::Var(name) | Term::Object(name) => name,
    };
    Atom { predicate: literal.predicate, args: literal.args.into_iter().map(name).collect() }
}
