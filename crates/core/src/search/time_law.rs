//! The fastest traversal of a path under limits of the acceleration, on a grid.
//!
//! Let x be the time of the curve γ, `u = ẋ²` and `a = ẍ = ½ du/dx`. The acceleration of the traversal is `∇γ' u + γ' a`
//! (for the arc length these are the formulas of Bobrow, Dubowsky & Gibson 1985), so that a limit A of its norm is
//! `p u² + 2 q u a + r a² ≤ A²` with `p = |∇γ'|²`, `q = ⟨∇γ', γ'⟩` and `r = |γ'|²`. On an interval of length h, u is
//! linear and a is constant: u differs by 2 h a between its ends. The passes are those of TOPP-RA (Pham & Pham 2018).

use crate::monitor::checkpoint;

/// Steps of bisection for the largest u, and the part of u by which it is first reduced.
const STEPS: usize = 10;
const NEAR: f64 = 1e-6;
/// Part of the terms of a coefficient below which it is a rounding error of zero.
const ROUNDING: f64 = 1e-14;

/// A path and its limits on a grid of n points.
pub struct Path<'a> {
    /// Lengths of the n − 1 intervals.
    pub h: &'a [f64],
    /// Largest u at the n points.
    pub most: &'a [f64],
    /// p, q and r at the starts of all intervals, then at their ends; in each, one number per factor of the space.
    pub forms: [&'a [f64]; 3],
    /// A² in each factor.
    pub limits: &'a [f64],
}

/// The end of an interval at which u is given.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Given {
    Start,
    End,
}

impl Path<'_> {
    /// The interval of a that the limits at both ends of interval k allow, given u at one of these.
    fn feasible(&self, k: usize, u: f64, given: Given) -> Option<[f64; 2]> {
        let count = self.limits.len();
        let (mut least, mut most) = (f64::NEG_INFINITY, f64::INFINITY);
        let shifts = match given {
            Given::Start => [0.0, 2.0 * self.h[k]],
            Given::End => [-2.0 * self.h[k], 0.0],
        };
        for (side, shift) in shifts.into_iter().enumerate() {
            for (i, square) in self.limits.iter().enumerate() {
                let [p, q, r] = self.forms.map(|form| form[(side * self.h.len() + k) * count + i]);
                // A polynomial of a, with u + shift a in place of u.
                let lead = p * shift * shift + 2.0 * q * shift + r;
                let half = u * (p * shift + q);
                let rest = p * u * u - square;
                if lead <= ROUNDING * (p * shift * shift + r) {
                    if rest > 0.0 {
                        return None;
                    }
                    continue;
                }
                let root = half * half - lead * rest;
                if root < 0.0 {
                    return None;
                }
                let root = root.sqrt();
                least = least.max((-half - root) / lead);
                most = most.min((root - half) / lead);
            }
        }
        (least <= most).then_some([least, most])
    }

    /// The largest u at the start of interval k, given u at its end.
    fn before(&self, k: usize, u: f64) -> Option<f64> {
        let [least, most] = self.feasible(k, u, Given::End)?;
        let step = 2.0 * self.h[k];
        let a = least.max((u - self.most[k]) / step);
        (a <= most).then_some((u - step * a).max(0.0))
    }

    /// The largest u at the grid from which the end can be reached, and the u at the end of each interval on the way.
    pub fn backward(&self) -> (Vec<f64>, Vec<f64>) {
        let count = self.h.len();
        let (mut largest, mut following) = (vec![0.0; count + 1], vec![0.0; count]);
        largest[count] = self.most[count];
        for k in (0..count).rev() {
            checkpoint();
            let u = largest[k + 1];
            (following[k], largest[k]) = match self.before(k, u) {
                Some(found) => (u, found),
                None => self.reduced(k, u),
            };
        }
        (largest, following)
    }

    /// The largest u at the end of interval k, usually near the given one, for which the limits at its start can be kept;
    /// and u at its start.
    fn reduced(&self, k: usize, u: f64) -> (f64, f64) {
        let mut part = NEAR;
        while part < 0.5 && self.before(k, u * (1.0 - part)).is_none() {
            part *= 4.0;
        }
        let (mut low, mut high) =
            if part < 0.5 { (u * (1.0 - part), u * (1.0 - part / 4.0)) } else { (0.0, u) };
        for _ in 0..STEPS {
            let middle = (low + high) / 2.0;
            if self.before(k, middle).is_none() {
                high = middle;
            } else {
                low = middle;
            }
        }
        (low, self.before(k, low).unwrap_or(0.0))
    }

    /// u at the grid, with the largest acceleration at any time that allows the end to be reached, from `start` or, by
    /// default, the largest u.
    pub fn forward(&self, largest: &[f64], following: &[f64], start: Option<f64>) -> Vec<f64> {
        let mut u = start.map_or(largest[0], |start| start.min(largest[0]));
        let mut values = vec![u];
        for (k, h) in self.h.iter().enumerate() {
            checkpoint();
            // The set of u and a within the limits is convex, so that this share of the backward pass is in it.
            let mut share = if largest[k] > 0.0 { following[k] * (u / largest[k]).min(1.0) } else { 0.0 };
            if let Some([least, most]) = self.feasible(k, u, Given::Start) {
                let a = most.min((largest[k + 1] - u) / (2.0 * h));
                if a >= least {
                    share = share.max(u + 2.0 * h * a);
                }
            }
            u = share.min(largest[k + 1]);
            values.push(u);
        }
        values
    }
}
