//! Subspaces of R^{p,q} on which the form −x₁² − … − x_p² + … has a given signature (a, b), O(p,q)/(O(a,b) ×
//! O(p−a,q−b)). A subspace is represented by its reflection P, which is 1 on it and −1 on its complement. Reflections
//! are the fixed points of inversion in O(p,q), and geodesics of O(p,q) through two of them consist of reflections
//! (Loos, Symmetric Spaces I, 1969, chapter II.1).

use crate::general_linear::GeneralLinear;
use crate::members::Members;
use std::f64::consts::{PI, SQRT_2};
use symspline_core::matrix::{Matrix, diagonalize, sort_columns};
use symspline_core::scalar::{Lane, Scalar, lane};
use symspline_core::space::{Ambient, Part};

/// Subspaces of signature (a, b).
#[derive(Clone, Copy)]
pub struct IndefiniteGrassmannian {
    subspace: [usize; 2],
    form: [usize; 2],
    whole: GeneralLinear<1>,
}

type Square = Matrix<Lane, 1>;

impl IndefiniteGrassmannian {
    /// Subspaces with given numbers of negative and positive squares, of a form with given numbers; the negative
    /// numbers come first.
    pub fn new(subspace: [usize; 2], form: [usize; 2]) -> Result<Self, String> {
        let [[a, b], [p, q]] = [subspace, form];
        let sum = |x: [usize; 2]| x[0].checked_add(x[1]);
        let (Some(k), Some(n)) = (sum(subspace), sum(form)) else {
            return Err("IndefiniteGrassmannian(a, b, p, q): p + q is too large".into());
        };
        if a > p || b > q || k == 0 || k == n {
            return Err(format!(
                "IndefiniteGrassmannian(a, b, p, q) needs a <= p, b <= q and 0 < a + b < p + q, not ({a}, {b}, {p}, {q})"
            ));
        }
        Ok(Self { subspace, form, whole: GeneralLinear::new(n, Members::PseudoOrthogonal(p))? })
    }

    fn rows(&self) -> usize {
        self.form[0] + self.form[1]
    }

    fn read(&self, x: &[Lane]) -> Square {
        Matrix::read(self.rows(), self.rows(), x)
    }

    /// Whether an axis lies in the subspace at the origin, as the last axes of either sign do.
    fn inside(&self, axis: usize) -> bool {
        let ([a, b], [p, q]) = (self.subspace, self.form);
        if axis < p { axis >= p - a } else { axis >= p + q - b }
    }

    /// For every coordinate of the whole space, whether it joins the subspace at the origin and its complement.
    fn across(&self) -> impl Iterator<Item = bool> {
        let n = self.rows();
        (0..n).flat_map(move |i| (i + 1..n).map(move |j| self.inside(i) != self.inside(j)))
    }

    /// The inverse, which is the adjoint.
    fn inverse(&self, x: &Square) -> Square {
        Members::PseudoOrthogonal(self.form[0]).adjoint(x).unwrap_or_else(|| x.clone())
    }

    /// η x η
    fn turned(&self, x: &Square) -> Square {
        self.inverse(x).adjoint()
    }

    /// The polar decomposition of a reflection P: a symmetric r of the group and an orthogonal reflection K with
    /// P = r K r⁻¹. With h = (PᵀP)^½ = |ηP| it is r = h^{−½} and K = P h⁻¹, since K h K = h⁻¹.
    fn polar(&self, p: &Square) -> [Square; 2] {
        let n = self.rows();
        let sign = |i: usize| lane(if i < self.form[0] { -1.0 } else { 1.0 });
        let mut m = [Square::from_fn(n, n, |i, j| [p[(i, j)][0] * sign(i)]).hermitian_part()];
        let v = diagonalize(&mut m);
        let roots: Vec<Lane> = (0..n).map(|i| m[0][(i, i)][0].abs().sqrt()).collect();
        let back = v.times(&Matrix::diagonal(&roots)).times_adjoint(&v);
        let r = self.turned(&back);
        let k = back.times(p).times(&r).hermitian_part();
        [r, k]
    }
}

