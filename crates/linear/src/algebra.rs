//! Lie algebras of matrices, by bases that are orthonormal for Re tr x*y.

use crate::members::Members;
use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::sync::{Mutex, OnceLock, PoisonError};
use symspline_core::matrix::{Dynamic, Matrix, Storage};
use symspline_core::scalar::{Lane, Scalar, lane};
use symspline_core::space::stretch_series;

/// A basis matrix: the positions of its nonzero numbers, row by row, and the numbers.
type Element = Vec<(usize, f64)>;

/// A Lie algebra of n × n matrices, real for D = 1, complex for D = 2.
#[derive(Clone, Copy)]
pub struct Algebra<const D: usize, A = Dynamic> {
    n: usize,
    members: Members,
    basis: &'static OnceLock<Vec<Element>>,
    storage: PhantomData<A>,
}

/// Bases by the number of components of an entry, the size and the group.
type Bases = BTreeMap<(usize, usize, Members), &'static OnceLock<Vec<Element>>>;

/// Storage for the bases of all requested algebras. They are never freed, so that a space can be copied. A basis is
/// computed when it is first needed, so that a name alone costs nothing.
static BASES: Mutex<Bases> = Mutex::new(Bases::new());

impl<const D: usize, A: Storage> Algebra<D, A> {
    /// The algebra of a group of n × n matrices.
    pub fn new(n: usize, members: Members) -> Self {
        let mut bases = BASES.lock().unwrap_or_else(PoisonError::into_inner);
        let basis = *bases.entry((D, n, members)).or_insert_with(|| Box::leak(Box::default()));
        Algebra { n, members, basis, storage: PhantomData }
    }

    /// The basis.
    pub fn basis(&self) -> &'static [Element] {
        self.basis.get_or_init(|| basis(D, self.n, self.members))
    }

    /// Number of coordinates.
    pub fn dim(&self) -> usize {
        let n = self.n;
        match self.members {
            Members::All => n * n * D,
            Members::Affine => (n - 1) * n,
            Members::Similarity => 1 + (n - 1) * (n - 2) / 2 + n - 1,
            Members::Special => n * n - 1,
            Members::Symplectic => n * (n + 1) / 2,
            Members::Lorentz | Members::PseudoOrthogonal(_) => n * (n - 1) / 2,
        }
    }

    /// Coordinates of a matrix.
    pub fn coordinates<S: Scalar>(&self, m: &Matrix<S, D, A>, x: &mut [S]) {
        let numbers = m.entries().as_flattened();
        for (x, element) in x.iter_mut().zip(self.basis()) {
            let zero = S::constant(Lane::ZERO);
            *x = element.iter().fold(zero, |sum, &(at, factor)| numbers[at].fma_lane(lane(factor), sum));
        }
    }

    /// `scale` times the matrix with given coordinates.
    pub fn multiple<S: Scalar>(&self, scale: f64, x: &[S]) -> Matrix<S, D, A> {
        let mut m = Matrix::zeros(self.n, self.n);
        for (&x, element) in x.iter().zip(self.basis()) {
            for &(at, factor) in element {
                let number = &mut m[(at / D / self.n, at / D % self.n)][at % D];
                *number = x.fma_lane(lane(factor * scale), *number);
            }
        }
        m
    }

    /// The nearest matrix of the algebra.
    pub fn part(&self, m: Matrix<Lane, D, A>) -> Matrix<Lane, D, A> {
        if self.dim() == m.entries().len() * D {
            return m;
        }
        let mut part = Matrix::zeros(self.n, self.n);
        for element in self.basis() {
            let numbers = m.entries().as_flattened();
            let x =
                element.iter().fold(Lane::ZERO, |sum, &(at, factor)| numbers[at].mul_add(lane(factor), sum));
            for &(at, factor) in element {
                let number = &mut part[(at / D / self.n, at / D % self.n)][at % D];
                *number = x.mul_add(lane(factor), *number);
            }
        }
        part
    }

    /// `[½a, [½b, c]]`: elements of 𝔪 act by half their matrices.
    pub fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
        let (a, b, c) = (self.multiple(0.5, a), self.multiple(0.5, b), self.multiple(1.0, c));
        self.coordinates(&commutator(&a, &commutator(&b, &c)), out);
    }

    /// `S(v) x = Σ ad²ʲ x/(2j+1)!` of Lemma A.2, with the bracket of ½v and matrices.
    pub fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        let (half, start) = (self.multiple(0.5, v), self.multiple(1.0, x));
        // |[a, x]| is at most √2 |a| |x| (Böttcher & Wenzel 2008).
        let size = half.size() * lane(std::f64::consts::SQRT_2);
        let sum = stretch_series(size, &start, |x| commutator(&half, &commutator(&half, x)));
        self.coordinates(&sum, x);
    }
}

