//! Symmetric banded matrices with a border of a few dense rows and columns. The unknowns of the border come first:
//!
//! ```text
//! A = (C Wᵀ; W B),    A⁻¹ = (S⁻¹, −S⁻¹Vᵀ; −VS⁻¹, B⁻¹ + VS⁻¹Vᵀ),    V = B⁻¹W,    S = C − WᵀV.
//! ```

use crate::banded::{Banded, Number};
use symspline_core::monitor::checkpoint;
use symspline_core::scalar::Lane;

/// A factored matrix.
pub struct Bordered<T = Lane> {
    /// B, factored.
    band: Banded<T>,
    /// W and V, row by row.
    sides: [Vec<T>; 2],
    /// S, row by row, ...
    schur: Vec<T>,
    /// ... and factored.
    corner: Banded<T>,
}

impl<T: Number> Bordered<T> {
    /// Factors a matrix. `side` is W, row by row, and `corner` is C; both are empty without a border.
    pub fn new(mut band: Banded<T>, side: Vec<T>, mut corner: Banded<T>) -> Self {
        band.factor();
        let size = corner.size;
        let mut v = side.clone();
        if size > 0 {
            band.solve(size, &mut v);
        }
        for a in 0..size {
            checkpoint();
            for b in 0..=a {
                let rows = side.chunks_exact(size).zip(v.chunks_exact(size));
                let entry = corner.entry(a, b);
                rows.for_each(|(w, v)| *entry = (-w[a]).mul_add(v[b], *entry));
            }
        }
        let schur = (0..size * size).map(|at| corner.at(at / size, at % size)).collect();
        corner.factor();
        Bordered { band, sides: [side, v], schur, corner }
    }

    /// S, row by row.
    pub fn schur(&self) -> Vec<T> {
        self.schur.clone()
    }

    /// The smallest pivot of B.
    pub fn band_pivot(&self) -> T {
        self.band.least_pivot()
    }

    /// The smallest pivot.
    pub fn least_pivot(&self) -> T {
        let [band, corner] = [&self.band, &self.corner].map(Banded::least_pivot);
        corner.least(band)
    }

    /// ln det.
    pub fn log_det(&self) -> T {
        self.band.log_det() + self.corner.log_det()
    }

    /// Multiplies rows of several numbers by the inverse, in place.
    pub fn solve(&self, columns: usize, x: &mut [T]) {
        let size = self.corner.size;
        let (first, rest) = x.split_at_mut(size * columns);
        self.band.solve(columns, rest);
        if size == 0 {
            return;
        }
        let [w, v] = &self.sides;
        for (w, row) in w.chunks_exact(size).zip(rest.chunks_exact(columns)) {
            checkpoint();
            for (factor, own) in w.iter().zip(first.chunks_exact_mut(columns)) {
                own.iter_mut().zip(row).for_each(|(x, y)| *x = (-*factor).mul_add(*y, *x));
            }
        }
        self.corner.solve(columns, first);
        for (v, row) in v.chunks_exact(size).zip(rest.chunks_exact_mut(columns)) {
            checkpoint();
            for (factor, own) in v.iter().zip(first.chunks_exact(columns)) {
                row.iter_mut().zip(own).for_each(|(x, y)| *x = (-*factor).mul_add(*y, *x));
            }
        }
    }

    /// Replaces independent normal numbers by a sample of the normal distribution whose covariance is A⁻¹: that of the
    /// border has the covariance S⁻¹, and the others have the mean −V times the border and the covariance B⁻¹.
    pub fn sample(&self, x: &mut [T]) {
        let size = self.corner.size;
        let (first, rest) = x.split_at_mut(size);
        self.corner.sample(first);
        self.band.sample(rest);
        if size > 0 {
            for (v, x) in self.sides[1].chunks_exact(size).zip(rest) {
                v.iter().zip(&*first).for_each(|(v, y)| *x = (-*v).mul_add(*y, *x));
            }
        }
    }

    /// The entries of the inverse in the border and inside the band.
    pub fn inverse(&self) -> Inverse<T> {
        let size = self.corner.size;
        let mut band = self.band.inverse_band();
        let mut corner = vec![T::ZERO; size * size];
        let mut side = vec![T::ZERO; band.size * size];
        if size > 0 {
            (0..size).for_each(|a| corner[a * size + a] = T::ONE);
            self.corner.solve(size, &mut corner);
            let v = &self.sides[1];
            for (row, out) in v.chunks_exact(size).zip(side.chunks_exact_mut(size)) {
                checkpoint();
                for (x, from) in row.iter().zip(corner.chunks_exact(size)) {
                    out.iter_mut().zip(from).for_each(|(out, c)| *out = (-*x).mul_add(*c, *out));
                }
            }
            for i in 0..band.size {
                checkpoint();
                for j in i.saturating_sub(band.width)..=i {
                    let rows = v[j * size..][..size].iter().zip(&side[i * size..][..size]);
                    *band.entry(i, j) -= rows.fold(T::ZERO, |sum, (v, x)| v.mul_add(*x, sum));
                }
            }
        }
        Inverse { corner, side, band }
    }
}

/// Entries of A⁻¹.
pub struct Inverse<T = Lane> {
    /// S⁻¹, row by row.
    pub corner: Vec<T>,
    /// −VS⁻¹, row by row.
    pub side: Vec<T>,
    /// B⁻¹ + VS⁻¹Vᵀ inside the band.
    pub band: Banded<T>,
}

impl<T: Number> Inverse<T> {
    /// The number of unknowns in the border.
    pub fn border(&self) -> usize {
        self.corner.len().isqrt()
    }

    /// An entry, which must lie in the border or inside the band.
    pub fn at(&self, i: usize, j: usize) -> T {
        let (size, i, j) = (self.border(), i.max(j), i.min(j));
        if i < size {
            self.corner[i * size + j]
        } else if j < size {
            self.side[(i - size) * size + j]
        } else {
            self.band.at(i - size, j - size)
        }
    }
}
