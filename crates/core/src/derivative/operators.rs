//! Functions of ad on 𝔪 as matrices.
//!
//! All functions are computed from `S(v) = sinh(ad_v)/ad_v` and the triple product `[a, [b, c]]`, which every space
//! provides. Hyperbolic identities give the other even functions of ad_v.

use crate::matrix::inverse;
use crate::scalar::{Dual, LANES, Lane, Scalar, few, lane};
use crate::space::{Erased, Origin};
use nalgebra::{DMatrix, DVector};
use smallvec::{SmallVec, smallvec};

/// A matrix of any size.
pub type Matrix = DMatrix<f64>;
/// A vector of any size.
pub type Vector = DVector<f64>;
/// A matrix on each lane.
pub type Square = crate::matrix::Matrix<Lane, 1>;
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

/// One number of the k-th unit vector on every lane.
pub fn axis(row: usize, k: usize) -> Lane {
    if row == k { Lane::ONE } else { Lane::ZERO }
}

/// Copies a vector to every lane.
pub fn splat(v: &Vector) -> Few<Lane> {
    v.iter().map(|&x| lane(x)).collect()
}

/// The matrix of one lane.
pub fn of_lane(x: &Square, l: usize) -> Matrix {
    Matrix::from_fn(x.rows(), x.cols(), |r, c| x[(r, c)][0].as_array()[l])
}

/// The vector of one lane.
pub fn vector_of_lane(x: &[Lane], l: usize) -> Vector {
    Vector::from_iterator(x.len(), x.iter().map(|x| x.as_array()[l]))
}

/// A x
pub fn act(a: &Square, x: &[Lane]) -> Few<Lane> {
    (0..a.rows())
        .map(|r| x.iter().enumerate().fold(Lane::ZERO, |sum, (c, x)| a[(r, c)][0].mul_add(*x, sum)))
        .collect()
}

/// The square matrix whose columns `f` computes one by one, on all lanes.
fn by_columns(m: usize, mut f: impl FnMut(usize, &mut [Lane])) -> Square {
    let mut out = Square::zeros(m, m);
    let mut column: Few<Lane> = smallvec![Lane::ZERO; m];
    for k in 0..m {
        f(k, &mut column);
        column.iter().enumerate().for_each(|(r, x)| out[(r, k)] = [*x]);
    }
    out
}

/// S(v).
pub fn stretch(space: &Erased, v: &[Lane]) -> Square {
    by_columns(v.len(), |k, x| {
        x.iter_mut().enumerate().for_each(|(r, x)| *x = axis(r, k));
        space.stretch(v, x);
    })
}

/// The derivative of S(v)x in v.
pub fn stretch_slope(space: &Erased, v: &[Lane], x: &[Lane]) -> Square {
    by_columns(v.len(), |k, out| {
        let v: Few<Dual> = v.iter().enumerate().map(|(r, &v)| Dual { v, d: axis(r, k) }).collect();
        let mut y: Few<Dual> = x.iter().map(|&x| Dual::constant(x)).collect();
        space.stretch(&v, &mut y);
        out.iter_mut().zip(&y).for_each(|(out, y)| *out = y.d);
    })
}

/// `z ↦ [[a, z], w]`, which is `[w, [z, a]]`.
pub fn curvature(space: &Erased, a: &[Lane], w: &[Lane]) -> Square {
    by_columns(a.len(), |k, out| {
        let z: Few<Lane> = (0..a.len()).map(|r| axis(r, k)).collect();
        space.triple(w, &z, a, out);
    })
}

/// ad_v²
fn ad_squared(space: &Erased, v: &[Lane]) -> Square {
    by_columns(v.len(), |k, out| {
        let x: Few<Lane> = (0..v.len()).map(|r| axis(r, k)).collect();
        space.triple(v, v, &x, out);
    })
}

/// Even functions of ad_v for one v.
#[derive(Clone)]
pub struct Functions {
    /// S = sinh(ad)/ad
    pub stretch: Square,
    /// S⁻¹
    pub shrink: Square,
    /// cosh(ad)
    pub cosh: Square,
    /// ad coth(ad)
    pub coth: Square,
    /// tanh(ad/2)/ad
    pub tanh: Square,
}

impl Functions {
    pub fn of(space: &Erased, v: &[Lane]) -> Self {
        let half: Few<Lane> = v.iter().map(|x| *x * lane(0.5)).collect();
        let (full, half) = (stretch(space, v), stretch(space, &half));
        let square = half.times(&half);
        // cosh x − 1 = 2 sinh²(x/2), tanh(x/2) sinh x = 2 sinh²(x/2)
        let cosh = ad_squared(space, v).times(&square).scaled(lane(0.5)).plus_identity(Lane::ONE);
        let shrink = inverse(&full);
        let (coth, tanh) = (shrink.times(&cosh), shrink.times(&square).scaled(lane(0.5)));
        Functions { stretch: full, shrink, cosh, coth, tanh }
    }
}
