//! Symmetric banded matrices, one per SIMD lane.

use symspline_core::monitor::checkpoint;
use symspline_core::scalar::Lane;

/// Bandwidth of BᵀWB and Ω.
pub const WIDTH: usize = 3;

/// Entries of a row of the band, for coupled coordinates.
pub fn stride(coupled: usize) -> usize {
    (WIDTH + 1) * coupled
}

/// Entries on the diagonal and `width` entries left of it, row by row; after [`factor`](Banded::factor) those of L
/// and D with A = L D Lᵀ.
#[derive(Clone, Default)]
pub struct Banded {
    /// The number of rows and columns.
    pub size: usize,
    /// The bandwidth: the number of subdiagonals.
    pub width: usize,
    entries: Vec<Lane>,
}

impl Banded {
    /// The zero matrix.
    pub fn zeros(size: usize, width: usize) -> Self {
        Banded { size, width, entries: vec![Lane::ZERO; size * (width + 1)] }
    }

    /// The matrix whose entries (i, i − d) are `entry(i (width + 1) + d)`.
    pub fn of(size: usize, width: usize, entry: impl Fn(usize) -> Lane) -> Self {
        Banded { size, width, entries: (0..size * (width + 1)).map(entry).collect() }
    }

    fn position(&self, i: usize, j: usize) -> usize {
        let (row, column) = if i >= j { (i, j) } else { (j, i) };
        row * (self.width + 1) + row - column
    }

    /// The index of an entry inside the band.
    pub fn entry(&mut self, i: usize, j: usize) -> &mut Lane {
        let position = self.position(i, j);
        &mut self.entries[position]
    }

    /// An entry inside the band.
    pub fn at(&self, i: usize, j: usize) -> Lane {
        self.entries[self.position(i, j)]
    }

    /// Factors the matrix in place; positive definite matrices need no pivoting.
    pub fn factor(&mut self) {
        let (w, stride) = (self.width, self.width + 1);
        let mut scaled = vec![Lane::ZERO; stride];
        for i in 0..self.size {
            checkpoint();
            let most = w.min(i);
            // L_ij D_j = A_ij − Σ_k L_ik D_k L_jk, from the outermost column inwards.
            for d in (1..=most).rev() {
                let j = i - d;
                let mut sum = self.entries[i * stride + d];
                for k in (d + 1)..=most.min(w + d) {
                    if k - d <= w {
                        sum -= scaled[k] * self.entries[j * stride + k - d];
                    }
                }
                scaled[d] = sum;
            }
            let mut pivot = self.entries[i * stride];
            for d in 1..=most {
                let l = scaled[d] / self.entries[(i - d) * stride];
                pivot -= l * scaled[d];
                self.entries[i * stride + d] = l;
            }
            self.entries[i * stride] = pivot;
        }
    }

    /// The smallest pivot of a factored matrix.
    pub fn least_pivot(&self) -> Lane {
        (0..self.size)
            .map(|i| self.entries[i * (self.width + 1)])
            .fold(Lane::splat(f64::INFINITY), |least, d| d.simd_lt(least).select(d, least))
    }

    /// ln det A of a factored matrix.
    pub fn log_det(&self) -> Lane {
        (0..self.size).fold(Lane::ZERO, |sum, i| sum + self.entries[i * (self.width + 1)].ln())
    }

    /// A⁻¹x of a factored matrix, in place, for rows of several numbers.
    pub fn solve(&self, columns: usize, x: &mut [Lane]) {
        let (w, stride) = (self.width, self.width + 1);
        for i in 0..self.size {
            checkpoint();
            let (before, here) = x.split_at_mut(i * columns);
            for d in 1..=w.min(i) {
                let l = self.entries[i * stride + d];
                let row = &before[(i - d) * columns..][..columns];
                here[..columns].iter_mut().zip(row).for_each(|(x, y)| *x = (-l).mul_add(*y, *x));
            }
        }
        for i in (0..self.size).rev() {
            checkpoint();
            let (here, behind) = x[i * columns..].split_at_mut(columns);
            let inverse = Lane::ONE / self.entries[i * stride];
            here.iter_mut().for_each(|x| *x *= inverse);
            for d in 1..=w.min(self.size - 1 - i) {
                let l = self.entries[(i + d) * stride + d];
                let row = &behind[(d - 1) * columns..][..columns];
                here.iter_mut().zip(row).for_each(|(x, y)| *x = (-l).mul_add(*y, *x));
            }
        }
    }

    /// L⁻ᵀD^{−1/2}x of a factored matrix, in place: for independent normal numbers x, a sample of the normal distribution
    /// with covariance A⁻¹.
    pub fn sample(&self, x: &mut [Lane]) {
        let stride = self.width + 1;
        for i in (0..self.size).rev() {
            checkpoint();
            x[i] /= self.entries[i * stride].sqrt();
            for d in 1..=self.width.min(self.size - 1 - i) {
                let l = self.entries[(i + d) * stride + d];
                x[i] = (-l).mul_add(x[i + d], x[i]);
            }
        }
    }

    /// The entries of A⁻¹ inside the band, of a factored matrix, by Takahashi's recursion (Erisman & Tinney 1975) `Z
    /// = D⁻¹L⁻¹ + (1 − Lᵀ)Z`.
    pub fn inverse_band(&self) -> Banded {
        let (n, w, stride) = (self.size, self.width, self.width + 1);
        let mut z = Banded::zeros(n, w);
        for i in (0..n).rev() {
            checkpoint();
            let most = w.min(n - 1 - i);
            for d in (0..=most).rev() {
                let j = i + d;
                let mut sum = if d == 0 { Lane::ONE / self.entries[i * stride] } else { Lane::ZERO };
                for k in 1..=most {
                    sum -= self.entries[(i + k) * stride + k] * z.at(i + k, j);
                }
                let position = z.position(i, j);
                z.entries[position] = sum;
            }
        }
        z
    }
}
