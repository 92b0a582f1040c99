//! What people read while an episode runs: one event, one line that fits the terminal.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use console::{measure_text_width, truncate_str};
use textwrap::{Options, WordSplitter, wrap};

use crate::messages::Event;
use crate::pddl::{Atom, Name, Step};

/// Columns of time, cycle and mark, which stand before every text.
const HEAD_COLUMNS: usize = 23;

/// Fewest columns that a text gets, however narrow the terminal is.
const TEXT_COLUMNS_MIN: usize = 20;

/// How events are shown.
#[derive(Debug, Clone)]
pub(super) struct Style {
    /// Whether the terminal shows colours.
    pub(super) colour: bool,
    /// Whether states and plans are shown in full, over several lines, instead of what fits one.
    pub(super) verbose: bool,
    /// Predicates that only order objects: too many facts, and they hardly change.
    pub(super) orders: Vec<Name>,
}

/// Turns the events of one episode into text. The same events and widths give the same text.
#[derive(Debug)]
pub(super) struct Narrator {
    style: Style,
    /// The stamp of the first event.
    started_ns: Option<u64>,
    /// The state that was told last.
    told: Option<State>,
}

/// The facts of a state that are shown, and how each is known.
type State = BTreeMap<Atom, Known>;

/// How a fact is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Known {
    /// It is unknown rather than true.
    unknown: bool,
    /// A constraint of the domain decided it, against its own feature.
    constrained: bool,
}

/// One event without its stamp: mark, colours of mark and text, and the text's paragraphs.
struct Told {
    mark: &'static str,
    code: &'static str,
    text_code: Option<&'static str>,
    paragraphs: Vec<Text>,
}

/// A text that is laid out for the width at hand.
enum Text {
    /// Words, over as many lines as they need.
    Words(String),
    /// A beginning, and as many items as fit one line.
    List(String, Vec<String>),
}

impl Narrator {
    pub(super) fn new(style: Style) -> Self {
        Self { style, started_ns: None, told: None }
    }

    /// The text of one event, for a terminal of that many columns. Its lines begin with the time
    /// since the first event; what does not fit one line goes on below the text.
    pub(super) fn tell(
        &mut self,
        capture_ns: u64,
        cycle: u64,
        event: &Event,
        columns: usize,
    ) -> String {
        let started_ns = *self.started_ns.get_or_insert(capture_ns);
        let seconds = capture_ns.saturating_sub(started_ns) as f64 / 1e9;
        let Told { mark, code, text_code, paragraphs } = self.told(event);
        let columns = columns.saturating_sub(HEAD_COLUMNS).max(TEXT_COLUMNS_MIN);
        let lines: Vec<String> = paragraphs
            .iter()
            .flat_map(|text| text.lines(columns))
            .map(|line| text_code.map_or_else(|| line.clone(), |code| self.paint(code, &line)))
            .collect();
        let stamp = self.paint("2", &format!("{seconds:6.1} s #{cycle:<5}"));
        let mark = self.paint(code, &format!("{mark:8}"));
        format!("{stamp}{mark}{}", lines.join(&format!("\n{:HEAD_COLUMNS$}", "")))
    }

    fn paint(&self, code: &str, text: &str) -> String {
        if self.style.colour { format!("\x1b[{code}m{text}\x1b[0m") } else { text.to_owned() }
    }

