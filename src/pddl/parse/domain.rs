//! Domains and files of rules.

use std::collections::{BTreeMap, BTreeSet};

use super::super::check::{Fit, Scope, Vocabulary, did_you_mean, type_text};
use super::super::error::{Parsed, PddlError, SourceText, Span};
use super::super::sexpr::{Node, quote, read};
use super::super::strata::stratify;
use super::super::{Action, Axiom, Condition, Domain, Effect, Name, Signature, Typed, Types};
use super::condition::KEYWORDS;
use super::effect::Conditional;
use super::requirements::Feature;
use super::typed::{Kind, TypedList};
use super::{Body, Reader, tail};

/// Reads and checks a domain.
///
/// # Errors
/// The first mistake in the text: not well formed, not consistent, or not supported.
pub fn parse_domain(source: &SourceText) -> Result<Parsed<Domain>, PddlError> {
    let forms = read(source)?;
    let mut reader = Reader::new(source);
    let (name, sections) = reader.define(&forms, "domain")?;
    let sections = reader.sections(sections, DOMAIN_SECTIONS)?;
    let mut domain = reader.declarations(name, &sections)?;
    let vocabulary = Vocabulary::new(&domain, &[]);
    let derived = reader.derived_heads(&sections)?;
    for (keyword, node) in &sections {
        match keyword.as_str() {
            ":derived" => domain.axioms.push(reader.axiom(node, &vocabulary)?),
            ":action" => {
                let action = reader.action(node, &vocabulary, &derived)?;
                if domain.action(action.name.as_str()).is_some() {
                    let message = format!("the action `{}` is declared twice", action.name);
                    return Err(reader.semantics(node.span, message));
                }
                domain.actions.push(action);
            }
            _ => {}
        }
    }
    reader.check_strata(&domain.axioms, &sections)?;
    reader.warn_of_undeclared(&domain.requirements);
    Ok(Parsed { value: domain, warnings: reader.into_warnings() })
}

/// Reads a file of `:derived` rules written for `domain`: `(define (domain d) (:derived …)*)`.
///
/// The heads may be predicates that actions change: such rules complete an observed state and are
/// never given to a planner.
///
/// # Errors
/// The first mistake in the text, among them another domain's name and rules whose heads depend
/// on their own negation.
pub fn parse_rules(source: &SourceText, domain: &Domain) -> Result<Vec<Axiom>, PddlError> {
    let forms = read(source)?;
    let mut reader = Reader::new(source);
    let form = reader.single(&forms, "`(define (domain …) …)`")?;
    let (name, sections) = reader.define(&forms, "domain")?;
    if name != domain.name {
        let message = format!("expected rules for the domain `{}`, got `{name}`", domain.name);
        return Err(reader.semantics(form.span, message));
    }
    let sections = reader.sections(sections, &[":requirements", ":derived"])?;
    let vocabulary = Vocabulary::new(domain, &[]);
    let rules = sections.iter().filter(|(keyword, _)| keyword == ":derived");
    let rules =
        rules.map(|(_, node)| reader.axiom(node, &vocabulary)).collect::<Result<Vec<_>, _>>()?;
    reader.check_strata(&rules, &sections)?;
    Ok(rules)
}

const DOMAIN_SECTIONS: &[&str] =
    &[":requirements", ":types", ":constants", ":predicates", ":functions", ":derived", ":action"];

/// A section's keyword, lower-cased, with the whole section.
pub(super) type Section<'n, 's> = (String, &'n Node<'s>);

