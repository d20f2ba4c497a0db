//! B-spline curves by de Boor's algorithm with geodesics in place of straight lines.
//!
//! A Bézier curve of degree d is the B-spline on the knots 0, …, 0, 1, …, 1 (d + 1 of each), for which de
//! Boor's algorithm is de Casteljau's.

use super::data::Quantity;
use crate::monitor::Monitor;
use crate::parallel;
use crate::scalar::{Dual, Jet, LANES, Lane, Scalar, few, gather, max_or_nan, scatter};
use crate::space::{Ambient, Erased};

/// A B-spline curve: `knots.len() = control points + degree + 1`, as in SciPy.
pub struct BSpline<'a> {
    /// Non-decreasing knots, possibly repeated.
    pub knots: &'a [f64],
    /// Control points, one after another, curve after curve.
    pub control: &'a [f64],
    /// The degree.
    pub degree: usize,
}

/// Maximum number of samples that one thread evaluates at a time.
const BLOCK: usize = 512;
/// Samples times numbers from which several threads are certainly faster.
const PARALLEL: usize = 1 << 14;

impl BSpline<'_> {
    /// Control points of one curve.
    pub fn count(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// The knot interval that contains a time; the last one at the end of the domain.
    fn interval(&self, x: f64) -> usize {
        let last = self.count() - 1;
        let k = self.knots.partition_point(|&t| t <= x).saturating_sub(1).clamp(self.degree, last);
        // Skip empty intervals at the end.
        (self.degree..=k).rev().find(|&k| self.knots[k] < self.knots[k + 1]).unwrap_or(k)
    }
}

/// Evaluates every curve at all times x: points or vectors, curve by curve and time by time.
pub fn evaluate_bspline(
    space: &Erased,
    curve: &BSpline,
    x: &[f64],
    quantity: Quantity,
    monitor: &Monitor,
    out: &mut [f64],
) {
    let size = if quantity.is_length() { 1 } else { space.point_len() };
    let parallel = out.len() / size * space.point_len() * curve.degree.max(1) > PARALLEL;
    let length = parallel::block(BLOCK, space.point_len());
    let blocks: Vec<(usize, &mut [f64])> = out.chunks_mut(length * size).enumerate().collect();
    parallel::for_each(blocks, parallel, monitor, |(block, out)| {
        for (group, out) in out.chunks_mut(LANES * size).enumerate() {
            let first = block * length + group * LANES;
            let samples = out.len() / size;
            let at = few(|l| first + l.min(samples - 1));
            match quantity.order() {
                0 => eight::<Lane>(space, curve, x, at, quantity, out),
                1 => eight::<Dual>(space, curve, x, at, quantity, out),
                _ => eight::<Jet>(space, curve, x, at, quantity, out),
            }
        }
        monitor.advance(out.len() / size);
    });
}

/// Eight samples in any intervals of any curves.
fn eight<S: Scalar>(
    space: &Erased,
    curve: &BSpline,
    x: &[f64],
    at: [usize; LANES],
    quantity: Quantity,
    out: &mut [f64],
) {
    let (len, degree, t) = (space.point_len(), curve.degree, curve.knots);
    let times = at.map(|i| x[i % x.len()]);
    let interval = times.map(|x| curve.interval(x));
    let point = |l: usize, i: usize| {
        let row = at[l] / x.len() * curve.count() + i;
        &curve.control[row * len..(row + 1) * len]
    };
    let mut row = vec![Lane::ZERO; len];
    let mut points: Vec<Vec<S>> = (0..=degree)
        .map(|j| {
            gather(few(|l| point(l, interval[l] - degree + j)), &mut row);
            row.iter().map(|&x| S::constant(x)).collect()
        })
        .collect();
    let mut next = vec![S::constant(Lane::ZERO); len];
    for r in 1..=degree {
        for j in (r..=degree).rev() {
            let from = Lane::new(few(|l| t[interval[l] + j - degree]));
            let to = Lane::new(few(|l| t[interval[l] + j + 1 - r]));
            let rate = Lane::ONE / (to - from);
            let alpha = S::from_parts([(Lane::new(times) - from) / (to - from), rate, Lane::ZERO]);
            space.geodesic(&points[j - 1], &points[j], alpha, &mut next);
            points[j].copy_from_slice(&next);
        }
    }
    let mut parts = [(); 3].map(|_| vec![Lane::ZERO; len]);
    for (i, x) in points[degree].iter().enumerate() {
        [parts[0][i], parts[1][i], parts[2][i]] = x.parts();
    }
    let [p, d, dd] = &mut parts;
    let vector = match quantity.order() {
        0 => return scatter(p, out),
        1 => {
            space.velocity(p, d);
            d
        }
        _ => {
            space.acceleration(p, d, dd);
            dd
        }
    };
    if quantity.is_length() {
        scatter(&[max_or_nan(space.inner(p, vector, vector), Lane::ZERO).sqrt()], out);
    } else {
        scatter(vector, out);
    }
}
