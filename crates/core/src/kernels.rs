//! The loops over knots and samples, for every space: the layer above `fit` and `curve`.

use crate::curve::{Job, Moving};
use crate::fit::{C2Residual, Chain, ChainEnds, NodeVectors, Run, Visit, sweep, sweep_by_table};
use crate::scalar::{LANES, Lane};
use crate::space::{Covered, Erased, Evaluation, Kernels, Space};

/// Whether every space calls the one copy of these loops through its table. Modules for browsers are small rather than
/// fast: loops for each space would be two thirds of them.
const SMALL: bool = cfg!(target_family = "wasm");

impl<M: Space> Kernels for M {
    fn walk(&self, chain: &mut Chain, runs: &[Run; LANES]) {
        if M::HOT && !SMALL { chain.walk(self, runs) } else { chain.walk_by_table(&Erased(self), runs) }
    }
    fn walk_again(&self, chain: &mut Chain, runs: &[Run; LANES], visit: Visit) {
        if M::HOT && !SMALL {
            chain.walk_again(self, runs, visit)
        } else {
            chain.walk_again_by_table(&Erased(self), runs, visit)
        }
    }
    fn sweep(
        &self,
        chain: &mut Chain,
        ends: &ChainEnds,
        u: &[Lane],
        r: &mut [Lane],
        work: &mut NodeVectors<Lane>,
        at_rest: Lane,
    ) -> C2Residual {
        if M::HOT && !SMALL {
            sweep(self, chain, ends, u, r, work, at_rest)
        } else {
            sweep_by_table(&Erased(self), chain, ends, u, r, work, at_rest)
        }
    }
    fn samples(&self, job: &Job, out: &mut [f64]) {
        self.evaluate_with(SampleCall { job, out });
    }
    fn push(&self, moving: &Moving, motions: &[f64], out: &mut [f64]) -> bool {
        let mut done = true;
        if moving.times.count > 0 {
            self.evaluate_with(PushCall { moving, motions, out, done: &mut done });
        }
        done
    }
    fn pull(&self, moving: &Moving, cotangents: &[f64], out: &mut [f64]) -> bool {
        let mut done = true;
        if moving.times.count > 0 {
            self.evaluate_with(PullCall { moving, cotangents, out, done: &mut done });
        }
        done
    }
}

/// A block of samples and where its results go.
struct SampleCall<'a> {
    job: &'a Job<'a>,
    out: &'a mut [f64],
}

impl Evaluation for SampleCall<'_> {
    fn direct<M: Space>(self, space: &M) {
        if M::HOT && !SMALL {
            self.job.run(space, self.out)
        } else {
            self.job.run_by_table(&Erased(space), self.out)
        }
    }
    fn covered<C: Covered>(self, space: &C) {
        if SMALL {
            // Rates in the frame of the body come from the covering space only, and are not part of such modules.
            assert!(!self.job.quantity.is_of_body());
            return self.job.run_by_table(&Erased(space), self.out);
        }
        self.job.run_covered(space, self.out);
    }
}

/// Motions of the control points, and where the motions of samples go.
struct PushCall<'a> {
    moving: &'a Moving<'a>,
    motions: &'a [f64],
    out: &'a mut [f64],
    done: &'a mut bool,
}

impl Evaluation for PushCall<'_> {
    fn direct<M: Space>(self, space: &M) {
        if M::HOT && !SMALL {
            *self.done = self.moving.push(space, self.motions, self.out);
        } else {
            *self.done = self.moving.push_by_table(&Erased(space), self.motions, self.out);
        }
    }
    fn covered<C: Covered>(self, space: &C) {
        *self.done = self.moving.push_covered(space, self.motions, self.out);
    }
}

/// Cotangent vectors of samples, and where those of the control points go.
struct PullCall<'a> {
    moving: &'a Moving<'a>,
    cotangents: &'a [f64],
    out: &'a mut [f64],
    done: &'a mut bool,
}

impl Evaluation for PullCall<'_> {
    fn direct<M: Space>(self, space: &M) {
        if M::HOT && !SMALL {
            *self.done = self.moving.pull(space, self.cotangents, self.out);
        } else {
            *self.done = self.moving.pull_by_table(&Erased(space), self.cotangents, self.out);
        }
    }
    fn covered<C: Covered>(self, space: &C) {
        *self.done = self.moving.pull_covered(space, self.cotangents, self.out);
    }
}
