//! Banded matrices of open and closed curves.
//!
//! The coefficients of a closed curve continue after the last one with the first ones, transformed by the holonomy H
//! of the curve. A matrix A that is banded in the coefficients with `overlap` of them repeated at the end becomes
//! EᵀAE, where E repeats and transforms them. The first coefficients border the others, which are banded:
//!
//! ```text
//! EᵀAE = (C Wᵀ; W B),    (EᵀAE)⁻¹ = (S⁻¹, −S⁻¹Vᵀ; −VS⁻¹, B⁻¹ + VS⁻¹Vᵀ),    V = B⁻¹W,    S = C − WᵀV.
//! ```

use crate::banded::Banded;
use symspline_core::scalar::{Lane, lane};

/// The periodic correction of a closed curve: how its coefficients continue at its start.
#[derive(Clone)]
pub struct PeriodicCorrection {
    /// The number of coefficients that are repeated after the last one.
    pub overlap: usize,
    /// The number of coordinates of a coefficient.
    pub m: usize,
    /// H, m × m numbers row by row: maps a vector at the start to the frame transported around the curve.
    pub turn: Vec<f64>,
}

impl PeriodicCorrection {
    /// A correction without holonomy.
    pub fn plain(overlap: usize, m: usize) -> Self {
        let turn = (0..m * m).map(|at| f64::from(at / m == at % m)).collect();
        PeriodicCorrection { overlap, m, turn }
    }

    /// Whether H is the identity.
    pub fn is_plain(&self) -> bool {
        /// The size of rounding errors of frames transported around the curve.
        const NONE: f64 = 1e-13;
        let off = |(at, x): (usize, &f64)| (x - f64::from(at / self.m == at % self.m)).abs();
        self.turn.iter().enumerate().map(off).all(|x| x < NONE)
    }

    /// Repeats the first coefficients, of m numbers each, after the last one: Ex.
    pub fn extend(&self, x: &mut Vec<f64>) {
        for k in 0..self.overlap * self.m {
            let (block, row) = (k / self.m, k % self.m);
            x.push((0..self.m).map(|c| self.turn[row * self.m + c] * x[block * self.m + c]).sum());
        }
    }

    /// The same for eight λ.
    pub fn extend_lanes(&self, x: &mut Vec<Lane>) {
        for k in 0..self.overlap * self.m {
            let (block, row) = (k / self.m, k % self.m);
            let term = |c: usize| x[block * self.m + c] * lane(self.turn[row * self.m + c]);
            let sum = (0..self.m).fold(Lane::ZERO, |sum, c| sum + term(c));
            x.push(sum);
        }
    }

    /// Eᵀx.
    pub fn fold(&self, x: &mut Vec<f64>) {
        let behind = x.split_off(x.len() - self.overlap * self.m);
        for (at, y) in behind.iter().enumerate() {
            let (block, row) = (at / self.m, at % self.m);
            (0..self.m).for_each(|c| x[block * self.m + c] += self.turn[row * self.m + c] * y);
        }
    }
}

/// A factored matrix.
pub struct Factored {
    /// The number of coefficients, or of those that do not belong to the border.
    band: Banded,
    border: Option<Border>,
}

struct Border {
    /// The number of entries in the border.
    size: usize,
    /// H.
    turn: Vec<f64>,
    /// W and V, row by row.
    sides: [Vec<Lane>; 2],
    /// S, factored.
    corner: Banded,
}

impl Factored {
    /// Factors a matrix in coefficients of `coupled` numbers. The correction of a closed curve must have as many
    /// coordinates.
    pub fn new(mut whole: Banded, periodic: Option<&PeriodicCorrection>) -> Self {
        let Some(periodic) = periodic else {
            whole.factor();
            return Factored { band: whole, border: None };
        };
        let (m, width) = (periodic.m, whole.width);
        let size = periodic.overlap * m;
        // The number of coefficients without repetitions, and of those in the border.
        let count = whole.size - size;
        let inner = count - size;
        let near = |i: usize, j: usize| if i.abs_diff(j) <= width { whole.at(i, j) } else { Lane::ZERO };
        // A[i, repeated] H: the contribution of a repeated coefficient to the first one.
        let again = |i: usize, b: usize| {
            let (block, c) = (b / m, b % m);
            (0..m).fold(Lane::ZERO, |sum, row| {
                sum + near(i, count + block * m + row) * lane(periodic.turn[row * m + c])
            })
        };
        let mut band = Banded::of(inner, width, |at| {
            let (i, d) = (at / (width + 1), at % (width + 1));
            if d <= i { whole.at(size + i, size + i - d) } else { Lane::ZERO }
        });
        band.factor();
        let mut w = vec![Lane::ZERO; inner * size];
        for i in 0..inner {
            for b in 0..size {
                if i < width || i + width + size >= inner {
                    w[i * size + b] = near(size + i, b) + again(size + i, b);
                }
            }
        }
        let mut v = w.clone();
        band.solve(size, &mut v);
        let mut corner = Banded::zeros(size, size.saturating_sub(1));
        for a in 0..size {
            for b in 0..=a {
                let (block, c) = (a / m, a % m);
                // HᵀA[repeated, repeated]H.
                let twice = (0..m).fold(Lane::ZERO, |sum, row| {
                    sum + again(count + block * m + row, b) * lane(periodic.turn[row * m + c])
                });
                let mut sum = near(a, b) + again(a, b) + again(b, a) + twice;
                for i in 0..inner {
                    sum -= w[i * size + a] * v[i * size + b];
                }
                *corner.entry(a, b) = sum;
            }
        }
        corner.factor();
        let border = Border { size, turn: periodic.turn.clone(), sides: [w, v], corner };
        Factored { band, border: Some(border) }
    }

