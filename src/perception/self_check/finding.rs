//! What a labelled example and the reading of it do not agree on, in words.

use std::fmt::{self, Display};

use crate::geometry::PixelBox;
use crate::logic::Truth;
use crate::pddl::{Atom, Name};

/// One thing that is not as labelled.
#[derive(Debug, Clone, PartialEq)]
pub struct ExemplarFinding {
    /// The example: the file of its boxes; `None` for what is about all examples.
    pub exemplar: Option<String>,
    /// What is not as labelled.
    pub kind: FindingKind,
}

/// A labelled object.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// Its name.
    pub object: Name,
    /// Its box, in pixels.
    pub labelled: PixelBox,
}

/// Whose boxes a fact was read from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoxOrigin {
    /// The example's own: the labels contradict each other or the domain's constraints.
    Labelled,
    /// The detector's.
    Detected,
}

/// What is not as labelled.
#[derive(Debug, Clone, PartialEq)]
pub enum FindingKind {
    /// Nothing is found where an object is labelled.
    NotFound {
        /// The object.
        label: Label,
        /// Why, as far as it can be said.
        reason: NotFoundReason,
    },
    /// The object is found with a box that overlaps the labelled one by less than one half.
    OtherBox {
        /// The object.
        label: Label,
        /// Where it is found.
        found: PixelBox,
    },
    /// The object is found under another colour than its name speaks of.
    OtherColour {
        /// The object.
        object: Name,
        /// The colour in its name.
        named: Name,
        /// The colour that the detector sees.
        seen: Name,
    },
    /// Something is found where nothing is labelled.
    Unlabelled {
        /// Its type.
        type_name: Name,
        /// What the detector calls it: a colour, or a class text.
        colour: Name,
        /// Where it is.
        found: PixelBox,
    },
    /// A fact is read otherwise than it is labelled.
    OtherFact {
        /// The fact, with the labelled names.
        atom: Atom,
        /// Whether it is labelled to hold.
        is_labelled: bool,
        /// How it is read.
        read: Truth,
        /// From whose boxes.
        boxes: BoxOrigin,
    },
    /// A fact that the labels leave open.
    Undecided {
        /// The line of the state file.
        line: usize,
        /// The fact, as it stands there.
        fact: String,
    },
    /// No example shows a predicate to hold, or none shows it not to hold.
    Untaught {
        /// The predicate.
        predicate: Name,
        /// Whether it is an example that holds which is missing.
        holds: bool,
        /// Whether the grounder says *unknown* where objects touch; otherwise nothing is read of it.
        unknown_where_touching: bool,
    },
}

/// Why nothing is found where an object is labelled.
#[derive(Debug, Clone, PartialEq)]
pub enum NotFoundReason {
    /// Box or patch are not of the outline or size that the type may have.
    OffLimit {
        /// The key of `perception.toml`.
        key: String,
        /// A share of the image height, or a ratio.
        value: f64,
        /// What the key allows.
        limits: [f64; 2],
        /// The patch with its colour, where it is not the labelled box that is off.
        patch: Option<(Name, PixelBox)>,
    },
    /// The box does not show the colour that the object's name speaks of.
    NoColour {
        /// That colour; `None`: any of the type's.
        wanted: Option<Name>,
        /// What it shows instead, with its share of the middle of the box.
        shown: Option<(Name, f64)>,
        /// The median colour of the middle.
        middle: [u8; 3],
    },
    /// There is a patch of that colour, and it is taken for no object: not told why.
    Patch {
        /// Its colour.
        colour: Name,
        /// Where it is.
        patch: PixelBox,
    },
    /// Its own labelled pixels are too few for an object that is seen whole.
    PartlyHidden {
        /// How much of its box they fill.
        share: f64,
    },
    /// It stands far from all others, or beside all fixtures.
    Outside,
    /// It lies outside the part of the image in which people say that objects can be.
    OutsideRegion,
    /// One detection covers it together with another labelled object.
    Merged {
        /// The other one.
        with: Name,
    },
    /// The domain does not say how objects of its type look.
    NoLook,
    /// The detector does not say.
    Unknown,
}

impl FindingKind {
    /// The words for the kinds, as in JSON.
    pub const WORDS: [&'static str; 7] = [
        "not_found",
        "other_box",
        "other_colour",
        "unlabelled",
        "other_fact",
        "untaught",
        "undecided",
    ];

    /// Its word.
    pub fn word(&self) -> &'static str {
        let at = match self {
            Self::NotFound { .. } => 0,
            Self::OtherBox { .. } => 1,
            Self::OtherColour { .. } => 2,
            Self::Unlabelled { .. } => 3,
            Self::OtherFact { .. } => 4,
            Self::Untaught { .. } => 5,
            Self::Undecided { .. } => 6,
        };
        Self::WORDS[at]
    }

    /// Whether it is told at the start of a run: all but facts that are merely unknown, which the
    /// loop meets with another look, and objects that the labels themselves say to be partly hidden.
    pub fn is_grave(&self) -> bool {
        match self {
            Self::NotFound { reason: NotFoundReason::PartlyHidden { .. }, .. }
            | Self::OtherFact { read: Truth::Unknown, .. } => false,
            Self::NotFound { .. }
            | Self::OtherBox { .. }
            | Self::OtherColour { .. }
            | Self::Unlabelled { .. }
            | Self::OtherFact { .. }
            | Self::Undecided { .. }
            | Self::Untaught { .. } => true,
        }
    }
}

