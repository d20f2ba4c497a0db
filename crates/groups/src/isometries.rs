//! The smallest groups as spheres: SO(2) and U(1) are circles, and SU(2) consists of unit quaternions.

use crate::unitary::UnitaryGroup;
use symspline_core::matrix::Known;
use symspline_core::scalar::{Scalar, lane};
use symspline_core::space::Isometry;
use symspline_vectors::Sphere;

/// A group of matrices as a sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AsSphere<G> {
    general: G,
    sphere: Sphere,
}

/// Rotations of the plane.
pub type PlaneRotations = AsSphere<UnitaryGroup<1>>;
/// Complex numbers of modulus one.
pub type Phases = AsSphere<UnitaryGroup<2>>;
/// SU(2), the matrices (a, b; −b̄, ā).
pub type UnitQuaternions = AsSphere<UnitaryGroup<2, Known<2, 4>>>;

impl PlaneRotations {
    /// SO(2)
    pub fn new() -> Result<Self, String> {
        Ok(AsSphere { general: UnitaryGroup::new(2, true)?, sphere: Sphere::new(1)? })
    }
}

impl Phases {
    /// U(1)
    pub fn new() -> Result<Self, String> {
        Ok(AsSphere { general: UnitaryGroup::new(1, false)?, sphere: Sphere::new(1)? })
    }
}

impl UnitQuaternions {
    /// SU(2)
    pub fn new() -> Result<Self, String> {
        Ok(AsSphere { general: UnitaryGroup::new(2, true)?, sphere: Sphere::new(3)? })
    }
}

impl Isometry for PlaneRotations {
    type Image = Sphere;
    type General = UnitaryGroup<1>;
    const LEN: usize = 2;
    const SCALE: f64 = 1.0;
    const ANGLE: f64 = 1.0;
    fn image(&self) -> Sphere {
        self.sphere
    }
    fn general(&self) -> &Self::General {
        &self.general
    }
    #[inline(always)]
    fn enter<S: Scalar>(x: &[S], y: &mut [S]) {
        y[0] = (x[0] + x[3]) * lane(0.5);
        y[1] = (x[2] - x[1]) * lane(0.5);
    }
    #[inline(always)]
    fn leave<S: Scalar>(y: &[S], x: &mut [S]) {
        x.copy_from_slice(&[y[0], -y[1], y[1], y[0]]);
    }
}

impl Isometry for Phases {
    type Image = Sphere;
    type General = UnitaryGroup<2>;
    const HOT: bool = false;
    const LEN: usize = 2;
    const SCALE: f64 = 1.0;
    const ANGLE: f64 = 1.0;
    fn image(&self) -> Sphere {
        self.sphere
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

impl Isometry for UnitQuaternions {
    type Image = Sphere;
    type General = UnitaryGroup<2, Known<2, 4>>;
    const LEN: usize = 4;
    const SCALE: f64 = std::f64::consts::SQRT_2;
    const ANGLE: f64 = 2.0;
    fn image(&self) -> Sphere {
        self.sphere
    }
    fn general(&self) -> &Self::General {
        &self.general
    }
    #[inline(always)]
    fn enter<S: Scalar>(x: &[S], y: &mut [S]) {
        let mean = |a: S, b: S| (a + b) * lane(0.5);
        y.copy_from_slice(&[mean(x[0], x[6]), mean(x[1], -x[7]), mean(x[2], -x[4]), mean(x[3], x[5])]);
    }
    #[inline(always)]
    fn leave<S: Scalar>(y: &[S], x: &mut [S]) {
        x.copy_from_slice(&[y[0], y[1], y[2], y[3], -y[2], y[3], y[0], -y[1]]);
    }
}
