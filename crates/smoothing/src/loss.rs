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
    #[doc(hidden)]
    pub fn slopes(self, q: f64, m: usize) -> (f64, f64) {
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
