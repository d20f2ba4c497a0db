//! A line search: a step that increases the residual is halved until it does not.

use crate::scalar::{Lane, lane, mask_from};

/// The factor by which a mixed step may increase the residual.
const GROWTH_MIXED: f64 = 2.0;
/// The maximum number of halvings of a step; then the step is accepted.
const MAX_TRIES: f64 = 6.0;

/// Line searches, one per lane.
pub struct LineSearch {
    /// The residual that must not be exceeded.
    last: Lane,
    /// The number of halvings.
    tries: Lane,
    /// The quotient of that residual and the one before.
    pub contraction: Lane,
}

impl LineSearch {
    /// At the start.
    pub fn new() -> Self {
        LineSearch { last: lane(f64::INFINITY), tries: Lane::ZERO, contraction: Lane::ZERO }
    }

    /// The lanes whose last step must be halved. The residual of lanes in `mixed` may grow slightly.
    pub fn judge(&mut self, iteration: usize, residual: Lane, mixed: Lane, done: Lane) -> Lane {
        // The first two residuals do not belong to a step that could be judged.
        let early = mask_from(|_| iteration <= 2);
        let allowed = self.last * mixed.select(lane(GROWTH_MIXED), Lane::ONE);
        let worse = !residual.simd_le(allowed) & !done & self.tries.simd_lt(lane(MAX_TRIES)) & !early;
        self.contraction = worse.select(self.contraction, residual / self.last);
        self.last = worse.select(self.last, residual);
        self.tries = worse.select(self.tries + Lane::ONE, Lane::ZERO);
        worse
    }
}

/// Replaces the next step by minus half of the last one on the lanes that go back.
pub fn halve(worse: Lane, step: &[Lane], next: &mut [Lane]) {
    for (n, s) in next.iter_mut().zip(step) {
        *n = worse.select(*s * lane(-0.5), *n);
    }
}
