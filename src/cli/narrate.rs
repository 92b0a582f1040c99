//! What people read while an episode runs.

use crate::messages::Event;
use crate::pddl::{Atom, Name, Step};

/// Most steps of a plan that are shown on one line.
const STEPS_SHOWN: usize = 6;

/// How events are shown.
#[derive(Debug, Clone)]
pub(super) struct Style {
    /// Whether the terminal shows colours.
    pub(super) colour: bool,
    /// Predicates that only order objects: too many facts, and they hardly change.
    pub(super) orders: Vec<Name>,
}

impl Style {
    fn paint(&self, code: &str, text: &str) -> String {
        if self.colour { format!("\x1b[{code}m{text}\x1b[0m") } else { text.to_owned() }
    }

    /// One event as one line.
    pub(super) fn line(&self, since_ns: u64, cycle: u64, event: &Event) -> String {
        let seconds = since_ns as f64 / 1e9;
        let (mark, text) = match event {
            Event::State { facts, unknown, constrained } => {
                (self.paint("2", "state  "), self.state(facts, unknown, constrained))
            }
            Event::Plan { steps, cost } => (self.paint("36", "plan   "), plan(steps, *cost)),
            Event::Started { step } => (self.paint("34", "skill  "), step.to_string()),
            Event::Done { step, seconds } => {
                (self.paint("32", "done   "), format!("{step} in {seconds:.1} s"))
            }
            Event::Failed { step, reason, failures } => {
                let times =
                    if *failures > 1 { format!(" ({failures} times)") } else { String::new() };
                (self.paint("31", "failed "), format!("{step}: {reason}{times}"))
            }
            Event::Deviation(deviation) => (self.paint("33;1", "seen   "), deviation.to_string()),
            Event::Replan { causes, old } => {
                let causes: Vec<String> = causes.iter().map(ToString::to_string).collect();
                let instead = old.as_ref().map(|step| format!("; {step} was next"));
                let text = format!("{}{}", causes.join("; "), instead.unwrap_or_default());
                (self.paint("35;1", "replan "), format!("because {text}"))
            }
            Event::Cancel { step, reason } => {
                (self.paint("33", "break  "), format!("{step}: {reason}"))
            }
            Event::Look { reason } => (self.paint("2", "look   "), reason.clone()),
            Event::Paused => (self.paint("33", "pause  "), "no frame is answered".to_owned()),
            Event::Resumed => (self.paint("33", "resume "), String::new()),
            Event::End(verdict) => {
                let code = if verdict.exit_code() == 0 { "32;1" } else { "31;1" };
                (self.paint("1", "end    "), self.paint(code, &verdict.to_string()))
            }
        };
        let stamp = self.paint("2", &format!("{seconds:7.1} s  #{cycle:<5}"));
        format!("{stamp} {mark} {text}")
    }

    /// The facts that hold, relations first, without those that only order objects. A mark tells
    /// what is unknown (?) and what a constraint decided (*).
    fn state(&self, facts: &[Atom], unknown: &[Atom], constrained: &[Atom]) -> String {
        let shown = |atom: &&Atom| !self.orders.contains(&atom.predicate);
        let mut sorted: Vec<&Atom> = facts.iter().filter(shown).collect();
        sorted.sort_by_key(|atom| std::cmp::Reverse(atom.args.len()));
        let mark = |atom: &Atom| if constrained.contains(atom) { "*" } else { "" };
        let known = sorted.into_iter().map(|atom| format!("{atom}{}", mark(atom)));
        let unknown = unknown.iter().filter(shown).map(|atom| format!("{atom}?{}", mark(atom)));
        let words: Vec<String> = known.chain(unknown).collect();
        words.join(" ")
    }
}

fn plan(steps: &[Step], cost: u64) -> String {
    let shown: Vec<String> = steps.iter().take(STEPS_SHOWN).map(ToString::to_string).collect();
    let more = steps.len().saturating_sub(STEPS_SHOWN);
    let rest = if more > 0 { format!(" … {more} more") } else { String::new() };
    format!("{} steps, cost {cost}: {}{rest}", steps.len(), shown.join(" "))
}
