//! The matrix type: entries, storage, and operations on entries.
//!
//! Types that depend on each other are defined here: a matrix has a kind of storage, and storage of any size has a
//! table of functions of its matrices.

use super::entry::{Entry, conjugate};
use crate::scalar::{Each, Lane, Scalar, few, lane};
use std::ops::{Add, Deref, DerefMut, Index, IndexMut, Neg, Sub};

/// Where the entries of a matrix are, and how many.
pub trait Storage: Copy + Send + Sync + 'static {
    /// Whether matrices may be of any size: functions of them are then compiled once, see [`Compiled`].
    const ANY: bool = false;
    /// Whether matrices have so few entries that a call through a table costs more than their operations.
    const TINY: bool = false;
    /// Rows and columns.
    type Shape: Copy;
    /// A container of entries.
    type Of<T: Copy>: Clone + Deref<Target = [T]> + DerefMut;
    /// A requested shape.
    fn shape(rows: usize, cols: usize) -> Self::Shape;
    /// The numbers of rows and columns.
    fn size(shape: Self::Shape) -> (usize, usize);
    /// Equal entries.
    fn filled<T: Copy>(shape: Self::Shape, x: T) -> Self::Of<T>;
    /// Entries from their indices, row by row. Writes each entry once, where `filled` and a loop would write twice.
    fn collected<T: Copy>(shape: Self::Shape, spare: T, f: impl FnMut(usize) -> T) -> Self::Of<T>;
    /// Functions of matrices of any size.
    fn compiled<S: Scalar, const D: usize>() -> &'static Compiled<S, D, Self> {
        unreachable!("matrices of any size only are stored there")
    }
}

/// Storage of any size. Up to sixteen entries are on the stack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dynamic;

type Function<S, const D: usize, A> = fn(&Matrix<S, D, A>) -> Matrix<S, D, A>;
type Functions<S, const D: usize, A> = fn(&Matrix<S, D, A>) -> [Matrix<S, D, A>; 2];
type Product<S, const D: usize, A> = fn(&Matrix<S, D, A>, &Matrix<S, D, A>) -> Matrix<S, D, A>;
type Choice<S, const D: usize, A> = fn(Lane, &Matrix<S, D, A>, &Matrix<S, D, A>) -> Matrix<S, D, A>;

/// The functions by name; functions whose names end with `_here` are compiled where they are called.
pub struct Compiled<S: Scalar, const D: usize, A: Storage> {
    pub(super) times: Product<S, D, A>,
    pub(super) adjoint_times: Product<S, D, A>,
    pub(super) times_adjoint: Product<S, D, A>,
    pub(super) times_adjoint_hermitian: Product<S, D, A>,
    pub(super) compose: Product<S, D, A>,
    pub(super) plus: Product<S, D, A>,
    pub(super) minus: Product<S, D, A>,
    pub(super) scaled: fn(&Matrix<S, D, A>, Lane) -> Matrix<S, D, A>,
    pub(super) select: Choice<S, D, A>,
    pub(super) trig: Functions<S, D, A>,
    pub(super) exp_minus_one: Function<S, D, A>,
    pub(super) log_one_plus: Function<S, D, A>,
    pub(super) arc: Function<S, D, A>,
}

/// A matrix, row by row.
pub struct Matrix<S: Scalar, const D: usize, A: Storage = Dynamic> {
    pub(super) shape: A::Shape,
    pub(super) data: A::Of<Entry<S, D>>,
}

impl<S: Scalar, const D: usize, A: Storage> Clone for Matrix<S, D, A> {
    #[inline(always)]
    fn clone(&self) -> Self {
        Matrix { shape: self.shape, data: self.data.clone() }
    }
}

impl<S: Scalar, const D: usize, A: Storage> Matrix<S, D, A> {
    /// The same matrix in another storage.
    pub fn stored<B: Storage>(&self) -> Matrix<S, D, B> {
        Matrix::from_fn(self.rows(), self.cols(), |i, j| self[(i, j)])
    }

    /// The rows `from..to`.
    pub fn some_rows(&self, from: usize, to: usize) -> Self {
        Self::from_fn(to - from, self.cols(), |i, j| self[(from + i, j)])
    }

