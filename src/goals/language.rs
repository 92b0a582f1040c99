//! `language.toml`: how people say goals in a domain.
//!
//! A phrase is one or more words; case, hyphens and articles do not matter. The longest phrase that
//! fits is taken. Every word that no phrase covers is an error, so nothing is misread in silence.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

use schemars::JsonSchema;
use serde::Deserialize;

use super::GoalError;
use crate::mismatch::Mismatch;
use crate::pddl::{Atom, Domain, Name};
use crate::settings::{SettingsProblem, TomlFile, joined, near_hint};

/// The words of one domain; those that all domains share are those of [`english`].
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Language {
    /// Sentences that are understood; the first one is shown with every error.
    pub examples: Vec<String>,
    /// Words left out wherever they stand, also inside phrases ("the").
    #[serde(default)]
    pub articles: Vec<String>,
    /// Phrases that change nothing about the goal ("please").
    #[serde(default)]
    pub fillers: Vec<String>,
    /// Phrases before a statement that is wished for ("make sure that").
    #[serde(default)]
    pub openers: Vec<String>,
    /// The same, where a question mark may follow ("can you").
    #[serde(default)]
    pub requests: Vec<String>,
    /// Verbs that bring something to the one place that is said ("put").
    #[serde(default)]
    pub places: Vec<String>,
    /// Verbs that take something up and say nothing about where it ends ("take").
    #[serde(default)]
    pub takes: Vec<String>,
    /// Verbs that make a group, whose relations follow ("build").
    #[serde(default)]
    pub builds: Vec<String>,
    /// Verbs for a state that is to hold ("keep").
    #[serde(default)]
    pub keeps: Vec<String>,
    /// Phrases between an object and what is wished of it ("should be").
    #[serde(default)]
    pub copulas: Vec<String>,
    /// Phrases between an object and what is said of it as it is ("is").
    #[serde(default)]
    pub states: Vec<String>,
    /// Phrases between an object and what is not to hold of it ("must not be").
    #[serde(default)]
    pub denials: Vec<String>,
    /// Words between an object and the place that describes it ("standing").
    #[serde(default)]
    pub participles: Vec<String>,
    /// Words before a description of an object ("that").
    #[serde(default)]
    pub relatives: Vec<String>,
    /// Phrases between statements and between objects of a list, beside the comma ("and").
    #[serde(default)]
    pub separators: Vec<String>,
    /// Phrases between statements, beside `;` and `.` ("then").
    #[serde(default)]
    pub sequels: Vec<String>,
    /// Phrases that end a heading, beside `:` ("with" in "a tower with red on blue").
    #[serde(default)]
    pub heading_ends: Vec<String>,
    /// Phrases for every object of a type ("all", "each").
    #[serde(default)]
    pub all: Vec<String>,
    /// Phrases for the objects that a list after a colon names ("these").
    #[serde(default)]
    pub listed: Vec<String>,
    /// Phrases for the object that was moved last ("it").
    #[serde(default)]
    pub pronouns: Vec<String>,
    /// Phrases for the objects that were moved last ("them").
    #[serde(default)]
    pub plural_pronouns: Vec<String>,
    /// Phrases before objects that are left out ("except").
    #[serde(default)]
    pub exceptions: Vec<String>,
    /// Phrases for all objects that have not been named ("the rest").
    #[serde(default)]
    pub rest: Vec<String>,
    /// The same before a noun ("the other").
    #[serde(default)]
    pub others: Vec<String>,
    /// Phrases before the place something comes from; the place is no part of the goal ("from").
    #[serde(default)]
    pub sources: Vec<String>,
    /// Words that lead to a place: a phrase that has one describes no object ("onto").
    #[serde(default)]
    pub directions: Vec<String>,
    /// Number words, from one upwards; digits are always understood.
    #[serde(default)]
    pub numbers: Vec<String>,
    /// Words for places in a row, from the first one upwards.
    #[serde(default)]
    pub ordinals: Vec<String>,
    /// Words for the last place in a row.
    #[serde(default)]
    pub last: Vec<String>,
    /// Phrases after a noun: places are counted from the left.
    #[serde(default)]
    pub from_left: Vec<String>,
    /// Phrases after a noun: places are counted from the right.
    #[serde(default)]
    pub from_right: Vec<String>,
    /// Whether "the first" counts from the left where no side is said.
    #[serde(default)]
    pub counts_from_left: bool,
    /// Verbs for two objects that change places ("swap").
    #[serde(default)]
    pub swaps: Vec<String>,
    /// Words between the two, beside `separators` ("with").
    #[serde(default)]
    pub swapped_with: Vec<String>,
    /// Phrases that deny or forbid, which the grammar refuses ("don't").
    #[serde(default)]
    pub negations: Vec<String>,
    /// Phrases that leave a choice, which the grammar refuses ("or").
    #[serde(default)]
    pub alternatives: Vec<String>,
    /// Phrases that ask, which the grammar refuses ("where").
    #[serde(default)]
    pub questions: Vec<String>,
    /// Phrases that set a condition, which the grammar refuses ("if").
    #[serde(default)]
    pub conditions: Vec<String>,
    /// Phrases that do not say which objects are meant, which the grammar refuses ("some").
    #[serde(default)]
    pub vague: Vec<String>,
    /// Phrases for what is left of an object; they describe, and are no goal ("left of").
    #[serde(default)]
    pub left_of: Vec<String>,
    /// Phrases for what is right of an object; they describe, and are no goal ("right of").
    #[serde(default)]
    pub right_of: Vec<String>,
    /// Phrases for places that no predicate of the domain says ("next to").
    #[serde(default)]
    pub inexpressible: Vec<String>,
    /// Further words for colours, where the domain has them.
    #[serde(default)]
    pub colour_words: BTreeMap<Name, Vec<String>>,
    /// Predicates whose atoms may not form a circle.
    #[serde(default)]
    pub acyclic: Vec<Name>,
    /// Colour names with further words for each.
    #[serde(default)]
    pub colours: BTreeMap<Name, Vec<String>>,
    /// Words for groups that are counted ("two stacks"); a wrong count is refused.
    pub stacks: Option<Stacks>,
    /// Words for the types of objects.
    #[serde(default, rename = "noun")]
    pub nouns: Vec<Noun>,
    /// Words that single out an object by its box.
    #[serde(default, rename = "position")]
    pub positions: Vec<Position>,
    /// Words for binary predicates.
    #[serde(default, rename = "relation")]
    pub relations: Vec<Relation>,
    /// Words for unary predicates, before or after their object.
    #[serde(default, rename = "property")]
    pub properties: Vec<Property>,
    /// Words that turn a list of objects into a chain.
    #[serde(default, rename = "sequence")]
    pub sequences: Vec<Sequence>,
    /// Pairs of atoms that no goal may ask for together.
    #[serde(default, rename = "never")]
    pub mutex_rules: Vec<MutexRule>,
}

