//! The panel beside the frame: caption, instruction, goal, plan, what the arrows mean.

use super::area::{Area, Point};
use super::canvas::{Canvas, Line};
use super::text::{Face, Fonts, Style};
use super::{EdgeKind, PictureInput, RemarkKind, edges, palette};
use crate::logic::Truth;

/// Width of the panel.
pub(super) const WIDTH: u32 = 540;

const PAD: f32 = 32.0;
const TITLE: Style = Style { face: Face::Sans, size: 38.0, colour: palette::TEXT };
const KEY: Style = Style { face: Face::Sans, size: 22.0, colour: palette::MUTED };
const VALUE: Style = Style { face: Face::Mono, size: 22.0, colour: palette::TEXT };
const WORDS: Style = Style { face: Face::Sans, size: 26.0, colour: palette::TEXT };
const CODE: Style = Style { face: Face::Mono, size: 19.0, colour: palette::TEXT };
/// Height of a line of goal or plan.
const LINE: f32 = 32.0;
/// Middle of the small letters below the top of a line.
const MARK: f32 = 11.5;
/// Most goal parts that are listed.
const GOALS_MAX: usize = 8;
/// Most remarks that are listed.
const REMARKS_MAX: usize = 8;
/// Most lines of the instruction.
const INSTRUCTION_LINES_MAX: usize = 4;

/// What an arrow of each look stands for, with its colour, and whether it is dashed.
type Legend<'a> = Vec<(&'a str, [u8; 3], bool)>;

fn legend<'a>(input: &PictureInput<'a>) -> Legend<'a> {
    let predicates = edges::predicates(input.edges).into_iter().enumerate();
    let mut legend: Legend<'a> =
        predicates.map(|(idx, name)| (name, palette::edge(idx), false)).collect();
    let any = |kind| input.edges.iter().any(|edge| edge.kind == kind);
    if any(EdgeKind::Wrong) {
        legend.push(("wrong", palette::WRONG, false));
    }
    if any(EdgeKind::Missing) {
        legend.push(("missing", palette::MISSING, true));
    }
    legend
}

/// A pen that moves down the panel.
struct Pen<'c, 'f> {
    canvas: &'c mut Canvas,
    fonts: &'f Fonts,
    x: f32,
    y: f32,
    width: f32,
}

/// Draws the panel from column `left` to the right edge.
pub(super) fn draw(canvas: &mut Canvas, input: &PictureInput<'_>, fonts: &Fonts, left: f32) {
    let height = canvas.height();
    canvas.fill(&Area::new(left, 0.0, WIDTH as f32 + 2.0, height), 0.0, palette::PANEL, 1.0);
    canvas.fill(&Area::new(left, 0.0, 2.0, height), 0.0, palette::RULE, 1.0);
    let width = WIDTH as f32 - 2.0 * PAD;
    let mut pen = Pen { canvas, fonts, x: left + PAD, y: PAD - 6.0, width };
    if !input.title.is_empty() {
        pen.line(input.title, TITLE, 50.0);
    }
    pen.caption(input.caption);
    pen.instruction(input.instruction);
    pen.goal(input);
    pen.remarks(input);
    let legend = legend(input);
    let legend_height = if legend.is_empty() { 0.0 } else { 66.0 };
    pen.plan(input, height - PAD - legend_height);
    if !legend.is_empty() {
        pen.y = height - PAD - 36.0;
        pen.legend(&legend);
    }
}

impl Pen<'_, '_> {
    /// One line of text, cut at the panel's edge.
    fn line(&mut self, text: &str, style: Style, advance: f32) {
        let text = self.fonts.cut(text, style, self.width);
        self.fonts.draw(self.canvas, &text, (self.x, self.y), style);
        self.y += advance;
    }