impl Display for ExemplarFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.exemplar {
            Some(exemplar) => write!(f, "{exemplar}: {}", self.kind),
            None => self.kind.fmt(f),
        }
    }
}

/// A box as text: its four edges in whole pixels.
struct Edges<'a>(&'a PixelBox);

impl Display for Edges<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x1, y1, x2, y2] = <[f64; 4]>::from(*self.0);
        write!(f, "{x1:.0} {y1:.0} {x2:.0} {y2:.0}")
    }
}

impl Display for FindingKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFound { label: Label { object, labelled }, reason } => {
                write!(f, "{object}: not found at {}: {reason}", Edges(labelled))
            }
            Self::OtherBox { label: Label { object, labelled }, found } => write!(
                f,
                "{object}: the label disagrees with the picture: labelled {}, found {}; correct the \
                 box",
                Edges(labelled),
                Edges(found)
            ),
            Self::OtherColour { object, named, seen } => write!(
                f,
                "{object}: found, and seen as {seen}: rename it in boxes and state, or add its shade \
                 to colours.{named} of perception.toml"
            ),
            Self::Unlabelled { type_name, colour, found } => {
                let what = what(colour, type_name);
                let place = Edges(found);
                write!(f, "the picture shows {what} at {place} that is not labelled: label it")
            }
            Self::OtherFact { atom, is_labelled, read, boxes } => {
                fact(f, (atom, *is_labelled), *read, *boxes)
            }
            Self::Undecided { line, fact } => write!(
                f,
                "line {line} of the state: {fact} is undecided: where it holds take \";?\" away, where not \
                 delete the line"
            ),
            Self::Untaught { predicate, holds, unknown_where_touching } => {
                let not = if *holds { "" } else { " not" };
                let then = if *unknown_where_touching {
                    "where objects touch it is unknown"
                } else {
                    "it is not read at all"
                };
                write!(
                    f,
                    "no labelled example shows {predicate}{not} to hold: {then}; label a picture \
                     that does"
                )
            }
        }
    }
}

/// `a red block`, or `a block` where the detector tells no colour.
fn what(colour: &Name, type_name: &Name) -> String {
    let colour = if colour == type_name { String::new() } else { format!("{colour} ") };
    let article = match format!("{colour}{type_name}").chars().next() {
        Some('a' | 'e' | 'i' | 'o' | 'u') => "an",
        _ => "a",
    };
    format!("{article} {colour}{type_name}")
}

fn fact(
    f: &mut fmt::Formatter<'_>,
    (atom, is_labelled): (&Atom, bool),
    read: Truth,
    boxes: BoxOrigin,
) -> fmt::Result {
    let labelled = if is_labelled { "labelled to hold" } else { "not labelled to hold" };
    let read = match read {
        Truth::True => "true",
        Truth::False => "false",
        Truth::Unknown => "unknown",
    };
    match boxes {
        BoxOrigin::Labelled => write!(
            f,
            "{atom}: {labelled}, and read as {read} from the labelled boxes: correct the state or the \
             boxes, or what [constraints] of perception.toml says"
        ),
        BoxOrigin::Detected => write!(
            f,
            "{atom}: {labelled}, and read as {read} from the detected boxes: correct the labelled \
             boxes if they are off, or label more pictures"
        ),
    }
}

impl Display for NotFoundReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OffLimit { key, value, limits: [low, high], patch } => {
                match patch {
                    Some((colour, b)) => write!(f, "the {colour} patch there, {},", Edges(b))?,
                    None => write!(f, "its box")?,
                }
                write!(
                    f,
                    " has {value:.3}, and {key} allows {low} to {high}: correct label \
                     or key, or show it whole"
                )
            }
            Self::NoColour { wanted, shown, middle: [r, g, b] } => {
                let of_type = "none of its type's colours";
                let wanted =
                    wanted.as_ref().map_or_else(|| of_type.to_owned(), |c| format!("no {c}"));
                match shown {
                    Some((colour, share)) => write!(
                        f,
                        "its box shows {wanted} but {colour} ({:.0} % of the middle)",
                        100.0 * share
                    )?,
                    None => {
                        write!(f, "its box shows {wanted} (its middle is #{r:02x}{g:02x}{b:02x})")?;
                    }
                }
                write!(
                    f,
                    ": correct box or name, or add the shade to [colours] of perception.toml; a colour \
                     like the ground's or near grey needs another detector"
                )
            }
            Self::Patch { colour, patch } => write!(
                f,
                "there is a {colour} patch at {}, too unlike an object in outline, size or contrast: \
                 correct the box, or take another picture",
                Edges(patch)
            ),
            Self::PartlyHidden { share } => write!(
                f,
                "by its own pixels ({:.0} % of its box) it is partly hidden: label another picture \
                 that shows it whole, if none does",
                100.0 * share
            ),
            Self::Outside => write!(
                f,
                "it stands elsewhere than the other labelled objects: label another picture with \
                 objects there, or leave it out"
            ),
            Self::OutsideRegion => f.write_str(
                "its middle lies outside the region of the camera: enlarge that, or leave it out",
            ),
            Self::Merged { with } => write!(
                f,
                "one detection covers it and {with}: move them apart in the picture, or label their \
                 boxes as the detector sees them"
            ),
            Self::NoLook => write!(
                f,
                "perception.toml does not say how objects of its type look: add [[type]] with an \
                 appearance, or take a detector that knows them"
            ),
            Self::Unknown => {
                write!(
                    f,
                    "the detector does not say why: correct the box, or take another detector"
                )
            }
        }
    }
}
