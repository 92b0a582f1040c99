//! Which query a service's label answers.
//!
//! Services change what they were asked for: case, punctuation, plural, words left out or joined.
//! A label that does not fit exactly one query is nobody's.

use crate::perception::phrases::words;

/// The query that a label answers: the one of the same words; else the only one that has all its
/// words ("disk" for "colored disk"); else the only one whose words it has all ("red colored disk").
pub(super) fn query_of(label: &str, queries: &[String]) -> Option<usize> {
    let said: Vec<String> = singular_words(label);
    if said.is_empty() {
        return None;
    }
    let asked: Vec<Vec<String>> = queries.iter().map(|query| singular_words(query)).collect();
    let only = |fits: &dyn Fn(&[String]) -> bool| {
        let mut fitting = asked.iter().enumerate().filter(|(_, query)| fits(query));
        let (idx, _) = fitting.next()?;
        fitting.next().is_none().then_some(idx)
    };
    let has_all = |some: &[String], all: &[String]| all.iter().all(|word| some.contains(word));
    only(&|query| query == said)
        .or_else(|| only(&|query| has_all(query, &said)))
        .or_else(|| only(&|query| !query.is_empty() && has_all(&said, query)))
}

/// The words of a text, the last one in the singular as far as its ending tells.
fn singular_words(text: &str) -> Vec<String> {
    let mut found: Vec<String> = words(text).collect();
    if let Some(last) = found.last_mut() {
        let endings = [
            ("oes", "o"),
            ("shes", "sh"),
            ("ches", "ch"),
            ("xes", "x"),
            ("ies", "y"),
            ("sses", "ss"),
        ];
        let replaced = endings.iter().find_map(|(plural, singular)| {
            Some(format!("{}{singular}", last.strip_suffix(plural)?))
        });
        let without_s = || last.strip_suffix('s').filter(|stem| !stem.ends_with(['s', 'u', 'i']));
        if let Some(singular) = replaced.or_else(|| without_s().map(str::to_owned)) {
            *last = singular;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(label: &str, expect: Option<&str>) {
        let queries = ["colored disk", "wooden stick", "bowl", "wooden board", "tomato", "glass"]
            .map(str::to_owned);
        let found = query_of(label, &queries).map(|idx| queries[idx].as_str());
        assert_eq!(found, expect, "{label}");
    }

    #[test]
    fn labels_are_matched_through_case_punctuation_and_plural() {
        for (label, query) in [
            ("colored disk", "colored disk"),
            (" Colored  Disks. ", "colored disk"),
            ("a bowl", "bowl"),
            ("colored_disk", "colored disk"),
            ("tomatoes", "tomato"),
            ("glasses", "glass"),
            ("disk", "colored disk"),
            ("sticks", "wooden stick"),
            ("small red colored disk", "colored disk"),
        ] {
            check(label, Some(query));
        }
    }

    #[test]
    fn a_label_that_fits_none_or_several_is_nobodys() {
        for label in ["", "...", "wooden", "cup", "bowl wooden board", "robot"] {
            check(label, None);
        }
    }
}