    fn caption(&mut self, caption: &[(String, String)]) {
        for (key, value) in caption {
            self.fonts.draw(self.canvas, &self.fonts.cut(key, KEY, 96.0), (self.x, self.y), KEY);
            let value = self.fonts.cut(value, VALUE, self.width - 104.0);
            self.fonts.draw(self.canvas, &value, (self.x + 104.0, self.y), VALUE);
            self.y += 29.0;
        }
    }

    fn instruction(&mut self, instruction: &str) {
        if instruction.trim().is_empty() {
            return;
        }
        self.heading("INSTRUCTION", "");
        let lines = self.fonts.wrap(instruction.trim(), WORDS, self.width, INSTRUCTION_LINES_MAX);
        for line in lines {
            self.line(&line, WORDS, 33.0);
        }
    }

    /// A rule, a small title and a remark at the right.
    fn heading(&mut self, title: &str, remark: &str) {
        self.y += 16.0;
        let rule = Area::new(self.x, self.y, self.width, 1.5);
        self.canvas.fill(&rule, 0.0, palette::RULE, 1.0);
        self.y += 13.0;
        let style = Style { size: 19.0, ..KEY };
        self.fonts.draw(self.canvas, title, (self.x, self.y), style);
        let x = self.x + self.width - self.fonts.width(remark, style);
        self.fonts.draw(self.canvas, remark, (x, self.y), style);
        self.y += 30.0;
    }

    fn goal(&mut self, input: &PictureInput<'_>) {
        if input.goal.is_empty() {
            return;
        }
        let n_held = input.goal.iter().filter(|part| part.holds.is_true()).count();
        self.heading("GOAL", &format!("{n_held} of {} hold", input.goal.len()));
        let n_shown = shown(input.goal.len(), GOALS_MAX);
        for part in &input.goal[..n_shown] {
            let middle = (self.x + 9.0, self.y + MARK);
            match part.holds {
                Truth::True => self.check(middle, palette::ACCENT),
                Truth::False => self.canvas.disc(middle, 4.0, palette::MUTED, 1.0),
                Truth::Unknown => self.canvas.disc(middle, 5.0, palette::DOUBT, 1.0),
            }
            let colour = if part.holds.is_true() { palette::ACCENT } else { palette::TEXT };
            self.entry(&part.text, Style { colour, ..CODE });
        }
        self.more(input.goal.len() - n_shown);
    }

