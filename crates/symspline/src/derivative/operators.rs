//! Functions of ad on 𝔪 as matrices.
//!
//! Everything comes from `S(v) = sinh(ad_v)/ad_v`, which every space has: its second derivative along t ↦ tv is
//! ad_v²/3, and hyperbolic identities give the other even functions of ad_v.

use crate::scalar::{Dual, Jet, LANES, Lane, Scalar, lane};
use crate::space::Space;
use nalgebra::{DMatrix, DVector};
use smallvec::{SmallVec, smallvec};

pub type Matrix = DMatrix<f64>;
pub type Vector = DVector<f64>;
/// A few numbers on the stack: lanes on the heap are aligned, which costs more than the work done here.
pub type Few<S> = SmallVec<[S; 12]>;

/// The matrix whose columns `f` computes, eight from a first one on.
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
    Lane::new(std::array::from_fn(|l| if row == first + l { 1.0 } else { 0.0 }))
}

/// A vector on every lane.
pub fn splat(v: &Vector) -> Few<Lane> {
    v.iter().map(|&x| lane(x)).collect()
}

/// S(v).
pub fn stretch<M: Space>(space: &M, v: &Vector) -> Matrix {
    let (m, v) = (v.len(), splat(v));
    columns(m, m, |first, x| {
        x.iter_mut().enumerate().for_each(|(r, x)| *x = unit(r, first));
        space.stretch(&v, x);
    })
}

/// The derivative of S(v)x in v.
pub fn stretch_slope<M: Space>(space: &M, v: &Vector, x: &Vector) -> Matrix {
    let m = v.len();
    columns(m, m, |first, out| {
        let v: Few<Dual> = (0..m).map(|r| Dual { v: lane(v[r]), d: unit(r, first) }).collect();
        let mut y: Few<Dual> = x.iter().map(|&x| Dual::constant(lane(x))).collect();
        space.stretch(&v, &mut y);
        out.iter_mut().zip(&y).for_each(|(out, y)| *out = y.d);
    })
}

/// ad_v² x, lane by lane.
fn ad_squared<M: Space>(space: &M, v: &[Lane], x: &[Lane]) -> Few<Lane> {
    let v: Few<Jet> = v.iter().map(|&d| Jet { v: Lane::ZERO, d, dd: Lane::ZERO }).collect();
    let mut y: Few<Jet> = x.iter().map(|&x| Jet::constant(x)).collect();
    space.stretch(&v, &mut y);
    y.iter().map(|y| y.dd * lane(3.0)).collect()
}

/// `[b, [c, x]] + [c, [b, x]]`, lane by lane.
fn symmetric_bracket<M: Space>(space: &M, b: &[Lane], c: &[Lane], x: &[Lane]) -> Few<Lane> {
    let along = |sign: f64| -> Few<Lane> { b.iter().zip(c).map(|(b, c)| *b + *c * lane(sign)).collect() };
    let (plus, minus) = (ad_squared(space, &along(1.0), x), ad_squared(space, &along(-1.0), x));
    plus.iter().zip(&minus).map(|(p, m)| (*p - *m) * lane(0.5)).collect()
}

/// `z ↦ [[a, z], w]`, which by Jacobi's identity is a third of
/// `[z, [w, a]] + [w, [z, a]] − [a, [w, z]] − [w, [a, z]]`.
pub fn curvature<M: Space>(space: &M, a: &Vector, w: &Vector) -> Matrix {
    let (m, a, w) = (a.len(), splat(a), splat(w));
    columns(m, m, |first, out| {
        let z: Few<Lane> = (0..m).map(|r| unit(r, first)).collect();
        let (x, y) = (symmetric_bracket(space, &z, &w, &a), symmetric_bracket(space, &a, &w, &z));
        for (out, (x, y)) in out.iter_mut().zip(x.iter().zip(&y)) {
            *out = (*x - *y) * lane(1.0 / 3.0);
        }
    })
}

/// Functions of ad_v for one v. They are even.
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
    pub fn of<M: Space>(space: &M, v: &Vector) -> Self {
        let m = v.len();
        let (full, half) = (stretch(space, v), stretch(space, &(v * 0.5)));
        let square = &half * &half;
        let lanes = splat(v);
        let ad2 = columns(m, m, |first, out| {
            let x: Few<Lane> = (0..m).map(|r| unit(r, first)).collect();
            out.copy_from_slice(&ad_squared(space, &lanes, &x));
        });
        // cosh x − 1 = 2 sinh²(x/2), tanh(x/2) sinh x = 2 sinh²(x/2)
        let cosh = Matrix::identity(m, m) + ad2 * &square * 0.5;
        let shrink = full.clone().try_inverse().unwrap_or_else(|| Matrix::from_element(m, m, f64::NAN));
        let (coth, tanh) = (&shrink * &cosh, &shrink * square * 0.5);
        Functions { stretch: full, shrink, cosh, coth, tanh }
    }
}
