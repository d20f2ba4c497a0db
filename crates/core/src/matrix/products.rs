//! Products of matrices.

use super::base::{Matrix, Storage};
use super::blocked::{self, LARGE};
use super::entry::{Entry, conjugate, inner_add, mul_add, mul_add_lane};
use crate::scalar::{Lane, Scalar, few};

impl<S: Scalar, const D: usize, A: Storage> Matrix<S, D, A> {
    /// `A B`.
    #[inline(always)]
    pub fn times(&self, b: &Self) -> Self {
        if A::ANY { (A::compiled().times)(self, b) } else { self.times_here(b) }
    }

    pub(super) fn times_here(&self, b: &Self) -> Self {
        if A::ANY && b.is_large() {
            return blocked::times(self, b);
        }
        let mut out = Self::zeros(self.rows(), b.cols());
        for i in 0..self.rows() {
            for j in 0..b.cols() {
                let mut sum = [S::constant(Lane::ZERO); D];
                for k in 0..self.cols() {
                    sum = mul_add::<S, D, false>(self[(i, k)], b[(k, j)], sum);
                }
                out[(i, j)] = sum;
            }
        }
        out
    }

    /// Whether products with this matrix are faster in another order of loops.
    #[inline(always)]
    fn is_large(&self) -> bool {
        self.rows() * self.cols() >= LARGE * LARGE
    }

    /// `A* B`.
    #[inline(always)]
    pub fn adjoint_times(&self, b: &Self) -> Self {
        if A::ANY { (A::compiled().adjoint_times)(self, b) } else { self.adjoint_times_here(b) }
    }

    pub(super) fn adjoint_times_here(&self, b: &Self) -> Self {
        if A::ANY && b.is_large() {
            return blocked::times(&self.adjoint(), b);
        }
        let mut out = Self::zeros(self.cols(), b.cols());
        for k in 0..self.rows() {
            for i in 0..self.cols() {
                let a = conjugate(self.data[k * self.cols() + i]);
                let row = &mut out.data[i * b.cols()..][..b.cols()];
                for (c, b) in row.iter_mut().zip(&b.data[k * b.cols()..][..b.cols()]) {
                    *c = mul_add::<S, D, false>(a, *b, *c);
                }
            }
        }
        out
    }

    /// `A B*`.
    #[inline(always)]
    pub fn times_adjoint(&self, b: &Self) -> Self {
        if A::ANY { (A::compiled().times_adjoint)(self, b) } else { self.times_adjoint_here(b) }
    }

    pub(super) fn times_adjoint_here(&self, b: &Self) -> Self {
        if A::ANY && b.is_large() {
            return blocked::times(self, &b.adjoint());
        }
        Self::from_fn(self.rows(), b.rows(), |i, j| self.row_product(i, b, j, [S::constant(Lane::ZERO); D]))
    }

    /// `(1 + A)(1 + B) − 1`: products of matrices close to the identity without cancellation.
    #[inline(always)]
    pub fn compose(&self, b: &Self) -> Self {
        if A::ANY { (A::compiled().compose)(self, b) } else { self.compose_here(b) }
    }

    pub(super) fn compose_here(&self, b: &Self) -> Self {
        let product = self.times(b);
        let (x, y, z) = (product.entries(), self.entries(), b.entries());
        Self::collected(self.shape, |i| few(|c| x[i][c] + y[i][c] + z[i][c]))
    }

    /// `(1 + A)(1 + A*) − 1`, exactly Hermitian.
    pub fn gram(&self) -> Self {
        if A::ANY && self.is_large() {
            return (&self.times_adjoint(self) + &(self + &self.adjoint())).hermitian_part();
        }
        Self::hermitian(self.rows(), |i, j| {
            let (a, b) = (self[(i, j)], conjugate(self[(j, i)]));
            self.row_product(i, self, j, few(|c| a[c] + b[c]))
        })
    }

    /// `A B*` if it is Hermitian: one half of it is computed.
    #[inline(always)]
    pub fn times_adjoint_hermitian(&self, b: &Self) -> Self {
        if A::ANY {
            (A::compiled().times_adjoint_hermitian)(self, b)
        } else {
            self.times_adjoint_hermitian_here(b)
        }
    }

    pub(super) fn times_adjoint_hermitian_here(&self, b: &Self) -> Self {
        if A::ANY && b.is_large() {
            return self.times_adjoint(b).hermitian_part();
        }
        Self::hermitian(self.rows(), |i, j| self.row_product(i, b, j, [S::constant(Lane::ZERO); D]))
    }

    /// `L X L*` of this Hermitian matrix X for a lower triangular L without derivatives: half of the numbers of half of
    /// the products.
    #[inline(always)]
    pub fn congruent_by(&self, l: &Matrix<Lane, D, A>) -> Self {
        if A::ANY {
            let l = l.map(S::constant);
            return l.times(self).times_adjoint_hermitian(&l);
        }
        let (n, zero) = (self.rows(), [S::constant(Lane::ZERO); D]);
        let mut half = Self::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                let product = |sum, k| mul_add_lane::<S, D, false>(self[(k, j)], l[(i, k)], sum);
                half[(i, j)] = (0..=i).fold(zero, product);
            }
        }
        Self::hermitian(n, |i, j| {
            conjugate((0..=i).fold(zero, |sum, k| mul_add_lane::<S, D, true>(half[(j, k)], l[(i, k)], sum)))
        })
    }

    /// From the entries on and above the diagonal, exactly Hermitian.
    fn hermitian(n: usize, f: impl Fn(usize, usize) -> Entry<S, D>) -> Self {
        let mut out = Self::zeros(n, n);
        for i in 0..n {
            for j in i..n {
                let x = f(i, j);
                out[(i, j)] = x;
                out[(j, i)] = conjugate(x);
            }
            if D > 1 {
                out[(i, i)][D - 1] = S::constant(Lane::ZERO);
            }
        }
        out
    }

    /// Row i of A times the adjoint of row j of B, added to `sum`.
    #[inline(always)]
    fn row_product(&self, i: usize, b: &Self, j: usize, mut sum: Entry<S, D>) -> Entry<S, D> {
        let (x, y) = (&self.data[i * self.cols()..][..self.cols()], &b.data[j * b.cols()..][..b.cols()]);
        for (x, y) in x.iter().zip(y) {
            sum = mul_add::<S, D, true>(*x, *y, sum);
        }
        sum
    }

    /// `Re tr A*B`.
    pub fn inner(&self, b: &Self) -> S {
        let mut sum = S::constant(Lane::ZERO);
        for (a, b) in self.entries().iter().zip(b.entries()) {
            sum = inner_add(*a, *b, sum);
        }
        sum
    }
}
