//! A space of your own: the circle of the angles of a joint, as unit vectors (cos, sin).
//!
//! `cargo run --example custom_space`

use symspline::custom::{Custom, Lane, Model, Scalar, Trig};
use symspline::{CubicSpline, Error};

#[derive(Clone, Copy)]
struct Circle;

/// p × q: the sine of the angle from p to q, and the coordinate of a tangent vector q at p.
fn cross<S: Scalar>(p: &[S], q: &[S]) -> S {
    p[0] * q[1] - p[1] * q[0]
}

/// p turned by an angle. [`Trig`] has cosine and sine with their derivatives, as functions of the square.
fn turned<S: Scalar>(p: &[S], angle: S) -> [S; 2] {
    let Trig { c: cos, s, .. } = Trig::new(angle * angle);
    let sin = s * angle;
    [cos * p[0] - sin * p[1], cos * p[1] + sin * p[0]]
}

/// The angle from p to q, from −π to π, with its derivatives θ' = cos θ (sin θ)' − sin θ (cos θ)'.
fn angle_between<S: Scalar>(p: &[S], q: &[S]) -> S {
    // The difference keeps its digits for near points.
    let (sin, cos) = (cross(p, &[q[0] - p[0], q[1] - p[1]]), p[0] * q[0] + p[1] * q[1]);
    let [_, d, dd] = (sin * cos.value() - cos * sin.value()).parts();
    S::from_parts([sin.value().atan2(cos.value()), d, dd])
}

impl Model for Circle {
    fn point_shape(&self) -> Vec<usize> {
        vec![2]
    }
    fn cut_angle(&self) -> f64 {
        std::f64::consts::PI
    }
    fn dim(&self) -> usize {
        1
    }
    fn curvature(&self) -> f64 {
        0.0
    }
    fn origin(&self, o: &mut [Lane]) {
        (o[0], o[1]) = (Lane::ONE, Lane::ZERO);
    }
    fn vector<S: Scalar>(&self, x: &[S], v: &mut [S]) {
        v[1] = x[0];
    }
    fn coordinates<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        x[0] = v[1];
    }
    fn triple<S: Scalar>(&self, _: &[S], _: &[S], _: &[S], out: &mut [S]) {
        out[0] = S::constant(Lane::ZERO);
    }
    fn exp<S: Scalar>(&self, p: &[S], v: &[S], q: &mut [S]) {
        q.copy_from_slice(&turned(p, cross(p, v)));
    }
    fn log<S: Scalar>(&self, p: &[S], q: &[S], v: &mut [S]) -> Lane {
        let angle = angle_between(p, q);
        (v[0], v[1]) = (-(angle * p[1]), angle * p[0]);
        angle.value().abs()
    }
    fn transvect<S: Scalar>(&self, p: &[S], v: &[S], x: &mut [S]) {
        let angle = cross(p, v);
        x.chunks_exact_mut(2).for_each(|x| {
            let moved = turned(x, angle);
            x.copy_from_slice(&moved);
        });
    }
    fn section(&self, p: &[Lane], x: &mut [Lane]) {
        x.chunks_exact_mut(2)
            .for_each(|x| (x[0], x[1]) = (p[0] * x[0] - p[1] * x[1], p[1] * x[0] + p[0] * x[1]));
    }
    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        let a = cross(gamma, d);
        (d[0], d[1]) = (-gamma[1] * a, gamma[0] * a);
    }
    fn inner(&self, _: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        u[0] * v[0] + u[1] * v[1]
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        let norm = (x[0] * x[0] + x[1] * x[1]).sqrt();
        (x[0], x[1]) = (x[0] / norm, x[1] / norm);
        (norm - Lane::ONE).abs()
    }
    fn violation(&self, x: &[f64]) -> String {
        format!("its norm is {}, not 1", x[0].hypot(x[1]))
    }
}

fn main() -> Result<(), Error> {
    let times = [0.0, 1.0, 2.5, 3.0];
    let angles = [0.0, 1.5, 3.75, 4.5];
    let points = angles.map(|angle: f64| vec![angle.cos(), angle.sin()]);
    let spline = CubicSpline::new(Custom(Circle), &times, &points)?;
    // The angle grows in proportion to time, beyond half a turn.
    for time in [0.3, 1.7, 2.9] {
        let (point, velocity) = (spline.at(time), spline.velocity(time));
        println!("{time}: {point:.6?}, {velocity:.6?}");
        assert!(
            (point[0] - (1.5 * time).cos()).abs() < 1e-12 && (point[1] - (1.5 * time).sin()).abs() < 1e-12
        );
    }
    assert!(CubicSpline::new(Custom(Circle), &times[..2], &[vec![1.0, 0.0], vec![-1.0, 0.0]]).is_err());
    Ok(())
}
