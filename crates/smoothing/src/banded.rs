//! Symmetric banded matrices: a single one, or one per SIMD lane.

use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};
use symspline_core::monitor::checkpoint;
use symspline_core::scalar::{Lane, lane};

/// The entries of a matrix: numbers, or lanes of them for several matrices at once.
pub trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// A number, on every lane.
    fn of(x: f64) -> Self;
    /// `self · b + c`.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// The square root.
    fn sqrt(self) -> Self;
    /// The natural logarithm.
    fn ln(self) -> Self;
    /// The smaller of the two; `other` if `self` is NaN.
    fn least(self, other: Self) -> Self;
}

impl Number for f64 {
    const ZERO: f64 = 0.0;
    const ONE: f64 = 1.0;
    fn of(x: f64) -> f64 {
        x
    }
    fn mul_add(self, b: f64, c: f64) -> f64 {
        self.mul_add(b, c)
    }
    fn sqrt(self) -> f64 {
        self.sqrt()
    }
    fn ln(self) -> f64 {
        self.ln()
    }
    fn least(self, other: f64) -> f64 {
        if self < other { self } else { other }
    }
}

impl Number for Lane {
    const ZERO: Lane = Lane::ZERO;
    const ONE: Lane = Lane::ONE;
    fn of(x: f64) -> Lane {
        lane(x)
    }
    fn mul_add(self, b: Lane, c: Lane) -> Lane {
        self.mul_add(b, c)
    }
    fn sqrt(self) -> Lane {
        self.sqrt()
    }
    fn ln(self) -> Lane {
        self.ln()
    }
    fn least(self, other: Lane) -> Lane {
        self.simd_lt(other).select(self, other)
    }
}

/// Bandwidth of BᵀWB and Ω.
pub const WIDTH: usize = 3;

/// Entries of a row of the band, for coupled coordinates.
pub fn stride(coupled: usize) -> usize {
    (WIDTH + 1) * coupled
}

/// Entries on the diagonal and `width` entries left of it, row by row; after [`factor`](Banded::factor) those of L
/// and D with A = L D Lᵀ.
#[derive(Clone)]
pub struct Banded<T = Lane> {
    /// The number of rows and columns.
    pub size: usize,
    /// The bandwidth: the number of subdiagonals.
    pub width: usize,
    entries: Vec<T>,
}

impl<T: Number> Banded<T> {
    /// The zero matrix.
    pub fn zeros(size: usize, width: usize) -> Self {
        Banded { size, width, entries: vec![T::ZERO; size * (width + 1)] }
    }

    /// The matrix whose entries (i, i − d) are `entry(i (width + 1) + d)`.
    pub fn of(size: usize, width: usize, entry: impl Fn(usize) -> T) -> Self {
        Banded { size, width, entries: (0..size * (width + 1)).map(entry).collect() }
    }

    fn position(&self, i: usize, j: usize) -> usize {
        let (row, column) = if i >= j { (i, j) } else { (j, i) };
        row * (self.width + 1) + row - column
    }

    /// The index of an entry inside the band.
    pub fn entry(&mut self, i: usize, j: usize) -> &mut T {
        let position = self.position(i, j);
        &mut self.entries[position]
    }

    /// An entry inside the band.
    pub fn at(&self, i: usize, j: usize) -> T {
        self.entries[self.position(i, j)]
    }

    /// Factors the matrix in place; positive definite matrices need no pivoting.
    pub fn factor(&mut self) {
        let (w, stride) = (self.width, self.width + 1);
        let mut scaled = vec![T::ZERO; stride];
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
    pub fn least_pivot(&self) -> T {
        (0..self.size)
            .map(|i| self.entries[i * (self.width + 1)])
            .fold(T::of(f64::INFINITY), |least, d| d.least(least))
    }

    /// ln det A of a factored matrix.
    pub fn log_det(&self) -> T {
        (0..self.size).fold(T::ZERO, |sum, i| sum + self.entries[i * (self.width + 1)].ln())
    }

    /// A⁻¹x of a factored matrix, in place, for rows of several numbers.
    pub fn solve(&self, columns: usize, x: &mut [T]) {
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
            let inverse = T::ONE / self.entries[i * stride];
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
    pub fn sample(&self, x: &mut [T]) {
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
    pub fn inverse_band(&self) -> Self {
        let (n, w, stride) = (self.size, self.width, self.width + 1);
        let mut z = Banded::zeros(n, w);
        for i in (0..n).rev() {
            checkpoint();
            let most = w.min(n - 1 - i);
            for d in (0..=most).rev() {
                let j = i + d;
                let mut sum = if d == 0 { T::ONE / self.entries[i * stride] } else { T::ZERO };
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
