//! Functions of ad on 𝔪 as matrices.
//!
//! All functions are computed from `S(v) = sinh(ad_v)/ad_v` and the triple product `[a, [b, c]]`, which every space
//! provides. Hyperbolic identities give the other even functions of ad_v.

use crate::fit::eliminate;
use crate::scalar::{Dual, LANES, Lane, Scalar, dot, few, lane};
use crate::space::{Erased, Origin};
use nalgebra::{DMatrix, DVector};
use smallvec::{SmallVec, smallvec};

/// A matrix of any size.
pub type Matrix = DMatrix<f64>;
/// A vector of any size.
pub type Vector = DVector<f64>;
/// A few numbers on the stack: allocating aligned lanes on the heap would cost more than the computation.
pub type Few<S> = SmallVec<[S; 12]>;

/// The matrix whose columns `f` computes, as many at a time as there are lanes, starting from a given first one.
pub fn columns(rows: usize, count: usize, mut f: impl FnMut(usize, &mut [Lane])) -> Matrix {
    let mut out = Matrix::zeros(rows, count);
    let mut lanes: Few<Lane> = smallvec![Lane::ZERO; rows];
    for first in (0..count).step_by(LANES) {
        f(first, &mut lanes);
        for l in 0..LANES.min(count - first) {
            for r in 0..rows {
                out[(r, first + l)] = lanes[r].as_array()[l];
            }
        }
    }
    out
}

/// One number of the unit vectors e_first, e_{first + 1}, … on the lanes.
pub fn unit(row: usize, first: usize) -> Lane {
    Lane::new(few(|l| if row == first + l { 1.0 } else { 0.0 }))
}

/// An m × m matrix on each lane, row by row.
#[derive(Clone)]
pub struct Square {
    m: usize,
    x: Vec<Lane>,
}

impl Square {
    pub fn zeros(m: usize) -> Self {
        Square { m, x: vec![Lane::ZERO; m * m] }
    }

    pub fn identity(m: usize) -> Self {
        let mut out = Square::zeros(m);
        out.add_identity(Lane::ONE);
        out
    }

    /// The numbers, row by row.
    pub fn numbers(&self) -> &[Lane] {
        &self.x
    }

    pub fn numbers_mut(&mut self) -> &mut [Lane] {
        &mut self.x
    }

    /// The matrix of one lane.
    pub fn of_lane(&self, l: usize) -> Matrix {
        Matrix::from_fn(self.m, self.m, |r, c| self.x[r * self.m + c].as_array()[l])
    }

    /// The matrices of other lanes.
    pub fn permuted(&self, from: [usize; LANES]) -> Self {
        let x = self.x.iter().map(|x| Lane::new(from.map(|l| x.as_array()[l]))).collect();
        Square { m: self.m, x }
    }

    /// Subtracts A x for the matrix A of one lane.
    pub fn subtract_of_lane(&self, l: usize, x: &[f64], out: &mut [f64]) {
        for (out, row) in out.iter_mut().zip(self.x.chunks_exact(self.m)) {
            *out -= row.iter().zip(x).map(|(a, x)| a.as_array()[l] * x).sum::<f64>();
        }
    }

    /// Subtracts Aᵀ x.
    pub fn subtract_transposed_of_lane(&self, l: usize, x: &[f64], out: &mut [f64]) {
        for (x, row) in x.iter().zip(self.x.chunks_exact(self.m)) {
            out.iter_mut().zip(row).for_each(|(out, a)| *out -= a.as_array()[l] * x);
        }
    }

    /// A B
    pub fn times(&self, b: &Square) -> Self {
        let mut out = Square::zeros(self.m);
        out.set_product(self, b);
        out
    }

    pub fn set(&mut self, other: &Square) {
        self.x.copy_from_slice(&other.x);
    }

    pub fn scale(&mut self, factor: Lane) {
        self.x.iter_mut().for_each(|x| *x *= factor);
    }

    pub fn add(&mut self, factor: Lane, other: &Square) {
        self.x.iter_mut().zip(&other.x).for_each(|(x, y)| *x = factor.mul_add(*y, *x));
    }

    pub fn add_identity(&mut self, factor: Lane) {
        self.x.iter_mut().step_by(self.m + 1).for_each(|x| *x += factor);
    }

    /// A B
    pub fn set_product(&mut self, a: &Square, b: &Square) {
        self.x.fill(Lane::ZERO);
        self.add_product(Lane::ONE, a, b);
    }

    /// Adds a multiple of A B.
    pub fn add_product(&mut self, factor: Lane, a: &Square, b: &Square) {
        let m = self.m;
        for (out, a) in self.x.chunks_exact_mut(m).zip(a.x.chunks_exact(m)) {
            for (a, b) in a.iter().zip(b.x.chunks_exact(m)) {
                let a = *a * factor;
                out.iter_mut().zip(b).for_each(|(out, b)| *out = a.mul_add(*b, *out));
            }
        }
    }

