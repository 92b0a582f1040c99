//! Order in which derived predicates can be computed.

use std::collections::{BTreeMap, BTreeSet};

use super::{Axiom, Condition, Name};

/// A set of rules whose heads depend on each other through a negation.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the derived predicate `{predicate}` depends on its own negation")]
pub struct NotStratified {
    /// One predicate of the cycle.
    pub predicate: Name,
}

/// Rules that are computed together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stratum {
    /// The rules, by index, in rising order.
    pub rules: Vec<usize>,
    /// Whether a body asks for a head of this stratum; if not, one pass computes it.
    pub recursive: bool,
}

/// Groups the rules into strata, first to last: a rule's body asks for heads of lower strata, or
/// without negation for heads that depend on its own head in turn.
///
/// # Errors
/// [`NotStratified`] when no such grouping exists.
///
/// Source: Thiébaux, Hoffmann, Nebel: In defense of PDDL axioms, section 2.
pub fn stratify(axioms: &[Axiom]) -> Result<Vec<Stratum>, NotStratified> {
    let heads: BTreeSet<&Name> = axioms.iter().map(|a| &a.head.name).collect();
    // (head, used head, whether below a negation).
    let mut uses: BTreeSet<(&Name, &Name, bool)> = BTreeSet::new();
    for axiom in axioms {
        let mut used = BTreeSet::new();
        collect_uses(&axiom.body, false, &mut used);
        let of_heads = used.into_iter().filter(|(name, _)| heads.contains(name));
        uses.extend(of_heads.map(|(name, negated)| (&axiom.head.name, name, negated)));
    }
    let depends_on: BTreeMap<&Name, BTreeSet<&Name>> =
        heads.iter().map(|&head| (head, reached(head, &uses))).collect();
    let mutual = |a: &Name, b: &Name| depends_on[a].contains(b) && depends_on[b].contains(a);
    let mut level: BTreeMap<&Name, usize> = heads.iter().map(|&head| (head, 0)).collect();
    // Only uses outside a cycle raise a level, so this comes to an end.
    let mut changed = true;
    while changed {
        changed = false;
        for &(head, used, negated) in &uses {
            let in_cycle = mutual(head, used);
            if in_cycle && negated {
                return Err(NotStratified { predicate: head.clone() });
            }
            let needed = level[used] + usize::from(!in_cycle);
            if level[head] < needed {
                level.insert(head, needed);
                changed = true;
            }
        }
    }
    let n_strata = level.values().max().map_or(0, |l| l + 1);
    let mut strata = vec![Stratum { rules: Vec::new(), recursive: false }; n_strata];
    for (idx, axiom) in axioms.iter().enumerate() {
        let head = &axiom.head.name;
        let stratum = &mut strata[level[head]];
        stratum.rules.push(idx);
        stratum.recursive |= depends_on[head].contains(head);
    }
    Ok(strata)
}

/// The heads that a head depends on, directly or through others.
fn reached<'a>(head: &'a Name, uses: &BTreeSet<(&'a Name, &'a Name, bool)>) -> BTreeSet<&'a Name> {
    let mut seen = BTreeSet::new();
    let mut open = vec![head];
    while let Some(name) = open.pop() {
        let used = uses.iter().filter(|(user, ..)| *user == name).map(|(_, used, _)| *used);
        open.extend(used.filter(|&used| seen.insert(used)));
    }
    seen
}

/// Collects the predicates of a condition, each with whether it stands below a negation.
fn collect_uses<'a>(
    condition: &'a Condition,
    negated: bool,
    used: &mut BTreeSet<(&'a Name, bool)>,
) {
    match condition {
        Condition::True | Condition::False | Condition::Equal(..) => {}
        Condition::Atom(literal) => {
            used.insert((&literal.predicate, negated));
        }
        Condition::Not(inner) => collect_uses(inner, !negated, used),
        Condition::And(parts) | Condition::Or(parts) => {
            for part in parts {
                collect_uses(part, negated, used);
            }
        }
        Condition::Exists(_, inner) | Condition::Forall(_, inner) => {
            collect_uses(inner, negated, used);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pddl::{Literal, Signature};

    fn rule(head: &str, positive: &[&str], negative: &[&str]) -> Axiom {
        let atom = |p: &&str| Condition::Atom(Literal { predicate: Name::from(*p), args: vec![] });
        let negated = negative.iter().map(|p| Condition::Not(Box::new(atom(p))));
        Axiom {
            head: Signature { name: head.into(), params: vec![] },
            body: Condition::And(positive.iter().map(atom).chain(negated).collect()),
        }
    }

    fn strata(rules: &[Axiom]) -> Vec<(Vec<usize>, bool)> {
        stratify(rules).unwrap().into_iter().map(|s| (s.rules, s.recursive)).collect()
    }

    #[test]
    fn recursion_is_one_stratum_and_negation_goes_below() {
        let rules = [
            rule("safe", &[], &["reach"]),
            rule("reach", &["reach"], &[]),
            rule("reach", &["edge"], &[]),
        ];
        assert_eq!(strata(&rules), [(vec![1, 2], true), (vec![0], false)]);
        let mutual = [rule("p", &["q"], &[]), rule("q", &["p"], &[]), rule("r", &["p"], &["x"])];
        assert_eq!(strata(&mutual), [(vec![0, 1], true), (vec![2], false)]);
    }

    #[test]
    fn a_long_chain_is_computed_from_its_end() {
        let rules = [rule("d", &[], &["c"]), rule("c", &["b"], &[]), rule("b", &[], &["a"])];
        assert_eq!(strata(&rules), [(vec![2], false), (vec![1], false), (vec![0], false)]);
    }

    #[test]
    fn negation_in_a_cycle_is_refused() {
        assert!(stratify(&[rule("p", &[], &["p"])]).is_err());
        assert!(stratify(&[rule("p", &["q"], &[]), rule("q", &[], &["p"])]).is_err());
    }
}
