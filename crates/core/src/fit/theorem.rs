//! Theorem 3.1 in numbers: a region that Algorithm 1 does not leave, and its contraction there.
//!
//! `docs/convergence.md` derives both bounds. They use the curvature alone and hold only where D + 2V is less than the
//! injectivity radius. `_base/report.py` checks this, because only the Python package has the radius of quotients.

/// Spacings whose quotients differ from one by at most this much are equal.
const EQUAL: f64 = 1e-9;

/// Whether knots are equally spaced, as the theorem requires.
pub fn equally_spaced(t: &[f64]) -> bool {
    let h = t[1] - t[0];
    t.windows(2).all(|t| (t[1] - t[0] - h).abs() <= EQUAL * h)
}

/// The smallest V of (38) that also bounds the given end velocities `v` = h|u|/3, for steps up to D and the curvature
/// K of (22); `None` where the theorem does not apply.
pub fn invariant_radius(step: f64, curvature: f64, v: f64) -> Option<f64> {
    if curvature == 0.0 {
        // ½ (D + V) ≤ V
        return Some(step.max(v));
    }
    let (d, v) = (curvature * step, curvature * v);
    // The radius is at least that of flat space.
    let smallest = root(d, d, 1.0)?;
    if v <= smallest {
        return Some(smallest / curvature);
    }
    let largest = root(d, 0.5 * (std::f64::consts::PI - d) * (1.0 - 1e-9), -1.0)?;
    (v <= largest).then_some(v / curvature)
}

/// A bound α < 1 of the contraction of Algorithm 1 per sweep, in the largest length of a velocity, on the region ‖v‖
/// ≤ V for steps up to D and the curvature K of (22); `None` where no bound is known.
///
/// With K = 1 and U = D + 2V ≥ ‖ω‖, (37), the derivatives of φᵢ by its two neighbours are at most
/// ½ (U/sin U)(sinh V/V) together (Proposition C.3). By Lemma C.5 those by ξᵢ are the two operators
/// ¼ (1 − ad_ω coth(ad_ω) sinh(ad_ξ)/ad_ξ − ad_ω (cosh(ad_ξ) − 1)/ad_ξ), and the series with the absolute values of the
/// coefficients of x coth x is 2 − x cot x. Natural ends (20) have ½ (2V/sin 2V)(sinh V/V), which is less.
pub fn contraction_bound(step: f64, curvature: f64, radius: f64) -> Option<f64> {
    let (v, u) = (curvature * radius, curvature * (step + 2.0 * radius));
    if u >= std::f64::consts::PI {
        return None;
    }
    // x/sin x and x cot x; sinh x/x and (cosh x − 1)/x.
    let (over_sin, cot) = if u == 0.0 { (1.0, 1.0) } else { (u / u.sin(), u / u.tan()) };
    let (sinh, cosh) = if v == 0.0 { (1.0, 0.0) } else { (v.sinh() / v, 2.0 * (0.5 * v).sinh().powi(2) / v) };
    let neighbours = over_sin * sinh;
    let own = (2.0 - cot) * sinh - 1.0 + u * cosh;
    Some(0.5 * (neighbours + own)).filter(|&alpha| alpha < 1.0)
}

/// The number of sweeps of Algorithm 1, from zero velocities, after which all handles are within `tol` · V of those
/// of the spline. Handles are at most V long, so this is the first k with αᵏ ≤ `tol`, where `tol` is at least the
/// rounding error.
pub fn guaranteed_sweeps(alpha: f64, tol: f64) -> f64 {
    (tol.clamp(f64::EPSILON, 1.0).ln() / alpha.ln()).ceil()
}

/// A root x = KV of ½ u/sin u (d + x) − x with u = d + 2x, by Newton's method. The function is convex: from the left
/// (`side` = 1) the iteration converges to the smallest root, from the right (−1) to the largest. If its tangent
/// points away, there is no root.
fn root(d: f64, mut x: f64, side: f64) -> Option<f64> {
    for _ in 0..200 {
        let u = d + 2.0 * x;
        if !(x >= 0.0 && u < std::f64::consts::PI) {
            return None;
        }
        let (sin, cos) = u.sin_cos();
        let f = if u == 0.0 { 1.0 } else { u / sin };
        let df = if u == 0.0 { 0.0 } else { (1.0 - f * cos) / sin };
        let (value, slope) = (0.5 * f * (d + x) - x, df * (d + x) + 0.5 * f - 1.0);
        if value <= 1e-15 * x {
            return Some(x);
        }
        if !(side * slope < 0.0) {
            return None;
        }
        let next = x - value / slope;
        if next == x {
            return Some(x);
        }
        x = next;
    }
    None
}