    fn told(&mut self, event: &Event) -> Told {
        let words = |mark, code, text: String| {
            let paragraphs = vec![Text::Words(text)];
            Told { mark, code, text_code: None, paragraphs }
        };
        match event {
            Event::Goal { goal, said } => {
                // In full: a person is to see what is going to be done.
                let told = [said.join(", "), goal.clone()].into_iter().filter(|t| !t.is_empty());
                let paragraphs = told.map(Text::Words).collect();
                Told { mark: "goal", code: "1", text_code: None, paragraphs }
            }
            Event::State { facts, unknown, constrained } => {
                let paragraphs = self.state(facts, unknown, constrained);
                Told { mark: "state", code: "2", text_code: None, paragraphs }
            }
            Event::Plan { steps, cost } => {
                let paragraphs = vec![self.list(plan_head(steps, *cost), texts(steps))];
                Told { mark: "plan", code: "36", text_code: None, paragraphs }
            }
            Event::Started { step } => words("skill", "34", step.to_string()),
            Event::Done { step, seconds } => {
                words("done", "32", format!("{step} in {seconds:.1} s"))
            }
            Event::Failed { step, reason, failures } => {
                let times =
                    if *failures > 1 { format!(" ({failures} times)") } else { String::new() };
                words("failed", "31", format!("{step}: {reason}{times}"))
            }
            Event::Deviation(deviation) => words("differs", "33;1", deviation.to_string()),
            Event::Replan { causes, old } => {
                let instead = old.as_ref().map(|step| format!("; {step} was next"));
                let causes = texts(causes).join("; ");
                let text = format!("because {causes}{}", instead.unwrap_or_default());
                words("replan", "35;1", text)
            }
            Event::Cancel { step, reason } => words("cancel", "33", format!("{step}: {reason}")),
            Event::Look { reason } => words("look", "2", reason.clone()),
            Event::Paused => words("pause", "33", "no frame is answered".to_owned()),
            Event::Resumed => words("resume", "33", String::new()),
            Event::End(verdict) => {
                let code = if verdict.exit_code() == 0 { "32;1" } else { "31;1" };
                let told = words("end", "1", verdict.to_string());
                Told { text_code: Some(code), ..told }
            }
        }
    }

    /// The first state as its facts; after that what has changed, where `+` holds now, `-` does not
    /// any more, and `?` is unknown now. `*` marks what a constraint decided. A verbose style shows
    /// all facts below the changes.
    fn state(&mut self, facts: &[Atom], unknown: &[Atom], constrained: &[Atom]) -> Vec<Text> {
        let shown = |atom: &&Atom| !self.style.orders.contains(&atom.predicate);
        let known = |unknown: bool| {
            move |atom: &Atom| {
                (atom.clone(), Known { unknown, constrained: constrained.contains(atom) })
            }
        };
        let holding = facts.iter().filter(shown).map(known(false));
        let now: State = holding.chain(unknown.iter().filter(shown).map(known(true))).collect();
        let all = || self.list(format!("{}:", counted(now.len(), "fact")), facts_of(&now));
        let texts = match &self.told {
            None => vec![all()],
            Some(before) => {
                let changes = match changes(before, &now) {
                    changes if changes.is_empty() => Text::Words("unchanged".to_owned()),
                    changes => self.list(String::new(), changes),
                };
                if self.style.verbose { vec![changes, all()] } else { vec![changes] }
            }
        };
        self.told = Some(now);
        texts
    }

    fn list(&self, head: String, items: Vec<String>) -> Text {
        if !self.style.verbose {
            return Text::List(head, items);
        }
        let head = std::iter::once(head).filter(|head| !head.is_empty());
        Text::Words(head.chain(items).collect::<Vec<_>>().join(" "))
    }
}

impl Text {
    fn lines(&self, columns: usize) -> Vec<String> {
        match self {
            Self::Words(text) => wrapped(text, columns),
            Self::List(head, items) => vec![fitted(head, items, columns)],
        }
    }
}

/// Breaks a text between words, and inside parentheses only where these are longer than a line.
fn wrapped(text: &str, columns: usize) -> Vec<String> {
    /// Stands for a blank at which no line ends.
    const HARD_BLANK: &str = "\u{a0}";
    let mut joined = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(open) = rest.find('(') {
        let (before, from) = rest.split_at(open);
        let end = from.find(')').map_or(from.len(), |end| end + 1);
        let (atom, after) = from.split_at(end);
        joined.push_str(before);
        if measure_text_width(atom) < columns {
            joined.push_str(&atom.replace(' ', HARD_BLANK));
        } else {
            joined.push_str(atom);
        }
        rest = after;
    }
    joined.push_str(rest);
    let options = Options::new(columns).word_splitter(WordSplitter::NoHyphenation);
    wrap(&joined, options).iter().map(|line| line.replace(HARD_BLANK, " ")).collect()
}

