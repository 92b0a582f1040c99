//! Ground conditions in negation normal form, and their packed tests.

/// A ground condition over atom numbers.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::planning) enum Formula {
    /// Holds always.
    True,
    /// Holds never.
    False,
    /// The atom is true.
    Holds(u32),
    /// The atom is false.
    Fails(u32),
    /// Every part holds; at least two parts, sorted.
    And(Vec<Formula>),
    /// Some part holds; at least two parts, sorted.
    Or(Vec<Formula>),
}

impl Formula {
    /// A literal.
    pub(in crate::planning) fn literal(atom: u32, positive: bool) -> Self {
        if positive { Self::Holds(atom) } else { Self::Fails(atom) }
    }

    /// Conjunction, simplified.
    pub(in crate::planning) fn and(parts: impl IntoIterator<Item = Self>) -> Self {
        let mut flat = Vec::new();
        for part in parts {
            match part {
                Self::True => {}
                Self::False => return Self::False,
                Self::And(inner) => flat.extend(inner),
                other @ (Self::Holds(_) | Self::Fails(_) | Self::Or(_)) => flat.push(other),
            }
        }
        Self::tidy(flat, Self::True, Self::False, Self::And)
    }

    /// Disjunction, simplified.
    pub(in crate::planning) fn or(parts: impl IntoIterator<Item = Self>) -> Self {
        let mut flat = Vec::new();
        for part in parts {
            match part {
                Self::False => {}
                Self::True => return Self::True,
                Self::Or(inner) => flat.extend(inner),
                other @ (Self::Holds(_) | Self::Fails(_) | Self::And(_)) => flat.push(other),
            }
        }
        Self::tidy(flat, Self::False, Self::True, Self::Or)
    }

    /// Sorts the parts; `empty` stands for none of them, `clash` for an atom and its negation.
    fn tidy(mut parts: Vec<Self>, empty: Self, clash: Self, many: fn(Vec<Self>) -> Self) -> Self {
        parts.sort_unstable();
        parts.dedup();
        let clashes = parts.iter().any(|part| match part {
            Self::Holds(atom) => parts.binary_search(&Self::Fails(*atom)).is_ok(),
            Self::True | Self::False | Self::Fails(_) | Self::And(_) | Self::Or(_) => false,
        });
        if clashes {
            return clash;
        }
        match parts.len() {
            0 => empty,
            1 => parts.swap_remove(0),
            _ => many(parts),
        }
    }

    /// The negation.
    pub(in crate::planning) fn negate(&self) -> Self {
        match self {
            Self::True => Self::False,
            Self::False => Self::True,
            Self::Holds(atom) => Self::Fails(*atom),
            Self::Fails(atom) => Self::Holds(*atom),
            Self::And(parts) => Self::or(parts.iter().map(Self::negate)),
            Self::Or(parts) => Self::and(parts.iter().map(Self::negate)),
        }
    }

    /// Whether it holds, given the value of each literal (atom, wanted value).
    pub(in crate::planning) fn holds_where(&self, literal: &impl Fn(u32, bool) -> bool) -> bool {
        match self {
            Self::True => true,
            Self::False => false,
            Self::Holds(atom) => literal(*atom, true),
            Self::Fails(atom) => literal(*atom, false),
            Self::And(parts) => parts.iter().all(|p| p.holds_where(literal)),
            Self::Or(parts) => parts.iter().any(|p| p.holds_where(literal)),
        }
    }

    /// The formula with each literal on (atom, wanted value) replaced.
    pub(in crate::planning) fn replaced(&self, literal: &impl Fn(u32, bool) -> Self) -> Self {
        match self {
            Self::True => Self::True,
            Self::False => Self::False,
            Self::Holds(atom) => literal(*atom, true),
            Self::Fails(atom) => literal(*atom, false),
            Self::And(parts) => Self::and(parts.iter().map(|p| p.replaced(literal))),
            Self::Or(parts) => Self::or(parts.iter().map(|p| p.replaced(literal))),
        }
    }

