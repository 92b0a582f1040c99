//! What faults have begun and not yet ended: pushes, shifts, and objects in people's hands.

use nalgebra::Vector3;

use crate::config::STEPS_PER_SECOND;

/// Steps between two pushes of one knock: 0.6 s.
const PUSH_STEPS: u64 = STEPS_PER_SECOND * 6 / 10;
const PUSHES_MAX: u32 = 8;
/// Speed that a push gives to 5 cm blocks, in metres per second; larger ones get more.
const PUSH_SPEED_M_S: f64 = 0.62;
/// How much faster each further push is.
const PUSH_GROWTH: f64 = 1.25;

/// Mean speed of a shift, in metres per second.
const SHIFT_SPEED_M_S: f64 = 0.25;

/// A body, what it is to be pushed off (nothing: it only goes along), and its share of the speed.
type Pushed = (usize, Option<usize>, f64);

/// A push that is repeated, harder each time, until its objects are off what they stood on.
#[derive(Debug, Clone)]
pub(crate) struct Push {
    group: Vec<Pushed>,
    direction: Vector3<f64>,
    speed_m_s: f64,
    n_left: u32,
    steps_left: u64,
}

impl Push {
    /// The first push of a group of bodies; `size_m` is the edge length of what is pushed.
    pub(crate) fn new(group: Vec<Pushed>, direction: Vector3<f64>, size_m: f64) -> Self {
        let speed_m_s = PUSH_SPEED_M_S * (size_m / 0.05).sqrt();
        Self { group, direction, speed_m_s, n_left: PUSHES_MAX, steps_left: PUSH_STEPS }
    }

    /// The bodies that are pushed.
    pub(crate) fn bodies(&self) -> impl Iterator<Item = usize> {
        self.group.iter().map(|(idx, ..)| *idx)
    }

    /// Change of velocity that it gives to each body, in metres per second.
    pub(crate) fn changes_m_s(&self) -> impl Iterator<Item = (usize, Vector3<f64>)> {
        self.group.iter().map(|(idx, _, share)| (*idx, self.direction * self.speed_m_s * *share))
    }

    /// Counts one step down; whether a decision is due: push again, or be done.
    pub(crate) fn step(&mut self) -> bool {
        self.steps_left = self.steps_left.saturating_sub(1);
        self.steps_left == 0
    }

    /// Decides what a due push does, given what each object stands on now; whether it is to be given
    /// again.
    pub(crate) fn renew(&mut self, on: &dyn Fn(usize) -> Option<usize>) -> bool {
        let stands = |(idx, from, _): &Pushed| from.is_some_and(|from| on(*idx) == Some(from));
        let fallen = !self.group.iter().any(stands);
        self.group.retain(|pushed| pushed.1.is_none() || stands(pushed));
        self.n_left = if fallen { 0 } else { self.n_left - 1 };
        if self.n_left > 0 {
            self.steps_left = PUSH_STEPS;
            self.speed_m_s *= PUSH_GROWTH;
        }
        self.n_left > 0
    }

    /// Whether it will not be given again.
    pub(crate) fn is_done(&self) -> bool {
        self.n_left == 0
    }
}

/// An object in a person's hand.
#[derive(Debug, Clone)]
pub(crate) struct InHand {
    pub(crate) body: usize,
    pub(crate) steps_left: u64,
}

/// What faults have begun and not yet ended.
#[derive(Debug, Clone, Default)]
pub(crate) struct UnderWay {
    pub(crate) pushes: Vec<Push>,
    pub(crate) shifts: Vec<Shift>,
    pub(crate) in_hand: Vec<InHand>,
}

/// A group of bodies on its way to another place.
#[derive(Debug, Clone)]
pub(crate) struct Shift {
    pub(crate) group: Vec<usize>,
    by_m: Vector3<f64>,
    n_steps: u64,
    n_done: u64,
}

impl Shift {
    /// A shift that begins.
    pub(crate) fn new(group: Vec<usize>, by_m: Vector3<f64>) -> Self {
        let n_steps = (by_m.norm() / SHIFT_SPEED_M_S * STEPS_PER_SECOND as f64).ceil() as u64;
        Self { group, by_m, n_steps, n_done: 0 }
    }

    /// Whether it has taken all its way.
    pub(crate) fn is_done(&self) -> bool {
        self.n_done >= self.n_steps
    }

    /// The way of the next step: slow at first and at the end.
    pub(crate) fn next(&mut self) -> Vector3<f64> {
        let eased = |n: u64| {
            let share = n as f64 / self.n_steps as f64;
            share * share * (3.0 - 2.0 * share)
        };
        let way = self.by_m * (eased(self.n_done + 1) - eased(self.n_done));
        self.n_done += 1;
        way
    }
}
