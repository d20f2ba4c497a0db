//! Stiefel manifolds: n × k matrices of orthonormal columns, with the canonical metric tr uᵀ(1 − ppᵀ/2)v (Edelman,
//! Arias & Smith, The geometry of algorithms with orthogonality constraints, 1998).
//!
//! They are symmetric for k = 1 only, so that this is not a [`Space`](symspline_core::space::Space): curves use the
//! exponential, the logarithm and its derivative. All happen in the span of the columns of a point p and of a vector
//! there, of dimension m = min(2k, n): with a basis Q of it whose first columns are p, a vector is Q (A; B) with a
//! skew-symmetric A, and `exp_p(v)` consists of the first k columns of Q exp(Ω) with Ω = (A, −Bᵀ; B, 0).

use std::marker::PhantomData;
use std::sync::Arc;
use symspline_core::matrix::{
    Dynamic, Matrix, Select, Small, Storage, determinant, diagonalize, exp_skew_minus_one, inverse, polar,
    sort_columns, trig,
};
use symspline_core::scalar::{Dual, Lane, Scalar, dot, lane};
use symspline_core::space::{Ambient, Erased, Kernels, below};

type Real<A> = Matrix<Lane, 1, A>;

/// The block of a logarithm that must vanish is a rounding error below this size.
const TOLERANCE: Lane = lane(1e-14);
/// The largest number of iterations of the logarithm.
const MOST: usize = 60;

/// The operations of a manifold, on one point per lane.
pub trait Stiefel: Send + Sync {
    /// n and k
    fn size(&self) -> (usize, usize);
    /// `exp_p(v)`
    fn exp(&self, p: &[Lane], v: &[Lane], out: &mut [Lane]);
    /// `log_p(q)`, NaN where there is none.
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]);
    /// The derivative of `log_p` at `exp_p(v)` in the direction w.
    fn dlog(&self, p: &[Lane], v: &[Lane], w: &[Lane], out: &mut [Lane]);

    /// The inner product tr uᵀ(1 − ppᵀ/2)v.
    fn inner(&self, p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        let (n, k) = self.size();
        let mut sum = dot(u, v);
        for (i, j) in (0..k * k).map(|c| (c / k, c % k)) {
            let along =
                |x: &[Lane]| (0..n).fold(Lane::ZERO, |sum, r| p[r * k + i].mul_add(x[r * k + j], sum));
            sum -= lane(0.5) * along(u) * along(v);
        }
        sum
    }

    /// D log of the vector to the other inner control point minus the handle, at both ends of a segment with the points
    /// and handles p, v, q, w: h²/6 times the accelerations.
    fn bends(&self, x: &[Vec<Lane>], out: &mut [Lane]) {
        let (n, k) = self.size();
        let [mut inner, mut other, mut between] = [(); 3].map(|()| vec![Lane::ZERO; n * k]);
        self.exp(&x[0], &x[1], &mut inner);
        self.exp(&x[2], &x[3], &mut other);
        for (x, out) in x.chunks_exact(2).zip(out.chunks_exact_mut(n * k)) {
            self.log(&inner, &other, &mut between);
            self.dlog(&x[0], &x[1], &between, out);
            out.iter_mut().zip(&x[1]).for_each(|(x, v)| *x -= *v);
            std::mem::swap(&mut inner, &mut other);
        }
    }

    /// De Casteljau's algorithm for a segment p, v, q, w, p, v, t: points, handles, and between the inner control points
    /// the vector w at the first of them, q. Of order 1 or 2, for k = 2 and n = 4 only, the point
    /// and its velocity or acceleration with respect to t.
    fn curve(&self, order: usize, x: &[Vec<Lane>], out: &mut [Lane]) {
        assert_eq!(order, 0, "there are no derivatives");
        let (len, t) = (out.len(), x[6][0]);
        let ray = |p: &[Lane], v: &[Lane], t: Lane| {
            let (v, mut out) = (v.iter().map(|x| *x * t).collect::<Vec<_>>(), vec![Lane::ZERO; len]);
            self.exp(p, &v, &mut out);
            out
        };
        let between = |p: &[Lane], q: &[Lane]| {
            let mut v = vec![Lane::ZERO; len];
            self.log(p, q, &mut v);
            ray(p, &v, t)
        };
        let (a, b, c) = (ray(&x[0], &x[1], t), ray(&x[2], &x[3], t), ray(&x[4], &x[5], Lane::ONE - t));
        out.copy_from_slice(&between(&between(&a, &b), &between(&b, &c)));
    }
}