    /// The smallest pivot.
    pub fn least_pivot(&self) -> Lane {
        let least = self.band.least_pivot();
        self.border.as_ref().map_or(least, |border| {
            let own = border.corner.least_pivot();
            own.simd_lt(least).select(own, least)
        })
    }

    /// ln det.
    pub fn log_det(&self) -> Lane {
        let own = self.band.log_det();
        self.border.as_ref().map_or(own, |border| own + border.corner.log_det())
    }

    /// Multiplies rows of several numbers by the inverse, in place.
    pub fn solve(&self, columns: usize, x: &mut [Lane]) {
        let Some(border) = &self.border else { return self.band.solve(columns, x) };
        let [w, v] = &border.sides;
        let (first, rest) = x.split_at_mut(border.size * columns);
        self.band.solve(columns, rest);
        for (i, row) in rest.chunks_exact(columns).enumerate() {
            for b in 0..border.size {
                let factor = w[i * border.size + b];
                let own = &mut first[b * columns..][..columns];
                own.iter_mut().zip(row).for_each(|(x, y)| *x = (-factor).mul_add(*y, *x));
            }
        }
        border.corner.solve(columns, first);
        for (i, row) in rest.chunks_exact_mut(columns).enumerate() {
            for b in 0..border.size {
                let factor = v[i * border.size + b];
                let own = &first[b * columns..][..columns];
                row.iter_mut().zip(own).for_each(|(x, y)| *x = (-factor).mul_add(*y, *x));
            }
        }
    }

    /// The band of the inverse; for a closed curve that of E(EᵀAE)⁻¹Eᵀ.
    pub fn inverse_band(&self) -> Banded {
        let own = self.band.inverse_band();
        let Some(border) = &self.border else { return own };
        let (size, width, v) = (border.size, self.band.width, &border.sides[1]);
        let m = (border.turn.len() as f64).sqrt() as usize;
        let mut corner = vec![Lane::ZERO; size * size];
        (0..size).for_each(|a| corner[a * size + a] = Lane::ONE);
        border.corner.solve(size, &mut corner);
        let count = size + own.size;
        // −VS⁻¹.
        let mut side = vec![Lane::ZERO; own.size * size];
        for (row, out) in v.chunks_exact(size).zip(side.chunks_exact_mut(size)) {
            for (b, x) in row.iter().enumerate() {
                let from = &corner[b * size..][..size];
                out.iter_mut().zip(from).for_each(|(out, c)| *out = (-*x).mul_add(*c, *out));
            }
        }
        // An entry among the coefficients that are not repeated.
        let plain = |i: usize, j: usize| {
            let (i, j) = (i.max(j), i.min(j));
            if i < size {
                corner[i * size + j]
            } else if j < size {
                side[(i - size) * size + j]
            } else {
                let (i, j) = (i - size, j - size);
                let dot =
                    (0..size).fold(Lane::ZERO, |sum, b| v[j * size + b].mul_add(side[i * size + b], sum));
                own.at(i, j) - dot
            }
        };
        let turned = |i: usize, j: &dyn Fn(usize) -> Lane| {
            let (block, row) = ((i - count) / m, (i - count) % m);
            (0..m).fold(Lane::ZERO, |sum, c| sum + j(block * m + c) * lane(border.turn[row * m + c]))
        };
        Banded::of(count + size, width, |at| {
            let (i, d) = (at / (width + 1), at % (width + 1));
            if d > i {
                return Lane::ZERO;
            }
            let j = i - d;
            if i < count {
                plain(i, j)
            } else if j < count {
                turned(i, &|k| plain(k, j))
            } else {
                turned(i, &|k| turned(j, &|l| plain(k, l)))
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closes_and_inverts() {
        for (count, m, width) in [(3, 1, 3), (4, 1, 3), (9, 1, 3), (3, 2, 7), (5, 2, 7), (8, 2, 7)] {
            let (sine, cosine) = 0.7_f64.sin_cos();
            let turn = if m == 1 { vec![1.0] } else { vec![cosine, -sine, sine, cosine] };
            let periodic = PeriodicCorrection { overlap: 3, m, turn };
            let long = (count + 3) * m;
            let whole = Banded::of(long, width, |at| {
                let (i, d) = (at / (width + 1), at % (width + 1));
                lane(if d == 0 {
                    20.0
                } else if d <= i {
                    ((i * 7 + d * 3) as f64).sin()
                } else {
                    0.0
                })
            });
            let dense = |i: usize, j: usize| if i.abs_diff(j) <= width { whole.at(i, j) } else { Lane::ZERO };
            let factored = Factored::new(whole.clone(), Some(&periodic));
            let band = factored.inverse_band();
            assert!(factored.least_pivot().simd_gt(Lane::ZERO).all());
            for column in 0..count * m {
                let mut x = vec![Lane::ZERO; count * m];
                x[column] = Lane::ONE;
                factored.solve(1, &mut x);
                periodic.extend_lanes(&mut x);
                // The product with EᵀAE is the unit vector again.
                let product: Vec<f64> = (0..long)
                    .map(|i| (0..long).fold(Lane::ZERO, |sum, j| sum + dense(i, j) * x[j]).as_array()[0])
                    .collect();
                let mut product = product;
                periodic.fold(&mut product);
                for (i, y) in product.iter().enumerate() {
                    assert!((y - f64::from(i == column)).abs() < 1e-13, "{count} {m}: {i} {column} {y}");
                }
                for i in 0..long {
                    if i.abs_diff(column) <= width {
                        assert!((band.at(i, column) - x[i]).abs().simd_lt(lane(1e-14)).all());
                    }
                }
            }
        }
    }
}
