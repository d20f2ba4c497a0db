//! The trait of a symmetric space, and the list of all of them.
//!
//! A page below this folder is one space. Its formulas come in three groups:
//!
//! * in the ambient array (exponential, logarithm, geodesic, transvection), for a user's calls and
//!   for evaluating a curve;
//! * with a *moving frame*: an element g of the group with g·o = p that is carried in parallel from
//!   point to point. In frames every tangent vector is a coordinate vector of 𝔪 = T_oM and parallel
//!   transport is the identity;
//! * at the origin o, on coordinates of 𝔪: there the C² condition is solved.
//!
//! Adding a space is one page and one line in `spaces!`, see docs/adding-a-space.md. The page's type needs
//! `new`, which returns why its parameters are bad, `parameters`, and to derive Clone, Copy, Debug and Eq.

mod algebra;
mod constant_curvature;
mod euclidean;
mod grassmannian;
mod hyperbolic;
mod positive_definite;
mod rigid;
mod rotations;
mod special_euclidean;
mod sphere;
mod unitary;

pub use euclidean::Euclidean;
pub use grassmannian::{
    ComplexGrassmannian, ComplexProjective, Grassmannian, RealProjective, SmallComplexProjective,
    SmallGrassmannian, SmallRealProjective,
};
pub use hyperbolic::Hyperbolic;
pub use positive_definite::{
    HermitianPositiveDefinite, SymmetricPositiveDefinite, SymmetricPositiveDefinite2,
    SymmetricPositiveDefinite3,
};
pub use rotations::Rotations;
pub use special_euclidean::SpecialEuclidean;
pub use sphere::Sphere;
pub use unitary::{
    Orthogonal, SpecialOrthogonal, SpecialUnitary, SpecialUnitary2, Unitary, Unitary2, Unitary4,
};

use crate::scalar::{Lane, Scalar, dot, max_or_nan};

/// Vectors of this size and smaller, at points of size one, may be rounding errors as to direction: a
/// defect is measured against it where a vector is smaller still.
pub const ROUNDING_SIZE: Lane = Lane::splat(1e-7);

