//! A push that is repeated, harder each time, until its objects are off what they stood on.

use nalgebra::Vector3;

/// Steps between two pushes of one knock: 0.6 s.
const PUSH_STEPS: u64 = crate::config::STEPS_PER_SECOND * 6 / 10;
const PUSHES_MAX: u32 = 8;
/// Speed that a push gives to 5 cm blocks, in metres per second; larger ones get more.
const PUSH_SPEED_M_S: f64 = 0.62;
/// How much faster each further push is.
const PUSH_GROWTH: f64 = 1.25;

/// A body, what it is to be pushed off (nothing: it only goes along), and its share of the speed.
type Pushed = (usize, Option<usize>, f64);

/// A push under way.
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
