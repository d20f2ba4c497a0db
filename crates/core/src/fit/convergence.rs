//! When an iteration has arrived, and its best iterate in case that it does not.

use super::chain::Chain;
use super::node::C2Residual;
use crate::scalar::{LANES, Lane, few, lane, mask_bits};
use crate::space::Erased;

/// Defects of this many ε times the condition of the chords are rounding: an iteration that stops
/// improving below has converged.
const ROUNDING: f64 = 256.0 * f64::EPSILON;
/// But a residual above this is never called rounding.
const ROUNDING_MOST: f64 = 1e-9;
/// Velocities below this part of |d|/h count as rest: residuals are measured against it then.
const STANDSTILL: f64 = 1e-3;
/// Residuals are brought to this part of the tolerance: the jump of the acceleration at a knot is
/// about twelve times the residual.
const AIM: f64 = 1.0 / 40.0;
/// So many iterations without lowering the residual by 30 % are a standstill.
const PATIENCE: f64 = 8.0;
/// From this iteration on the best iterate is kept, in case that the iteration fails.
const EASY: usize = 8;

/// The residuals of eight iterations, and what they say.
pub struct Convergence {
    tol: Lane,
    aim: Lane,
    floor: Lane,
    /// Lanes that go on no longer.
    pub done: Lane,
    /// Lanes that have arrived.
    pub converged: Lane,
    /// The C² residual, relative to the largest speed.
    now: Lane,
    /// The same where a lane ended.
    pub residual: Lane,
    /// The longest outer handle |h u/3| where a lane is.
    pub handle: Lane,
    /// Residual evaluations.
    pub iterations: [usize; LANES],
    /// The second residual, the one to fall below, and how long that has not happened.
    second: Lane,
    mark: Lane,
    waiting: Lane,
}

impl Convergence {
    /// At the start; lanes in `idle` take no part.
    pub fn new(chain: &Chain, tol: Lane, idle: Lane) -> Self {
        let infinity = lane(f64::INFINITY);
        let rounding = (chain.condition * lane(ROUNDING)).min(lane(ROUNDING_MOST));
        Convergence {
            tol,
            aim: tol * lane(AIM),
            floor: rounding.max(tol),
            done: idle,
            converged: Lane::ZERO,
            now: infinity,
            residual: infinity,
            handle: Lane::ZERO,
            iterations: [0; LANES],
            second: infinity,
            mark: infinity,
            waiting: Lane::ZERO,
        }
    }

    /// Takes in the next residual.
    pub fn note(&mut self, iteration: usize, C2Residual { residual, speed, handle }: C2Residual, pace: Lane) {
        // A curve that stands still has neither speed nor residual; one that goes there and back may stand
        // still at every knot, where rounding is all that there is of its velocities.
        let speed = speed.max(pace * lane(STANDSTILL));
        let now = residual.simd_eq(Lane::ZERO).select(Lane::ZERO, residual / speed);
        self.now = now;
        self.residual = self.done.select(self.residual, now);
        self.handle = self.done.select(self.handle, handle);
        mask_bits(self.done).iter().zip(&mut self.iterations).for_each(|(done, i)| *i += usize::from(!done));
        let fallen = now.simd_lt(self.mark * lane(0.7));
        self.mark = fallen.select(now, self.mark);
        self.waiting = fallen.select(Lane::ZERO, self.waiting + Lane::ONE);
        if iteration == 2 {
            self.second = now;
        }
        let stagnant = self.waiting.simd_ge(lane(PATIENCE)) & now.simd_le(self.floor);
        let arrived = (now.simd_le(self.aim) | stagnant) & !self.done;
        self.converged |= arrived;
        self.done |= arrived;
    }

    /// There is no further iteration on some lanes.
    pub fn leave(&mut self, lanes: Lane) {
        self.converged |= self.now.simd_le(self.tol) & lanes & !self.done;
        self.done |= lanes;
    }

    /// There is no further iteration: what is within the tolerance has arrived.
    pub fn end(&mut self) {
        self.converged |= self.now.simd_le(self.tol) & !self.done;
    }

    /// Geometric mean of the contraction, from the second residual on: the first is that of u = 0.
    pub fn rate(&self) -> Lane {
        let (first, last) = (self.second.to_array(), self.residual.to_array());
        Lane::new(few(|l| {
            let steps = self.iterations[l].saturating_sub(2);
            if steps == 0 { 0.0 } else { (last[l] / first[l]).powf(1.0 / steps as f64) }
        }))
    }
}

/// The best iterate of each lane.
#[derive(Default)]
pub struct Best {
    u: Vec<Lane>,
    residual: Lane,
}

impl Best {
    /// Forgets everything.
    pub fn restart(&mut self) {
        self.u.clear();
        self.residual = lane(f64::INFINITY);
    }

    /// Keeps iterates that are better than what was kept; near the start only if there is no more to come.
    pub fn keep(&mut self, iteration: usize, max_iter: Lane, unknowns: &[Lane], state: &Convergence) {
        let mut better = state.now.simd_lt(self.residual) & !state.done;
        if iteration <= EASY {
            better &= max_iter.simd_le(lane(EASY as f64));
        }
        if better.none() {
            return;
        }
        if self.u.is_empty() {
            self.u.extend_from_slice(unknowns);
        }
        for (b, u) in self.u.iter_mut().zip(unknowns) {
            *b = better.select(*u, *b);
        }
        self.residual = better.select(state.now, self.residual);
    }

    /// Goes back to what was kept on lanes that failed, where that is better.
    pub fn restore(&self, space: &Erased, chain: &mut Chain, idle: Lane, state: &mut Convergence) {
        let failed = !state.converged & !idle;
        let better = failed & !state.residual.simd_le(self.residual) & self.residual.is_finite();
        if better.none() {
            return;
        }
        chain.update(space, |_, u| {
            u.iter_mut().zip(&self.u).for_each(|(u, b)| *u = better.select(*b, *u));
        });
        state.residual = better.select(self.residual, state.residual);
    }
}