/// Words for a type of objects.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Noun {
    /// One of the domain's types.
    #[serde(rename = "type")]
    pub type_name: Name,
    /// Phrases for one object ("block").
    pub one: Vec<String>,
    /// Phrases for several objects; without a colour they mean all of them ("blocks").
    pub many: Vec<String>,
    /// Phrases for all objects that need no noun ("everything", "the tower").
    #[serde(default)]
    pub everything: Vec<String>,
    /// The name of an object that is said before it is seen: `{colour}` and `{type}` are filled in.
    /// Without it such an object must be seen first.
    pub name: Option<String>,
    /// How many objects must be seen before positions are resolved over them.
    #[serde(default = "one")]
    pub seen_min: usize,
}

/// Words that single out one object of a type by its box.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Position {
    /// Which object.
    pub pick: Pick,
    /// Phrases before the noun, or alone ("rightmost").
    pub before: Vec<String>,
    /// Phrases after the noun ("on the right").
    #[serde(default)]
    pub after: Vec<String>,
}

/// Which of several boxes is meant; ties go to the first name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pick {
    /// Smallest centre column.
    Left,
    /// Largest centre column.
    Right,
    /// The one in the middle by centre column; an odd number of boxes is needed.
    Middle,
    /// Smallest centre row.
    Top,
    /// Largest centre row.
    Bottom,
    /// Smallest area.
    Smallest,
    /// Largest area.
    Largest,
    /// The n-th by centre column, counted from 1.
    FromLeft(usize),
}