    /// The columns `from..to`.
    pub fn some_cols(&self, from: usize, to: usize) -> Self {
        Self::from_fn(self.rows(), to - from, |i, j| self[(i, from + j)])
    }
}

impl<S: Scalar, const D: usize, A: Storage> Matrix<S, D, A> {
    /// All zeros.
    pub fn zeros(rows: usize, cols: usize) -> Self {
        let shape = A::shape(rows, cols);
        Matrix { shape, data: A::filled(shape, [S::constant(Lane::ZERO); D]) }
    }

    /// The identity.
    pub fn identity(n: usize) -> Self {
        Self::zeros(n, n).plus_identity(Lane::ONE)
    }

    /// From numbers row by row, imaginary parts behind real ones.
    #[inline]
    pub fn read(rows: usize, cols: usize, numbers: &[S]) -> Self {
        let entries = &numbers.as_chunks::<D>().0[..rows * cols];
        Self::collected(A::shape(rows, cols), |i| entries[i])
    }

    /// Constants.
    pub fn constant(rows: usize, cols: usize, numbers: &[Lane]) -> Self {
        Self::from_fn(rows, cols, |i, j| {
            let at = (i * cols + j) * D;
            few(|c| S::constant(numbers[at + c]))
        })
    }

    /// From a function of row and column.
    pub fn from_fn(rows: usize, cols: usize, mut f: impl FnMut(usize, usize) -> Entry<S, D>) -> Self {
        let mut m = Self::zeros(rows, cols);
        for i in 0..rows {
            for j in 0..cols {
                m[(i, j)] = f(i, j);
            }
        }
        m
    }

    /// From a function of the index of an entry, counted row by row.
    #[inline(always)]
    pub(super) fn collected(shape: A::Shape, f: impl FnMut(usize) -> Entry<S, D>) -> Self {
        Matrix { shape, data: A::collected(shape, [S::constant(Lane::ZERO); D], f) }
    }

    /// A function of the numbers of one matrix.
    #[inline(always)]
    pub(super) fn each(&self, f: impl Fn(S) -> S) -> Self {
        let x = self.entries();
        Self::collected(self.shape, |i| x[i].each(&f))
    }

    /// A function of the numbers of two matrices.
    #[inline(always)]
    pub(super) fn zip(&self, b: &Self, f: impl Fn(S, S) -> S) -> Self {
        let (x, y) = (self.entries(), b.entries());
        Self::collected(self.shape, |i| few(|c| f(x[i][c], y[i][c])))
    }

    /// A real diagonal matrix.
    pub fn diagonal(entries: &[S]) -> Self {
        let mut m = Self::zeros(entries.len(), entries.len());
        for (i, &x) in entries.iter().enumerate() {
            m[(i, i)][0] = x;
        }
        m
    }

    /// Writes the numbers as [`read`](Self::read) takes them.
    pub fn write(&self, out: &mut [S]) {
        for (out, x) in out.as_chunks_mut::<D>().0.iter_mut().zip(self.data.iter()) {
            *out = *x;
        }
    }

    /// Number of rows.
    #[inline(always)]
    pub fn rows(&self) -> usize {
        A::size(self.shape).0
    }

    /// Number of columns.
    #[inline(always)]
    pub fn cols(&self) -> usize {
        A::size(self.shape).1
    }

    /// All entries, row by row.
    #[inline(always)]
    pub fn entries(&self) -> &[Entry<S, D>] {
        &self.data[..self.rows() * self.cols()]
    }

    /// `A*`.
    pub fn adjoint(&self) -> Self {
        Self::from_fn(self.cols(), self.rows(), |i, j| conjugate(self[(j, i)]))
    }

    /// `(A + A*)/2`, exactly Hermitian.
    pub fn hermitian_part(&self) -> Self {
        self.with_adjoint(Lane::ONE)
    }

    /// `(A − A*)/2`, exactly skew-Hermitian.
    pub fn skew_part(&self) -> Self {
        self.with_adjoint(lane(-1.0))
    }

