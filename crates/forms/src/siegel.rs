//! Siegel's upper half space Sp(2n, R)/U(n), the symplectic matrices among the positive definite ones of 2n rows: pJp
//! = J with J = (0, 1; −1, 0). These are the fixed points of the isometry p ↦ J p⁻¹ Jᵀ (Siegel, Symplectic geometry,
//! 1943). The complex symmetric X + iY with positive definite Y is (Y + XY⁻¹X, XY⁻¹; Y⁻¹X, Y⁻¹).

use crate::positive_definite::PositiveDefinite;
use std::f64::consts::FRAC_1_SQRT_2;
use symspline_core::matrix::{Known, Matrix, cholesky, solve_lower};
use symspline_core::scalar::{Each, Lane, Scalar, lane};
use symspline_core::space::{Ambient, Isometry, Origin, Part, Within};

/// Siegel's upper half space of n × n matrices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Siegel {
    n: usize,
    whole: PositiveDefinite<1>,
}

type Square<S> = Matrix<S, 1>;

impl Siegel {
    /// The half space of complex symmetric n × n matrices.
    pub fn new(n: usize) -> Result<Self, String> {
        if n == 0 {
            return Err("Siegel(n) needs n >= 1".into());
        }
        let rows = n.checked_mul(2).ok_or("Siegel(n) needs a smaller n")?;
        Ok(Siegel { n, whole: PositiveDefinite::new(rows, false)? })
    }

    fn read(&self, x: &[Lane]) -> Square<Lane> {
        Matrix::read(2 * self.n, 2 * self.n, x)
    }

    /// J x Jᵀ
    fn turned(&self, x: &Square<Lane>) -> Square<Lane> {
        let n = self.n;
        Matrix::from_fn(2 * n, 2 * n, |i, j| {
            let entry = x[((i + n) % (2 * n), (j + n) % (2 * n))];
            if (i < n) == (j < n) { entry } else { entry.each(|x| -x) }
        })
    }

    /// Tangent vectors at the identity are (A, B; B, −A) with symmetric A and B. For each pair of coordinates, the
    /// position of the first one in A and its factor.
    fn positions(&self) -> impl Iterator<Item = (usize, usize, Lane)> {
        let n = self.n;
        (0..n).flat_map(move |i| {
            (i..n).map(move |j| (i, j, if i == j { lane(FRAC_1_SQRT_2) } else { lane(0.5) }))
        })
    }
}

impl Part for Siegel {
    type Whole = PositiveDefinite<1>;
    fn whole(&self) -> PositiveDefinite<1> {
        self.whole
    }
    fn dim(&self) -> usize {
        self.n.saturating_mul(self.n + 1)
    }
    fn curvature(&self) -> f64 {
        self.whole.curvature()
    }
    fn injectivity_radius(&self) -> f64 {
        f64::INFINITY
    }
    fn widen<S: Scalar>(&self, x: &[S], wide: &mut [S]) {
        let (n, mut m) = (self.n, Square::zeros(2 * self.n, 2 * self.n));
        for ((i, j, factor), x) in self.positions().zip(x.as_chunks::<2>().0) {
            let [a, b] = x.each(|x| [x * factor]);
            for (i, j) in [(i, j), (j, i)] {
                m[(i, j)] = a;
                m[(n + i, n + j)] = a.each(|a| -a);
                m[(i, n + j)] = b;
                m[(n + i, j)] = b;
            }
        }
        self.whole.algebra().coordinates(&m, wide);
    }
    fn narrow<S: Scalar>(&self, wide: &[S], x: &mut [S]) {
        let (n, m) = (self.n, self.whole.algebra().matrix(wide));
        for ((i, j, factor), x) in self.positions().zip(x.as_chunks_mut::<2>().0) {
            // Each occurs four times in the matrix, or twice on the diagonals of its blocks.
            let factor = if i == j { factor } else { factor * lane(2.0) };
            *x = [m[(i, j)][0] - m[(n + i, n + j)][0], m[(i, n + j)][0] + m[(j, n + i)][0]]
                .each(|x| x * factor);
        }
    }
    fn mirror(&self, p: &[Lane], image: &mut [Lane]) {
        let back = solve_lower(&cholesky(&self.read(p)), &Matrix::identity(2 * self.n));
        self.turned(&back.adjoint_times(&back)).write(image);
    }
    /// −J p⁻¹ v p⁻¹ Jᵀ, where p⁻¹ = Jᵀ p J.
    fn mirror_vector(&self, p: &[Lane], v: &[Lane], image: &mut [Lane]) {
        let p = self.read(p);
        (-p.times(&self.turned(&self.read(v))).times(&p)).hermitian_part().write(image);
    }
    /// With p = (·, b; b*, c c*) the symplectic g = (c⁻*, b c⁻*; 0, c).
    fn lift(&self, p: &[Lane], frame: &mut [Lane]) {
        let (n, p) = (self.n, self.read(p));
        let c = cholesky(&p.some_rows(n, 2 * n).some_cols(n, 2 * n));
        let across = solve_lower(&c, &Matrix::identity(n)).adjoint();
        let beside = p.some_rows(0, n).some_cols(n, 2 * n).times(&across);
        let minus = -beside.adjoint();
        let (c_adjoint, back) = (c.adjoint(), across.adjoint());
        let zero = Square::zeros(n, n);
        let of = |blocks: [&Square<Lane>; 4]| {
            Square::from_fn(2 * n, 2 * n, |i, j| blocks[i / n * 2 + j / n][(i % n, j % n)])
        };
        let (g, inverse) = frame.split_at_mut(4 * n * n);
        of([&across, &beside, &zero, &c]).write(g);
        of([&c_adjoint, &minus, &zero, &back]).write(inverse);
    }
    fn violation(&self, p: &[Lane]) -> String {
        let rounding = self.whole.rounding(p).to_array()[0];
        if rounding * f64::EPSILON > 1e-9 {
            return format!(
                "its condition number of {rounding:.1e} is too large to verify in double precision that it is symplectic; \
                 move all points by one isometry, such as z - x for a symmetric x"
            );
        }
        let p = self.read(p);
        let off = p.times(&self.turned(&p)).plus_identity(lane(-1.0)).size().to_array()[0];
        format!(
            "it is not symplectic: |pJpJ + 1| = {off:.3e} (symspline.convert.siegel_to_positive_definite makes points \
             of complex symmetric matrices)"
        )
    }
}

/// The half space of complex numbers, whose points are the matrices of determinant one: symplectic means the same for
/// 2 × 2 matrices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HalfPlane {
    general: Within<Siegel>,
    image: Plane,
}

type Plane = PositiveDefinite<1, Known<2, 4>>;

impl HalfPlane {
    /// Siegel's half space of 1 × 1 matrices.
    pub fn new() -> Result<Self, String> {
        Ok(HalfPlane { general: Within(Siegel::new(1)?), image: PositiveDefinite::new(2, true)? })
    }
}

impl Isometry for HalfPlane {
    type Image = Plane;
    type General = Within<Siegel>;
    const LEN: usize = 4;
    const SCALE: f64 = 1.0;
    const ANGLE: f64 = 1.0;
    fn image(&self) -> Plane {
        self.image
    }
    fn general(&self) -> &Self::General {
        &self.general
    }
    #[inline(always)]
    fn enter<S: Scalar>(x: &[S], y: &mut [S]) {
        y.copy_from_slice(x);
    }
    #[inline(always)]
    fn leave<S: Scalar>(y: &[S], x: &mut [S]) {
        x.copy_from_slice(y);
    }
}
