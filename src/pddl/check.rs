//! What a domain declares, and whether names and types used elsewhere agree with it.

use std::collections::BTreeMap;

use super::{Name, Signature, Term, Typed, Types};

/// Everything that may be named inside conditions, effects and facts.
#[derive(Debug, Clone, Default)]
pub(super) struct Vocabulary {
    /// The type hierarchy.
    pub(super) types: Types,
    /// Declared predicates.
    pub(super) predicates: BTreeMap<Name, Signature>,
    /// Declared numeric functions.
    pub(super) functions: BTreeMap<Name, Signature>,
    /// Constants and, in a problem, objects, with their types.
    pub(super) objects: BTreeMap<Name, Vec<Name>>,
}

/// How an argument's type agrees with the parameter it stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fit {
    /// Every object of the argument's type may stand there.
    Always,
    /// Some may.
    Sometimes,
    /// None may.
    Never,
}

impl Vocabulary {
    /// The vocabulary of a domain, with further objects.
    pub(super) fn new(domain: &super::Domain, objects: &[Typed]) -> Self {
        let by_name = |s: &Signature| (s.name.clone(), s.clone());
        let all_objects = domain.constants.iter().chain(objects);
        Self {
            types: domain.types.clone(),
            predicates: domain.predicates.iter().map(by_name).collect(),
            functions: domain.functions.iter().map(by_name).collect(),
            objects: all_objects.map(|o| (o.name.clone(), o.types.clone())).collect(),
        }
    }

    /// Whether a type of that name exists.
    pub(super) fn has_type(&self, name: &Name) -> bool {
        *name == "object" || self.types.parents.contains_key(name)
    }

    /// How something of one of `types` fits where one of `wanted` is asked for.
    pub(super) fn fit(&self, types: &[Name], wanted: &[Name]) -> Fit {
        let is_wanted = |t: &Name| wanted.iter().any(|w| self.types.is_a(t, w));
        let is_of = |t: &Name| types.iter().any(|own| self.types.is_a(t, own));
        if wanted.is_empty() || !types.is_empty() && types.iter().all(is_wanted) {
            Fit::Always
        } else if types.is_empty() || self.types.parents.keys().any(|t| is_of(t) && is_wanted(t)) {
            Fit::Sometimes
        } else {
            Fit::Never
        }
    }

    /// How an object of `types` fits where one of `wanted` is asked for: it is of one fixed type.
    pub(super) fn object_fits(&self, types: &[Name], wanted: &[Name]) -> bool {
        self.types.fits(types, wanted)
    }
}

/// The variables that are bound at some place, innermost last.
#[derive(Debug, Clone, Default)]
pub(super) struct Scope {
    bound: Vec<Typed>,
}

impl Scope {
    /// The type of a variable; an inner binding hides an outer one.
    pub(super) fn types_of(&self, variable: &Name) -> Option<&[Name]> {
        self.bound.iter().rev().find(|b| b.name == *variable).map(|b| b.types.as_slice())
    }

    /// Binds further variables and returns what [`Scope::leave`] needs to forget them.
    pub(super) fn enter(&mut self, variables: &[Typed]) -> usize {
        let before = self.bound.len();
        self.bound.extend_from_slice(variables);
        before
    }

    /// Forgets the variables bound since `before` was returned.
    pub(super) fn leave(&mut self, before: usize) {
        self.bound.truncate(before);
    }

    /// The names of all bound variables.
    pub(super) fn names(&self) -> impl Iterator<Item = &Name> {
        self.bound.iter().map(|b| &b.name)
    }
}

/// "block", "either block disk" or "object".
pub(super) fn type_text(types: &[Name]) -> String {
    match types {
        [] => "object".to_owned(),
        [one] => one.to_string(),
        several => {
            let names: Vec<&str> = several.iter().map(Name::as_str).collect();
            format!("either {}", names.join(" "))
        }
    }
}

/// The term as written.
pub(super) fn term_text(term: &Term) -> String {
    match term {
        Term::Var(name) => format!("?{name}"),
        Term::Object(name) => name.to_string(),
    }
}

/// "did you mean `x`?" for the nearest of `known`, when one is near enough to be a slip.
pub(super) fn did_you_mean<'a>(
    name: &Name,
    known: impl IntoIterator<Item = &'a Name>,
) -> Option<String> {
    // Longer names than this are not typed by hand.
    const CHARS_MAX: usize = 64;
    if name.as_str().chars().count() > CHARS_MAX {
        return None;
    }
    let distance_max = name.as_str().chars().count().div_ceil(3);
    known
        .into_iter()
        .filter(|k| k.as_str().chars().count() <= CHARS_MAX)
        .map(|k| (strsim::levenshtein(name.as_str(), k.as_str()), k))
        .filter(|(distance, _)| *distance <= distance_max)
        .min()
        .map(|(_, k)| format!("did you mean `{k}`?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_recognised_and_strangers_are_not() {
        let known: Vec<Name> = ["veggie", "tool", "container"].map(Name::from).to_vec();
        let help = |name: &str| did_you_mean(&Name::from(name), &known);
        assert_eq!(help("vegie").as_deref(), Some("did you mean `veggie`?"));
        assert_eq!(help("elephant"), None);
    }

    #[test]
    fn a_wider_variable_fits_sometimes_and_a_foreign_one_never() {
        let parents = [("a", vec!["top"]), ("b", vec!["top"]), ("top", vec![])];
        let parents = parents
            .map(|(t, p)| (Name::from(t), p.into_iter().map(Name::from).collect::<Vec<_>>()));
        let types = Types { parents: parents.into_iter().collect() };
        let vocabulary = Vocabulary { types, ..Vocabulary::default() };
        let names = |t: &[&str]| t.iter().map(|&n| Name::from(n)).collect::<Vec<_>>();
        let fit = |own: &[&str], wanted: &[&str]| vocabulary.fit(&names(own), &names(wanted));
        assert_eq!(fit(&["a"], &["top"]), Fit::Always);
        assert_eq!(fit(&["top"], &["a"]), Fit::Sometimes);
        assert_eq!(fit(&["a"], &["b"]), Fit::Never);
        assert_eq!(fit(&["a", "b"], &["b"]), Fit::Sometimes);
        assert_eq!(fit(&[], &["b"]), Fit::Sometimes);
        assert_eq!(fit(&[], &[]), Fit::Always);
    }
}
