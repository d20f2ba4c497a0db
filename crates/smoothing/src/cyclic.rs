//! Banded matrices of open and closed curves.
//!
//! The coefficients of a closed curve continue after the last one with the first ones, transformed by the holonomy H
//! of the curve. A matrix A that is banded in the coefficients with `overlap` of them repeated at the end becomes
//! EᵀAE, where E repeats and transforms them. The first coefficients border the others, which are banded.

use crate::banded::{Banded, Number};
use crate::bordered::{Bordered, Inverse};
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

    /// The same for the λ of all lanes.
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

/// The factored matrix of an open or a closed curve.
pub struct Factored<T = Lane> {
    matrix: Bordered<T>,
    /// H of a closed curve.
    turn: Option<Vec<f64>>,
}

impl<T: Number> Factored<T> {
    /// Factors a matrix in coefficients of `coupled` numbers. The correction of a closed curve must have as many
    /// coordinates.
    pub fn new(whole: Banded<T>, periodic: Option<&PeriodicCorrection>) -> Self {
        let Some(periodic) = periodic else {
            return Factored::open(Bordered::new(whole, Vec::new(), Banded::zeros(0, 0)));
        };
        let (m, width) = (periodic.m, whole.width);
        let size = periodic.overlap * m;
        // The number of coefficients without repetitions, and of those in the border.
        let count = whole.size - size;
        let inner = count - size;
        let near = |i: usize, j: usize| if i.abs_diff(j) <= width { whole.at(i, j) } else { T::ZERO };
        // A[i, repeated] H: the contribution of a repeated coefficient to the first one.
        let again = |i: usize, b: usize| {
            let (block, c) = (b / m, b % m);
            (0..m).fold(T::ZERO, |sum, row| {
                sum + near(i, count + block * m + row) * T::of(periodic.turn[row * m + c])
            })
        };
        let band = Banded::of(inner, width, |at| {
            let (i, d) = (at / (width + 1), at % (width + 1));
            if d <= i { whole.at(size + i, size + i - d) } else { T::ZERO }
        });
        let mut w = vec![T::ZERO; inner * size];
        for i in 0..inner {
            for b in 0..size {
                if i < width || i + width + size >= inner {
                    w[i * size + b] = near(size + i, b) + again(size + i, b);
                }
            }
        }
        let mut corner = Banded::zeros(size, size.saturating_sub(1));
        for a in 0..size {
            for b in 0..=a {
                let (block, c) = (a / m, a % m);
                // HᵀA[repeated, repeated]H.
                let twice = (0..m).fold(T::ZERO, |sum, row| {
                    sum + again(count + block * m + row, b) * T::of(periodic.turn[row * m + c])
                });
                *corner.entry(a, b) = near(a, b) + again(a, b) + again(b, a) + twice;
            }
        }
        Factored { matrix: Bordered::new(band, w, corner), turn: Some(periodic.turn.clone()) }
    }

    /// The matrix of an open curve, with a border of parameters.
    pub fn open(matrix: Bordered<T>) -> Self {
        Factored { matrix, turn: None }
    }

    /// Replaces independent normal numbers by a sample of the normal distribution whose covariance is the inverse.
    pub fn sample(&self, x: &mut [T]) {
        self.matrix.sample(x);
    }

    /// The smallest pivot.
    pub fn least_pivot(&self) -> T {
        self.matrix.least_pivot()
    }

    /// ln det.
    pub fn log_det(&self) -> T {
        self.matrix.log_det()
    }

    /// Multiplies rows of several numbers by the inverse, in place.
    pub fn solve(&self, columns: usize, x: &mut [T]) {
        self.matrix.solve(columns, x);
    }

    /// The entries of the inverse in the border of parameters and inside the band; for a closed curve those of
    /// E(EᵀAE)⁻¹Eᵀ.
    pub fn inverse(&self) -> Inverse<T> {
        if self.turn.is_some() {
            return Inverse { corner: Vec::new(), side: Vec::new(), band: self.inverse_band() };
        }
        self.matrix.inverse()
    }

    /// The band of the inverse; for a closed curve that of E(EᵀAE)⁻¹Eᵀ.
    pub fn inverse_band(&self) -> Banded<T> {
        let inverse = self.matrix.inverse();
        let Some(turn) = &self.turn else { return inverse.band };
        let m = (turn.len() as f64).sqrt() as usize;
        let (size, width) = (inverse.border(), inverse.band.width);
        let count = size + inverse.band.size;
        let plain = |i: usize, j: usize| inverse.at(i, j);
        let turned = |i: usize, j: &dyn Fn(usize) -> T| {
            let (block, row) = ((i - count) / m, (i - count) % m);
            (0..m).fold(T::ZERO, |sum, c| sum + j(block * m + c) * T::of(turn[row * m + c]))
        };
        Banded::of(count + size, width, |at| {
            let (i, d) = (at / (width + 1), at % (width + 1));
            if d > i {
                return T::ZERO;
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