/// As many items as fit, and how many more there are; the first item is cut short where it does
/// not fit by itself.
fn fitted(head: &str, items: &[String], columns: usize) -> String {
    let more = |n_shown: usize| match items.len() - n_shown {
        0 => String::new(),
        n => format!(" … {n} more"),
    };
    let shown = |n: usize| {
        let words = std::iter::once(head).chain(items.iter().take(n).map(String::as_str));
        words.filter(|word| !word.is_empty()).collect::<Vec<_>>().join(" ")
    };
    let fits = |text: &String| measure_text_width(text) <= columns;
    let longest = (1..=items.len()).rev().map(|n| shown(n) + &more(n)).find(fits);
    longest.unwrap_or_else(|| {
        let n = items.len().min(1);
        let columns = columns.saturating_sub(measure_text_width(&more(n)));
        truncate_str(&shown(n), columns, "…").into_owned() + &more(n)
    })
}

/// All facts, relations first.
fn facts_of(state: &State) -> Vec<String> {
    let mut facts: Vec<(&Atom, &Known)> = state.iter().collect();
    facts.sort_by_key(|(atom, known)| (known.unknown, Reverse(atom.args.len())));
    facts
        .iter()
        .map(|(atom, known)| known.marked(atom, if known.unknown { "?" } else { "" }))
        .collect()
}

/// What differs from an earlier state, relations first.
fn changes(before: &State, now: &State) -> Vec<String> {
    let news = now.iter().filter(|(atom, known)| {
        before.get(*atom).is_none_or(|earlier| earlier.unknown != known.unknown)
    });
    let news = news.map(|(atom, known)| (atom, known, if known.unknown { "?" } else { "+" }));
    let gone = before.iter().filter(|(atom, _)| !now.contains_key(*atom));
    let gone = gone.map(|(atom, known)| (atom, known, "-"));
    let mut all: Vec<_> = news.chain(gone).collect();
    all.sort_by_key(|(atom, ..)| Reverse(atom.args.len()));
    all.iter().map(|(atom, known, sign)| known.marked(atom, sign)).collect()
}

impl Known {
    fn marked(self, atom: &Atom, sign: &str) -> String {
        let star = if self.constrained && sign != "-" { "*" } else { "" };
        format!("{sign}{atom}{star}")
    }
}

/// Length and cost; a cost that is the length says nothing.
fn plan_head(steps: &[Step], cost: u64) -> String {
    let steps = steps.len();
    let cost = if cost == steps as u64 { String::new() } else { format!(", cost {cost}") };
    format!("{}{cost}:", counted(steps, "step"))
}

fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

