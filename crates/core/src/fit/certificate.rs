//! What Theorem 3.1 proves: a region that Algorithm 1 does not leave.

/// Spacings whose quotients are this close to one are equal.
const EQUAL: f64 = 1e-9;

/// Whether knots are equally spaced, as the theorem has them.
pub fn equally_spaced(t: &[f64]) -> bool {
    let h = t[1] - t[0];
    t.windows(2).all(|t| (t[1] - t[0] - h).abs() <= EQUAL * h)
}

/// The smallest V of (38) that also bounds the given end velocities `v` = h|u|/3, for steps up to D and
/// the curvature K of (22); `None` where the theorem says nothing.
pub fn invariant_radius(step: f64, curvature: f64, v: f64) -> Option<f64> {
    if curvature == 0.0 {
        // ½ (D + V) ≤ V
        return Some(step.max(v));
    }
    let (d, v) = (curvature * step, curvature * v);
    // It is at least that of flat space.
    let smallest = root(d, d, 1.0)?;
    if v <= smallest {
        return Some(smallest / curvature);
    }
    let largest = root(d, 0.5 * (std::f64::consts::PI - d) * (1.0 - 1e-9), -1.0)?;
    (v <= largest).then_some(v / curvature)
}

/// A root x = KV of ½ u/sin u (d + x) − x with u = d + 2x, by Newton's method. The function is convex: from
/// the left (`side` = 1) it comes to the smallest root, from the right (−1) to the largest, and where
/// its tangent points away there is none.
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

#[cfg(test)]
mod tests {
    use super::invariant_radius;

    #[test]
    fn the_largest_step_is_that_of_the_literature() {
        // The two roots meet at KD = 0.2610895, KV = 0.4420886 (from d/dV of (38), at 40 digits).
        let v = invariant_radius(0.261_089, 1.0, 0.0).expect("below the largest step");
        assert!((v - 0.442).abs() < 2e-3);
        assert!(invariant_radius(0.261_090, 1.0, 0.0).is_none());
        // KD and KV only.
        let (one, half) = (invariant_radius(0.2, 1.0, 0.0), invariant_radius(0.4, 0.5, 0.0));
        assert!((one.unwrap() - 0.5 * half.unwrap()).abs() < 1e-15);
    }

    #[test]
    fn the_inequality_holds_at_the_root_and_not_below() {
        for d in [1e-9, 1e-3, 0.1, 0.25] {
            let v = invariant_radius(d, 1.0, 0.0).unwrap();
            let excess = |v: f64| {
                let u: f64 = d + 2.0 * v;
                0.5 * u / u.sin() * (u - v) - v
            };
            assert!(excess(v) <= 1e-14 * v && excess(v * (1.0 - 1e-6)) > 0.0);
        }
    }

    #[test]
    fn given_velocities_must_fit() {
        let v = invariant_radius(0.1, 1.0, 0.3).unwrap();
        assert_eq!(v, 0.3);
        assert!(invariant_radius(0.1, 1.0, 1.2).is_none());
    }
}