    fn with_adjoint(&self, sign: Lane) -> Self {
        let half = lane(0.5);
        Self::from_fn(self.rows(), self.cols(), |i, j| {
            let (a, b) = (self[(i, j)], conjugate(self[(j, i)]));
            few(|c| (a[c] + b[c] * sign) * half)
        })
    }

    /// `A + x`, x times the identity.
    pub fn plus_identity(mut self, x: Lane) -> Self {
        for i in 0..self.rows().min(self.cols()) {
            self[(i, i)][0] = self[(i, i)][0] + x;
        }
        self
    }

    /// `x A`.
    #[inline(always)]
    pub fn scaled(&self, x: Lane) -> Self {
        if A::ANY { (A::compiled().scaled)(self, x) } else { self.scaled_here(x) }
    }

    pub(super) fn scaled_here(&self, x: Lane) -> Self {
        self.each(|a| a * x)
    }

    pub(super) fn select_here(mask: Lane, a: &Self, b: &Self) -> Self {
        a.zip(b, |a, b| S::select(mask, a, b))
    }

    pub(super) fn plus_here(&self, b: &Self) -> Self {
        self.zip(b, |x, y| x + y)
    }

    pub(super) fn minus_here(&self, b: &Self) -> Self {
        self.zip(b, |x, y| x - y)
    }

    /// `x A` with a scalar that may have derivatives.
    pub fn times_scalar(&self, x: S) -> Self {
        self.each(|a| a * x)
    }

    /// Frobenius norm of the values, a bound of all eigenvalues.
    pub fn size(&self) -> Lane {
        let mut sum = Lane::ZERO;
        for a in self.entries().as_flattened() {
            sum = a.value().mul_add(a.value(), sum);
        }
        sum.sqrt()
    }

    /// Real part of the trace.
    pub fn trace(&self) -> S {
        let mut sum = self[(0, 0)][0];
        for i in 1..self.rows() {
            sum = sum + self[(i, i)][0];
        }
        sum
    }

    /// The values without derivatives.
    pub fn value(&self) -> Matrix<Lane, D, A> {
        self.map(|x| x.value())
    }

    /// The value, or the derivative of this order.
    pub fn part(&self, order: usize) -> Matrix<Lane, D, A> {
        self.map(|x| x.parts()[order])
    }

    /// A function of every entry.
    pub fn map_entries(&self, f: impl Fn(Entry<S, D>) -> Entry<S, D>) -> Self {
        let x = self.entries();
        Self::collected(self.shape, |i| f(x[i]))
    }

    /// A function of every number.
    pub fn map<T: Scalar>(&self, f: impl Fn(S) -> T) -> Matrix<T, D, A> {
        let x = self.entries();
        Matrix::<T, D, A>::collected(self.shape, |i| x[i].each(&f))
    }
}

impl<S: Scalar, const D: usize, A: Storage> Index<(usize, usize)> for Matrix<S, D, A> {
    type Output = Entry<S, D>;
    #[inline(always)]
    fn index(&self, (i, j): (usize, usize)) -> &Entry<S, D> {
        &self.data[i * self.cols() + j]
    }
}

impl<S: Scalar, const D: usize, A: Storage> IndexMut<(usize, usize)> for Matrix<S, D, A> {
    #[inline(always)]
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut Entry<S, D> {
        let cols = self.cols();
        &mut self.data[i * cols + j]
    }
}

impl<S: Scalar, const D: usize, A: Storage> Add for &Matrix<S, D, A> {
    type Output = Matrix<S, D, A>;
    #[inline(always)]
    fn add(self, b: Self) -> Matrix<S, D, A> {
        if A::ANY { (A::compiled().plus)(self, b) } else { self.plus_here(b) }
    }
}

impl<S: Scalar, const D: usize, A: Storage> Sub for &Matrix<S, D, A> {
    type Output = Matrix<S, D, A>;
    #[inline(always)]
    fn sub(self, b: Self) -> Matrix<S, D, A> {
        if A::ANY { (A::compiled().minus)(self, b) } else { self.minus_here(b) }
    }
}

impl<S: Scalar, const D: usize, A: Storage> Neg for Matrix<S, D, A> {
    type Output = Self;
    fn neg(self) -> Self {
        self.each(|x| -x)
    }
}