/// The manifold of n × k matrices, with k < n; `rotations` is SO(m) with m = min(2k, n).
pub fn stiefel(k: usize, n: usize, rotations: Arc<dyn Kernels>) -> Box<dyn Stiefel> {
    if n * (2 * k) <= 16 {
        Box::new(Frames::<Small<16>> { k, n, rotations, storage: PhantomData })
    } else {
        Box::new(Frames::<Dynamic> { k, n, rotations, storage: PhantomData })
    }
}

/// Frames of k orthonormal vectors in Rⁿ.
struct Frames<A> {
    k: usize,
    n: usize,
    /// Rotations of the span.
    rotations: Arc<dyn Kernels>,
    storage: PhantomData<A>,
}

/// A basis of the span of p and v whose first columns are p, and the generator Ω of v.
struct Span<A: Storage> {
    basis: Real<A>,
    generator: Real<A>,
}

impl<A: Storage> Frames<A> {
    fn read(&self, x: &[Lane]) -> Real<A> {
        Matrix::read(self.n, self.k, x)
    }

    /// m
    fn dim_of_span(&self) -> usize {
        self.n.min(2 * self.k)
    }

    /// The positions below the diagonal of the first k of m columns: coordinates of a generator.
    fn positions(&self) -> impl Iterator<Item = (usize, usize)> + Clone {
        let (k, m) = (self.k, self.dim_of_span());
        (0..m).flat_map(move |i| (0..k.min(i)).map(move |j| (i, j)))
    }

    /// p and orthonormal columns that complete it to a basis of the span of p and x.
    fn basis(&self, p: &Real<A>, x: &Real<A>) -> Real<A> {
        let (k, m) = (self.k, self.dim_of_span());
        let rest = x - &p.times(&p.adjoint_times(x));
        let both = Matrix::from_fn(self.n, 2 * k, |i, j| if j < k { p[(i, j)] } else { rest[(i, j - k)] });
        let (others, _) = columns_of_q::<A>(both, k, m);
        Matrix::from_fn(self.n, m, |i, j| if j < k { p[(i, j)] } else { others[(i, j - k)] })
    }

    fn span(&self, p: &[Lane], v: &[Lane]) -> Span<A> {
        let (p, v, k) = (self.read(p), self.read(v), self.k);
        let basis = self.basis(&p, &v);
        let parts = basis.adjoint_times(&v);
        let m = parts.rows();
        let generator = Matrix::from_fn(m, m, |i, j| match (i < k, j < k) {
            (true, true) => [(parts[(i, j)][0] - parts[(j, i)][0]) * lane(0.5)],
            (false, true) => parts[(i, j)],
            (true, false) => [-parts[(j, i)][0]],
            (false, false) => [Lane::ZERO],
        });
        Span { basis, generator }
    }

    /// The first k columns of Q x.
    fn columns(&self, basis: &Real<A>, x: &Real<A>) -> Real<A> {
        basis.times(&x.some_cols(0, self.k))
    }
}

impl<A: Storage> Stiefel for Frames<A> {
    fn size(&self) -> (usize, usize) {
        (self.n, self.k)
    }

    fn exp(&self, p: &[Lane], v: &[Lane], out: &mut [Lane]) {
        let Span { basis, generator } = self.span(p, v);
        let turn = exp_skew_minus_one(&generator).plus_identity(Lane::ONE);
        self.columns(&basis, &turn).write(out);
    }