/// Words for a binary predicate.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Relation {
    /// The phrases; several relations may share one, the types of the objects then decide.
    pub phrases: Vec<String>,
    /// One of the domain's predicates.
    pub predicate: Name,
    /// Whether the object said second is the predicate's first argument ("under").
    #[serde(default)]
    pub swap: bool,
}

/// Words for a unary predicate.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Property {
    /// Words that say it, each as it is spoken.
    pub phrases: Vec<String>,
    /// One of the domain's predicates.
    pub predicate: Name,
}

/// Words that turn a list into a chain ("from top to bottom: red, blue").
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sequence {
    /// Words that say it, each as it is spoken.
    pub phrases: Vec<String>,
    /// The binary PDDL predicate between neighbours of the list.
    pub predicate: Name,
    /// Whether the later object is the predicate's first argument.
    #[serde(default)]
    pub swap: bool,
}

/// Words for groups that are counted.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stacks {
    /// The phrases ("stacks of blocks").
    pub phrases: Vec<String>,
    /// The predicate whose connected atoms form one group.
    pub predicate: Name,
}

/// Two atoms that exclude each other; different variables are different objects.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MutexRule {
    /// Both patterns, as in `["(on ?x ?y)", "(on ?x ?z)"]`.
    pub both: [Pattern; 2],
    /// Why, as a clause for a message.
    pub because: String,
}

impl MutexRule {
    /// Whether the pair forbids these two atoms together, in either order.
    pub fn excludes(&self, left: &Atom, right: &Atom) -> bool {
        let [a, b] = &self.both;
        matches(a, b, left, right) || matches(a, b, right, left)
    }
}

/// Whether the two atoms are instances of the patterns, with different objects for different
/// variables.
fn matches(a: &Pattern, b: &Pattern, left: &Atom, right: &Atom) -> bool {
    if a.predicate != left.predicate || b.predicate != right.predicate {
        return false;
    }
    let mut bound: BTreeMap<&Name, &Name> = BTreeMap::new();
    let pairs = a.variables.iter().zip(&left.args).chain(b.variables.iter().zip(&right.args));
    for (variable, object) in pairs {
        let known = *bound.entry(variable).or_insert(object);
        if known != object {
            return false;
        }
    }
    let different: BTreeSet<&Name> = bound.values().copied().collect();
    different.len() == bound.len()
}

/// An atom over variables, written as in PDDL.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(try_from = "String")]
pub struct Pattern {
    /// One of the domain's predicates.
    pub predicate: Name,
    /// Its variables, without question marks.
    pub variables: Vec<Name>,
}

impl TryFrom<String> for Pattern {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let wanted = || format!("expected an atom such as \"(on ?x ?y)\", got \"{text}\"");
        let inner = text.trim().strip_prefix('(').and_then(|t| t.strip_suffix(')'));
        let mut words = inner.ok_or_else(wanted)?.split_whitespace();
        let predicate = Name::new(words.next().ok_or_else(wanted)?);
        let variables: Option<Vec<Name>> =
            words.map(|word| word.strip_prefix('?').map(Name::new)).collect();
        Ok(Self { predicate, variables: variables.ok_or_else(wanted)? })
    }
}

