//! An episode of the simulator, judged at its end by what really was: every step that was started, and
//! how long each fault went unnoticed and was not made good.

use std::collections::BTreeSet;

use super::diary::{Diary, Page};
use super::scoring::{Words, with_unseen};
use crate::hardware::{GroundTruth, TrueDispatch, TrueHistory, TrueMoment};
use crate::logic::{Bindings, Facts, Universe, bind, unsatisfied};
use crate::metrics::{DispatchAudit, FaultRecord, UntrueDispatch};
use crate::pddl::{Action, Atom, Name, Step, Typed};

/// What an episode is judged by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Audit<'a> {
    /// The domain, and all objects of the episode.
    pub(super) words: Words<'a>,
    /// What really was.
    pub(super) history: &'a TrueHistory,
    /// What was believed and planned.
    pub(super) diary: &'a Diary,
    /// For how long a change must be seen to be believed, seconds.
    pub(super) confirm_s: f64,
    /// Frames per second.
    pub(super) rate_hz: f64,
}

/// Whether the loop noticed a fault.
enum Noticed {
    /// There was nothing to notice: it made nothing false that was believed.
    Nothing,
    /// From this frame on nothing is believed any more that it has made false.
    At(u64),
    /// That never came.
    Never,
}

/// Every object of an episode: those that were seen, and those of true facts that nobody has seen.
pub(super) fn every_object(words: Words<'_>, history: &TrueHistory, diary: &Diary) -> Vec<Typed> {
    let seen = diary.pages().iter().flat_map(|page| &page.objects);
    let seen: BTreeSet<&Typed> = seen.chain(words.objects).collect();
    let objects = seen.into_iter().cloned().collect();
    let moments = history.moments.iter().map(|moment| &moment.truth);
    moments.fold(objects, |objects, truth| with_unseen(objects, words.domain, truth))
}