impl<'s> Reader<'s> {
    /// Takes `(define (kind name) section*)` apart.
    pub(super) fn define<'n>(
        &self,
        forms: &'n [Node<'s>],
        kind: &str,
    ) -> Result<(Name, &'n [Node<'s>]), PddlError> {
        let expected = format!("`(define ({kind} …) …)`");
        let form = self.single(forms, &expected)?;
        let members = self.list(form, &expected)?;
        let [define, header, sections @ ..] = members else {
            let message = format!("expected {expected}, got {}", form.describe());
            return Err(self.syntax(form.span, message));
        };
        if !define.is("define") {
            let message = format!("expected `define`, got {}", define.describe());
            return Err(self.syntax(define.span, message));
        }
        match header.list() {
            Some([word, name]) if word.is(kind) => {
                Ok((self.name(name, &format!("the {kind}'s name"))?, sections))
            }
            _ => {
                let message = format!("expected `({kind} name)`, got {}", header.describe());
                let mut error = self.syntax(header.span, message);
                let other = if kind == "domain" { "problem" } else { "domain" };
                if header.head().as_deref() == Some(other) {
                    error.help = Some(format!("this file holds a {other}, not a {kind}"));
                }
                Err(error)
            }
        }
    }

    /// The sections with their keywords, each known and, but for rules and actions, at most once.
    pub(super) fn sections<'n>(
        &self,
        nodes: &'n [Node<'s>],
        known: &[&str],
    ) -> Result<Vec<Section<'n, 's>>, PddlError> {
        let mut sections: Vec<Section<'n, 's>> = Vec::new();
        for node in nodes {
            let keyword = node.head().unwrap_or_default();
            if !known.contains(&keyword.as_str()) {
                return Err(self.unknown_section(node, &keyword, known));
            }
            let repeatable = matches!(keyword.as_str(), ":derived" | ":action");
            if !repeatable && sections.iter().any(|(k, _)| *k == keyword) {
                let message = format!("the section {} is given twice", quote(&keyword));
                return Err(self.syntax(node.span, message));
            }
            sections.push((keyword, node));
        }
        Ok(sections)
    }

    fn unknown_section(&self, node: &Node<'s>, keyword: &str, known: &[&str]) -> PddlError {
        let unsupported = match keyword {
            ":durative-action" => Some("durative actions"),
            ":process" | ":event" => Some("processes and events"),
            ":constraints" => Some("trajectory constraints"),
            ":preferences" => Some("preferences"),
            ":task" | ":method" => Some("hierarchical tasks"),
            _ => None,
        };
        if let Some(feature) = unsupported {
            return self.unsupported(node.span, feature);
        }
        let message = format!("expected one of {}, got {}", known.join(" "), node.describe());
        let mut error = self.syntax(node.span, message);
        let names: Vec<Name> = known.iter().map(|&k| Name::from(k)).collect();
        error.help = did_you_mean(&Name::from(keyword), &names);
        error
    }

    /// Everything but rules and actions.
    fn declarations(
        &mut self,
        name: Name,
        sections: &[Section<'_, 's>],
    ) -> Result<Domain, PddlError> {
        let section = |keyword: &str| {
            let found = sections.iter().find(|(k, _)| k == keyword);
            found.and_then(|(_, node)| node.list()).map_or(&[][..], tail)
        };
        let requirements = self.requirements(section(":requirements"))?;
        let types = self.within("types", |r| r.types(section(":types")))?;
        let mut vocabulary = Vocabulary { types, ..Vocabulary::default() };
        let constants = self.within("constants", |r| {
            let nodes = section(":constants");
            let list = r.checked_typed_list(nodes, Kind::Name, "constant", &vocabulary)?;
            r.refuse_duplicates(&list.items, &list.spans, "constant")?;
            Ok(list.items)
        })?;
        let predicates =
            self.within("predicates", |r| r.predicates(section(":predicates"), &vocabulary))?;
        let functions =
            self.within("functions", |r| r.functions(section(":functions"), &vocabulary))?;
        let types = std::mem::take(&mut vocabulary.types);
        let (axioms, actions) = (Vec::new(), Vec::new());
        Ok(Domain { name, requirements, types, constants, predicates, functions, axioms, actions })
    }

    pub(super) fn requirements(&mut self, nodes: &[Node<'s>]) -> Result<BTreeSet<Name>, PddlError> {
        let mut requirements = BTreeSet::new();
        for node in nodes {
            let word = self.word(node, "a requirement")?;
            if !word.starts_with(':') {
                let message = format!("expected a requirement, got {}", quote(word));
                let mut error = self.syntax(node.span, message);
                error.help = Some("requirements begin with `:`".to_owned());
                return Err(error);
            }
            let name = Name::new(word);
            self.warn_of_unknown(&name, node.span);
            requirements.insert(name);
        }
        Ok(requirements)
    }

    fn types(&mut self, nodes: &[Node<'s>]) -> Result<Types, PddlError> {
        let list = self.typed_list(nodes, Kind::Name, "type")?;
        if let (Some(first), Some(last)) = (nodes.first(), nodes.last()) {
            self.uses(Feature::Typing, Span { start: first.span.start, end: last.span.end });
        }
        let mut parents: BTreeMap<Name, Vec<Name>> = BTreeMap::new();
        // A type that is declared again has one parent more.
        for typed in list.items.iter().filter(|typed| typed.name != "object") {
            let known = parents.entry(typed.name.clone()).or_default();
            let new = typed.types.iter().filter(|parent| !known.contains(parent));
            let new: Vec<Name> = new.cloned().collect();
            known.extend(new);
        }
        for (name, span) in &list.types {
            if *name != "object" && !parents.contains_key(name) {
                let message = format!("the type `{name}` is used as a parent but not declared");
                self.warn("undeclared parent", *span, message);
                parents.insert(name.clone(), Vec::new());
            }
        }
        let types = Types { parents };
        self.refuse_cycles(&types, &list)?;
        Ok(types)
    }

    fn refuse_cycles(&self, types: &Types, list: &TypedList) -> Result<(), PddlError> {
        for (typed, span) in list.items.iter().zip(&list.spans) {
            let mut own = types.parents.get(&typed.name).into_iter().flatten();
            if own.any(|parent| types.is_a(parent, &typed.name)) {
                let message = format!("the type `{}` is its own ancestor", typed.name);
                return Err(self.semantics(*span, message));
            }
        }
        Ok(())
    }

    fn predicates(
        &mut self,
        nodes: &[Node<'s>],
        vocabulary: &Vocabulary,
    ) -> Result<Vec<Signature>, PddlError> {
        let mut signatures: Vec<Signature> = Vec::new();
        for node in nodes {
            let signature = self.signature(node, "a predicate", vocabulary)?;
            if KEYWORDS.contains(&signature.name.as_str()) {
                let message = format!("`{}` cannot name a predicate", signature.name);
                return Err(self.semantics(node.span, message));
            }
            if signatures.iter().any(|s| s.name == signature.name) {
                let message = format!("the predicate `{}` is declared twice", signature.name);
                return Err(self.semantics(node.span, message));
            }
            signatures.push(signature);
        }
        Ok(signatures)
    }

    fn functions(
        &mut self,
        nodes: &[Node<'s>],
        vocabulary: &Vocabulary,
    ) -> Result<Vec<Signature>, PddlError> {
        let mut signatures: Vec<Signature> = Vec::new();
        let mut rest = nodes;
        while let [node, following @ ..] = rest {
            rest = following;
            if node.is("-") {
                let [result, following @ ..] = following else {
                    return Err(self.syntax(node.span, "expected a type after `-`"));
                };
                if !result.is("number") {
                    return Err(self.unsupported(result.span, "object fluents"));
                }
                rest = following;
                continue;
            }
            self.uses(Feature::ActionCosts, node.span);
            let signature = self.signature(node, "a function", vocabulary)?;
            if signatures.iter().any(|s| s.name == signature.name) {
                let message = format!("the function `{}` is declared twice", signature.name);
                return Err(self.semantics(node.span, message));
            }
            signatures.push(signature);
        }
        Ok(signatures)
    }

    /// `(name ?x - type …)`.
    fn signature(
        &mut self,
        node: &Node<'s>,
        what: &str,
        vocabulary: &Vocabulary,
    ) -> Result<Signature, PddlError> {
        let members = self.list(node, &format!("{what} in parentheses"))?;
        let Some(first) = members.first() else {
            return Err(self.syntax(node.span, format!("expected {what}, got `()`")));
        };
        let name = self.name(first, what)?;
        let list =
            self.checked_typed_list(tail(members), Kind::Variable, "parameter", vocabulary)?;
        Ok(Signature { name, params: list.items })
    }

    /// The heads of all rules, before any rule or action is read.
    fn derived_heads(&self, sections: &[Section<'_, 's>]) -> Result<BTreeSet<Name>, PddlError> {
        let rules = sections.iter().filter(|(keyword, _)| keyword == ":derived");
        let heads = rules.map(|(_, node)| {
            let head = node.list().and_then(|l| l.get(1)).and_then(Node::list);
            match head.and_then(|l| l.first()) {
                Some(name) => self.name(name, "a predicate"),
                None => {
                    Err(self.syntax(node.span, "expected `(:derived (predicate …) condition)`"))
                }
            }
        });
        heads.collect()
    }

    /// `(:derived (predicate ?x - type …) condition)`.
    fn axiom(&mut self, node: &Node<'s>, vocabulary: &Vocabulary) -> Result<Axiom, PddlError> {
        self.uses(Feature::DerivedPredicates, node.span);
        let Some([_, head_node, body]) = node.list() else {
            return Err(self.syntax(node.span, "expected `(:derived (predicate …) condition)`"));
        };
        let mut head = self.within("the head of a rule", |r| {
            let params = tail(head_node.list().unwrap_or_default());
            r.variables(params, "parameter", vocabulary)?;
            let head = r.signature(head_node, "a predicate", vocabulary)?;
            let Some(declared) = vocabulary.predicates.get(&head.name) else {
                let message = format!("unknown predicate `{}`", head.name);
                let mut error = r.semantics(head_node.span, message);
                error.help = did_you_mean(&head.name, vocabulary.predicates.keys());
                return Err(error);
            };
            r.check_head(head_node, &head, declared, vocabulary)?;
            Ok(head)
        })?;
        // An untyped parameter of a head is of the declared type.
        let declared = vocabulary.predicates.get(&head.name).map(|d| d.params.as_slice());
        for (param, declared) in head.params.iter_mut().zip(declared.unwrap_or_default()) {
            if param.types.is_empty() {
                param.types.clone_from(&declared.types);
            }
        }
        let context = format!("the rule for {}", head.name);
        let body = self.condition_within(context, body, &head.params, vocabulary)?;
        Ok(Axiom { head, body })
    }

    fn check_head(
        &mut self,
        node: &Node<'s>,
        head: &Signature,
        declared: &Signature,
        vocabulary: &Vocabulary,
    ) -> Result<(), PddlError> {
        let (expected, got) = (declared.params.len(), head.params.len());
        if expected != got {
            let message = format!("expected {expected} argument(s) of `{}`, got {got}", head.name);
            return Err(self.semantics(node.span, message));
        }
        for (param, declared) in head.params.iter().zip(&declared.params) {
            let fits = vocabulary.fit(&param.types, &declared.types);
            if fits == Fit::Never {
                let expected = type_text(&declared.types);
                let got = type_text(&param.types);
                let message = format!("expected `?{}` of type `{expected}`", param.name);
                return Err(self.semantics(node.span, format!("{message}, got `{got}`")));
            }
        }
        Ok(())
    }

    /// A condition below named parameters.
    fn condition_within(
        &mut self,
        context: String,
        node: &Node<'s>,
        params: &[Typed],
        vocabulary: &Vocabulary,
    ) -> Result<Condition, PddlError> {
        self.within(context, |reader| {
            let mut scope = Scope::default();
            scope.enter(params);
            Body { reader, vocabulary, scope, derived: &BTreeSet::new() }.condition(node)
        })
    }

    /// `(:action name :parameters (…) :precondition … :effect …)`.
    fn action(
        &mut self,
        node: &Node<'s>,
        vocabulary: &Vocabulary,
        derived: &BTreeSet<Name>,
    ) -> Result<Action, PddlError> {
        let Some([_, name, fields @ ..]) = node.list() else {
            return Err(self.syntax(node.span, "expected `(:action name …)`"));
        };
        let name = self.name(name, "the action's name")?;
        self.within(format!("action {name}"), |r| {
            let fields = r.fields(fields)?;
            let field = |keyword: &str| fields.iter().find(|(k, _)| k == keyword).map(|(_, n)| *n);
            let params = match field(":parameters") {
                Some(node) => r.within("parameters", |r| {
                    let nodes = r.list(node, "parameters in parentheses")?;
                    r.variables(nodes, "parameter", vocabulary)
                })?,
                None => TypedList { items: Vec::new(), spans: Vec::new(), types: Vec::new() },
            }
            .items;
            let precondition = match field(":precondition") {
                Some(node) => {
                    r.condition_within("precondition".to_owned(), node, &params, vocabulary)?
                }
                None => Condition::True,
            };
            let effect = match field(":effect") {
                Some(node) => r.within("effect", |reader| {
                    let mut scope = Scope::default();
                    scope.enter(&params);
                    Body { reader, vocabulary, scope, derived }.effect(node, Conditional::No)
                })?,
                None => Effect::And(Vec::new()),
            };
            Ok(Action { name, params, precondition, effect })
        })
    }

    /// The `:keyword value` pairs of an action.
    fn fields<'n>(&self, nodes: &'n [Node<'s>]) -> Result<Vec<Section<'n, 's>>, PddlError> {
        const KNOWN: &[&str] = &[":parameters", ":precondition", ":effect"];
        let mut fields: Vec<Section<'n, 's>> = Vec::new();
        for pair in nodes.chunks(2) {
            let keyword = self.word(&pair[0], "`:parameters`, `:precondition` or `:effect`")?;
            let lower = keyword.to_lowercase();
            if matches!(lower.as_str(), ":duration" | ":condition") {
                return Err(self.unsupported(pair[0].span, "durative actions"));
            }
            if !KNOWN.contains(&lower.as_str()) {
                let message =
                    format!("expected one of {}, got {}", KNOWN.join(" "), quote(keyword));
                return Err(self.syntax(pair[0].span, message));
            }
            if fields.iter().any(|(k, _)| *k == lower) {
                let message = format!("{} is given twice", quote(keyword));
                return Err(self.syntax(pair[0].span, message));
            }
            let [_, value] = pair else {
                let message = format!("expected a value after {}", quote(keyword));
                return Err(self.syntax(pair[0].span, message));
            };
            fields.push((lower, value));
        }
        Ok(fields)
    }

    fn check_strata(
        &self,
        axioms: &[Axiom],
        sections: &[Section<'_, 's>],
    ) -> Result<(), PddlError> {
        let Err(cycle) = stratify(axioms) else { return Ok(()) };
        let rules = sections.iter().filter(|(keyword, _)| keyword == ":derived");
        let culprit = axioms.iter().zip(rules).find(|(a, _)| a.head.name == cycle.predicate);
        let span = culprit.map_or(Span { start: 0, end: 0 }, |(_, (_, node))| node.span);
        Err(self.semantics(span, cycle.to_string()))
    }
}
