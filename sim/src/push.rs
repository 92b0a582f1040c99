//! A push that is repeated, harder each time, until its object is off what it stood on.

use nalgebra::Vector3;

/// Steps between two pushes of one knock: 0.6 s.
const PUSH_STEPS: u64 = crate::config::STEPS_PER_SECOND * 6 / 10;
const PUSHES_MAX: u32 = 8;
/// Speed that a push gives to 5 cm blocks, in metres per second; larger ones get more.
const PUSH_SPEED_M_S: f64 = 0.62;
/// How much faster each further push is.
const PUSH_GROWTH: f64 = 1.25;

/// A push under way.
#[derive(Debug, Clone)]
pub(crate) struct Push {
    /// The object and what stands on it.
    pub(crate) group: Vec<usize>,
    /// What the object stood on.
    from: usize,
    direction: Vector3<f64>,
    speed_m_s: f64,
    n_left: u32,
    steps_left: u64,
}

impl Push {
    /// The first push of a group of bodies off the body `from`; `size_m` is the object's edge length.
    pub(crate) fn new(
        group: Vec<usize>,
        from: usize,
        direction: Vector3<f64>,
        size_m: f64,
    ) -> Self {
        let speed_m_s = PUSH_SPEED_M_S * (size_m / 0.05).sqrt();
        Self { group, from, direction, speed_m_s, n_left: PUSHES_MAX, steps_left: PUSH_STEPS }
    }

    /// Change of velocity that it gives to each body, in metres per second.
    pub(crate) fn change_m_s(&self) -> Vector3<f64> {
        self.direction * self.speed_m_s
    }

    /// Counts one step down; whether a decision is due: push again, or be done.
    pub(crate) fn step(&mut self) -> bool {
        self.steps_left = self.steps_left.saturating_sub(1);
        self.steps_left == 0
    }

    /// Decides what a due push does, given what its object stands on now; whether it is to be given
    /// again.
    pub(crate) fn renew(&mut self, on: Option<usize>) -> bool {
        let fallen = on != Some(self.from);
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