impl Audit<'_> {
    /// Judges every step that was started.
    pub(super) fn dispatches(&self) -> DispatchAudit {
        let dispatches = &self.history.dispatches;
        let against_truth: Vec<UntrueDispatch> =
            dispatches.iter().filter_map(|dispatch| self.untrue(dispatch)).collect();
        let against_evidence = against_truth.iter().filter(|d| d.is_against_evidence);
        DispatchAudit {
            n_dispatches: dispatches.len() as u64,
            n_against_evidence: against_evidence.count() as u64,
            against_truth,
        }
    }

    /// What is wrong with a step, where its precondition did not really hold.
    fn untrue(&self, dispatch: &TrueDispatch) -> Option<UntrueDispatch> {
        let TrueDispatch { frame_sequence: frame, step } = dispatch;
        let action = self.words.domain.action(step.action.as_str())?;
        let bindings = bind(action, &step.args)?;
        let moment = self.history.at(*frame)?;
        if !self.is_untrue(moment, step, (action, &bindings)) {
            return None;
        }
        let before = self.history.moments.iter().rev();
        let before = before.skip_while(|moment| moment.frame_sequence > *frame);
        let untrue = before.take_while(|m| self.is_untrue(m, step, (action, &bindings)));
        let frames =
            |first: Option<&TrueMoment>| first.map_or(0, |first| frame + 1 - first.frame_sequence);
        let plain = untrue.clone().take_while(|m| is_in_sight(m, step));
        let universe = Universe { types: &self.words.domain.types, objects: self.words.objects };
        let facts = self.words.facts(&moment.truth);
        let unmet =
            unsatisfied(&action.precondition, &bindings, &universe, &|atom| facts.truth(atom));
        Some(UntrueDispatch {
            frame: *frame,
            step: step.to_string(),
            unmet,
            is_against_evidence: self.is_believed_after(frames(plain.last())),
            untrue_for_frames: frames(untrue.last()),
        })
    }

    /// Whether a change is believed after so many frames, of which the first counts for no time.
    fn is_believed_after(&self, n_frames: u64) -> bool {
        let seconds = n_frames.saturating_sub(1) as f64 / self.rate_hz;
        n_frames > 0 && seconds >= self.confirm_s
    }

    /// Whether the precondition of a step certainly did not hold.
    fn is_untrue(
        &self,
        TrueMoment { truth, .. }: &TrueMoment,
        step: &Step,
        (action, bindings): (&Action, &Bindings),
    ) -> bool {
        let is_sure = concerned(truth, step).is_disjoint(&truth.unsettled);
        is_sure && self.words.really_holds(&action.precondition, bindings, truth) == Some(false)
    }

    /// Writes into each record when the loop noticed the fault, and when it had made it good.
    pub(super) fn follow(&self, records: &mut [FaultRecord]) {
        for record in records.iter_mut().filter(|record| record.happened) {
            let Some(before) = record.frame.checked_sub(1) else { continue };
            let from = match self.noticed(before, record) {
                Noticed::Nothing => record.frame,
                Noticed::At(frame) => {
                    record.noticed_after_frames = Some(frame - record.frame);
                    frame
                }
                Noticed::Never => continue,
            };
            let recovered = self.further_than(before, from);
            record.recovered_after_frames = recovered.map(|frame| frame - record.frame);
        }
    }

    /// From which frame on nothing is believed that the fault has made false.
    fn noticed(&self, before: u64, record: &FaultRecord) -> Noticed {
        self.unnoticed(before, record).unwrap_or(Noticed::Nothing)
    }

    /// The same; `None` when it made nothing false that was believed.
    fn unnoticed(&self, before: u64, record: &FaultRecord) -> Option<Noticed> {
        let objects: BTreeSet<Name> = record.objects.iter().map(Name::new).collect();
        let is_at_rest = |truth: &GroundTruth| objects.is_disjoint(&truth.unsettled);
        let then = self.history.moments.iter();
        let mut then = then.filter(|m| m.frame_sequence >= record.frame && is_at_rest(&m.truth));
        let after = then.next()?;
        let old = self.words.facts(&self.history.at(before)?.truth);
        let new = self.words.facts(&after.truth);
        let changed: Vec<&Atom> =
            old.known.symmetric_difference(&new.known).filter(|a| is_told(a, after)).collect();
        let is_right = |page: &Page| {
            let truth = self.history.at(page.frame).map(|m| self.words.facts(&m.truth));
            truth.is_some_and(|truth| changed.iter().all(|atom| !contradicts(page, &truth, atom)))
        };
        let at_once = self.diary.at(after.frame_sequence)?;
        if changed.iter().all(|atom| !contradicts(at_once, &new, atom)) {
            return None;
        }
        let later = self.diary.pages().iter().filter(|p| p.frame > after.frame_sequence);
        let noticed = later.clone().find(|page| is_right(page));
        Some(noticed.map_or(Noticed::Never, |page| Noticed::At(page.frame)))
    }

    /// The first frame from `from` on with fewer steps left than in the frame `before`.
    fn further_than(&self, before: u64, from: u64) -> Option<u64> {
        let left = self.diary.at(before)?.steps_left?;
        let is_further =
            |page: &Page| page.steps_left.is_some_and(|steps| steps < left || steps == 0);
        if self.diary.at(from).is_some_and(is_further) {
            return Some(from);
        }
        let pages = self.diary.pages().iter();
        pages.filter(|page| page.frame > from).find(|page| is_further(page)).map(|page| page.frame)
    }
}

/// Whether all that a step concerns is in sight. An object that was taken out of the world is: its place
/// shows that it is not there.
fn is_in_sight(TrueMoment { truth, seen, .. }: &TrueMoment, step: &Step) -> bool {
    concerned(truth, step).is_subset(seen)
}

/// Whether the truth says of an atom whether it holds.
fn is_told(atom: &Atom, TrueMoment { truth, .. }: &TrueMoment) -> bool {
    let mut alike = truth.look_alikes.iter().flatten();
    !alike.any(|name| atom.args.contains(name))
        && atom.args.iter().all(|arg| !truth.unsettled.contains(arg))
}

/// The objects of a step that are there, and those of which true facts say something together with them.
fn concerned(truth: &GroundTruth, step: &Step) -> BTreeSet<Name> {
    let is_named = |atom: &&Atom| atom.args.iter().any(|arg| step.args.contains(arg));
    let others = truth.facts.iter().filter(is_named).flat_map(|atom| &atom.args);
    let all = step.args.iter().chain(others);
    all.filter(|name| truth.objects.contains(*name)).cloned().collect()
}

/// Whether what is believed of an atom is not so.
fn contradicts(page: &Page, truth: &Facts, atom: &Atom) -> bool {
    let believed = page.belief.truth(atom);
    let is_there = |arg: &Name| page.objects.iter().any(|object| object.name == *arg);
    if truth.known.contains(atom) {
        believed.is_false() && atom.args.iter().all(is_there)
    } else {
        believed.is_true()
    }
}

#[cfg(test)]
mod tests;
