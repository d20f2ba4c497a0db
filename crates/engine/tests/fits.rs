//! Fitted curves are C² splines: on curved spaces, by every solver, with every end.

use symspline_engine::curve::{Curves, Outside, Quantity, Times, evaluate};
use symspline_engine::fit::{End, Ends, Method, Options, Problem, Status, fit};
use symspline_engine::monitor::Monitor;
use symspline_engine::scalar::{Lane, lane};
use symspline_engine::space::{Ambient, Erased, Frame, Origin};
use symspline_engine::spaces::AnySpace;

/// Spaces of positive and of negative curvature, of vectors and of matrices, with one array per point.
const SPACES: &[(&str, &[usize], f64)] = &[
    ("sphere", &[2], 0.9),
    ("so", &[4], 1.2),
    ("spd", &[2], 1.0),
    ("hyperbolic", &[3], 0.8),
    ("siegel", &[2], 1.0),
];
const METHODS: [Method; 5] =
    [Method::Auto, Method::FixedPoint, Method::QuasiNewton, Method::Newton, Method::Homotopy];
const KNOTS: [f64; 7] = [0.0, 0.8, 2.0, 2.5, 3.9, 5.0, 6.3];
const KINDS: [&str; 5] = ["natural", "not-a-knot", "velocity", "acceleration", "periodic"];

/// Pseudo-random numbers, equal in every run.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut x = seed;
    move || {
        x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((x >> 11) as f64) / (1_u64 << 52) as f64 - 1.0
    }
}

fn numbers(x: &[Lane]) -> Vec<f64> {
    x.iter().map(|x| x.to_array()[0]).collect()
}

/// A tangent vector at p of given length.
fn vector(space: &Erased, p: &[Lane], length: f64, next: &mut impl FnMut() -> f64) -> Vec<Lane> {
    let (mut frame, mut v) = (vec![Lane::ZERO; space.frame_len()], vec![Lane::ZERO; p.len()]);
    let x: Vec<f64> = (0..space.dim()).map(|_| next()).collect();
    let size = x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let x: Vec<Lane> = x.iter().map(|x| lane(x / size * length)).collect();
    space.lift(p, &mut frame);
    space.tangent(&frame, p, &x, &mut v);
    v
}

/// Points at a given distance from each other, in random directions.
fn walk(space: &Erased, count: usize, step: f64, next: &mut impl FnMut() -> f64) -> Vec<f64> {
    let mut p: Vec<Lane> = (0..space.point_len()).map(|_| lane(next())).collect();
    space.random_point(&mut p);
    let mut out = numbers(&p);
    for _ in 1..count {
        let v = vector(space, &p, step, next);
        let mut q = p.clone();
        space.ray(&p, &v, Lane::ONE, &mut q);
        p = q;
        out.extend(numbers(&p));
    }
    out
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    // NaN counts as far.
    let largest = |m: f64, d: f64| if d <= m { m } else { d };
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, largest)
}

/// The velocities of some equal curves with given ends.
fn velocities_of(space: &Erased, points: &[f64], copies: usize, ends: Ends) -> Vec<f64> {
    let go_on = |_| true;
    let count = points.len() / space.point_len();
    let t: Vec<f64> = (0..count).map(|i| i as f64).collect();
    let offsets: Vec<usize> = (0..=copies).map(|curve| curve * count).collect();
    let points = points.repeat(copies);
    let mut velocities = vec![0.0; points.len()];
    let problem = Problem { t: &t, shared: true, points: &points, offsets: &offsets, ends };
    let options = Options { method: Method::Auto, tol: 1e-12, max_iter: None, certify: None };
    let reports = fit(space, &problem, &options, &Monitor::new(&go_on), &mut velocities);
    assert!(reports.iter().all(|report| report.status == Status::Converged));
    velocities
}

#[test]
fn a_curve_in_sections_is_that_of_a_batch() {
    let any = AnySpace::new("so", &[3]).unwrap();
    let (space, mut next) = (any.get(), noise(5));
    let natural = Ends::Open([End::Natural, End::Natural]);
    let not_a_knot = Ends::Open([End::NotAKnot, End::NotAKnot]);
    // The limits of what is divided, and a multiple of neither the number of sections nor that of lanes.
    for (count, step) in [129, 130, 255, 513].into_iter().flat_map(|count| [(count, 0.2), (count, 1.3)]) {
        let mut points = walk(&space, count, step, &mut next);
        let size = points.len() / count;
        for ends in [natural, not_a_knot, Ends::Periodic] {
            if matches!(ends, Ends::Periodic) {
                for i in 0..count / 2 {
                    points.copy_within(i * size..(i + 1) * size, (count - 1 - i) * size);
                }
            }
            let alone = velocities_of(&space, &points, 1, ends);
            let batch = velocities_of(&space, &points, 2, ends);
            let largest = batch.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
            let off = distance(&alone, &batch[..alone.len()]);
            // The tolerance of the solvers. Points that are far apart, and short curves, are fitted as in a batch.
            let allowed = if count > 129 && step < 1.0 { 1e-12 * largest } else { 0.0 };
            assert!(off <= allowed, "{count} knots at {step}: {off:.1e}");
            assert!((off > 0.0) == (allowed > 0.0), "{count} knots at {step} are in sections");
        }
    }
}