fn commutator<S: Scalar, const D: usize, A: Storage>(
    a: &Matrix<S, D, A>,
    x: &Matrix<S, D, A>,
) -> Matrix<S, D, A> {
    &a.times(x) - &x.times(a)
}

/// The basis of an algebra of n × n matrices.
fn basis(d: usize, n: usize, members: Members) -> Vec<Element> {
    let at = |i: usize, j: usize| (i * n + j) * d;
    let one = |i: usize, j: usize| vec![(at(i, j), 1.0)];
    // Two entries x and ±x.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let two = |(i, j), (k, l), sign: f64| vec![(at(i, j), half), (at(k, l), sign * half)];
    let pairs = |from: usize, to: usize| (from..to).flat_map(move |i| (i + 1..to).map(move |j| (i, j)));
    let square = |to: usize| (0..to).flat_map(move |i| (0..to).map(move |j| (i, j)));
    // An affine map x ↦ Ax + b has b in its last column.
    let shifts = |m: usize| (0..m).map(move |i| one(i, m));
    match members {
        Members::All => (0..n * n * d).map(|number| vec![(number, 1.0)]).collect(),
        Members::Affine => square(n - 1).map(|(i, j)| one(i, j)).chain(shifts(n - 1)).collect(),
        Members::Similarity => {
            let m = n - 1;
            let scale = (0..m).map(|i| (at(i, i), 1.0 / (m as f64).sqrt())).collect();
            let turns = pairs(0, m).map(|(i, j)| two((i, j), (j, i), -1.0));
            std::iter::once(scale).chain(turns).chain(shifts(m)).collect()
        }
        Members::Special => {
            // The j-th is (1, …, 1, −j, 0, …)/√(j(j+1)) on the diagonal.
            let diagonal = (1..n).map(|j| {
                let factor = 1.0 / ((j * (j + 1)) as f64).sqrt();
                (0..=j).map(|i| (at(i, i), if i < j { factor } else { -(j as f64) * factor })).collect()
            });
            diagonal.chain(square(n).filter(|(i, j)| i != j).map(|(i, j)| one(i, j))).collect()
        }
        Members::Symplectic => {
            // (A, B; C, −Aᵀ) with symmetric B and C.
            let m = n / 2;
            let first = square(m).map(|(i, j)| two((i, j), (m + j, m + i), -1.0));
            let diagonal = (0..m).flat_map(|i| [one(i, m + i), one(m + i, i)]);
            let beside = pairs(0, m)
                .flat_map(|(i, j)| [two((i, m + j), (j, m + i), 1.0), two((m + i, j), (m + j, i), 1.0)]);
            first.chain(diagonal).chain(beside).collect()
        }
        Members::Lorentz | Members::PseudoOrthogonal(_) => {
            // A boost joins two axes of different signs.
            let p = members.negative();
            pairs(0, n)
                .map(|(i, j)| two((i, j), (j, i), if (i < p) == (j < p) { -1.0 } else { 1.0 }))
                .collect()
        }
    }
}