    /// Calls `visit` with every literal.
    pub(in crate::planning) fn each_literal(&self, visit: &mut impl FnMut(u32, bool)) {
        match self {
            Self::True | Self::False => {}
            Self::Holds(atom) => visit(*atom, true),
            Self::Fails(atom) => visit(*atom, false),
            Self::And(parts) | Self::Or(parts) => {
                for part in parts {
                    part.each_literal(visit);
                }
            }
        }
    }
}

/// Whether the atom is true in a packed state.
pub(in crate::planning) fn bit(state: &[u64], atom: u32) -> bool {
    state[atom as usize / 64] >> (atom % 64) & 1 == 1
}

/// A formula made fast to test: literals are compared word by word.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::planning) struct Test {
    /// (word, bits that matter, their wanted values).
    words: Vec<(u32, u64, u64)>,
    /// Conjuncts that are not literals.
    rest: Vec<Formula>,
}

impl Test {
    /// Packs a formula.
    pub(in crate::planning) fn new(formula: &Formula) -> Self {
        let mut test = Self { words: Vec::new(), rest: Vec::new() };
        match formula {
            Formula::True => {}
            Formula::And(parts) => parts.iter().for_each(|p| test.add(p)),
            Formula::False | Formula::Holds(_) | Formula::Fails(_) | Formula::Or(_) => {
                test.add(formula);
            }
        }
        test
    }

    fn add(&mut self, part: &Formula) {
        let (atom, wanted) = match part {
            Formula::Holds(atom) => (*atom, true),
            Formula::Fails(atom) => (*atom, false),
            Formula::True | Formula::False | Formula::And(_) | Formula::Or(_) => {
                self.rest.push(part.clone());
                return;
            }
        };
        let (word, mask) = (atom / 64, 1 << (atom % 64));
        let known = self.words.iter().position(|(w, ..)| *w == word);
        let idx = known.unwrap_or_else(|| {
            self.words.push((word, 0, 0));
            self.words.len() - 1
        });
        let (_, care, value) = &mut self.words[idx];
        *care |= mask;
        if wanted {
            *value |= mask;
        }
    }

    /// Whether the formula holds in a packed state.
    pub(in crate::planning) fn holds(&self, state: &[u64]) -> bool {
        self.words.iter().all(|&(word, care, value)| state[word as usize] & care == value)
            && self.rest.iter().all(|f| f.holds_where(&|atom, wanted| bit(state, atom) == wanted))
    }

    /// (word, bits that matter, their wanted values), unless more than literals is tested.
    pub(in crate::planning) fn literals(&self) -> Option<&[(u32, u64, u64)]> {
        self.rest.is_empty().then_some(&self.words)
    }

    /// Whether nothing is tested.
    pub(in crate::planning) fn is_empty(&self) -> bool {
        self.words.is_empty() && self.rest.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simplification_keeps_the_meaning() {
        let (a, b) = (Formula::Holds(0), Formula::Holds(1));
        assert_eq!(Formula::and([a.clone(), Formula::Fails(0)]), Formula::False);
        assert_eq!(Formula::or([a.clone(), Formula::Fails(0), b.clone()]), Formula::True);
        assert_eq!(Formula::and([a.clone(), a.clone()]), a);
        let nested = Formula::and([b.clone(), Formula::and([a.clone(), b.clone()])]);
        assert_eq!(nested, Formula::And(vec![a.clone(), b.clone()]));
        assert_eq!(nested.negate(), Formula::Or(vec![Formula::Fails(0), Formula::Fails(1)]));
    }

    #[test]
    fn a_packed_test_agrees_with_its_formula() {
        let choice = Formula::or([Formula::Holds(70), Formula::Fails(2)]);
        let formula = Formula::and([Formula::Holds(0), Formula::Fails(65), choice]);
        let test = Test::new(&formula);
        for bits in 0..16_u64 {
            let state = [bits & 1 | bits >> 1 & 1 << 2, bits >> 2 << 1 & 2 | (bits >> 3 & 1) << 6];
            let expected = formula.holds_where(&|atom, wanted| bit(&state, atom) == wanted);
            assert_eq!(test.holds(&state), expected, "{state:?}");
        }
    }
}
