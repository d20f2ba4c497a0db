//! Linear equations g' = −A(t) g by Gauss collocation: a polynomial that approximates the solution along an interval.

#[cfg(feature = "dense")]
use nalgebra::{ComplexField, DMatrix};
use std::sync::LazyLock;

/// The number of nodes per interval. The solution is a polynomial of this degree; its order at the ends is twice as
/// high.
pub const STAGES: usize = 16;

struct Rule {
    /// Gauss nodes in [0, 1].
    nodes: [f64; STAGES],
    /// Integrals from 0 to the i-th node of the Lagrange polynomial of the j-th node.
    integrals: [[f64; STAGES]; STAGES],
    /// The l-th Legendre coefficient of that polynomial.
    coefficients: [[f64; STAGES]; STAGES],
}

static RULE: LazyLock<Rule> = LazyLock::new(|| {
    let (mut nodes, mut weights) = ([0.0; STAGES], [0.0; STAGES]);
    for i in 0..STAGES {
        // Newton's method for the roots of P_n, from the asymptotic formula.
        let n = STAGES as f64;
        let mut x = -((i as f64 + 0.75) / (n + 0.5) * std::f64::consts::PI).cos();
        for _ in 0..8 {
            let (p, slope) = last(x);
            x -= p / slope;
        }
        let slope = last(x).1;
        nodes[i] = 0.5 + 0.5 * x;
        weights[i] = 1.0 / ((1.0 - x * x) * slope * slope);
    }
    let at = nodes.map(legendre);
    let coefficients: [[f64; STAGES]; STAGES] =
        std::array::from_fn(|l| std::array::from_fn(|j| (2 * l + 1) as f64 * weights[j] * at[j][l]));
    let integrals = std::array::from_fn(|i| {
        let integral = |l: usize| match l {
            0 => nodes[i],
            _ => (at[i][l + 1] - at[i][l - 1]) / (2 * (2 * l + 1)) as f64,
        };
        std::array::from_fn(|j| (0..STAGES).map(|l| integral(l) * coefficients[l][j]).sum())
    });
    Rule { nodes, integrals, coefficients }
});

/// P_n and its derivative at x in (−1, 1), n the number of stages.
fn last(x: f64) -> (f64, f64) {
    let p = legendre(0.5 + 0.5 * x);
    (p[STAGES], STAGES as f64 * (p[STAGES - 1] - x * p[STAGES]) / (1.0 - x * x))
}

/// The Legendre polynomials P_0 … P_n of 2s − 1.
pub fn legendre(s: f64) -> [f64; STAGES + 1] {
    let x = 2.0 * s - 1.0;
    let mut p = [1.0; STAGES + 1];
    p[1] = x;
    for l in 1..STAGES {
        p[l + 1] = ((2 * l + 1) as f64 * x * p[l] - l as f64 * p[l - 1]) / (l + 1) as f64;
    }
    p
}

/// The nodes, as fractions of an interval.
pub fn nodes() -> &'static [f64; STAGES] {
    &RULE.nodes
}

/// Legendre coefficients, over an interval of length h, of the matrix g with g' = −A g and g = 1 at its start. A is
/// given at the nodes. NaN where A is NaN.
#[cfg(feature = "dense")]
pub fn solve<T: ComplexField<RealField = f64> + Copy>(h: f64, a: &[DMatrix<T>]) -> Vec<DMatrix<T>> {
    let k = a[0].nrows();
    let one = DMatrix::<T>::identity(k, k);
    let number = T::from_real;
    // g = 1 − h ∫ A g at the nodes.
    let mut system = DMatrix::<T>::identity(STAGES * k, STAGES * k);
    for (i, row) in RULE.integrals.iter().enumerate() {
        for (j, a) in a.iter().enumerate() {
            let mut block = system.view_mut((i * k, j * k), (k, k));
            block += a * number(h * row[j]);
        }
    }
    let ones = DMatrix::from_fn(STAGES * k, k, |i, j| one[(i % k, j)]);
    let g = system.lu().solve(&ones).unwrap_or_else(|| ones.map(|x| x * number(f64::NAN)));
    let rates: Vec<DMatrix<T>> =
        a.iter().enumerate().map(|(j, a)| a * g.rows(j * k, k) * number(-h)).collect();
    let mut out = vec![DMatrix::zeros(k, k); STAGES + 1];
    out[0] += one;
    for (l, row) in RULE.coefficients.iter().enumerate() {
        let mut rate = DMatrix::zeros(k, k);
        rates.iter().zip(row).for_each(|(x, &c)| rate += x * number(c));
        // ∫₀ˢ P_l = (P_{l+1} − P_{l−1})/(2(2l+1)), and (P_1 + P_0)/2 for l = 0.
        rate *= number(1.0 / (2 * (2 * l + 1)) as f64);
        out[l + 1] += &rate;
        if l == 0 { out[0] += rate } else { out[l - 1] -= rate }
    }
    out
}