impl Part for IndefiniteGrassmannian {
    type Whole = GeneralLinear<1>;
    fn whole(&self) -> GeneralLinear<1> {
        self.whole
    }
    fn dim(&self) -> usize {
        let k = self.subspace[0] + self.subspace[1];
        k * (self.rows() - k)
    }
    fn curvature(&self) -> f64 {
        // None of the invariant metrics is definite.
        f64::NAN
    }
    fn injectivity_radius(&self) -> f64 {
        SQRT_2 * PI
    }
    fn widen<S: Scalar>(&self, x: &[S], wide: &mut [S]) {
        let mut x = x.iter();
        for (wide, across) in wide.iter_mut().zip(self.across()) {
            let next = if across { x.next().copied() } else { None };
            *wide = next.unwrap_or(S::constant(Lane::ZERO));
        }
    }
    fn narrow<S: Scalar>(&self, wide: &[S], x: &mut [S]) {
        let own = wide.iter().zip(self.across()).filter(|(_, across)| *across);
        x.iter_mut().zip(own).for_each(|(x, (wide, _))| *x = *wide);
    }
    fn mirror(&self, p: &[Lane], image: &mut [Lane]) {
        self.inverse(&self.read(p)).write(image);
    }
    /// −P⁻¹ v P⁻¹ with P⁻¹ = P.
    fn mirror_vector(&self, p: &[Lane], v: &[Lane], image: &mut [Lane]) {
        let p = self.read(p);
        (-p.times(&self.read(v)).times(&p)).write(image);
    }
    /// A basis in which the form is η and the reflection diagonal.
    fn lift(&self, p: &[Lane], frame: &mut [Lane]) {
        let [r, k] = self.polar(&self.read(p));
        let n = self.rows();
        // The four eigenvalues decrease from −η: those of the axes in the order of the form, complement before
        // subspace.
        let split = Square::from_fn(n, n, |i, j| {
            let apart = if i == j { if i < self.form[0] { 3.0 } else { -3.0 } } else { 0.0 };
            [lane(apart) - k[(i, j)][0]]
        });
        let mut split = [split];
        let mut v = diagonalize(&mut split);
        let mut keys: Vec<Lane> = (0..n).map(|i| split[0][(i, i)][0]).collect();
        sort_columns(&mut keys, &mut [&mut v]);
        let g = r.times(&v);
        let (first, second) = frame.split_at_mut(n * n);
        g.write(first);
        self.inverse(&g).write(second);
    }
    fn contains(&self, p: &[Lane]) -> Lane {
        let [_, k] = self.polar(&self.read(p));
        // Traces of K on the negative and on the positive axes.
        let trace = |from: usize, to: usize| (from..to).fold(Lane::ZERO, |sum, i| sum + k[(i, i)][0]);
        let ([a, b], [p, q]) = (self.subspace, self.form);
        let same = |found: Lane, own: usize, all: usize| {
            (found - lane(2.0 * own as f64 - all as f64)).abs().simd_lt(lane(0.5))
        };
        same(trace(0, p), a, p) & same(trace(p, p + q), b, q)
    }
    fn random_point(&self, noise: &mut [Lane]) {
        self.whole.random_point(noise);
        let g = self.read(noise);
        let o: Vec<Lane> = (0..self.rows()).map(|i| lane(if self.inside(i) { 1.0 } else { -1.0 })).collect();
        g.times(&Matrix::diagonal(&o)).times(&self.inverse(&g)).write(noise);
    }
    fn violation(&self, p: &[Lane]) -> String {
        let ([a, b], x) = (self.subspace, self.read(p));
        let off = x.times(&x).plus_identity(lane(-1.0)).size().to_array()[0];
        let why = if off > 1e-8 {
            format!("it is not a reflection: |x² - 1| = {off:.3e}")
        } else {
            format!(
                "it is the reflection of a subspace on which the form has another signature than ({a}, {b})"
            )
        };
        format!("{why} (symspline.convert.basis_to_reflection makes points of bases)")
    }
}
