//! Finds one form in a text that is no clean PDDL: recorded answers of a language model may stand in
//! a code fence, repeat themselves or be cut off.

use std::ops::Range;

use crate::pddl::SourceText;

/// The first form `(head …)` of a text, parentheses included; up to the end of the text where the
/// form is not closed. Comments are skipped. Of `(head (head …))` the inner form is meant.
fn find(text: &str, head: &str) -> Option<Range<usize>> {
    let mut outer: Option<Range<usize>> = None;
    let mut from = 0;
    while let Some(start) = open(text, head, from) {
        let nested = outer
            .as_ref()
            .is_none_or(|outer| text[outer.start + 1..start].trim().eq_ignore_ascii_case(head));
        if !nested {
            break;
        }
        outer = Some(start..close(text, start));
        from = start + 1;
    }
    outer
}

/// Where the next `(head` opens, not in a comment.
fn open(text: &str, head: &str, from: usize) -> Option<usize> {
    outside_comments(text, from)
        .find(|(at, c)| {
            let rest = text[at + 1..].trim_start();
            let word = rest.get(..head.len()).is_some_and(|word| word.eq_ignore_ascii_case(head));
            let ends = rest.get(head.len()..).is_none_or(|after| {
                after.chars().next().is_none_or(|c| c.is_whitespace() || "();".contains(c))
            });
            *c == '(' && word && ends
        })
        .map(|(at, _)| at)
}

/// One past the parenthesis that closes the one at `start`, or the end of the text.
fn close(text: &str, start: usize) -> usize {
    let mut depth = 0_usize;
    for (at, c) in outside_comments(text, start) {
        match c {
            '(' => depth += 1,
            ')' if depth <= 1 => return at + 1,
            ')' => depth -= 1,
            _ => {}
        }
    }
    text.len()
}

/// The parentheses of a text that do not stand in comments.
fn outside_comments(text: &str, from: usize) -> impl Iterator<Item = (usize, char)> {
    let mut in_comment = false;
    text.char_indices().skip_while(move |(at, _)| *at < from).filter(move |(_, c)| {
        in_comment = match c {
            ';' => true,
            '\n' => false,
            _ => in_comment,
        };
        !in_comment && "()".contains(*c)
    })
}

/// The text with everything outside the range blank, so that places in messages stay right.
fn only(source: &SourceText, range: &Range<usize>) -> SourceText {
    let blank = |(at, c): (usize, char)| if range.contains(&at) || c == '\n' { c } else { ' ' };
    let text = source.text.char_indices().map(blank).collect::<String>();
    SourceText { name: source.name.clone(), text }
}

/// The source with nothing but its first form `(head …)`; the whole source where it has none.
pub(super) fn form_of(source: &SourceText, head: &str) -> SourceText {
    find(&source.text, head).map_or_else(|| source.clone(), |range| only(source, &range))
}

/// The source with nothing but what stands inside its first form `(head …)`.
pub(super) fn inside_of(source: &SourceText, head: &str) -> Option<SourceText> {
    let range = find(&source.text, head)?;
    let after = &source.text[range.start + 1..];
    let start = range.start + 1 + (after.len() - after.trim_start().len()) + head.len();
    let closed = source.text[range.clone()].ends_with(')');
    let end = if closed { range.end - 1 } else { range.end };
    Some(only(source, &(start.min(end)..end)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, expect: &str) {
        let form = form_of(&SourceText::new("stub", text), ":goal");
        assert_eq!(form.text.split_whitespace().collect::<Vec<_>>().join(" "), expect);
        assert_eq!(form.text.lines().count(), text.lines().count(), "lines stay where they are");
    }

    #[test]
    fn the_goal_is_found_in_what_surrounds_it() {
        check("(:goal (on a b))", "(:goal (on a b))");
        check("```pddl\n  (:goal (on a b))\n```", "(:goal (on a b))");
        check("Här:\n(:goal\n(on a b)) (:goal (on b a))", "(:goal (on a b))");
        check("( :GOAL ( :goal (on a b)))", "( :goal (on a b))");
        check("(:goal(:goal (and (p) (q))) (r))", "(:goal (and (p) (q)))");
        check("; (:goal (no))\n(:goal (p) ; )\n)", "(:goal (p) ; ) )");
        check("(:goals (p)) (:goal (q))", "(:goal (q))");
    }

    #[test]
    fn a_form_that_is_not_closed_goes_to_the_end() {
        check("x (:goal (on a", "(:goal (on a");
        check("(on a b)", "(on a b)");
        check("", "");
    }

    #[test]
    fn the_inside_is_what_stands_between_head_and_end() {
        let inside = |text: &str| {
            inside_of(&SourceText::new("stub", text), ":init").map(|s| s.text.trim().to_owned())
        };
        assert_eq!(inside("(:init (a) (b))").as_deref(), Some("(a) (b)"));
        assert_eq!(inside("(define (:init(a)\n) (:goal))").as_deref(), Some("(a)"));
        assert_eq!(inside("(:init").as_deref(), Some(""));
        assert_eq!(inside("(init)"), None);
    }
}
