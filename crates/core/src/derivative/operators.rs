//! Functions of ad on 𝔪 as matrices.
//!
//! All functions are computed from `S(v) = sinh(ad_v)/ad_v` and the triple product `[a, [b, c]]`, which every space
//! provides. Hyperbolic identities give the other even functions of ad_v.

use crate::scalar::{Dual, LANES, Lane, Scalar, few, lane};
use crate::space::{Erased, Origin};
use nalgebra::{DMatrix, DVector};
use smallvec::{SmallVec, smallvec};

/// A matrix of any size.
pub type Matrix = DMatrix<f64>;
/// A vector of any size.
pub type Vector = DVector<f64>;
/// A few numbers on the stack: allocating aligned lanes on the heap would cost more than the computation.
pub type Few<S> = SmallVec<[S; 12]>;

/// The matrix whose columns `f` computes, eight at a time, starting from a given first one.
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

/// One number of eight unit vectors e_first, e_{first + 1}, …
pub fn unit(row: usize, first: usize) -> Lane {
    Lane::new(few(|l| if row == first + l { 1.0 } else { 0.0 }))
}

/// Copies a vector to every lane.
pub fn splat(v: &Vector) -> Few<Lane> {
    v.iter().map(|&x| lane(x)).collect()
}

/// S(v).
pub fn stretch(space: &Erased, v: &Vector) -> Matrix {
    let (m, v) = (v.len(), splat(v));
    columns(m, m, |first, x| {
        x.iter_mut().enumerate().for_each(|(r, x)| *x = unit(r, first));
        space.stretch(&v, x);
    })
}

/// The derivative of S(v)x in v.
pub fn stretch_slope(space: &Erased, v: &Vector, x: &Vector) -> Matrix {
    let m = v.len();
    columns(m, m, |first, out| {
        let v: Few<Dual> = (0..m).map(|r| Dual { v: lane(v[r]), d: unit(r, first) }).collect();
        let mut y: Few<Dual> = x.iter().map(|&x| Dual::constant(lane(x))).collect();
        space.stretch(&v, &mut y);
        out.iter_mut().zip(&y).for_each(|(out, y)| *out = y.d);
    })
}

/// `z ↦ [[a, z], w]`, which is `[w, [z, a]]`.
pub fn curvature(space: &Erased, a: &Vector, w: &Vector) -> Matrix {
    let (m, a, w) = (a.len(), splat(a), splat(w));
    columns(m, m, |first, out| {
        let z: Few<Lane> = (0..m).map(|r| unit(r, first)).collect();
        space.triple(&w, &z, &a, out);
    })
}

/// ad_v²
fn ad_squared(space: &Erased, v: &Vector) -> Matrix {
    let (m, v) = (v.len(), splat(v));
    columns(m, m, |first, out| {
        let x: Few<Lane> = (0..m).map(|r| unit(r, first)).collect();
        space.triple(&v, &v, &x, out);
    })
}

/// Even functions of ad_v for one v.
pub struct Functions {
    /// S = sinh(ad)/ad
    pub stretch: Matrix,
    /// S⁻¹
    pub shrink: Matrix,
    /// cosh(ad)
    pub cosh: Matrix,
    /// ad coth(ad)
    pub coth: Matrix,
    /// tanh(ad/2)/ad
    pub tanh: Matrix,
}

impl Functions {
    pub fn of(space: &Erased, v: &Vector) -> Self {
        let m = v.len();
        let (full, half) = (stretch(space, v), stretch(space, &(v * 0.5)));
        let square = &half * &half;
        // cosh x − 1 = 2 sinh²(x/2), tanh(x/2) sinh x = 2 sinh²(x/2)
        let cosh = Matrix::identity(m, m) + ad_squared(space, v) * &square * 0.5;
        let shrink = full.clone().try_inverse().unwrap_or_else(|| Matrix::from_element(m, m, f64::NAN));
        let (coth, tanh) = (&shrink * &cosh, &shrink * square * 0.5);
        Functions { stretch: full, shrink, cosh, coth, tanh }
    }
}
