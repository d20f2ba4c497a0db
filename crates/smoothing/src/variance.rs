//! How uncertain a smoothed curve is: the posterior of an integrated Wiener process (Wahba 1983), in frames along it.

use crate::banded::{Banded, WIDTH};
use crate::cyclic::{Factored, PeriodicCorrection};
use crate::linearized::{Basis, LinearProblem, OVERLAP, Stencil};
use crate::path::{Position, positions};
use crate::problem::{EndCondition, EndConditions, Penalty};
use symspline_core::monitor::checkpoint;

const BAND: usize = WIDTH + 1;

/// The rows of the band of A⁻¹ as plain numbers, four per coefficient.
pub fn rows_of(inverse: &Banded<f64>) -> Vec<f64> {
    let entry = |at: usize| {
        let (i, d) = (at / BAND, at % BAND);
        if d <= i { inverse.at(i, i - d) } else { 0.0 }
    };
    (0..inverse.size * BAND).map(entry).collect()
}

/// The variance of a coordinate at given times, for noise of variance one: of the point (`nu` = 0) or of the velocity
/// (1). Beyond its ends the curve continues as a geodesic.
///
/// The points at the knots have the covariance PA⁻¹Pᵀ. An integrated Wiener process through given points has velocities
/// there with the inverse covariance λT, `vᵀTv` being the part of ∫ x''² in them; and between two knots whose points and
/// velocities are given it has the variance `h³s³(1 − s)³/(3λ)`, and its velocity `h s(1 − s)(1 − 3s(1 − s))/λ`. If λ varies,
/// `profile` has λ of each segment, divided by λ; otherwise it is empty.
pub fn variance(
    knots: &[f64],
    rows: &[f64],
    (lam, profile): (f64, &[f64]),
    ends: EndConditions,
    times: &[f64],
    nu: usize,
) -> Vec<f64> {
    let basis = Basis::new(knots, ends);
    let inverse = Banded::of(basis.count(), WIDTH, |at| rows[at]);
    let velocities = velocities_given_points(knots, profile, ends);
    let one = |t: &f64| {
        checkpoint();
        let ((segment, s), beyond) = position_of(knots, &basis, *t);
        let h = knots[segment + 1] - knots[segment];
        let row = row_at(knots, &basis, *t, nu);
        // The contribution of the velocities at the two knots: cubic Hermite functions.
        let mut hermite = match nu {
            0 => [h * s * (1.0 - s) * (1.0 - s), h * s * s * (s - 1.0)],
            _ => [(1.0 - s) * (1.0 - 3.0 * s), s * (3.0 * s - 2.0)],
        };
        if nu == 0 && beyond != 0.0 {
            hermite[s as usize] += beyond;
        }
        let known = row.square(&inverse);
        if lam == 0.0 {
            return known;
        }
        let both = s * (1.0 - s);
        let of_process = match nu {
            0 => h.powi(3) * both.powi(3) / 3.0,
            _ => h * both * (1.0 - 3.0 * both),
        };
        let between = of_process / profile.get(segment).unwrap_or(&1.0);
        let v = |a: usize, b: usize| velocities.at(segment + a, segment + b);
        let [a, b] = hermite;
        known + (a * a * v(0, 0) + 2.0 * a * b * v(0, 1) + b * b * v(1, 1) + between) / lam
    };
    times.iter().map(one).collect()
}

/// The band of A⁻¹ for scalar weights and a given λ, as [`rows_of`] returns it. The data are between the knots. The profile is
/// that of [`variance`].
pub fn inverse_of_weights(
    knots: &[f64],
    times: &[f64],
    weights: &[f64],
    (lam, profile): (f64, &[f64]),
    penalty: Penalty,
    ends: EndConditions,
) -> Vec<f64> {
    let basis = Basis::new(knots, ends);
    let lam = lam / penalty.unit(basis.spacing);
    let mut linearized = LinearProblem::new(basis, &positions(knots, times), weights, penalty);
    if !profile.is_empty() {
        linearized.set_profile(profile);
    }
    let entry = |at: usize| lam.mul_add(linearized.penalty[at], linearized.gram[at]);
    let matrix = Banded::of(linearized.basis.count(), WIDTH, entry);
    let periodic = linearized.basis.is_closed().then(|| PeriodicCorrection::plain(OVERLAP, 1));
    rows_of(&Factored::new(matrix, periodic.as_ref()).inverse_band())
}

/// The position of a time on the curve, and the time beyond its end. Closed curves continue periodically.
fn position_of(knots: &[f64], basis: &Basis, t: f64) -> (Position, f64) {
    let last = knots.len() - 1;
    let t = if basis.is_closed() { knots[0] + (t - knots[0]).rem_euclid(knots[last] - knots[0]) } else { t };
    let near = t.clamp(knots[0], knots[last]);
    (positions(knots, &[near])[0], t - near)
}

/// The factors of the coefficients in a derivative at any time, in the unit of the knots. Beyond its ends the curve
/// continues with constant velocity.
pub fn row_at(knots: &[f64], basis: &Basis, t: f64, nu: usize) -> Stencil {
    let ((segment, s), beyond) = position_of(knots, basis, t);
    let mut row = basis.row(segment, s, nu);
    let unit = basis.spacing.powi(-(nu as i32));
    row.factors.iter_mut().for_each(|x| *x *= unit);
    if beyond != 0.0 {
        match nu {
            0 => {
                let slope = basis.row(segment, s, 1);
                row.factors.iter_mut().zip(slope.factors).for_each(|(b, d)| *b += beyond / basis.spacing * d);
            }
            1 => {}
            _ => row.factors = [0.0; 4],
        }
    }
    row
}

/// The first coefficient and the factors of four coefficients in a derivative at given times: see [`row_at`].
pub fn functional_at(knots: &[f64], ends: EndConditions, times: &[f64], nu: usize) -> Vec<(usize, [f64; 4])> {
    let basis = Basis::new(knots, ends);
    let of_row = |row: Stencil| (row.first, row.factors);
    times.iter().map(|t| of_row(row_at(knots, &basis, *t, nu))).collect()
}

/// The band of T⁻¹, where vᵀTv is the contribution of the velocities at knots to ∫ x''²: `4(v₀² + v₀v₁ + v₁²)/h` per
/// segment, times its number in the profile. Prescribed velocities get a negligible variance.
fn velocities_given_points(knots: &[f64], profile: &[f64], ends: EndConditions) -> Banded<f64> {
    const FIXED: f64 = 1e12;
    let last = knots.len() - 1;
    let stiffness = |i: usize| profile.get(i).unwrap_or(&1.0) / (knots[i + 1] - knots[i]);
    let given = |end: usize| matches!(ends, EndConditions::Open(ends) if ends[end] == EndCondition::Velocity);
    let t = Banded::of(last + 1, 1, |at| {
        let (i, beside) = (at / 2, at % 2 == 1);
        let [left, right] = [(i > 0).then(|| stiffness(i - 1)), (i < last).then(|| stiffness(i))];
        if beside {
            return 2.0 * left.unwrap_or(0.0);
        }
        let fixed = if (i == 0 && given(0)) || (i == last && given(1)) { FIXED } else { 1.0 };
        4.0 * fixed * (left.unwrap_or(0.0) + right.unwrap_or(0.0))
    });
    // The last velocity of a closed curve equals the first.
    let periodic = (ends == EndConditions::Periodic).then(|| PeriodicCorrection::plain(1, 1));
    Factored::new(t, periodic.as_ref()).inverse_band()
}
