//! Loss functions: least squares, Huber, Cauchy.
//!
//! A robust fit is a least-squares fit to pseudo-data (Cox 1983): residuals r become `ψ(r)/ψ̄'`, where ψ̄' is the
//! mean slope of ψ. Cross-validation of pseudo-data remains valid; cross-validation of reweighted data does not.

use crate::chi;
use crate::frames::lanes_of;
use crate::problem::{Data, Loss};
use symspline_core::scalar::{LANES, Lane, gather};
use symspline_core::space::{Ambient, Erased, Origin};

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

/// A robust estimate of the standard deviation of the noise in a coordinate, from the median squared distance of data
/// from the geodesics between their neighbours. NaN for fewer than three data.
pub fn noise(space: &Erased, data: &Data) -> f64 {
    let [times, points, weights] = [data.times, data.points, data.weights];
    /// Rounded data may have deviations that are mostly zero; a fraction of the mean then replaces the median.
    const LEAST: f64 = 0.01;
    let found = deviations(space, times, points, weights);
    let mean = found.iter().sum::<f64>() / found.len() as f64;
    (median(&found).max(LEAST * mean) / chi::quantile(space.dim(), 0.5)).sqrt()
}

/// Squared distances of all data except the first and the last from the geodesic between their neighbours, in units
/// of their expectation for noise of variance one.
fn deviations(space: &Erased, times: &[f64], points: &[f64], weights: &[f64]) -> Vec<f64> {
    let len = space.point_len();
    let inner = times.len().saturating_sub(2);
    let share = |i: usize| {
        let (a, b) = (times[i + 1] - times[i], times[i + 2] - times[i + 1]);
        if a + b > 0.0 { a / (a + b) } else { 0.5 }
    };
    let [mut p, mut q, mut y, mut v, mut between] = [(); 5].map(|_| vec![Lane::ZERO; len]);
    let mut squares = Vec::with_capacity(inner);
    for group in 0..inner.div_ceil(LANES) {
        let at = lanes_of(group, inner);
        gather(at.map(|i| &points[i * len..][..len]), &mut p);
        gather(at.map(|i| &points[(i + 1) * len..][..len]), &mut y);
        gather(at.map(|i| &points[(i + 2) * len..][..len]), &mut q);
        space.log(&p, &q, &mut v);
        space.ray(&p, &v, Lane::new(at.map(share)), &mut between);
        let angle = space.log(&between, &y, &mut v);
        let apart = space.distance(&between, &y, &v, angle);
        let found = (apart * apart).to_array();
        for (l, &i) in at.iter().enumerate().take(inner - group * LANES) {
            let s = share(i);
            let [before, own, behind] = [i, i + 1, i + 2].map(|i| 1.0 / weights[i]);
            squares.push(found[l] / (own + (1.0 - s) * (1.0 - s) * before + s * s * behind));
        }
    }
    squares
}

/// The same estimate from the weighted squared residuals of a curve with given degrees of freedom per coordinate. It
/// is more robust: an outlier affects one residual, but three deviations from neighbours.
pub fn noise_beside(squares: &[f64], freedom: f64, m: usize) -> f64 {
    let left = (1.0 - freedom / squares.len() as f64).max(0.1);
    (median(squares) / chi::quantile(m, 0.5) / left).sqrt()
}

