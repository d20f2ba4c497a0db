//! Whether rounding errors spoil a curve whose velocities are accurate.
//!
//! On spaces that grow exponentially, velocities that are accurate to the last digit may define an inaccurate curve:
//! the geodesics of a segment amplify rounding errors at its start by the exponential of its length.

use super::problem::{End, Ends, Problem, Report};
use crate::curve::Segment;
use crate::scalar::{Dual, LANES, Lane, Scalar, few, gather, lane, max_or_nan};
use crate::space::{Ambient, Erased};

/// The largest error that is accepted as rounding, unless the tolerance of the fit is larger. Errors inside segments are
/// up to ten times as large as those at their ends, which are measured.
pub const MOST: f64 = 1e-7;
/// Errors up to this size are not reported.
const SMALLEST: f64 = 1e-8;
/// Up to this condition of the chords, steps of five to seven, curves need no check.
const SMALL: f64 = 1e3;

/// Makes two points that are far apart, without prescribed velocity or acceleration, the ends of a geodesic. Its
/// velocities follow from the points more accurately than from the C² condition. Returns whether the curve is one.
pub fn make_geodesic(
    space: &Erased,
    problem: &Problem,
    curve: usize,
    report: &Report,
    velocities: &mut [f64],
) -> bool {
    let free = |ends: &[End; 2]| ends.iter().all(|end| matches!(end, End::Natural | End::NotAKnot));
    let open = matches!(&problem.ends, Ends::Open(ends) if free(ends));
    if problem.segments(curve) != 1 || !open || report.condition <= SMALL || report.status.is_fault() {
        return false;
    }
    let (len, t, first) = (space.point_len(), problem.knots(curve), problem.offsets[curve]);
    let [p, q] = [0, 1].map(|i| {
        let row = &problem.points[(first + i) * len..(first + i + 1) * len];
        row.iter().map(|&x| lane(x)).collect::<Vec<_>>()
    });
    let mut log = vec![Lane::ZERO; len];
    let both = velocities.chunks_exact_mut(len).zip([(&p, &q, 1.0), (&q, &p, -1.0)]);
    for (velocity, (from, to, sign)) in both {
        space.log(from, to, &mut log);
        let over = sign / (t[1] - t[0]);
        velocity.iter_mut().zip(&log).for_each(|(u, x)| *u = x.as_array()[0] * over);
    }
    true
}

/// The error of a curve at the ends of its segments, relative to the largest speed at a knot or between neighbours,
/// if it is worth reporting; `condition` is that of the chords.
pub fn missed(
    space: &Erased,
    problem: &Problem,
    curve: usize,
    velocities: &[f64],
    condition: f64,
    tol: f64,
) -> Option<f64> {
    if condition <= SMALL {
        return None;
    }
    let (len, count, t) = (space.point_len(), problem.segments(curve), problem.knots(curve));
    let first = problem.offsets[curve];
    let rows = |all: &[f64], at: [usize; LANES], out: &mut [Lane]| {
        gather(at.map(|i| &all[i * len..(i + 1) * len]), out);
    };
    let mut segment = Segment::<Dual>::new(len);
    let mut gamma = vec![Dual::constant(Lane::ZERO); len];
    let [mut p, mut u, mut v, mut apart] = [(); 4].map(|_| vec![Lane::ZERO; len]);
    let (mut far, mut off, mut speed) = (Lane::ZERO, Lane::ZERO, Lane::ZERO);
    for group in 0..count.div_ceil(LANES) {
        let at: [usize; LANES] = few(|l| (group * LANES + l).min(count - 1));
        let h = Lane::new(at.map(|i| t[i + 1] - t[i]));
        for e in 0..2 {
            rows(problem.points, at.map(|i| first + i + e), &mut segment.ends[e]);
            rows(velocities, at.map(|i| i + e), &mut segment.handles[e]);
            segment.handles[e].iter_mut().for_each(|x| *x *= h / 3.0);
        }
        segment.prepare(space, len);
        segment.at(space, len, Dual::from_parts([Lane::ONE, Lane::ONE, Lane::ZERO]), &mut gamma);
        for (i, x) in gamma.iter().enumerate() {
            let [value, rate, _] = x.parts();
            (p[i], v[i]) = (value, rate / h);
        }
        space.velocity(&p, &mut v);
        space.log(&p, &segment.ends[1], &mut apart);
        far = max_or_nan(far, space.inner(&p, &apart, &apart).abs().sqrt() / h);
        // The vector at the array that represents the next point.
        let still = vec![Lane::ZERO; len];
        space.parallel_transport(&p, &segment.ends[1], &still, &v, &mut apart);
        rows(velocities, at.map(|i| i + 1), &mut u);
        apart.iter_mut().zip(&u).for_each(|(v, u)| *v -= *u);
        let length = |v: &[Lane]| space.inner(&segment.ends[1], v, v).abs().sqrt();
        off = max_or_nan(off, length(&apart));
        // A curve that turns back may have zero speed at every knot.
        space.log(&segment.ends[1], &segment.ends[0], &mut apart);
        speed = max_or_nan(speed, length(&u).max(length(&apart) / h));
    }
    let most = |x: Lane| {
        x.to_array().into_iter().fold(0.0, |most: f64, x| if x > most || x.is_nan() { x } else { most })
    };
    let missed = most(max_or_nan(far, off)) / most(speed);
    (!(missed <= SMALLEST.max(tol))).then_some(missed)
}

/// The largest growth of rounding errors at the points of a curve.
pub fn of_points(space: &Erased, problem: &Problem, curve: usize) -> f64 {
    let len = space.point_len();
    let points = &problem.points[problem.offsets[curve] * len..problem.offsets[curve + 1] * len];
    let count = points.len() / len;
    let (mut p, mut most) = (vec![Lane::ZERO; len], Lane::ZERO);
    for first in (0..count).step_by(LANES) {
        gather(
            few::<usize, LANES>(|l| (first + l).min(count - 1)).map(|i| &points[i * len..][..len]),
            &mut p,
        );
        most = max_or_nan(most, space.rounding(&p));
    }
    most.to_array().into_iter().fold(0.0, f64::max)
}
