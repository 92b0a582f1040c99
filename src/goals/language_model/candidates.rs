//! The one goal in an answer: in a fence, in JSON, after a model's thoughts or between sentences. An answer
//! with several is no answer.

use std::collections::BTreeSet;

use crate::http::chat::{ChatForm, ChatResponse};
use crate::pddl::Domain;

/// Words that begin a condition, beside the domain's predicates.
const HEADS: &[&str] = &[":goal", "and", "or", "not", "imply", "forall", "exists", "="];
/// Most candidates that are looked at.
const CANDIDATES_MAX: usize = 50;

/// The PDDL of the goal in an answer.
pub(super) fn goal_text(
    answer: &ChatResponse,
    form: ChatForm,
    domain: &Domain,
) -> Result<String, String> {
    let text = answer.text.rsplit("</think>").next().unwrap_or_default().trim();
    let cut = if answer.is_cut { " (the answer was too long and has been cut)" } else { "" };
    if text.is_empty() {
        return Err(format!("the answer is empty{cut}"));
    }
    let fences = fences(text);
    let mut blocks: Vec<&str> =
        fences.iter().copied().filter(|block| block.contains(['(', '{'])).collect();
    blocks.dedup_by_key(|block| normal(block));
    if let [first, second, ..] = blocks.as_slice() {
        return Err(several(first, second));
    }
    let only = blocks.first().copied().or(fences.first().copied()).unwrap_or(text).trim();
    if only.is_empty() {
        return Err(format!("the answer is empty{cut}"));
    }
    let inner = if only.starts_with('{') || form == ChatForm::Json && !only.starts_with('(') {
        let parsed: Result<serde_json::Value, _> = serde_json::from_str(only);
        let value = parsed.map_err(|e| format!("expected JSON {{\"goal\": \"…\"}}: {e}{cut}"))?;
        let goal = value.get("goal").and_then(serde_json::Value::as_str);
        goal.ok_or("expected JSON with a text \"goal\"")?.to_owned()
    } else {
        only.to_owned()
    };
    let start = inner.find('(').ok_or_else(|| format!("expected (and …), got no form{cut}"))?;
    let end = inner.rfind(')').filter(|end| *end > start);
    let end = end.ok_or_else(|| format!("expected (and …), got an open form{cut}"))?;
    let goal = &inner[start..=end];
    let own = forms(goal, domain);
    if let Some((first, second)) =
        own.iter().find_map(|a| own.iter().find(|b| *b != a).map(|b| (a, b)))
    {
        return Err(several(first, second));
    }
    // What stands around a fence may explain parts of the goal, and may not be another one.
    let all = normal(goal);
    let around = forms(text, domain);
    if let Some(other) = around.iter().find(|form| !all.contains(form.as_str())) {
        return Err(several(&all, other));
    }
    Ok(own.iter().next().filter(|_| own.len() == 1).cloned().unwrap_or_else(|| goal.to_owned()))
}

fn several(first: &str, second: &str) -> String {
    format!(
        "the answer holds several goals, among them {} and {}: write the one that is meant",
        normal(first),
        normal(second)
    )
}

/// What stands in the fences of a text, without the name of a language.
fn fences(text: &str) -> Vec<&str> {
    let inside = |part: &'_ str| {
        let first = part.lines().next().unwrap_or_default().len();
        let is_named = !part[..first].contains(['(', '{']);
        (first, is_named)
    };
    text.split("```")
        .skip(1)
        .step_by(2)
        .take(CANDIDATES_MAX)
        .map(|part| match inside(part) {
            (first, true) => part.get(first..).unwrap_or_default(),
            (_, false) => part,
        })
        .collect()
}

/// The different conditions that stand for themselves in a text, with single blanks.
fn forms(text: &str, domain: &Domain) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut rest = text;
    while let Some(start) = rest.find('(') {
        let from = &rest[start..];
        let Some(end) = closing(from) else { break };
        let form = normal(&from[..=end]);
        let head = form[1..].split([' ', '(', ')']).next().unwrap_or_default().to_lowercase();
        if HEADS.contains(&head.as_str()) || domain.predicate(&head).is_some() {
            found.insert(form);
            rest = &from[end + 1..];
        } else {
            rest = &from[1..];
        }
        if found.len() >= CANDIDATES_MAX {
            break;
        }
    }
    found
}

/// The place of the parenthesis that closes the first one.
fn closing(text: &str) -> Option<usize> {
    let mut depth = 0_usize;
    for (at, c) in text.char_indices() {
        match c {
            '(' => depth += 1,
            ')' => {
                depth = depth.saturating_sub(1);
                if depth == 0 {
                    return Some(at);
                }
            }
            _ => {}
        }
    }
    None
}

fn normal(text: &str) -> String {
    let spaced = text.replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    words.join(" ").replace("( ", "(").replace(" )", ")")
}
