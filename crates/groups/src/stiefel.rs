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
    sort_columns,
};
use symspline_core::scalar::{Lane, dot, lane};
use symspline_core::space::{Ambient, Erased, Kernels, below};

type Real<A> = Matrix<Lane, 1, A>;

/// The block of a logarithm that must vanish is a rounding error below this size.
const TOLERANCE: Lane = lane(1e-14);
/// The largest number of iterations of the logarithm.
const MOST: usize = 60;
/// Nodes below ½ and weights of the rule of Gauss and Legendre with ten points on [0, 1] (Abramowitz & Stegun, 1964, table
/// 25.4). For vectors up to the injectivity radius, its error for `exp(s ad)` is below 1e-18.
const GAUSS: [[f64; 2]; 5] = [
    [0.01304673574141414, 0.03333567215434407],
    [0.06746831665550775, 0.0747256745752903],
    [0.1602952158504878, 0.10954318125799102],
    [0.2833023029353764, 0.13463335965499817],
    [0.4255628305091844, 0.14776211235737644],
];

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

    /// D(v)⁻¹w − v at both ends of a segment with the points and handles p, v, q, w: h²/6 times the accelerations. Here
    /// w is the logarithm from the inner control point to the other one, moved to p by the transvection E_p(−v).
    fn bends(&self, x: &[Vec<Lane>], out: &mut [Lane]);
    /// The transvection E_p(v) = exp(Ω) on n × k matrices, one after the other.
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &mut [Lane]);

    /// Orthonormal tangent vectors at a point.
    fn basis(&self, p: &[Lane], out: &mut [Lane]) {
        let (n, k) = self.size();
        tangents(&Real::read(n, k, p))
            .iter()
            .zip(out.chunks_exact_mut(n * k))
            .for_each(|(x, out)| x.write(out));
    }

    /// The matrix of a parallel transport from p to q along their geodesic, in the bases at both points, up to terms of
    /// third order: exp(Ω) exp(−½ ad_Ω) (Kobayashi & Nomizu, Foundations of Differential Geometry II, 1969, theorem
    /// X.2.10), with Cayley's orthogonal approximation of the second factor.
    fn turn(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) {
        let (n, k) = self.size();
        let mut v = vec![Lane::ZERO; n * k];
        self.log(p, q, &mut v);
        let read = |x: &[Lane]| Real::<Dynamic>::read(n, k, x);
        let (here, there) = (tangents(&read(p)), tangents(&read(q)));
        let dim = here.len();
        let mut moved: Vec<Lane> = here.iter().flat_map(numbers).collect();
        self.transvect(p, &v, &mut moved);
        let forms = |at: &[Lane], x: &[Real<Dynamic>], y: &[Real<Dynamic>]| {
            let (x, y) =
                (x.iter().map(numbers).collect::<Vec<_>>(), y.iter().map(numbers).collect::<Vec<_>>());
            Real::<Dynamic>::from_fn(dim, dim, |a, b| [self.inner(at, &x[a], &y[b])])
        };
        let brackets: Vec<_> = here.iter().map(|x| bracket(&read(p), &read(&v), x)).collect();
        let quarter = forms(p, &here, &brackets).scaled(lane(0.25));
        let [plus, minus] = [1.0, -1.0].map(|sign| quarter.scaled(lane(sign)).plus_identity(Lane::ONE));
        let moved: Vec<_> = moved.chunks_exact(n * k).map(read).collect();
        forms(q, &there, &moved).times(&inverse(&plus).times(&minus)).write(out);
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

/// A basis of the span of p and v whose first columns are p, the generator Ω of v, and exp(Ω).
struct Span<A: Storage> {
    basis: Real<A>,
    generator: Real<A>,
    turn: Real<A>,
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
        let turn = exp_skew_minus_one(&generator).plus_identity(Lane::ONE);
        Span { basis, generator, turn }
    }

    /// The first k columns of Q x.
    fn columns(&self, basis: &Real<A>, x: &Real<A>) -> Real<A> {
        basis.times(&x.some_cols(0, self.k))
    }

    /// The logarithm of q at p, and that of p at q.
    ///
    /// Rotations with the same first k columns differ by a rotation of the last columns. The block C of the logarithm
    /// that must vanish is removed by exp(Γ), where SΓ + ΓS = C with S = BBᵀ/12 − 1/2 accounts for the first terms of
    /// the series of Baker, Campbell and Hausdorff (Zimmermann & Hüper, Computing the Riemannian logarithm on the
    /// Stiefel manifold, 2022, Algorithm 4).
    fn logs(&self, p: &Real<A>, q: &Real<A>) -> [Real<A>; 2] {
        let k = self.k;
        let basis = self.basis(p, q);
        let mut turn = completed(&basis.adjoint_times(q));
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
        let generator = Real::<A>::read(m, m, &found);
        [self.columns(&basis, &generator), -self.columns(&basis, &turn.times(&generator))]
    }

    /// D(v)⁻¹ of E_p(−v)w for a vector w at `exp_p(v)`. The map D(v) = π ∘ dexp₋ᵥ is the mean of π ∘ exp(−sΩ) over s
    /// from 0 to 1. exp(−sΩ) acts on skew-symmetric matrices by minors of order two, and on the part of w that is
    /// orthogonal to the span by its adjoint.
    fn dlog_of(&self, Span { basis, generator, turn }: &Span<A>, w: &Real<A>) -> Real<A> {
        let (m, k) = (generator.rows(), self.k);
        let positions: Vec<_> = self.positions().collect();
        let dim = positions.len();
        let (mut derivative, mut mean) = (Matrix::<Lane, 1>::zeros(dim, dim), Real::<A>::zeros(m, m));
        for [s, weight] in GAUSS {
            let near = exp_skew_minus_one(&generator.scaled(lane(-s))).plus_identity(Lane::ONE);
            // exp(−(1 − s)Ω)
            let far = near.times(turn).adjoint();
            for u in [near, far] {
                let of = |i: usize, j: usize| u[(i, j)][0];
                for (a, &(r, c)) in positions.iter().enumerate() {
                    for (b, &(i, j)) in positions.iter().enumerate() {
                        let minor = of(r, i) * of(c, j) - of(r, j) * of(c, i);
                        derivative[(a, b)][0] += lane(weight) * minor;
                    }
                }
                mean = &mean + &u.scaled(lane(weight));
            }
        }
        let along = basis.adjoint_times(w);
        let inside = turn.adjoint_times(&along);
        let right = Matrix::from_fn(dim, 1, |a, _| inside[positions[a]]);
        let solved = inverse(&derivative).times(&right);
        let mut change = Real::<A>::zeros(m, m);
        for (a, &(i, j)) in positions.iter().enumerate() {
            let x = solved[(a, 0)][0];
            (change[(i, j)], change[(j, i)]) = ([x], [-x]);
        }
        let result = self.columns(basis, &change);
        if m == self.n {
            return result;
        }
        let outside = w - &basis.times(&along);
        &result + &outside.times(&inverse(&mean.adjoint().some_rows(0, k).some_cols(0, k)))
    }
}