fn median(x: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = x.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Data without clear outliers: times, points and weights of the initial curve.
pub fn plausible(space: &Erased, data: &Data) -> [Vec<f64>; 3] {
    /// The number of rounds that remove data, and the squared deviation beyond which data are removed, in medians.
    const ROUNDS: usize = 4;
    const FAR: f64 = 12.0;
    let len = space.point_len();
    let pick = |chosen: &[usize]| {
        [
            chosen.iter().map(|&i| data.times[i]).collect::<Vec<f64>>(),
            chosen.iter().flat_map(|&i| data.points[i * len..][..len].to_vec()).collect(),
            chosen.iter().map(|&i| data.weights[i]).collect(),
        ]
    };
    let mut chosen = medoids(space, data);
    for _ in 0..ROUNDS {
        let [times, points, weights] = pick(&chosen);
        let found = deviations(space, &times, &points, &weights);
        let limit = FAR * median(&found);
        // An outlier affects the geodesics of its neighbours, too, so only the worst of several neighbours is
        // removed.
        let worst = |k: usize| {
            let near = &found[k.saturating_sub(1)..(k + 2).min(found.len())];
            found[k] > limit && near.iter().all(|x| *x <= found[k])
        };
        let before = chosen.len();
        let mut k = 0;
        chosen.retain(|_| {
            k += 1;
            k == 1 || k == before || !worst(k - 2)
        });
        if chosen.len() == before {
            break;
        }
    }
    pick(&chosen)
}

/// The number of the datum nearest to the others in every window of a few consecutive data. Two good data among five
/// prevail over outliers that do not agree.
fn medoids(space: &Erased, data: &Data) -> Vec<usize> {
    const WINDOW: usize = 5;
    const STRIDE: usize = 2;
    let len = space.point_len();
    let count = data.times.len();
    let window = WINDOW.min(count);
    let mut chosen = Vec::new();
    let [mut p, mut q, mut v] = [(); 3].map(|_| vec![Lane::ZERO; len]);
    let starts: Vec<usize> = (0..=count - window).step_by(STRIDE).collect();
    for group in 0..starts.len().div_ceil(LANES) {
        let at = lanes_of(group, starts.len()).map(|k| starts[k]);
        // Sums of the distances of each member from the others.
        let mut sums = [Lane::ZERO; WINDOW];
        for a in 0..window {
            gather(at.map(|i| &data.points[(i + a) * len..][..len]), &mut p);
            for b in 0..a {
                gather(at.map(|i| &data.points[(i + b) * len..][..len]), &mut q);
                let angle = space.log(&p, &q, &mut v);
                let apart = space.distance(&p, &q, &v, angle);
                (sums[a], sums[b]) = (sums[a] + apart, sums[b] + apart);
            }
        }
        for (l, i) in at.iter().enumerate().take(starts.len() - group * LANES) {
            let sum = |j: &usize| sums[*j].as_array()[l];
            chosen.extend((0..window).min_by(|a, b| sum(a).total_cmp(&sum(b))).map(|j| i + j));
        }
    }
    chosen.sort_unstable();
    chosen.dedup();
    // All windows may have selected the same datum.
    if chosen.len() < 2 || data.times[chosen[0]] == data.times[chosen[chosen.len() - 1]] {
        chosen = (0..count).collect();
    }
    chosen
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

    #[test]
    fn the_noise_level_matches_the_data() {
        use symspline_core::space::Kernels;
        let plane = symspline_vectors::Euclidean::new(1).unwrap();
        let space = Erased(&plane as &dyn Kernels);
        // Normal noise from a hash of its index, about a straight line.
        let n = 4001;
        let times: Vec<f64> = (0..n).map(|i| i as f64 + 0.3 * (i as f64).sin()).collect();
        let weights: Vec<f64> = (0..n).map(|i| 1.0 + (i % 3) as f64).collect();
        let normal = |u: f64| chi::quantile(1, (2.0 * u - 1.0).abs()).sqrt().copysign(u - 0.5);
        let points: Vec<f64> = (0..n)
            .map(|i| {
                let u = ((i as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0);
                3.0 * times[i] + 0.2 * normal(u.clamp(1e-9, 1.0 - 1e-9)) / weights[i].sqrt()
            })
            .collect();
        let none: &[f64] = &[];
        let data = Data {
            times: &times,
            points: &points,
            weights: &weights,
            information: none,
            knots: &times,
            lam: None,
            sigma: None,
            ends: [none; 2],
        };
        let found = noise(&space, &data);
        assert!((found / 0.2 - 1.0).abs() < 0.05, "{found}");
    }
}
