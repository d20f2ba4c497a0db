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

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight line from rest to rest: full acceleration, the largest speed, full deceleration.
    #[test]
    fn a_trapezoid() {
        let n = 1000;
        let (length, limit, top) = (3.0_f64, 2.0_f64, 2.5_f64);
        let h = vec![length / n as f64; n];
        let mut most = vec![top; n + 1];
        (most[0], most[n]) = (0.0, 0.0);
        let (zeros, ones) = (vec![0.0; 2 * n], vec![1.0; 2 * n]);
        let path = Path { h: &h, most: &most, forms: [&zeros, &zeros, &ones], limits: &[limit * limit] };
        let (largest, following) = path.backward();
        let u = path.forward(&largest, &following, Some(0.0));
        for (k, u) in u.iter().enumerate() {
            let x = k as f64 * h[0];
            let exact = (2.0 * limit * x).min(2.0 * limit * (length - x)).min(top);
            assert!((u - exact).abs() < 1e-9, "{k} {u} {exact}");
        }
    }

    /// On a circle of radius 1 with any u, the limit is `u² + a² ≤ A²`.
    #[test]
    fn a_circle() {
        let n = 4000;
        let h = vec![1.5 / n as f64; n];
        let most = vec![2.0; n + 1];
        let (zeros, ones) = (vec![0.0; 2 * n], vec![1.0; 2 * n]);
        let path = Path { h: &h, most: &most, forms: [&ones, &zeros, &ones], limits: &[4.0] };
        let (largest, following) = path.backward();
        let u = path.forward(&largest, &following, Some(0.0));
        for (k, pair) in u.windows(2).enumerate() {
            let a = (pair[1] - pair[0]) / (2.0 * h[k]);
            assert!(pair[0].hypot(a) <= 2.0 + 1e-12 && pair[1].hypot(a) <= 2.0 + 1e-12);
        }
        // du/dx = 2 √(4 − u²): u = 2 sin 2x up to 2.
        for (k, u) in u.iter().enumerate() {
            let exact = 2.0 * (2.0 * k as f64 * h[0]).min(std::f64::consts::FRAC_PI_2).sin();
            assert!((u - exact).abs() < 5e-3, "{k} {u} {exact}");
        }
    }

    /// Limits that only a lower speed at the end of an interval can keep.
    #[test]
    fn a_bend_in_the_path() {
        let h = [0.1, 0.1];
        let most = [10.0, 1.0, 10.0];
        // The second interval turns sharply at its start: p = 100 there.
        let (p, q, r) = ([0.0, 100.0, 0.0, 0.0], [0.0; 4], [1.0; 4]);
        let path = Path { h: &h, most: &most, forms: [&p, &q, &r], limits: &[1.0] };
        let (largest, following) = path.backward();
        assert!(following[1] < 10.0 && largest[1] <= 0.1 + 1e-9);
        let u = path.forward(&largest, &following, Some(0.0));
        assert!(u[1] > 0.05 && u[1] <= 0.1 + 1e-9, "{u:?}");
    }
}
