//! The flat torus as unit vectors, which the library has as angles: the example of `docs/adding-a-space.md`, which quotes
//! everything between the two markers below.

// ---- the page begins ----
use std::f64::consts::PI;
use symspline_engine::scalar::{Lane, Scalar, dot, lane, max_or_nan};
use symspline_engine::space::Model;
use symspline_engine::special::Trig;

/// Tⁿ = S¹ × … × S¹: n unit vectors of R².
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Circles {
    n: usize,
}

impl Circles {
    /// The torus of n circles.
    pub fn new(n: usize) -> Result<Self, String> {
        if n == 0 { Err("Circles(n) needs n >= 1".into()) } else { Ok(Circles { n }) }
    }
}

/// The j-th vector of R².
#[inline(always)]
fn pair<S: Scalar>(x: &[S], j: usize) -> [S; 2] {
    [x[2 * j], x[2 * j + 1]]
}

/// p × q: the sine of the angle from p to q, and the coordinate of a tangent vector q at p.
#[inline(always)]
fn cross<S: Scalar>(p: [S; 2], q: [S; 2]) -> S {
    p[0] * q[1] - p[1] * q[0]
}

/// The tangent vector at p with coordinate x.
#[inline(always)]
fn along<S: Scalar>(p: [S; 2], x: S) -> [S; 2] {
    [-(x * p[1]), x * p[0]]
}

/// p turned by an angle.
#[inline(always)]
fn turned<S: Scalar>(p: [S; 2], angle: S) -> [S; 2] {
    let Trig { c: cos, s, .. } = Trig::new(angle * angle);
    let sin = s * angle;
    [cos * p[0] - sin * p[1], cos * p[1] + sin * p[0]]
}

/// The angle from p to q, from −π to π.
#[inline(always)]
fn angle_between<S: Scalar>(p: [S; 2], q: [S; 2]) -> S {
    // p × q = p × (q − p), which keeps its digits for near points.
    let (sin, cos) = (cross(p, [q[0] - p[0], q[1] - p[1]]), dot(&p, &q));
    // θ' = cos θ (sin θ)' − sin θ (cos θ)', and one derivative more likewise.
    let [_, d, dd] = (sin * cos.value() - cos * sin.value()).parts();
    S::from_parts([sin.value().atan2(cos.value()), d, dd])
}

impl Model for Circles {
    fn point_shape(&self) -> Vec<usize> {
        vec![self.n, 2]
    }
    fn dim(&self) -> usize {
        self.n
    }
    fn cut_angle(&self) -> f64 {
        PI
    }
    fn curvature(&self) -> f64 {
        0.0
    }

    fn exp<S: Scalar>(&self, p: &[S], v: &[S], q: &mut [S]) {
        for (j, q) in q.chunks_exact_mut(2).enumerate() {
            q.copy_from_slice(&turned(pair(p, j), cross(pair(p, j), pair(v, j))));
        }
    }
    fn log<S: Scalar>(&self, p: &[S], q: &[S], v: &mut [S]) -> Lane {
        for (j, v) in v.chunks_exact_mut(2).enumerate() {
            v.copy_from_slice(&along(pair(p, j), angle_between(pair(p, j), pair(q, j))));
        }
        let values: Vec<Lane> = v.iter().map(|v| v.value()).collect();
        self.angle(&[], &values)
    }
    fn transvect<S: Scalar>(&self, p: &[S], v: &[S], x: &mut [S]) {
        for (j, x) in x.chunks_exact_mut(2).enumerate() {
            let j = j % self.n;
            x.copy_from_slice(&turned([x[0], x[1]], cross(pair(p, j), pair(v, j))));
        }
    }