fn one() -> usize {
    1
}

/// The words that all domains share.
///
/// # Errors
/// [`GoalError::Language`] when `domains/english.toml` is wrong.
pub fn english() -> Result<&'static Language, GoalError> {
    static ENGLISH: LazyLock<Result<Language, String>> = LazyLock::new(|| {
        let text = include_str!("../../domains/english.toml");
        Language::from_toml("domains/english.toml", text).map_err(|problems| joined(&problems))
    });
    ENGLISH.as_ref().map_err(|message| misfit(message.clone()))
}

impl Language {
    /// Reads a `language.toml`; `file` is its name in messages.
    ///
    /// # Errors
    /// Every unknown key and wrong value, with line and column.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, Vec<SettingsProblem>> {
        TomlFile::parse(file, text)?.read()
    }

    /// Checks that every type and predicate exists in the domain and takes as many arguments.
    ///
    /// # Errors
    /// The key whose name does not fit, with what may stand there.
    pub fn check(&self, domain: &Domain) -> Result<(), Mismatch> {
        for (idx, noun) in self.nouns.iter().enumerate() {
            known_type(domain, &format!("noun[{idx}].type"), &noun.type_name)?;
        }
        let of = |table: &str, idx: usize| format!("{table}[{idx}].predicate");
        for (idx, relation) in self.relations.iter().enumerate() {
            takes(domain, &of("relation", idx), &relation.predicate, 2)?;
        }
        for (idx, sequence) in self.sequences.iter().enumerate() {
            takes(domain, &of("sequence", idx), &sequence.predicate, 2)?;
        }
        for (idx, property) in self.properties.iter().enumerate() {
            takes(domain, &of("property", idx), &property.predicate, 1)?;
        }
        if let Some(stacks) = &self.stacks {
            takes(domain, "stacks.predicate", &stacks.predicate, 2)?;
        }
        for (idx, predicate) in self.acyclic.iter().enumerate() {
            takes(domain, &format!("acyclic[{idx}]"), predicate, 2)?;
        }
        for (idx, never) in self.mutex_rules.iter().enumerate() {
            for (side, pattern) in never.both.iter().enumerate() {
                let at = format!("never[{idx}].both[{side}]");
                takes(domain, &at, &pattern.predicate, pattern.variables.len())?;
            }
        }
        Ok(())
    }
}

/// An error about a key of `language.toml` that is well-formed but does not fit the domain.
pub(super) fn misfit(message: String) -> GoalError {
    GoalError::Language { file: "language.toml".to_owned(), message }
}

fn known_type(domain: &Domain, at: &str, type_name: &Name) -> Result<(), Mismatch> {
    let types = &domain.types.parents;
    let known = types.contains_key(type_name)
        || *type_name == "object"
        || types.values().any(|parents| parents.contains(type_name));
    if known {
        return Ok(());
    }
    let names: Vec<&str> = types.keys().map(Name::as_str).collect();
    let expected = format!("a type of the domain {} ({})", domain.name, names.join(", "));
    let near = near_hint(type_name.as_str(), names);
    Err(Mismatch::new(at, expected, format!("{type_name}{near}")))
}

fn takes(domain: &Domain, at: &str, predicate: &Name, n_args: usize) -> Result<(), Mismatch> {
    let Some(signature) = domain.predicate(predicate.as_str()) else {
        let names: Vec<&str> = domain.predicates.iter().map(|p| p.name.as_str()).collect();
        let expected = format!("a predicate of the domain {} ({})", domain.name, names.join(", "));
        let near = near_hint(predicate.as_str(), names);
        return Err(Mismatch::new(at, expected, format!("{predicate}{near}")));
    };
    let arity = signature.params.len();
    if arity == n_args {
        return Ok(());
    }
    let expected = format!("a predicate of {n_args} arguments");
    Err(Mismatch::new(at, expected, format!("{predicate}, which has {arity}")))
}
