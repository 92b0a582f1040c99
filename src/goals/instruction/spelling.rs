//! Known words that come close to an unknown one.

/// Up to `n_max` of `known` that are few edits away from `word`, nearest first, then alphabetical.
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
        .map(|candidate| (edits(word, candidate), candidate))
        .filter(|(distance, _)| *distance <= edits_max)
        .collect();
    found.sort_unstable();
    found.dedup();
    found.into_iter().take(n_max).map(|(_, candidate)| candidate.to_owned()).collect()
}

/// Insertions, deletions, replacements and swaps of neighbours between two words (optimal string
/// alignment distance).
fn edits(left: &str, right: &str) -> usize {
    let left: Vec<char> = left.chars().collect();
    let right: Vec<char> = right.chars().collect();
    let mut before: Vec<usize> = Vec::new();
    let mut above: Vec<usize> = (0..=right.len()).collect();
    for (row, &a) in left.iter().enumerate() {
        let mut line = vec![row + 1];
        for (column, &b) in right.iter().enumerate() {
            let replaced = above[column] + usize::from(a != b);
            let mut best = replaced.min(above[column + 1] + 1).min(line[column] + 1);
            let swapped = row > 0 && column > 0 && a == right[column - 1] && left[row - 1] == b;
            if swapped {
                best = best.min(before[column - 1] + 1);
            }
            line.push(best);
        }
        before = std::mem::replace(&mut above, line);
    }
    above.last().copied().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_slip_of_each_kind_is_one_edit() {
        for slip in ["gren", "greeen", "groen", "rgeen"] {
            assert_eq!(edits("green", slip), 1, "{slip}");
        }
        assert_eq!(edits("", "abc"), 3);
        assert_eq!(edits("same", "same"), 0);
    }

    #[test]
    fn short_words_need_a_nearer_neighbour() {
        let known = ["red", "green", "on", "over"];
        assert_eq!(close("grean", known.into_iter(), 3), ["green"]);
        assert_eq!(close("rad", known.into_iter(), 3), ["red"]);
        assert!(close("an", known.into_iter(), 3).is_empty());
    }
}
