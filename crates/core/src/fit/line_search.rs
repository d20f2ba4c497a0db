//! How far a step goes: half of one that makes the residual worse is taken back, and half of that again.

use crate::scalar::{Lane, lane, mask_from};

/// By how much a mixed step may let the residual grow before it is taken back.
const GROWTH_MIXED: f64 = 2.0;
/// How often a step is halved before it is taken as it is.
const MAX_TRIES: f64 = 6.0;

/// Eight line searches.
pub struct LineSearch {
    /// The residual that must not be exceeded.
    last: Lane,
    /// How often the step was taken back.
    tries: Lane,
    /// That residual's quotient by the one before.
    pub contraction: Lane,
}

impl LineSearch {
    /// At the start.
    pub fn new() -> Self {
        LineSearch { last: lane(f64::INFINITY), tries: Lane::ZERO, contraction: Lane::ZERO }
    }

    /// The lanes whose last step must be taken back in part; lanes in `mixed` may grow a little.
    pub fn judge(&mut self, iteration: usize, residual: Lane, mixed: Lane, done: Lane) -> Lane {
        // The first two residuals belong to no step that could be judged.
        let early = mask_from(|_| iteration <= 2);
        let allowed = self.last * mixed.select(lane(GROWTH_MIXED), Lane::ONE);
        let worse = !residual.simd_le(allowed) & !done & self.tries.simd_lt(lane(MAX_TRIES)) & !early;
        self.contraction = worse.select(self.contraction, residual / self.last);
        self.last = worse.select(self.last, residual);
        self.tries = worse.select(self.tries + Lane::ONE, Lane::ZERO);
        worse
    }
}

/// Replaces the next step by half of the last one, backwards, where it is to be taken back.
pub fn halve(worse: Lane, step: &[Lane], next: &mut [Lane]) {
    for (n, s) in next.iter_mut().zip(step) {
        *n = worse.select(*s * lane(-0.5), *n);
    }
}
