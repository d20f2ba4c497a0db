//! Convergence of an iteration, and its best iterate if it fails.

use super::chain::Chain;
use super::node::C2Residual;
use crate::scalar::{LANES, Lane, few, lane, mask_bits};
use crate::space::Erased;

/// Residuals below this many ε times the condition of the chords are rounding errors: an iteration that stops
/// improving below this limit has converged.
const ROUNDING: f64 = 256.0 * f64::EPSILON;
/// Residuals above this limit never count as rounding errors.
const ROUNDING_MOST: f64 = 1e-9;
/// Velocities below this fraction of |d|/h count as zero: residuals are then relative to |d|/h.
const STANDSTILL: f64 = 1e-3;
/// Residuals are reduced to this fraction of the tolerance: the jump of the acceleration at a knot is about twelve
/// times the residual.
const AIM: f64 = 1.0 / 40.0;
/// An iteration stagnates if this many steps do not reduce the residual by 30 %.
const PATIENCE: f64 = 8.0;
/// From this iteration on, the best iterate is stored in case the iteration fails.
const EASY: usize = 8;

/// The residuals of the iterations of all lanes, and the conclusions from them.
pub struct Convergence {
    tol: Lane,
    aim: Lane,
    floor: Lane,
    /// Lanes that have stopped.
    pub done: Lane,
    /// Lanes that have converged.
    pub converged: Lane,
    /// The C² residual, relative to the largest speed.
    now: Lane,
    /// The residual at which a lane stopped.
    pub residual: Lane,
    /// The longest outer handle |h u/3| of the current iterate of each lane.
    pub handle: Lane,
    /// Residual evaluations.
    pub iterations: [usize; LANES],
    /// The second residual as a reference, and the number of iterations that have not fallen below it.
    second: Lane,
    mark: Lane,
    waiting: Lane,
}

impl Convergence {
    /// The initial state. Lanes in `idle` do not take part.
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

    /// Records the next residual.
    pub fn note(&mut self, iteration: usize, C2Residual { residual, speed, handle }: C2Residual, pace: Lane) {
        // A constant curve has neither speed nor residual. A curve that turns back may have zero speed at every knot,
        // where its velocities are rounding errors only.
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

    /// Stops some lanes.
    pub fn leave(&mut self, lanes: Lane) {
        self.converged |= self.now.simd_le(self.tol) & lanes & !self.done;
        self.done |= lanes;
    }

    /// Stops all lanes; those within the tolerance have converged.
    pub fn end(&mut self) {
        self.converged |= self.now.simd_le(self.tol) & !self.done;
    }

    /// Geometric mean of the contraction, from the second residual on, since the first is that of u = 0.
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
    /// Removes all stored iterates.
    pub fn restart(&mut self) {
        self.u.clear();
        self.residual = lane(f64::INFINITY);
    }

    /// Stores iterates that are better than the stored ones; near the start only if the iteration ends.
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

    /// Restores the stored iterates on lanes that failed, if they are better.
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