    fn remarks(&mut self, input: &PictureInput<'_>) {
        if input.remarks.is_empty() {
            return;
        }
        let count = |kind| input.remarks.iter().filter(|remark| remark.kind == kind).count();
        let counts = [
            (count(RemarkKind::Wrong), "wrong"),
            (count(RemarkKind::Missing), "missing"),
            (count(RemarkKind::Anomaly), "in doubt"),
        ];
        let counts = counts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}"));
        self.heading("FACTS", &counts.collect::<Vec<_>>().join(", "));
        let n_shown = shown(input.remarks.len(), REMARKS_MAX);
        for remark in &input.remarks[..n_shown] {
            let (x, y) = (self.x + 9.0, self.y + MARK);
            match remark.kind {
                RemarkKind::Wrong => {
                    let (a, line) = (5.5, Line::unbroken(3.0, palette::WRONG, 1.0));
                    self.canvas.stroke(&[(x - a, y - a), (x + a, y + a)], &line);
                    self.canvas.stroke(&[(x - a, y + a), (x + a, y - a)], &line);
                }
                RemarkKind::Missing => {
                    let line = Line::unbroken(3.0, palette::MISSING, 1.0);
                    self.canvas.stroke(&[(x - 6.0, y), (x + 6.0, y)], &line);
                }
                RemarkKind::Anomaly => self.canvas.disc((x, y), 5.0, palette::DOUBT, 1.0),
            }
            self.entry(&remark.text, CODE);
        }
        self.more(input.remarks.len() - n_shown);
    }

    /// The steps around the running one, as many as fit above `bottom`.
    fn plan(&mut self, input: &PictureInput<'_>, bottom: f32) {
        if input.plan.is_empty() {
            return;
        }
        let n_steps = input.plan.len();
        let remark = match input.step_idx {
            Some(step_idx) if step_idx < n_steps => format!("step {} of {n_steps}", step_idx + 1),
            _ => format!("{n_steps} steps"),
        };
        self.heading("PLAN", &remark);
        let lines_max = ((bottom - self.y) / LINE).floor().max(1.0) as usize;
        let current = input.step_idx.unwrap_or(0).min(n_steps - 1);
        // One done step stays in view; one line is kept for what follows.
        let first = if n_steps <= lines_max { 0 } else { current.saturating_sub(1) };
        let n_shown = shown(n_steps - first, lines_max);
        for (idx, step) in input.plan.iter().enumerate().skip(first).take(n_shown) {
            let is_now = input.step_idx == Some(idx);
            let is_done = input.step_idx.is_some_and(|now| idx < now);
            let middle = (self.x + 9.0, self.y + MARK);
            if is_now {
                let row = Area::new(self.x - 10.0, self.y - 5.0, self.width + 20.0, LINE);
                self.canvas.fill(&row, 8.0, palette::ACCENT, 0.16);
                let tip = (middle.0 + 8.0, middle.1);
                self.canvas.arrow_head(tip, (1.0, 0.0), 14.0, palette::ACCENT, 1.0);
            } else if is_done {
                self.check(middle, palette::MUTED);
            } else {
                self.canvas.disc(middle, 3.0, palette::MUTED, 1.0);
            }
            let colour = match (is_now, is_done) {
                (true, _) => palette::ACCENT,
                (_, true) => palette::MUTED,
                _ => palette::TEXT,
            };
            self.entry(step, Style { colour, ..CODE });
        }
        self.more(n_steps - first - n_shown);
    }

    /// One line of a list, right of its mark.
    fn entry(&mut self, text: &str, style: Style) {
        let text = self.fonts.cut(text, style, self.width - 30.0);
        self.fonts.draw(self.canvas, &text, (self.x + 30.0, self.y), style);
        self.y += LINE;
    }

    fn more(&mut self, n_more: usize) {
        if n_more > 0 {
            self.entry(&format!("and {n_more} more"), Style { size: 21.0, ..KEY });
        }
    }

    fn check(&mut self, (x, y): Point, colour: [u8; 3]) {
        let points = [(x - 7.0, y + 1.0), (x - 2.0, y + 6.0), (x + 7.0, y - 6.0)];
        self.canvas.stroke(&points, &Line::unbroken(3.0, colour, 1.0));
    }

    /// One arrow with its name for each look, in one line.
    fn legend(&mut self, legend: &Legend<'_>) {
        let rule = Area::new(self.x, self.y - 16.0, self.width, 1.5);
        self.canvas.fill(&rule, 0.0, palette::RULE, 1.0);
        let right = self.x + self.width;
        let mut x = self.x;
        for (name, colour, dashed) in legend {
            let (colour, y) = (*colour, self.y + MARK);
            let text_width = self.fonts.width(name, CODE);
            if x + 44.0 + text_width > right {
                break;
            }
            self.canvas.disc((x + 4.0, y), 4.0, colour, 1.0);
            let line: &[[f32; 2]] = if *dashed { &[[12.0, 15.0]] } else { &[[4.0, 22.0]] };
            for [from, to] in line {
                let line = Line::unbroken(3.0, colour, 1.0);
                self.canvas.stroke(&[(x + from, y), (x + to, y)], &line);
            }
            self.canvas.arrow_head((x + 34.0, y), (1.0, 0.0), 13.0, colour, 1.0);
            self.fonts.draw(self.canvas, name, (x + 44.0, self.y), CODE);
            x += 44.0 + text_width + 22.0;
        }
    }
}

/// How many of `n` entries fit into `n_max` lines when the rest is summed up in one line.
fn shown(n: usize, n_max: usize) -> usize {
    if n <= n_max { n } else { n_max.saturating_sub(1) }
}