impl<A: Storage> Stiefel for Frames<A> {
    fn size(&self) -> (usize, usize) {
        (self.n, self.k)
    }

    fn exp(&self, p: &[Lane], v: &[Lane], out: &mut [Lane]) {
        let Span { basis, turn, .. } = self.span(p, v);
        self.columns(&basis, &turn).write(out);
    }

    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) {
        self.logs(&self.read(p), &self.read(q))[0].write(out);
    }

    fn dlog(&self, p: &[Lane], v: &[Lane], w: &[Lane], out: &mut [Lane]) {
        self.dlog_of(&self.span(p, v), &self.read(w)).write(out);
    }

    fn bends(&self, x: &[Vec<Lane>], out: &mut [Lane]) {
        let spans = [0, 2].map(|i| self.span(&x[i], &x[i + 1]));
        let [inner, other] = [0, 1].map(|i| self.columns(&spans[i].basis, &spans[i].turn));
        let logs = self.logs(&inner, &other);
        for (i, out) in out.chunks_exact_mut(self.n * self.k).enumerate() {
            (&self.dlog_of(&spans[i], &logs[i]) - &self.read(&x[2 * i + 1])).write(out);
        }
    }

    fn transvect(&self, p: &[Lane], v: &[Lane], x: &mut [Lane]) {
        let Span { basis, turn, .. } = self.span(p, v);
        let change = turn.plus_identity(lane(-1.0));
        for x in x.chunks_exact_mut(self.n * self.k) {
            let old = self.read(x);
            (&old + &basis.times(&change.times(&basis.adjoint_times(&old)))).write(x);
        }
    }
}

/// Vectors at p that are orthonormal in the canonical metric: two columns of p that turn into each other, or one that
/// turns into a direction orthogonal to all.
fn tangents(p: &Real<Dynamic>) -> Vec<Real<Dynamic>> {
    let (n, k) = (p.rows(), p.cols());
    let (others, _) = columns_of_q(p.clone(), k, n);
    // Column j becomes x.
    let one = |j: usize, x: &dyn Fn(usize) -> Lane| {
        Real::from_fn(n, k, |r, c| [if c == j { x(r) } else { Lane::ZERO }])
    };
    let pairs = (0..k).flat_map(|i| (0..i).map(move |j| (i, j)));
    let inside = pairs.map(|(i, j)| &one(j, &|r| p[(r, i)][0]) - &one(i, &|r| p[(r, j)][0]));
    let outside = (0..n - k).flat_map(|i| (0..k).map(move |j| (i, j)));
    inside.chain(outside.map(|(i, j)| one(j, &|r| others[(r, i)][0]))).collect()
}

/// π[v, w], for v and w at p as elements of 𝔪.
fn bracket(p: &Real<Dynamic>, v: &Real<Dynamic>, w: &Real<Dynamic>) -> Real<Dynamic> {
    let [a, b] = [v, w].map(|x| p.adjoint_times(x));
    let [c, d] = [(v, &a), (w, &b)].map(|(x, a)| x - &p.times(a));
    let inside = (&a.times(&b) - &c.adjoint_times(&d)).skew_part().scaled(lane(2.0));
    &(&p.times(&inside) + &c.times(&b)) - &d.times(&a)
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