/// Integrals of a function given at the nodes: from the start of the unit interval to every node, and to its end.
pub fn integrate(rates: &[f64; STAGES]) -> ([f64; STAGES], f64) {
    let sum = |weights: &[f64; STAGES]| weights.iter().zip(rates).map(|(w, x)| w * x).sum();
    (std::array::from_fn(|i| sum(&RULE.integrals[i])), sum(&RULE.coefficients[0]))
}

/// Value at the end of the interval.
#[cfg(feature = "dense")]
pub fn end<T: ComplexField<RealField = f64> + Copy>(coefficients: &[DMatrix<T>]) -> DMatrix<T> {
    let k = coefficients[0].nrows();
    coefficients.iter().fold(DMatrix::zeros(k, k), |sum, c| sum + c)
}

/// The size of the last coefficients, which bounds the truncation error.
#[cfg(feature = "dense")]
pub fn tail<T: ComplexField<RealField = f64> + Copy>(coefficients: &[DMatrix<T>]) -> f64 {
    coefficients[STAGES - 1..].iter().flat_map(|c| c.iter()).fold(0.0, |most, x| x.modulus().max(most))
}

#[cfg(all(test, feature = "dense"))]
mod tests {
    use super::*;
    use nalgebra::Complex;

    #[test]
    fn polynomials_and_exponentials_are_exact() {
        // g' = −i(1 + 2t) g is solved by exp(−i(t + t²)).
        let h = 0.8;
        let a: Vec<_> =
            nodes().map(|s| DMatrix::from_element(1, 1, Complex::new(0.0, 1.0 + 2.0 * h * s))).to_vec();
        let found = solve(h, &a);
        for s in [0.0, 0.1, 0.5, 0.77, 1.0] {
            let value: Complex<f64> = found.iter().zip(legendre(s)).map(|(c, p)| c[(0, 0)] * p).sum();
            let t = h * s;
            assert!((value - Complex::from_polar(1.0, -(t + t * t))).norm() < 5e-16, "{value} at {s}");
        }
        assert!((end(&found)[(0, 0)] - Complex::from_polar(1.0, -(h + h * h))).norm() < 5e-16);
        // The first omitted coefficient is smaller by the square of the ratio of neighbours.
        assert!(tail(&found) < 1e-12, "{}", tail(&found));
    }

    #[test]
    fn noncommuting_matrices_are_integrated() {
        // Rotating coordinates: g = R(t) exp(−t(B + J)) for A(t) = R B R⁻¹ where R' = J R.
        let (h, b, j) =
            (0.5, [[0.0, 0.3], [0.9, 0.0]], DMatrix::from_row_slice(2, 2, &[0.0, -1.0, 1.0, 0.0]));
        let b = DMatrix::from_fn(2, 2, |i, j| b[i][j]);
        let turn = |t: f64| (&j * t).exp();
        let a: Vec<_> = nodes().map(|s| turn(h * s) * &b * turn(-h * s)).to_vec();
        let found = solve(h, &a);
        for s in [0.25, 0.6, 1.0] {
            let value = found.iter().zip(legendre(s)).fold(DMatrix::zeros(2, 2), |sum, (c, p)| sum + c * p);
            let expected = turn(h * s) * ((&b + &j) * (-h * s)).exp();
            assert!((value - expected).norm() < 3e-15);
        }
    }
}
