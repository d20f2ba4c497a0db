//! Tangent vectors at the origin as matrices, and their coordinates.

use crate::matrix::{Matrix, Storage, by_size};
use crate::scalar::{Lane, Scalar, lane};
use std::marker::PhantomData;

/// A space of n × n matrices: Hermitian or skew-Hermitian, real (D = 1) or complex (D = 2), with or
/// without the multiples of the identity.
///
/// Coordinates are orthonormal for `Re tr x*y`, for skew-symmetric real matrices for half of it.
#[derive(Clone, Copy)]
pub struct Algebra<const D: usize, A> {
    /// Rows and columns.
    pub n: usize,
    /// Whether matrices are skew-Hermitian instead of Hermitian.
    pub skew: bool,
    /// Whether multiples of the identity are excluded.
    pub traceless: bool,
    /// The storage of the matrices.
    pub storage: PhantomData<A>,
}

impl<const D: usize, A: Storage> Algebra<D, A> {
    /// Number of coordinates.
    pub fn dim(&self) -> usize {
        let n = self.n;
        let diagonal = if self.skew && D == 1 { 0 } else { n - usize::from(self.traceless) };
        diagonal + D * (n * (n - 1) / 2)
    }

    fn off_diagonal(&self) -> f64 {
        if self.skew && D == 1 { 1.0 } else { std::f64::consts::SQRT_2 }
    }

    /// Where the numbers of the diagonal are: the real or the imaginary part.
    fn part(&self) -> usize {
        if self.skew { D - 1 } else { 0 }
    }

    /// Coordinates of a matrix.
    pub fn coordinates<S: Scalar>(&self, m: &Matrix<S, D, A>, x: &mut [S]) {
        let n = self.n;
        let mut at = 0;
        if !(self.skew && D == 1) {
            let part = self.part();
            if self.traceless {
                let mut sum = m[(0, 0)][part];
                for j in 1..n {
                    let next = m[(j, j)][part];
                    x[at] = (sum - next * lane(j as f64)) * lane(1.0 / ((j * (j + 1)) as f64).sqrt());
                    (sum, at) = (sum + next, at + 1);
                }
            } else {
                for j in 0..n {
                    x[j] = m[(j, j)][part];
                }
                at = n;
            }
        }
        let factor = lane(self.off_diagonal());
        for i in 0..n {
            for j in i + 1..n {
                for c in 0..D {
                    x[at] = m[(i, j)][c] * factor;
                    at += 1;
                }
            }
        }
    }

    /// The matrix with given coordinates.
    pub fn matrix<S: Scalar>(&self, x: &[S]) -> Matrix<S, D, A> {
        self.multiple(1.0, x)
    }

    /// `scale` times the matrix with given coordinates; the transvections use `scale` = ±½.
    pub fn multiple<S: Scalar>(&self, scale: f64, x: &[S]) -> Matrix<S, D, A> {
        let n = self.n;
        let mut m = Matrix::zeros(n, n);
        let mut at = 0;
        if !(self.skew && D == 1) {
            let part = self.part();
            if self.traceless {
                // The j-th direction is (1, …, 1, −j, 0, …)/√(j(j+1)).
                for j in 1..n {
                    let value = x[at] * lane(scale / ((j * (j + 1)) as f64).sqrt());
                    for i in 0..j {
                        m[(i, i)][part] = m[(i, i)][part] + value;
                    }
                    m[(j, j)][part] = m[(j, j)][part] - value * lane(j as f64);
                    at += 1;
                }
            } else {
                for j in 0..n {
                    m[(j, j)][part] = x[j] * lane(scale);
                }
                at = n;
            }
        }
        let factor = lane(scale / self.off_diagonal());
        let sign = if self.skew { lane(-1.0) } else { Lane::ONE };
        for i in 0..n {
            for j in i + 1..n {
                for c in 0..D {
                    let value = x[at] * factor;
                    m[(i, j)][c] = value;
                    m[(j, i)][c] = if c == 0 { value * sign } else { value * -sign };
                    at += 1;
                }
            }
        }
        m
    }

    /// `[½a, [½b, c]]`: elements of 𝔪 act by half their matrices.
    pub fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        let (a, b, c) = (self.multiple(0.5, a), self.multiple(0.5, b), self.matrix(c));
        self.coordinates(&commutator(&a, &commutator(&b, &c)), out);
    }

    /// `S(v) x = Σ ad²ʲ x/(2j+1)!` of Lemma A.2, with the bracket of ½v and matrices.
    pub fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        let (half, start) = (self.multiple(0.5, v), self.matrix(x));
        let sum =
            stretch_series(half.size() * lane(2.0), &start, |x| commutator(&half, &commutator(&half, x)));
        self.coordinates(&sum, x);
    }
}

fn commutator<S: Scalar, const D: usize, A: Storage>(
    a: &Matrix<S, D, A>,
    x: &Matrix<S, D, A>,
) -> Matrix<S, D, A> {
    &a.times(x) - &x.times(a)
}

/// `Σ (ad²)ʲ x/(2j+1)!` where `size` bounds the norm of ad.
pub fn stretch_series<S: Scalar, const D: usize, A: Storage>(
    size: Lane,
    x: &Matrix<S, D, A>,
    twice: impl Fn(&Matrix<S, D, A>) -> Matrix<S, D, A>,
) -> Matrix<S, D, A> {
    // The first omitted term is below 1e-16.
    const TIERS: [f64; 5] = [0.1, 0.5, 1.5, 3.5, 8.0];
    const TERMS: [usize; 6] = [4, 7, 10, 15, 23, 40];
    by_size(size, &TIERS, |tier| {
        let (mut sum, mut term) = (x.clone(), x.clone());
        for j in 1..=TERMS[tier] {
            term = twice(&term).scaled(lane(1.0 / ((2 * j) * (2 * j + 1)) as f64));
            sum = &sum + &term;
        }
        sum
    })
}