    /// Rotations with the same first k columns differ by a rotation of the last columns. The block C of the logarithm
    /// that must vanish is removed by exp(Γ), where SΓ + ΓS = C with S = BBᵀ/12 − 1/2 accounts for the first terms of
    /// the series of Baker, Campbell and Hausdorff (Zimmermann & Hüper, Computing the Riemannian logarithm on the
    /// Stiefel manifold, 2022, Algorithm 4).
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) {
        let (p, q, k) = (self.read(p), self.read(q), self.k);
        let basis = self.basis(&p, &q);
        let mut turn = completed(&basis.adjoint_times(&q));
        let m = turn.rows();
        let (rotations, identity) = (Erased(&*self.rotations), numbers(&Real::<A>::identity(m)));
        let limit = below(rotations.cut_angle());
        let mut found = vec![lane(f64::NAN); m * m];
        let mut open = Lane::ZERO.simd_eq(Lane::ZERO);
        let mut log = vec![Lane::ZERO; m * m];
        for _ in 0..MOST {
            let angle = rotations.log(&identity, &numbers(&turn), &mut log);
            let generator = Real::<A>::read(m, m, &log);
            let wrong = generator.some_rows(k, m).some_cols(k, m);
            let size = wrong.size();
            let lost = !(angle.simd_lt(limit) & size.simd_lt(lane(f64::INFINITY)));
            let done = open & size.simd_le(TOLERANCE) & !lost;
            found.iter_mut().zip(&log).for_each(|(found, x)| *found = done.select(*x, *found));
            open = open & !done & !lost;
            if open.none() {
                break;
            }
            let change = exp_skew_minus_one(&correction(&generator.some_rows(k, m).some_cols(0, k), &wrong));
            let last = turn.some_cols(k, m);
            let moved = &last.times(&change) + &last;
            for i in 0..m {
                for j in k..m {
                    turn[(i, j)][0] = open.select(moved[(i, j - k)][0], turn[(i, j)][0]);
                }
            }
        }
        self.columns(&basis, &Real::<A>::read(m, m, &found)).write(out);
    }

    /// The inverse of the derivative of `exp_p` at v.
    fn dlog(&self, p: &[Lane], v: &[Lane], w: &[Lane], out: &mut [Lane]) {
        let Span { basis, generator } = self.span(p, v);
        let (w, m, k) = (self.read(w), generator.rows(), self.k);
        let turn = exp_skew_minus_one(&generator).plus_identity(Lane::ONE);
        let dim = self.positions().count();
        // The columns of exp(−Ω) D exp(Ω) E for the basis matrices E.
        let mut derivative = Matrix::<Lane, 1>::zeros(dim, dim);
        for (b, (row, col)) in self.positions().enumerate() {
            let moving: Matrix<Dual, 1, A> = Matrix::from_fn(m, m, |i, j| {
                let rate = match (i, j) {
                    at if at == (row, col) => Lane::ONE,
                    at if at == (col, row) => lane(-1.0),
                    _ => Lane::ZERO,
                };
                [Dual::from_parts([generator[(i, j)][0], rate, Lane::ZERO])]
            });
            let rate = exp_skew_minus_one(&moving).map(|x| x.parts()[1]);
            let column = turn.adjoint_times(&rate);
            for (a, at) in self.positions().enumerate() {
                derivative[(a, b)] = column[at];
            }
        }
        let (along, inside) = (basis.adjoint_times(&w), turn.adjoint_times(&basis.adjoint_times(&w)));
        let right =
            Matrix::from_fn(dim, 1, |a, _| self.positions().nth(a).map_or([Lane::ZERO], |at| inside[at]));
        let solved = inverse(&derivative).times(&right);
        let mut change = Real::<A>::zeros(m, m);
        for (a, (i, j)) in self.positions().enumerate() {
            let x = solved[(a, 0)][0];
            (change[(i, j)], change[(j, i)]) = ([x], [-x]);
        }
        let mut result = self.columns(&basis, &change);
        if m < self.n {
            // The part orthogonal to the span is multiplied by the mean of exp(sΩ), sin√G/√G + Ω (1 − cos√G)/G.
            let [s, c] = trig(&generator.adjoint_times(&generator));
            let mean = &s - &generator.times(&c);
            let outside = &w - &basis.times(&along);
            result = &result + &outside.times(&inverse(&mean.some_rows(0, k).some_cols(0, k)));
        }
        result.write(out);
    }
}

fn numbers<A: Storage>(x: &Real<A>) -> Vec<Lane> {
    x.entries().as_flattened().to_vec()
}

/// Γ of Algorithm 4 for the blocks B and C of a logarithm.
fn correction<A: Storage>(b: &Real<A>, wrong: &Real<A>) -> Real<A> {
    let mut s = [b.times_adjoint(b).scaled(lane(1.0 / 12.0)).plus_identity(lane(-0.5))];
    if wrong.rows() == 2 {
        // SJ + JS = tr(S) J for the skew-symmetric J.
        let trace = s[0].trace();
        return wrong.map(|x| x / trace);
    }
    let z = diagonalize(&mut s);
    let turned = z.adjoint_times(wrong).times(&z);
    let rest = wrong.rows();
    let scaled =
        Real::<A>::from_fn(rest, rest, |i, j| [turned[(i, j)][0] / (s[0][(i, i)][0] + s[0][(j, j)][0])]);
    z.times(&scaled).times_adjoint(&z).skew_part()
}

