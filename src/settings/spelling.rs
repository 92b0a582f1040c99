//! Known words that come close to an unknown one.

/// The known word that is nearest to a misspelt one, where one is near.
pub fn did_you_mean<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let edits_max = match word.chars().count() {
        0..=2 => 0,
        3..=5 => 1,
        _ => 2,
    };
    let distance = |known: &'a str| (strsim::osa_distance(word, known), known);
    // A word that is said longer or shorter ("rate" for "rate_hz") is near as well.
    let is_part =
        |known: &str| word.len() >= 3 && (known.starts_with(word) || word.starts_with(known));
    let near = known.into_iter().map(distance);
    let near = near.filter(|(edits, known)| *edits <= edits_max || is_part(known));
    near.min().map(|(_, known)| known)
}

/// The nearest known word as the end of a message, where one is near: `; did you mean "on"?`.
pub fn near_hint<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let near = did_you_mean(word, known).filter(|near| *near != word);
    near.map(|near| format!("; did you mean \"{near}\"?")).unwrap_or_default()
}
