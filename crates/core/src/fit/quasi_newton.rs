//! Newton's method with the matrix T of flat space in transported frames, and Anderson mixing.
//!
//! `T δu = 3r` is one tridiagonal solve per sweep. It is exact in flat space; on a curved space the iteration
//! contracts by a factor that grows with the squared step between points. Where that factor is not small, Anderson
//! mixing (type II; Walker & Ni 2011) of the last few updates accelerates the iteration.

use super::chain::Chain;
use super::end_kind::ChainEnds;
use super::tridiagonal::Tridiagonal;
use crate::scalar::{Lane, lane};
use crate::space::Erased;

/// The number of earlier updates that are mixed.
const DEPTH: usize = 5;
/// The contraction above which mixing is worth its additional vectors.
const MIX_ABOVE: f64 = 0.15;

/// `step ← T⁻¹ 3r` for the residual in `chain.r`.
pub fn update(space: &Erased, chain: &mut Chain, ends: &ChainEnds, t: &mut Tridiagonal, step: &mut [Lane]) {
    t.solve(space, chain, ends, lane(3.0), step);
}

/// The history of Anderson mixing. A lane takes part from the iteration at which its own contraction requires it.
/// Before that its columns are zero, so that lanes stay independent.
#[derive(Default)]
pub struct Anderson {
    /// Differences of updates, and of iterates plus updates, newest first.
    columns: Vec<[Vec<Lane>; 2]>,
    used: usize,
    previous: [Vec<Lane>; 2],
    active: Lane,
}

impl Anderson {
    /// Removes the history.
    pub fn restart(&mut self) {
        self.used = 0;
        self.active = Lane::ZERO;
        self.previous.iter_mut().for_each(Vec::clear);
    }

    /// Removes the history of some lanes, whose next step is not mixed.
    pub fn forget(&mut self, lanes: Lane) {
        for [f, g] in &mut self.columns[..self.used] {
            for x in f.iter_mut().chain(g) {
                *x = lanes.select(Lane::ZERO, *x);
            }
        }
        self.active = lanes.select(Lane::ZERO, self.active);
    }

    /// The lanes that take part in mixing.
    pub fn active(&self) -> Lane {
        self.active
    }

    /// Replaces the update f(u) by the mixed one. `contraction` is that of the last iteration. Lanes in `idle` do not
    /// take part in this step.
    pub fn mix(&mut self, contraction: Lane, idle: Lane, u: &[Lane], f: &mut [Lane]) {
        let slow = contraction.simd_gt(lane(MIX_ABOVE)) & !idle;
        if self.active.none() && slow.none() {
            return;
        }
        if !self.previous[0].is_empty() {
            self.remember(u, f);
        }
        // A lane that starts in this iteration has no earlier difference, as if it were alone.
        self.active |= slow;
        let [old_f, old_g] = &mut self.previous;
        old_f.clear();
        old_f.extend_from_slice(f);
        old_g.clear();
        old_g.extend(u.iter().zip(&*f).map(|(u, f)| *u + *f));
        if self.used > 0 {
            self.project(f);
        }
    }

    /// Stores the differences from the last iteration as the newest column.
    fn remember(&mut self, u: &[Lane], f: &[Lane]) {
        if self.used == self.columns.len() && self.used < DEPTH {
            self.columns.push(Default::default());
        }
        self.used = (self.used + 1).min(DEPTH);
        self.columns[..self.used].rotate_right(1);
        let [df, dg] = &mut self.columns[0];
        let active = self.active;
        let [old_f, old_g] = &self.previous;
        df.clear();
        df.extend(f.iter().zip(old_f).map(|(f, o)| active.select(*f - *o, Lane::ZERO)));
        dg.clear();
        let g = u.iter().zip(f).map(|(u, f)| *u + *f);
        dg.extend(g.zip(old_g).map(|(g, o)| active.select(g - *o, Lane::ZERO)));
    }

    /// f ← f − ΔG γ with the γ that minimises |f − ΔF γ| (normal equations, lane by lane).
    fn project(&self, f: &mut [Lane]) {
        let k = self.used;
        let dot = |a: &[Lane], b: &[Lane]| crate::scalar::dot(a, b);
        let mut gram = [[Lane::ZERO; DEPTH]; DEPTH];
        let mut gamma = [Lane::ZERO; DEPTH];
        for i in 0..k {
            for j in 0..=i {
                gram[i][j] = dot(&self.columns[i][0], &self.columns[j][0]);
            }
            gamma[i] = dot(&self.columns[i][0], f);
        }
        // L D Lᵀ; a column that depends on newer ones, or is empty, is ignored.
        let mut inverse = [Lane::ZERO; DEPTH];
        for i in 0..k {
            let size = gram[i][i];
            for j in 0..i {
                let mut x = gram[i][j];
                for l in 0..j {
                    x -= gram[i][l] * gram[j][l] * inverse[l];
                }
                gram[i][j] = x;
                gram[i][i] -= x * x * inverse[j];
            }
            let sound = gram[i][i].simd_gt(size * lane(1e-12));
            inverse[i] = sound.select(Lane::ONE / gram[i][i], Lane::ZERO);
        }
        for i in 0..k {
            for l in 0..i {
                gamma[i] -= gram[i][l] * inverse[l] * gamma[l];
            }
        }
        for i in 0..k {
            gamma[i] *= inverse[i];
        }
        for i in (0..k).rev() {
            for l in i + 1..k {
                gamma[i] -= gram[l][i] * inverse[i] * gamma[l];
            }
        }
        for i in 0..k {
            for (f, g) in f.iter_mut().zip(&self.columns[i][1]) {
                *f -= gamma[i] * *g;
            }
        }
    }
}