/// A symmetric space: the paper's §2.1–2.4.
///
/// The *deciding angle* of two points is what tells whether the geodesic between them is unique: it is
/// below [`cut_angle`](Space::cut_angle) if so, and need be exact only near there; below it may be any
/// upper bound. NaN in points must come back as NaN. What a lane gets must not depend on its neighbours.
///
/// Points and tangent vectors are ambient arrays of [`point_len`](Space::point_len) numbers (a
/// complex number is two), coordinates at the origin are [`dim`](Space::dim) numbers, for which
/// [`norm2`](Space::norm2) is the squared length of the vector.
pub trait Space: Copy + Send + Sync + 'static {
    /// Whether multiplying all points by a number multiplies the curve by it. Then data of any size
    /// are brought to size one first, so that squares neither overflow nor vanish.
    const SCALES: bool = false;
    /// Whether points are vectors of a few numbers, for which code of known sizes pays.
    const VECTORS: bool = false;

    /// A space that covers this one locally, in which curves are evaluated: usually the space itself.
    type Chart: Space;
    /// The chart; `None` where it is the space itself. With a chart `enter` and `leave` are needed.
    fn chart(&self) -> Option<Self::Chart> {
        None
    }
    /// Brings a segment of a curve into the chart: its end points and tangent vectors there.
    fn enter(&self, _p: [&[Lane]; 2], _v: [&[Lane]; 2], _y: [&mut [Lane]; 2], _w: [&mut [Lane]; 2]) {}
    /// Brings a point of the chart and, if given, a tangent vector there back: writes the point, or the
    /// vector.
    fn leave(&self, _y: &[Lane], _w: Option<&[Lane]>, _out: &mut [Lane]) {}

    /// Numbers in the array of a point.
    fn point_len(&self) -> usize;
    /// Dimension of the space.
    fn dim(&self) -> usize;
    /// Numbers in a frame.
    fn frame_len(&self) -> usize;
    /// Numbers that [`prepare`](Space::prepare) keeps of a chord.
    fn chord_len(&self) -> usize {
        0
    }
    /// The deciding angle at which the cut locus is met; infinite where there is none.
    fn cut_angle(&self) -> f64;
    /// The deciding angle that a control leg must not reach.
    fn longest_leg(&self) -> f64 {
        self.cut_angle()
    }
    /// K of (22).
    fn curvature(&self) -> f64;
    /// Shape of the array of a point.
    fn point_shape(&self) -> Vec<usize> {
        vec![self.point_len()]
    }
    /// Whether the numbers of a point are complex, real and imaginary part side by side.
    fn is_complex(&self) -> bool {
        false
    }
    /// Whether any two points are joined by a curve.
    fn is_connected(&self) -> bool {
        true
    }
    /// Tells the two parts of a space apart that no curve joins.
    fn component(&self, _p: &[f64]) -> bool {
        true
    }
    /// Distance below which the logarithm is defined whatever the direction; other than the cut angle
    /// where length and angle differ.
    fn injectivity_radius(&self) -> f64 {
        self.cut_angle()
    }

    // ---- in the ambient array -------------------------------------------------------------

    /// `exp_p(t v)`: the geodesic from p with velocity v.
    fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]);
    /// `log_p(q)`, (11); returns the deciding angle.
    fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane;
    /// Distance, given `log_p(q)` and the deciding angle; defined past the cut locus too.
    fn distance(&self, p: &[Lane], _q: &[Lane], log: &[Lane], _angle: Lane) -> Lane {
        max_or_nan(self.inner(p, log, log), Lane::ZERO).sqrt()
    }
    /// `[p, q]_t`, (7), between points that may move with t.
    fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]);
    /// The transvection `E_p(v)` of (10) applied to a point x.
    fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]);
    /// Parallel transport of a tangent vector x from p to q = `exp_p(v)`: `E_p(v)` applied to it, at the
    /// representative q.
    fn carry(&self, p: &[Lane], _q: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) {
        self.transvect(p, v, x, out);
    }
    /// Turns the derivative of the ambient array at γ into the velocity γ', in place.
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]);
    /// Turns the second derivative of the ambient array into the covariant acceleration ∇γ', in place;
    /// `d` is the first derivative.
    fn acceleration(&self, gamma: &[Lane], d: &[Lane], dd: &mut [Lane]);
    /// Inner product of two tangent vectors at p.
    fn inner(&self, p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane;
    /// Replaces x by a point of the space beside it; returns how far it was, relative to its size.
    fn project(&self, x: &mut [Lane]) -> Lane;
    /// Replaces v by its tangential part at p; returns how far it was, relative to its size (or to
    /// [`ROUNDING_SIZE`]).
    fn project_tangent(&self, p: &[Lane], v: &mut [Lane]) -> Lane;
    /// Turns independent standard normal numbers into a random point.
    fn scatter(&self, noise: &mut [Lane]);
    /// Says in words and numbers why x, which is finite, is not a point.
    fn complaint(&self, x: &[f64]) -> String;

    // ---- moving frame ---------------------------------------------------------------------

    /// A frame at p.
    fn lift(&self, p: &[Lane], frame: &mut [Lane]);
    /// Moves a frame at p along the geodesic to q, in parallel; `chord` becomes the coordinates of
    /// `log_p(q)`. Returns the deciding angle.
    fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane;
    /// Removes the rounding errors that a frame at p has gathered.
    fn tidy(&self, frame: &mut [Lane], p: &[Lane]);
    /// Coordinates of a tangent vector at p.
    fn coordinates(&self, frame: &[Lane], p: &[Lane], v: &[Lane], x: &mut [Lane]);
    /// The tangent vector at p with given coordinates.
    fn tangent(&self, frame: &[Lane], p: &[Lane], x: &[Lane], v: &mut [Lane]);

    // ---- at the origin --------------------------------------------------------------------

    /// Computes once for a chord what every call of [`legs`](Space::legs) needs of it.
    fn prepare(&self, _chord: &[Lane], _prepared: &mut [Lane]) {}
    /// With `M = E(−a) E(d) E(−b)` for the chord d: `w⁺ = log_o(M·o)` and `w⁻ = log_o(M⁻¹·o)`.
    ///
    /// These are the two logarithms of the C² condition (13), seen from either end of a segment
    /// whose end velocities are `3a` and `3b`.
    fn legs<S: Scalar>(
        &self,
        chord: &[Lane],
        prepared: &[Lane],
        a: &[S],
        b: &[S],
        w_plus: &mut [S],
        w_minus: &mut [S],
    );
    /// `S(v) x` with `S(v) = sinh(ad_v)/ad_v` of Lemma A.2.
    fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]);
    /// Squared length of a coordinate vector.
    fn norm2(&self, x: &[Lane]) -> Lane {
        dot(x, x)
    }
    /// The deciding angle of `exp_o(v)`; grows in proportion to v.
    fn angle(&self, v: &[Lane]) -> Lane {
        self.norm2(v).sqrt()
    }
    /// The deciding angle of `exp_p(v)`.
    fn angle_at(&self, p: &[Lane], v: &[Lane]) -> Lane {
        let (mut frame, mut x) = (vec![Lane::ZERO; self.frame_len()], vec![Lane::ZERO; self.dim()]);
        self.lift(p, &mut frame);
        self.coordinates(&frame, p, v, &mut x);
        self.angle(&x)
    }
    /// By how much rounding errors may grow in [`legs`](Space::legs) over a chord.
    fn condition(&self, _chord: &[Lane]) -> Lane {
        Lane::ONE
    }
}

