//! Plans as planners write them.

use super::super::Step;
use super::super::error::{PddlError, SourceText};
use super::super::sexpr::{Node, read};
use super::Reader;

/// Reads a plan: one `(action object …)` after the other. Names are not checked.
///
/// A step may have a time before it and a duration behind it, as in `0.001: (pick a) [1.000]`. When
/// all have times, the steps are put in their order; those of one time stay in the order of the text.
///
/// # Errors
/// [`super::super::ErrorKind::Syntax`] for anything else.
pub fn parse_plan(source: &SourceText) -> Result<Vec<Step>, PddlError> {
    let forms = read(source)?;
    let reader = Reader::new(source);
    let mut timed: Vec<(Option<f64>, Step)> = Vec::new();
    let (mut rest, mut time) = (forms.as_slice(), None);
    while let Some((form, following)) = rest.split_first() {
        rest = following;
        match form.word() {
            None => timed.push((time.take(), reader.step(form)?)),
            Some(word) if word.starts_with('[') && !timed.is_empty() && time.is_none() => {
                rest = after_duration(form, following);
            }
            Some(word) => {
                let colon_apart = following.first().is_some_and(|next| next.is(":"));
                let number = word.strip_suffix(':').or(colon_apart.then_some(word));
                let number = number.and_then(|word| word.parse::<f64>().ok());
                time = number.filter(|t| t.is_finite() && time.is_none());
                if time.is_none() {
                    return Err(reader.step(form).err().unwrap_or_else(|| reader.no_step(form)));
                }
                rest = &following[usize::from(colon_apart)..];
            }
        }
    }
    if timed.iter().all(|(time, _)| time.is_some()) {
        timed.sort_by(|(a, _), (b, _)| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    }
    Ok(timed.into_iter().map(|(_, step)| step).collect())
}

/// What follows a duration: `[1.0]`, or several words in brackets. A `;` in it hides its end.
fn after_duration<'n, 's>(first: &Node<'s>, following: &'n [Node<'s>]) -> &'n [Node<'s>] {
    let is_end = |node: &Node<'_>| node.word().is_none_or(|word| word.ends_with(']'));
    if is_end(first) {
        return following;
    }
    let end = following.iter().position(is_end).unwrap_or(following.len());
    let is_bracket = following.get(end).is_some_and(|node| node.word().is_some());
    // Without its end, the duration is what stands before the next step and its time.
    let time =
        following[..end].iter().position(|node| node.word().is_some_and(|w| w.contains(':')));
    if is_bracket { &following[end + 1..] } else { &following[time.unwrap_or(end)..] }
}

impl<'s> Reader<'s> {
    fn step(&self, form: &Node<'s>) -> Result<Step, PddlError> {
        let members = self.list(form, "a step `(action object …)`")?;
        let Some((action, args)) = members.split_first() else {
            return Err(self.no_step(form));
        };
        let action = self.name(action, "an action")?;
        let args = args.iter().map(|a| self.name(a, "an object")).collect::<Result<_, _>>()?;
        Ok(Step { action, args })
    }

    fn no_step(&self, form: &Node<'s>) -> PddlError {
        let got = form.describe();
        self.syntax(form.span, format!("expected a step `(action object …)`, got {got}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(text: &str) -> Result<String, String> {
        let steps = parse_plan(&SourceText::new("plan", text)).map_err(|e| e.to_string())?;
        Ok(steps.iter().map(ToString::to_string).collect())
    }

    #[test]
    fn times_and_durations_are_read_past() {
        for text in [
            "(a x)\n(b)\n; cost = 2 (unit cost)\n",
            "0: (A X)\n1: (B)\n",
            "0.000:(a x) [0.001]\n0.001: (b)[10.000]",
            "; Time 0.02\n0.001: (b) [ 1 ]\n0.000 : (a x) [0.001]\n",
            "0.0003: (A X) [D:1.0000; C:0.1000]\n1.0005: (B) [D:1.0000; C:0.1000]\n",
            "0: (a x)\r0: (b)\r",
            "0.000: (a x)\n(b)\n",
        ] {
            assert_eq!(plan(text).as_deref(), Ok("(a x)(b)"), "{text:?}");
        }
    }

    #[test]
    fn anything_else_is_refused_where_it_stands() {
        for (text, place, what) in [
            ("(a)\nb c", "2:1", "`b`"),
            ("0 (a)", "1:1", "`0`"),
            ("0: 1: (a)", "1:4", "`1:`"),
            ("[1] (a)", "1:1", "`[1]`"),
            ("x: (a)", "1:1", "`x:`"),
            ("()", "1:1", "`()`"),
            ("(a (b))", "1:4", "a list that begins with `b`"),
        ] {
            let error = plan(text).unwrap_err();
            assert!(error.starts_with(&format!("plan:{place}: ")), "{error}");
            assert!(error.ends_with(&format!("got {what}")), "{error}");
        }
    }
}