#[test]
fn fitted_curves_are_c2_splines() {
    let go_on = |_| true;
    let monitor = Monitor::new(&go_on);
    for (name, parameters, step) in SPACES {
        let any = AnySpace::new(name, parameters).unwrap();
        let (space, len) = (any.get(), any.get().point_len());
        for (case, (method, kind)) in
            METHODS.iter().flat_map(|&method| KINDS.map(|kind| (method, kind))).enumerate()
        {
            let mut next = noise(case as u64);
            let mut points = walk(&space, KNOTS.len(), *step, &mut next);
            if kind == "periodic" {
                // The points return, so that the curve is closed.
                for (i, j) in [(4, 2), (5, 1), (6, 0)] {
                    points.copy_within(j * len..(j + 1) * len, i * len);
                }
            }
            let at = |i: usize| points[i * len..][..len].iter().map(|&x| lane(x)).collect::<Vec<Lane>>();
            let given = [0, KNOTS.len() - 1].map(|i| numbers(&vector(&space, &at(i), 0.4, &mut next)));
            let end = |e: usize| match kind {
                "velocity" => End::Velocity(&given[e]),
                "acceleration" => End::Acceleration(&given[e]),
                "not-a-knot" => End::NotAKnot,
                _ => End::Natural,
            };
            let ends = if kind == "periodic" { Ends::Periodic } else { Ends::Open([end(0), end(1)]) };
            let offsets = [0, KNOTS.len()];
            let problem = Problem { t: &KNOTS, shared: true, points: &points, offsets: &offsets, ends };
            let mut velocities = vec![0.0; points.len()];
            let options = Options { method, tol: 1e-13, max_iter: Some(1000), certify: None };
            let report = &fit(&space, &problem, &options, &monitor, &mut velocities)[0];
            let what = format!("{name} {parameters:?}, {method:?}, {kind}");
            assert_eq!(report.status, Status::Converged, "{what}");

            let curves = Curves {
                t: &KNOTS,
                nodes: KNOTS.len(),
                points: &points,
                velocities: &velocities,
                before: &[],
            };
            let values = |quantity: Quantity, x: &[f64]| {
                let mut out = vec![0.0; x.len() * len];
                let times = Times { x, count: x.len() };
                evaluate(&space, &curves, &times, quantity, Outside::Continue, &monitor, &mut out);
                out
            };
            // Both sides of every inner knot, so close to it that the change of the curve is below rounding.
            let inside = &KNOTS[1..KNOTS.len() - 1];
            let beside = |h: f64| inside.iter().map(|t| t + h).collect::<Vec<f64>>();
            let size = values(Quantity::Acceleration, &KNOTS).iter().fold(1.0_f64, |m, x| m.max(x.abs()));
            for (quantity, allowed) in
                [(Quantity::Point, 1e-12), (Quantity::Velocity, 1e-11), (Quantity::Acceleration, 1e-9)]
            {
                let [left, right] = [-1e-13, 1e-13].map(|h| values(quantity, &beside(h)));
                let jump = distance(&left, &right);
                assert!(jump <= allowed * size, "{what}: {quantity:?} jumps by {jump:.1e}");
            }
            let met = distance(&values(Quantity::Point, &KNOTS), &points);
            assert!(met <= 1e-12 * size, "{what}: misses its points by {met:.1e}");

            let ends_of = |quantity: Quantity| {
                let both = values(quantity, &[KNOTS[0], KNOTS[KNOTS.len() - 1]]);
                [both[..len].to_vec(), both[len..].to_vec()]
            };
            let (v, a) = (ends_of(Quantity::Velocity), ends_of(Quantity::Acceleration));
            let zero = vec![0.0; len];
            let off = match kind {
                "natural" => distance(&a[0], &zero).max(distance(&a[1], &zero)),
                "velocity" => distance(&v[0], &given[0]).max(distance(&v[1], &given[1])),
                "acceleration" => distance(&a[0], &given[0]).max(distance(&a[1], &given[1])),
                "periodic" => distance(&v[0], &v[1]).max(distance(&a[0], &a[1])),
                _ => 0.0,
            };
            assert!(off <= 1e-10 * size, "{what}: the end is off by {off:.1e}");
        }
    }
}
