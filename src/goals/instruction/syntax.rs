//! What the grammar makes of the tokens: noun phrases, descriptions, clauses.

use super::super::language::Pick;
use super::Span;
use super::meaning::{Ordinal, RowSide};
use crate::pddl::Name;

/// The words for one or more objects, before they are looked up.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct NounPhrase {
    pub(super) head: Head,
    /// What tells them from others of their kind.
    pub(super) descriptions: Vec<Description>,
    /// Whether a place describes it without any such word ("the block on blue").
    pub(super) is_placed: bool,
    /// Objects that are left out.
    pub(super) except: Vec<NounPhrase>,
    pub(super) span: Span,
}

/// What a noun phrase is about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Head {
    /// "it".
    It,
    /// "them".
    They,
    /// "the rest".
    Rest,
    /// "these", which a list after a colon names.
    Listed,
    /// An object's exact name.
    Named(Name),
    /// "the red block", "all disks".
    Thing(Thing),
}

/// The words of a noun phrase with a noun or what stands for one.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[expect(clippy::struct_excessive_bools, reason = "words of a noun phrase, each said or not")]
pub(super) struct Thing {
    pub(super) all: bool,
    /// "these disks": a list after a colon names them.
    pub(super) is_listed: bool,
    /// "the other disks".
    pub(super) is_other: bool,
    /// "three" in "three disks".
    pub(super) number: Option<usize>,
    pub(super) colour: Option<Name>,
    pub(super) pick: Option<Pick>,
    /// "first" in "the first peg", 2 in "peg 2"; and from which side it is counted.
    pub(super) place: Option<(Ordinal, Option<RowSide>)>,
    /// Properties that stand before the noun ("sliced").
    pub(super) attributes: Vec<(usize, Span)>,
    pub(super) noun_idx: Option<usize>,
    pub(super) many: bool,
    pub(super) has_article: bool,
}

impl Thing {
    /// Whether something beside the type is said, or what stands for a type.
    pub(super) fn has_content(&self) -> bool {
        self.all
            || self.is_other
            || self.colour.is_some()
            || self.pick.is_some()
            || self.place.is_some()
            || !self.attributes.is_empty()
    }

    /// Whether the words may mean several objects.
    pub(super) fn is_plural(&self) -> bool {
        self.all || self.many || self.is_listed || self.is_other
    }
}

/// What is said of an object to tell it from others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Description {
    /// "on the blue block".
    Related { relation_idxs: Vec<usize>, landmark: Box<NounPhrase>, span: Span },
    /// "on the table".
    Has { property_idx: usize, span: Span },
    /// "left of the green one".
    Beside { side: RowSide, landmark: Box<NounPhrase>, span: Span },
    /// "from the left peg": where it is, by any relation.
    At { landmark: Box<NounPhrase>, span: Span },
}

impl Description {
    pub(super) fn span(&self) -> &Span {
        match self {
            Self::Related { span, .. }
            | Self::Has { span, .. }
            | Self::Beside { span, .. }
            | Self::At { span, .. } => span,
        }
    }
}

impl NounPhrase {
    pub(super) fn new(head: Head, span: Span) -> Self {
        Self { head, descriptions: Vec::new(), is_placed: false, except: Vec::new(), span }
    }

    /// A name or colour without article and noun ("red"), which people do not describe further in
    /// passing.
    pub(super) fn is_bare(&self) -> bool {
        match &self.head {
            Head::Named(_) => true,
            Head::Thing(thing) => {
                thing.colour.is_some() && thing.noun_idx.is_none() && !thing.has_article
            }
            Head::It | Head::They | Head::Rest | Head::Listed => false,
        }
    }

    /// Whether it is a bare name that a place describes, which few people say.
    pub(super) fn is_bare_and_placed(&self) -> bool {
        self.is_bare() && self.is_placed
    }

    /// Whether all that describes it is where it is moved from.
    pub(super) fn is_only_moved_from(&self) -> bool {
        self.descriptions.iter().all(|description| matches!(description, Description::At { .. }))
    }

    /// Whether it only names a type, as headings do ("a stack of blocks:").
    pub(super) fn is_type_only(&self) -> bool {
        let is_plain = self.descriptions.is_empty() && self.except.is_empty();
        match &self.head {
            Head::Thing(thing) => is_plain && !thing.has_content(),
            Head::Listed => true,
            Head::It | Head::They | Head::Rest | Head::Named(_) => false,
        }
    }

    /// Whether a list after a colon may say which objects are meant.
    pub(super) fn is_open_list(&self) -> bool {
        match &self.head {
            Head::Listed => true,
            Head::Thing(thing) => thing.is_plural(),
            Head::It | Head::They | Head::Rest | Head::Named(_) => false,
        }
    }
}

/// A relation to an object, as it is wished for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Link {
    /// Relations that share the phrase.
    pub(super) relation_idxs: Vec<usize>,
    pub(super) word: Span,
    pub(super) landmark: NounPhrase,
}

/// A property, as it is wished for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Trait {
    pub(super) property_idx: usize,
    pub(super) word: Span,
}

/// What is wished of objects: one place, one property, or places one after the other.
#[derive(Debug, Clone)]
pub(super) struct Wish {
    pub(super) links: Vec<Link>,
    pub(super) ends: Option<Trait>,
    /// Whether its words lead to a place ("onto").
    pub(super) is_directed: bool,
}

impl Wish {
    /// What it says of these objects.
    pub(super) fn of(self, themes: Vec<NounPhrase>) -> ClauseKind {
        match self.ends {
            Some(what) if self.links.is_empty() => ClauseKind::Has { themes, what },
            ends => ClauseKind::Place { themes, links: self.links, ends },
        }
    }
}

/// How a clause says it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mood {
    /// "put …", "… should be …", "red on blue".
    Wish,
    /// "… is …".
    State,
    /// "… must not be …".
    Denial,
}

/// With what a clause begins; one without a verb goes on as the one before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Form {
    /// No clause stands before.
    None,
    /// "put": one place each.
    Place,
    /// "stack", "keep", or no verb at all: relations one after the other.
    Chain,
    /// "red should be".
    Subject,
    /// "slice", "take": no place follows.
    Closed,
}

/// One statement of the instruction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Clause {
    pub(super) mood: Mood,
    pub(super) form: Form,
    /// Whether a verb or a wish is said in it.
    pub(super) is_command: bool,
    pub(super) kind: ClauseKind,
    pub(super) span: Span,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum ClauseKind {
    /// Objects in a relation to another, which may go on as a chain and end in a property: "red on blue
    /// on green on the table".
    Place { themes: Vec<NounPhrase>, links: Vec<Link>, ends: Option<Trait> },
    /// ", over green" after a chain.
    GoesOn { links: Vec<Link>, ends: Option<Trait> },
    /// Objects with a property.
    Has { themes: Vec<NounPhrase>, what: Trait },
    /// Neighbours of a list stand in a sequence's relation.
    Chain { sequence_idx: usize, word: Span, objects: Vec<NounPhrase> },
    /// Something is taken up, and a later clause says where to.
    Take { themes: Vec<NounPhrase> },
    /// Two objects change places.
    Swap { both: Box<[NounPhrase; 2]> },
    /// "two stacks of three blocks", with what it counts.
    Heading { n_stacks: Option<(usize, Span)>, n_objects: Option<(usize, Span)> },
}