/// The list of spaces: makes the enum that dispatches once a call, and the names. Behind `specialised`
/// stand pages of their own for some sizes of a space.
macro_rules! spaces {
    ($($space:ident($($parameter:ident),+) = $($name:literal)|+;)+
     => specialised: $($special:ident = $general:ident($($p:ident),+) if $condition:expr;)+) => {
        /// Any of the spaces.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum AnySpace {
            $(#[allow(missing_docs)] $space($space),)+
            $(#[allow(missing_docs)] $special($special)),+
        }

        impl AnySpace {
            /// The space with a name (short or long) and parameters, e.g. `"sphere"`, `[2]`.
            pub fn new(name: &str, parameters: &[usize]) -> Result<Self, String> {
                Self::general(name, parameters).and_then(Self::specialised)
            }

            fn general(name: &str, parameters: &[usize]) -> Result<Self, String> {
                match (name, parameters) {
                    $(($($name)|+, &[$($parameter),+]) => $space::new($($parameter),+).map(Self::$space),)+
                    $(($($name)|+, _) => Err(format!(
                        "{name} takes {} number(s) ({}), got {}",
                        [$(stringify!($parameter)),+].len(), [$(stringify!($parameter)),+].join(", "), parameters.len())),)+
                    _ => Err(format!("unknown space {name:?}; known are {}", Self::NAMES.map(|n| n.join(" or ")).join(", "))),
                }
            }

            fn name_of(type_name: &str) -> &'static str {
                let types = [$(stringify!($space)),+];
                types.iter().position(|t| *t == type_name).map_or("", |i| Self::NAMES[i][0])
            }

            fn specialised(self) -> Result<Self, String> {
                match self {
                    $(Self::$general(space) if { let [$($p),+] = space.parameters(); $condition } => {
                        let [$($p),+] = space.parameters();
                        $special::new($($p),+).map(Self::$special)
                    })+
                    _ => Ok(self),
                }
            }

            /// All names, one row a space, the first of a row being the canonical one.
            pub const NAMES: [&[&str]; [$(stringify!($space)),+].len()] = [$(&[$($name),+]),+];

            /// The canonical name and the parameters.
            pub fn name(&self) -> (&'static str, Vec<usize>) {
                match self {
                    $(Self::$space(space) => ([$($name),+][0], space.parameters().to_vec()),)+
                    $(Self::$special(space) => (Self::name_of(stringify!($general)), space.parameters().to_vec()),)+
                }
            }
        }

        /// Runs an expression with the concrete space behind an [`AnySpace`].
        #[macro_export]
        macro_rules! with_space {
            ($any:expr, $bound:ident => $body:expr) => {
                match $any {
                    $($crate::space::AnySpace::$space($bound) => $body,)+
                    $($crate::space::AnySpace::$special($bound) => $body),+
                }
            };
        }
    };
}

spaces! {
    Euclidean(n) = "euclidean" | "r";
    Sphere(n) = "sphere" | "s";
    Hyperbolic(n) = "hyperbolic" | "h";
    RealProjective(n) = "rp" | "real-projective";
    ComplexProjective(n) = "cp" | "complex-projective";
    Grassmannian(k, n) = "gr" | "grassmannian";
    ComplexGrassmannian(k, n) = "cgr" | "complex-grassmannian";
    SpecialOrthogonal(n) = "so" | "special-orthogonal";
    Orthogonal(n) = "o" | "orthogonal";
    Unitary(n) = "u" | "unitary";
    SpecialUnitary(n) = "su" | "special-unitary";
    SymmetricPositiveDefinite(n) = "spd" | "symmetric-positive-definite";
    HermitianPositiveDefinite(n) = "hpd" | "hermitian-positive-definite";
    SpecialEuclidean(n) = "se" | "special-euclidean";

    => specialised:
    Rotations = SpecialOrthogonal(n) if n == 3;
    SymmetricPositiveDefinite2 = SymmetricPositiveDefinite(n) if n == 2;
    SymmetricPositiveDefinite3 = SymmetricPositiveDefinite(n) if n == 3;
    Unitary2 = Unitary(n) if n == 2;
    Unitary4 = Unitary(n) if n == 4;
    SpecialUnitary2 = SpecialUnitary(n) if n == 2;
    SmallRealProjective = RealProjective(n) if n <= 3;
    SmallComplexProjective = ComplexProjective(n) if n <= 3;
    SmallGrassmannian = Grassmannian(k, n) if k * n <= 10;
}