    fn velocity(&self, gamma: &[Lane], d: &mut [Lane]) {
        for (j, d) in d.chunks_exact_mut(2).enumerate() {
            let p = pair(gamma, j);
            d.copy_from_slice(&along(p, cross(p, [d[0], d[1]])));
        }
    }
    fn inner(&self, _p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane {
        dot(u, v)
    }
    fn angle(&self, _p: &[Lane], v: &[Lane]) -> Lane {
        v.chunks_exact(2).fold(Lane::ZERO, |most, v| max_or_nan(most, dot(v, v).sqrt()))
    }
    fn project(&self, x: &mut [Lane]) -> Lane {
        let mut off = Lane::ZERO;
        for x in x.chunks_exact_mut(2) {
            let norm = dot(x, x).sqrt();
            let this = (norm - Lane::ONE).abs();
            // What is a unit vector up to rounding stays as it is, bit for bit.
            let scale = this.simd_le(lane(2.0 * f64::EPSILON)).select(Lane::ONE, Lane::ONE / norm);
            x.iter_mut().for_each(|x| *x *= scale);
            off = max_or_nan(off, this);
        }
        off
    }
    fn violation(&self, x: &[f64]) -> String {
        let norms: Vec<f64> = x.chunks_exact(2).map(|x| x[0].hypot(x[1])).collect();
        format!("its rows have the norms {norms:?}, not 1")
    }

    fn origin(&self, o: &mut [Lane]) {
        o.chunks_exact_mut(2).for_each(|o| o[0] = Lane::ONE);
    }
    fn vector<S: Scalar>(&self, x: &[S], v: &mut [S]) {
        v.chunks_exact_mut(2).zip(x).for_each(|(v, x)| v[1] = *x);
    }
    fn coordinates<S: Scalar>(&self, v: &[S], x: &mut [S]) {
        x.iter_mut().zip(v.chunks_exact(2)).for_each(|(x, v)| *x = v[1]);
    }
    fn section(&self, p: &[Lane], x: &mut [Lane]) {
        for (j, x) in x.chunks_exact_mut(2).enumerate() {
            x.copy_from_slice(&along(pair(p, j % self.n), x[1]));
        }
    }
    fn triple<S: Scalar>(&self, _a: &[S], _b: &[S], _c: &[S], out: &mut [S]) {
        out.fill(S::constant(Lane::ZERO));
    }
}
// ---- the page ends ----

use symspline_engine::curve::{Curves, Outside, Quantity, Times, evaluate};
use symspline_engine::fit::{End, Ends, Method, Options, Problem, Status, fit};
use symspline_engine::laws::check;
use symspline_engine::monitor::Monitor;
use symspline_engine::rows::{Operation, RowFault, apply, project_points};
use symspline_engine::space::Erased;
use symspline_engine::spaces::Euclidean;

#[test]
fn it_obeys_every_law() {
    for n in 1..=3 {
        let torus = Circles::new(n).unwrap();
        assert_eq!(check(&Erased(&torus), 0), [""; 0], "n = {n}");
    }
}

const ON: fn(usize) -> bool = |_| true;
const QUANTITIES: [Quantity; 3] = [Quantity::Point, Quantity::Velocity, Quantity::Acceleration];
const KNOTS: [f64; 9] = [0.0, 1.0, 1.7, 3.0, 3.4, 4.4, 5.4, 6.0, 7.1];
/// Two angles a knot. They go round more than once, and neighbours are up to 2.6 apart.
const ANGLES: [[f64; 2]; 9] = [
    [3.0, -1.0],
    [4.2, -3.1],
    [5.5, -4.0],
    [8.1, -4.4],
    [8.8, -4.2],
    [9.6, -3.0],
    [8.9, -0.8],
    [7.9, 0.3],
    [6.3, 0.9],
];

/// The point of the torus with some angles.
fn point(angles: &[f64]) -> Vec<f64> {
    angles.iter().flat_map(|a| [a.cos(), a.sin()]).collect()
}

/// The tangent vector there with some coordinates.
fn vector(angles: &[f64], x: &[f64]) -> Vec<f64> {
    angles.iter().zip(x).flat_map(|(a, x)| [-x * a.sin(), x * a.cos()]).collect()
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    assert!(a.iter().chain(b).all(|x| x.is_finite()));
    a.iter().zip(b).fold(0.0, |most, (a, b)| (a - b).abs().max(most))
}

fn run(operation: Operation, inputs: &[&[f64]], t: &[f64], len: usize) -> Result<Vec<f64>, RowFault> {
    let mut out = vec![0.0; len];
    apply(&Erased(&Circles::new(2).unwrap()), operation, inputs, t, &Monitor::new(&ON), &mut out)
        .map(|()| out)
}

/// The velocities of the spline through points.
fn spline(space: &Erased, points: &[f64], ends: [End; 2]) -> Result<Vec<f64>, Status> {
    let options = Options { method: Method::Auto, tol: 1e-13, max_iter: None, certify: None };
    let problem =
        Problem { t: &KNOTS, shared: true, points, offsets: &[0, KNOTS.len()], ends: Ends::Open(ends) };
    let mut velocities = vec![0.0; points.len()];
    match fit(space, &problem, &options, &Monitor::new(&ON), &mut velocities)[0].status {
        Status::Converged => Ok(velocities),
        status => Err(status),
    }
}

fn values(space: &Erased, curves: &Curves, times: &Times, quantity: Quantity) -> Vec<f64> {
    let mut out = vec![0.0; curves.points.len() / curves.nodes * times.count];
    evaluate(space, curves, times, quantity, Outside::Continue, &Monitor::new(&ON), &mut out);
    out
}

#[test]
fn parameters_are_checked() {
    assert!(Circles::new(0).is_err());
    let (_, off, why) =
        project_points(&Erased(&Circles::new(2).unwrap()), &mut [1.0, 0.0, 0.0, 2.0], 1e-8).unwrap_err();
    assert_eq!((off, why.as_str()), (1.0, "its rows have the norms [1.0, 2.0], not 1"));
}

#[test]
fn exp_and_log_are_inverse_and_wrap() {
    let (x, y) = ([3.0, 0.1], [-3.0, -2.4]);
    let (p, q) = (point(&x), point(&y));
    // The short way, across π in the first angle.
    let v = vector(&x, &[2.0 * PI - 6.0, -2.5]);
    assert!(difference(&run(Operation::Log, &[&p, &q], &[], 4).unwrap(), &v) < 1e-15);
    assert!(difference(&run(Operation::Exp, &[&p, &v], &[], 4).unwrap(), &q) < 1e-15);
    let middle = point(&[PI, -1.15]);
    assert!(difference(&run(Operation::Geodesic, &[&p, &q], &[0.5], 4).unwrap(), &middle) < 1e-15);
    let distance = run(Operation::Distance, &[&p, &q], &[], 1).unwrap();
    assert!((distance[0] - (2.0 * PI - 6.0).hypot(2.5)).abs() < 1e-15);
    // A short vector keeps its digits, at whatever angle.
    let short = vector(&x, &[3e-9, -1e-12]);
    let moved = run(Operation::Exp, &[&p, &short], &[], 4).unwrap();
    assert!(difference(&run(Operation::Log, &[&p, &moved], &[], 4).unwrap(), &short) < 3e-16);
}

#[test]
fn the_cut_locus_is_at_pi_in_any_coordinate() {
    let (p, near, far) = (point(&[0.3, 1.0]), point(&[0.3, 1.0 - 3.1]), point(&[0.2, 1.0 + PI]));
    assert!(run(Operation::Log, &[&p, &near], &[], 4).is_ok());
    let (row, angle) = run(Operation::Log, &[&p, &far], &[], 4).unwrap_err();
    assert_eq!(row, 0);
    assert!((angle - PI).abs() < 1e-15);
    let mut points = ANGLES.concat();
    (points[6], points[7]) = (8.1, -4.0 + PI);
    let fault = spline(&Erased(&Circles::new(2).unwrap()), &point(&points), [End::Natural; 2]).unwrap_err();
    assert!(matches!(fault, Status::CutLocus { index: 2, .. }), "{fault:?}");
}

#[test]
fn the_spline_is_the_flat_one_of_the_angles() {
    let (torus, flat) = (Circles::new(2).unwrap(), Euclidean::new(2).unwrap());
    let (torus, flat) = (Erased(&torus), Erased(&flat));
    let angles = ANGLES.concat();
    let points = point(&angles);
    let x: Vec<f64> = (0..=200).map(|i| i as f64 * 7.1 / 200.0).collect();
    let (nodes, times) = (KNOTS.len(), Times { x: &x, count: x.len() });
    for end in [End::Natural, End::NotAKnot] {
        let u = spline(&torus, &points, [end; 2]).unwrap();
        let rates = spline(&flat, &angles, [end; 2]).unwrap();
        assert!(difference(&u, &vector(&angles, &rates)) < 1e-13);
        let curves = Curves { t: &KNOTS, nodes, points: &points, velocities: &u, before: &[] };
        let lines = Curves { t: &KNOTS, nodes, points: &angles, velocities: &rates, before: &[] };
        let theta = values(&flat, &lines, &times, Quantity::Point);
        for (quantity, allowed) in QUANTITIES.into_iter().zip([1e-14, 1e-13, 1e-12]) {
            let expected = match quantity {
                Quantity::Point => point(&theta),
                _ => vector(&theta, &values(&flat, &lines, &times, quantity)),
            };
            let off = difference(&values(&torus, &curves, &times, quantity), &expected);
            assert!(off < allowed, "{quantity:?} is {off:e} off");
        }
    }
}

#[test]
fn the_spline_is_c2_at_the_knots() {
    let torus = Circles::new(2).unwrap();
    let torus = Erased(&torus);
    let points = point(&ANGLES.concat());
    // A start so fast the wrong way that the first inner handle takes the other way round.
    let away = vector(&ANGLES[0], &[-8.5, 8.5]);
    for ends in [[End::NotAKnot; 2], [End::Velocity(&away), End::Natural]] {
        let u = spline(&torus, &points, ends).unwrap();
        // Every segment as a curve of its own, at both its ends.
        let twice = |x: &[f64], len: usize| -> Vec<f64> {
            x.windows(2 * len).step_by(len).flatten().copied().collect()
        };
        let (t, p, v) = (twice(&KNOTS, 1), twice(&points, 4), twice(&u, 4));
        let curves = Curves { t: &t, nodes: 2, points: &p, velocities: &v, before: &[] };
        for (quantity, allowed) in QUANTITIES.into_iter().zip([1e-15, 1e-13, 1e-11]) {
            let sides = values(&torus, &curves, &Times { x: &t, count: 2 }, quantity);
            // The end of a segment, the start of the next, …
            for (knot, sides) in sides[4..sides.len() - 4].chunks_exact(8).enumerate() {
                let jump = difference(&sides[..4], &sides[4..]);
                assert!(jump <= allowed, "{quantity:?} jumps by {jump:e} at knot {}", knot + 1);
            }
        }
    }
}