fn texts<T: ToString>(items: &[T]) -> Vec<String> {
    items.iter().map(ToString::to_string).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{Deviation, ReplanCause, Verdict};

    fn atoms(texts: &[&str]) -> Vec<Atom> {
        let atom = |text: &&str| {
            let words: Vec<&str> = text.split(' ').collect();
            Atom::new(words[0], &words[1..])
        };
        texts.iter().map(atom).collect()
    }

    fn step(text: &str) -> Step {
        let words: Vec<&str> = text.split(' ').collect();
        Step::new(words[0], &words[1..])
    }

    fn state(facts: &[&str], unknown: &[&str], constrained: &[&str]) -> Event {
        let [facts, unknown, constrained] = [facts, unknown, constrained].map(atoms);
        Event::State { facts, unknown, constrained }
    }

    /// An episode with one event of each kind.
    fn events() -> Vec<(u64, Event)> {
        let unstack = || step("unstack green_block purple_block arm");
        let steps = ["put_down green_block arm", "unstack blue_block yellow_block arm"];
        let deviation = Deviation {
            missing: atoms(&["on red_block blue_block"]),
            seen: atoms(&["ontable red_block"]),
            unknown: Vec::new(),
        };
        let reason = "green_block has moved by 0.08 m (limits.target_moved_m_max = 0.03)";
        let waiting = "waiting for a settled scene: no object confirmed";
        let start = [
            "clear green_block",
            "clear red_block",
            "handempty arm",
            "on blue_block yellow_block",
            "on green_block purple_block",
            "on red_block blue_block",
            "above green_block purple_block",
        ];
        let later = [
            "clear purple_block",
            "clear red_block",
            "handfull arm",
            "holding green_block",
            "on blue_block yellow_block",
            "ontable red_block",
        ];
        let plan: Vec<Step> = [unstack()].into_iter().chain(steps.map(step)).collect();
        vec![
            (0, Event::Look { reason: waiting.to_owned() }),
            (4, state(&start, &[], &["handempty arm"])),
            (4, Event::Plan { steps: plan.clone(), cost: 3 }),
            (4, Event::Started { step: unstack() }),
            (22, Event::Done { step: unstack(), seconds: 1.74 }),
            (22, Event::Deviation(deviation.clone())),
            (22, state(&later, &["on red_block blue_block"], &["ontable red_block"])),
            (
                22,
                Event::Replan {
                    causes: vec![ReplanCause::Deviation(deviation)],
                    old: Some(step("put_down green_block arm")),
                },
            ),
            (22, Event::Plan { steps: plan[1..].to_vec(), cost: 7 }),
            (30, Event::Cancel { step: plan[1].clone(), reason: reason.to_owned() }),
            (
                31,
                Event::Failed { step: plan[1].clone(), reason: "slipped".to_owned(), failures: 2 },
            ),
            (31, state(&later, &["on red_block blue_block"], &[])),
            (40, Event::End(Verdict::Reached)),
        ]
    }

    fn told([colour, verbose]: [bool; 2], columns: usize) -> String {
        let mut narrator = Narrator::new(Style { colour, verbose, orders: vec!["above".into()] });
        let lines = events().into_iter().map(|(cycle, event)| {
            narrator.tell(7_000_000_000 + cycle * 100_000_000, cycle, &event, columns)
        });
        lines.collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn lines_fit_80_columns() {
        insta::assert_snapshot!(told([false, false], 80), @r"
        0.0 s #0    look    waiting for a settled scene: no object confirmed
        0.4 s #4    state   6 facts: (on blue_block yellow_block) … 5 more
        0.4 s #4    plan    3 steps: (unstack green_block purple_block arm) … 2 more
        0.4 s #4    skill   (unstack green_block purple_block arm)
        2.2 s #22   done    (unstack green_block purple_block arm) in 1.7 s
        2.2 s #22   differs expected (on red_block blue_block), observed
                            (ontable red_block)
        2.2 s #22   state   ?(on red_block blue_block) … 7 more
        2.2 s #22   replan  because expected (on red_block blue_block), observed
                            (ontable red_block); (put_down green_block arm) was next
        2.2 s #22   plan    2 steps, cost 7: (put_down green_block arm) … 1 more
        3.0 s #30   cancel  (put_down green_block arm): green_block has moved by 0.08
                            m (limits.target_moved_m_max = 0.03)
        3.1 s #31   failed  (put_down green_block arm): slipped (2 times)
        3.1 s #31   state   unchanged
        4.0 s #40   end     reached: the goal holds in a confirmed state
        ");
    }

    #[test]
    fn lines_fit_160_columns() {
        insta::assert_snapshot!(told([false, false], 160), @r"
        0.0 s #0    look    waiting for a settled scene: no object confirmed
        0.4 s #4    state   6 facts: (on blue_block yellow_block) (on green_block purple_block) (on red_block blue_block) (clear green_block) … 2 more
        0.4 s #4    plan    3 steps: (unstack green_block purple_block arm) (put_down green_block arm) (unstack blue_block yellow_block arm)
        0.4 s #4    skill   (unstack green_block purple_block arm)
        2.2 s #22   done    (unstack green_block purple_block arm) in 1.7 s
        2.2 s #22   differs expected (on red_block blue_block), observed (ontable red_block)
        2.2 s #22   state   ?(on red_block blue_block) -(on green_block purple_block) +(clear purple_block) +(handfull arm) +(holding green_block) … 3 more
        2.2 s #22   replan  because expected (on red_block blue_block), observed (ontable red_block); (put_down green_block arm) was next
        2.2 s #22   plan    2 steps, cost 7: (put_down green_block arm) (unstack blue_block yellow_block arm)
        3.0 s #30   cancel  (put_down green_block arm): green_block has moved by 0.08 m (limits.target_moved_m_max = 0.03)
        3.1 s #31   failed  (put_down green_block arm): slipped (2 times)
        3.1 s #31   state   unchanged
        4.0 s #40   end     reached: the goal holds in a confirmed state
        ");
    }

    #[test]
    fn everything_is_told_on_request() {
        insta::assert_snapshot!(told([false, true], 100), @r"
        0.0 s #0    look    waiting for a settled scene: no object confirmed
        0.4 s #4    state   6 facts: (on blue_block yellow_block) (on green_block purple_block)
                            (on red_block blue_block) (clear green_block) (clear red_block)
                            (handempty arm)*
        0.4 s #4    plan    3 steps: (unstack green_block purple_block arm) (put_down green_block arm)
                            (unstack blue_block yellow_block arm)
        0.4 s #4    skill   (unstack green_block purple_block arm)
        2.2 s #22   done    (unstack green_block purple_block arm) in 1.7 s
        2.2 s #22   differs expected (on red_block blue_block), observed (ontable red_block)
        2.2 s #22   state   ?(on red_block blue_block) -(on green_block purple_block)
                            +(clear purple_block) +(handfull arm) +(holding green_block)
                            +(ontable red_block)* -(clear green_block) -(handempty arm)
                            7 facts: (on blue_block yellow_block) (clear purple_block) (clear red_block)
                            (handfull arm) (holding green_block) (ontable red_block)*
                            ?(on red_block blue_block)
        2.2 s #22   replan  because expected (on red_block blue_block), observed (ontable red_block);
                            (put_down green_block arm) was next
        2.2 s #22   plan    2 steps, cost 7: (put_down green_block arm)
                            (unstack blue_block yellow_block arm)
        3.0 s #30   cancel  (put_down green_block arm): green_block has moved by 0.08 m
                            (limits.target_moved_m_max = 0.03)
        3.1 s #31   failed  (put_down green_block arm): slipped (2 times)
        3.1 s #31   state   unchanged
                            7 facts: (on blue_block yellow_block) (clear purple_block) (clear red_block)
                            (handfull arm) (holding green_block) (ontable red_block)
                            ?(on red_block blue_block)
        4.0 s #40   end     reached: the goal holds in a confirmed state
        ");
    }

    #[test]
    fn no_line_is_longer_than_the_terminal() {
        for verbose in [false, true] {
            for columns in 43..200 {
                let (plain, coloured) =
                    (told([false, verbose], columns), told([true, verbose], columns));
                assert!(plain.lines().all(|l| measure_text_width(l) <= columns), "{plain}");
                assert_eq!(console::strip_ansi_codes(&coloured), plain);
            }
        }
    }

    #[test]
    fn a_terminal_that_is_too_narrow_harms_nothing() {
        assert!(told([false, false], 0).lines().count() > events().len());
    }
}
