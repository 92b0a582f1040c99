//! Known words that come close to an unknown one.

/// Up to `n_max` of `known` that are few edits away from `word`, nearest first, then alphabetical.
/// An edit is an insertion, a deletion, a replacement or a swap of neighbours.
pub(super) fn close<'a>(
    word: &str,
    known: impl Iterator<Item = &'a str>,
    n_max: usize,
) -> Vec<String> {
    let edits_max = match word.chars().count() {
        0..=2 => 0,
        3..=5 => 1,
        _ => 2,
    };
    let mut found: Vec<(usize, &str)> = known
        .map(|candidate| (strsim::osa_distance(word, candidate), candidate))
        .filter(|(distance, _)| *distance <= edits_max)
        .collect();
    found.sort_unstable();
    found.dedup();
    found.into_iter().take(n_max).map(|(_, candidate)| candidate.to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_slip_of_each_kind_is_one_edit() {
        for slip in ["gren", "greeen", "groen", "rgeen"] {
            assert_eq!(close(slip, ["green"].into_iter(), 1), ["green"], "{slip}");
        }
    }

    #[test]
    fn short_words_need_a_nearer_neighbour() {
        let known = ["red", "green", "on", "over"];
        assert_eq!(close("grean", known.into_iter(), 3), ["green"]);
        assert_eq!(close("rad", known.into_iter(), 3), ["red"]);
        assert!(close("an", known.into_iter(), 3).is_empty());
    }
}
