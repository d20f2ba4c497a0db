//! Loss functions: least squares, Huber, Cauchy.
//!
//! A robust fit is a least-squares fit to pseudo-data (Cox 1983): residuals r become `ψ(r)/ψ̄'`, where ψ̄' is the
//! mean slope of ψ. Cross-validation of pseudo-data remains valid; cross-validation of reweighted data does not.

use crate::chi;
use crate::problem::Loss;

impl Loss {
    /// The residual beyond which the loss grows more slowly, in standard deviations of a coordinate.
    pub fn corner(self, m: usize) -> f64 {
        match self {
            Loss::Linear => f64::INFINITY,
            Loss::Huber => chi::quantile(m, 0.82).sqrt(),
            Loss::Cauchy => chi::quantile(m, 0.95).sqrt(),
        }
    }

    /// ψ(r)/|r|, for q = |r|²/c²: the weight of a datum in reweighted least squares.
    pub fn weight(self, q: f64) -> f64 {
        self.slopes(q, 1).0
    }

    /// ψ(r)/r and the mean of ψ' over all directions, for q = |r|²/c².
    fn slopes(self, q: f64, m: usize) -> (f64, f64) {
        let m = m as f64;
        match self {
            Loss::Huber if q > 1.0 => (1.0 / q.sqrt(), (m - 1.0) / (m * q.sqrt())),
            Loss::Linear | Loss::Huber => (1.0, 1.0),
            Loss::Cauchy => {
                let factor = 1.0 / (1.0 + q);
                (factor, factor - 2.0 * q * factor * factor / m)
            }
        }
    }

    /// ρ of a squared residual, for the corner c.
    pub fn value(self, square: f64, corner: f64) -> f64 {
        let q = square / (corner * corner);
        match self {
            Loss::Huber if q > 1.0 => corner * corner * (2.0 * q.sqrt() - 1.0),
            Loss::Linear | Loss::Huber => square,
            Loss::Cauchy => corner * corner * q.ln_1p(),
        }
    }

    /// The factors ψ(r)/(|r| ψ̄') that convert residuals in m dimensions to those of the pseudo-data, given their
    /// weighted squares; and ψ̄'.
    pub fn pseudo(self, corner: f64, squares: &[f64], m: usize) -> (Vec<f64>, f64) {
        let slopes: Vec<(f64, f64)> =
            squares.iter().map(|square| self.slopes(square / (corner * corner), m)).collect();
        let mean = slopes.iter().map(|s| s.1).sum::<f64>() / slopes.len() as f64;
        // If most data were outliers, the mean slope would be meaningless.
        let mean = mean.max(0.05);
        (slopes.iter().map(|(factor, _)| factor / mean).collect(), mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_match_the_loss() {
        // ψ is half the gradient of ρ(|r|²), ψ' its divergence over m.
        let (corner, h) = (0.7, 1e-4);
        for loss in [Loss::Linear, Loss::Huber, Loss::Cauchy] {
            for r in [[0.3, 0.1, 0.2], [1.1, -0.4, 0.5], [4.0, 1.0, -3.0]] {
                let square = |r: [f64; 3]| r.iter().map(|x| x * x).sum::<f64>();
                let value = |r: [f64; 3]| loss.value(square(r), corner);
                let moved = |c: usize, by: f64| {
                    let mut x = r;
                    x[c] += by;
                    x
                };
                let (factor, slope) = loss.slopes(square(r) / (corner * corner), 3);
                let mut divergence = 0.0;
                for c in 0..3 {
                    let (up, down) = (value(moved(c, h)), value(moved(c, -h)));
                    assert!((factor * r[c] - (up - down) / (4.0 * h)).abs() < 1e-7);
                    divergence += (up + down - 2.0 * value(r)) / (2.0 * h * h) / 3.0;
                }
                assert!((slope - divergence).abs() < 1e-5, "{loss:?} {r:?}: {slope} {divergence}");
            }
        }
    }
}