    /// Adds a multiple of A x to a vector.
    pub fn act(&self, factor: Lane, x: &[Lane], out: &mut [Lane]) {
        for (out, row) in out.iter_mut().zip(self.x.chunks_exact(self.m)) {
            *out = dot(row, x).mul_add(factor, *out);
        }
    }

    /// Computes the columns one by one.
    fn set_columns(&mut self, mut f: impl FnMut(usize, &mut [Lane])) {
        let mut column: Few<Lane> = smallvec![Lane::ZERO; self.m];
        for k in 0..self.m {
            f(k, &mut column);
            self.x[k..].iter_mut().step_by(self.m).zip(&column).for_each(|(out, x)| *out = *x);
        }
    }

    /// S(v).
    pub fn set_stretch(&mut self, space: &Erased, v: &[Lane]) {
        self.set_columns(|k, x| {
            x.fill(Lane::ZERO);
            x[k] = Lane::ONE;
            space.stretch(v, x);
        });
    }

    /// The derivative of S(v)x in v.
    pub fn set_stretch_slope(&mut self, space: &Erased, v: &[Lane], x: &[Lane]) {
        let mut v: Few<Dual> = v.iter().map(|&v| Dual::constant(v)).collect();
        let x: Few<Dual> = x.iter().map(|&x| Dual::constant(x)).collect();
        let mut y = x.clone();
        self.set_columns(|k, out| {
            v[k].d = Lane::ONE;
            y.copy_from_slice(&x);
            space.stretch(&v, &mut y);
            v[k].d = Lane::ZERO;
            out.iter_mut().zip(&y).for_each(|(out, y)| *out = y.d);
        });
    }

    /// `z ↦ [[a, z], w]`, which is `[w, [z, a]]`.
    pub fn set_curvature(&mut self, space: &Erased, a: &[Lane], w: &[Lane]) {
        let mut z: Few<Lane> = smallvec![Lane::ZERO; self.m];
        self.set_columns(|k, out| {
            z[k] = Lane::ONE;
            space.triple(w, &z, a, out);
            z[k] = Lane::ZERO;
        });
    }

    /// ad_v²
    fn set_ad_squared(&mut self, space: &Erased, v: &[Lane]) {
        let mut x: Few<Lane> = smallvec![Lane::ZERO; self.m];
        self.set_columns(|k, out| {
            x[k] = Lane::ONE;
            space.triple(v, v, &x, out);
            x[k] = Lane::ZERO;
        });
    }

    /// A⁻¹ times several matrices, in place.
    pub fn divide(&self, right: &mut [&mut Square]) {
        let (m, width) = (self.m, self.m * (1 + right.len()));
        let mut rows: Vec<Lane> = Vec::with_capacity(m * width);
        for r in 0..m {
            rows.extend_from_slice(&self.x[r * m..][..m]);
            right.iter().for_each(|b| rows.extend_from_slice(&b.x[r * m..][..m]));
        }
        eliminate(&mut rows, m, width);
        for (r, row) in rows.chunks_exact(width).enumerate() {
            for (b, row) in right.iter_mut().zip(row[m..].chunks_exact(m)) {
                b.x[r * m..][..m].copy_from_slice(row);
            }
        }
    }
}

/// Even functions of ad_v for one v.
#[derive(Clone)]
pub struct Functions {
    /// S = sinh(ad)/ad
    pub stretch: Square,
    /// cosh(ad)
    pub cosh: Square,
    /// ad coth(ad)
    pub coth: Square,
    /// tanh(ad/2)/ad
    pub tanh: Square,
    half: Square,
}

impl Functions {
    pub fn new(m: usize) -> Self {
        let zeros = || Square::zeros(m);
        Functions { stretch: zeros(), cosh: zeros(), coth: zeros(), tanh: zeros(), half: zeros() }
    }

    pub fn set(&mut self, space: &Erased, v: &[Lane]) {
        let middle: Few<Lane> = v.iter().map(|x| *x * lane(0.5)).collect();
        let Functions { stretch, cosh, coth, tanh, half } = self;
        stretch.set_stretch(space, v);
        half.set_stretch(space, &middle);
        tanh.set_product(half, half);
        // cosh x − 1 = 2 sinh²(x/2), tanh(x/2) sinh x = 2 sinh²(x/2)
        half.set_ad_squared(space, v);
        cosh.set_product(half, tanh);
        cosh.scale(lane(0.5));
        cosh.add_identity(Lane::ONE);
        tanh.scale(lane(0.5));
        coth.set(cosh);
        stretch.divide(&mut [coth, tanh]);
    }
}