/// A rotation with given first columns and a symmetric last block, so that it is not far from the identity.
fn completed<A: Storage>(first: &Real<A>) -> Real<A> {
    let (m, k) = (first.rows(), first.cols());
    let (mut columns, side) = columns_of_q(first.clone(), k, m);
    // Of the two orientations one gives rotations.
    (0..m).for_each(|i| columns[(i, 0)][0] *= side);
    let last = columns.times_adjoint(&nearest_rotation(&columns.some_rows(k, m)));
    Real::<A>::from_fn(m, m, |i, j| if j < k { first[(i, j)] } else { last[(i, j - k)] })
}

/// The rotation nearest to a matrix, or the identity where it is not unique.
fn nearest_rotation<A: Storage>(b: &Real<A>) -> Real<A> {
    let n = b.rows();
    let identity = Real::<A>::identity(n);
    if n == 2 {
        // The rotation (x, −y; y, x) with the largest trace of its product with b.
        let (x, y) = (b[(0, 0)][0] + b[(1, 1)][0], b[(1, 0)][0] - b[(0, 1)][0]);
        let size = x.mul_add(x, y * y).sqrt();
        let turn = Real::<A>::read(2, 2, &[x, -y, y, x].map(|x| x / size));
        return Select::select(size.simd_gt(Lane::ZERO), turn, identity);
    }
    let off = b.adjoint_times(b).plus_identity(lane(-1.0)).size();
    let nearest = polar(b, off);
    // If the nearest orthogonal matrix is a reflection, the direction of the smallest singular value changes its sign.
    let mut square = [b.adjoint_times(b)];
    let mut v = diagonalize(&mut square);
    let mut values: Vec<Lane> = (0..n).map(|i| square[0][(i, i)][0]).collect();
    sort_columns(&mut values, &mut [&mut v]);
    let least = v.some_cols(n - 1, n);
    let other = &nearest - &nearest.times(&least).times_adjoint(&least).scaled(lane(2.0));
    let det = determinant(&nearest)[0];
    let reflection = Select::select(det.simd_lt(Lane::ZERO), other, identity);
    Select::select(det.simd_gt(Lane::ZERO), nearest, reflection)
}

/// Columns of the orthogonal factor of a matrix by Householder's reflections, whose columns are orthogonal for any
/// rank. If the columns of the matrix are orthonormal, also the determinant of these columns with all further ones.
fn columns_of_q<A: Storage>(mut x: Real<A>, from: usize, to: usize) -> (Real<A>, Lane) {
    let n = x.rows();
    let (mut reflections, mut side) = (Vec::new(), Lane::ONE);
    for j in 0..x.cols().min(n) {
        let mut v: Vec<Lane> = (j..n).map(|i| x[(i, j)][0]).collect();
        let (norm, behind) = (dot(&v, &v).sqrt(), v[0].simd_lt(Lane::ZERO));
        v[0] += behind.select(-norm, norm);
        // A reflection maps the column to the axis with the other sign.
        side = behind.select(-side, side);
        let square = dot(&v, &v);
        // Nothing is left to reflect in a column of zeros.
        let scale = square.simd_gt(Lane::ZERO).select(lane(2.0) / square, square);
        for l in j + 1..x.cols() {
            let along = (j..n).fold(Lane::ZERO, |sum, i| v[i - j].mul_add(x[(i, l)][0], sum)) * scale;
            (j..n).for_each(|i| x[(i, l)][0] -= along * v[i - j]);
        }
        reflections.push((v, scale));
    }
    let mut out = Real::<A>::zeros(n, to - from);
    for l in from..to {
        let mut column = vec![Lane::ZERO; n];
        column[l] = Lane::ONE;
        for (j, (v, scale)) in reflections.iter().enumerate().rev() {
            let along = dot(v, &column[j..]) * *scale;
            column[j..].iter_mut().zip(v).for_each(|(x, v)| *x -= along * *v);
        }
        (0..n).for_each(|i| out[(i, l - from)][0] = column[i]);
    }
    (out, side)
}
