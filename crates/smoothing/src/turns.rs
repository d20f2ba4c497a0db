//! Fast rotations: the path that turns by the most frequent step between consecutive data.

use crate::frames::lanes_of;
use symspline_core::monitor::checkpoint;
use symspline_core::scalar::{LANES, Lane, gather, lane, scatter};
use symspline_core::space::{Ambient, Erased};

/// The numbers of steps among which one is the most frequent, and the number of data up to which all of them are tried.
const WINDOWS: [usize; 3] = [11, 21, 41];
const LONG: usize = 20_000;

/// A path of rotations.
pub struct Turn {
    /// Its matrices, from the identity on.
    pub path: Vec<f64>,
    /// Whether it turns in the fixed frame: the data are the path times slow rotations, not slow rotations times the path.
    pub fixed: bool,
}

/// The path that turns by the most frequent step nearby, for n × n rotation matrices.
///
/// The frame (moving or fixed) and the length of the windows are those for which the remaining steps are shortest.
pub fn usual_turn(space: &Erased, points: &[f64], n: usize) -> Turn {
    let size = n * n;
    let count = points.len() / size;
    let one: Vec<f64> = (0..size).map(|i| f64::from(i % (n + 1) == 0)).collect();
    let mut best = (f64::INFINITY, Turn { path: points.to_vec(), fixed: false });
    for fixed in [false, true] {
        // Steps in the fixed frame are those of the inverse in the moving frame.
        let own = if fixed { transposed(points, n) } else { points.to_vec() };
        let back = transposed(&own, n);
        let steps: Vec<f64> = (0..count - 1).flat_map(|i| product(&back, i, &own, i + 1, n)).collect();
        let vectors = of_pairs(space, |_| &one, |i| &steps[i * size..][..size], count - 1).0;
        for window in if count <= LONG { &WINDOWS[..] } else { &WINDOWS[1..2] } {
            let modes = modes(&vectors, size, (*window).min(count - 1));
            let each = rays(space, &one, &modes);
            let mut path = one.clone();
            for i in 0..count - 1 {
                let next = product(&path, i, &each, i, n);
                path.extend(next);
            }
            let inverse = transposed(&path, n);
            let rest: Vec<f64> = (0..count).flat_map(|i| product(&own, i, &inverse, i, n)).collect();
            let row = |i: usize| &rest[i * size..][..size];
            let length = quartile(of_pairs(space, row, |i| row(i + 1), count - 1).1);
            if length < best.0 {
                best = (length, Turn { path: if fixed { inverse } else { path }, fixed });
            }
        }
    }
    best.1
}

fn transposed(matrices: &[f64], n: usize) -> Vec<f64> {
    let entry = |at: usize| matrices[at - at % (n * n) + at % n * n + at / n % n];
    (0..matrices.len()).map(entry).collect()
}

/// The product of the i-th and the j-th of some matrices.
fn product(left: &[f64], i: usize, right: &[f64], j: usize, n: usize) -> Vec<f64> {
    let (a, b) = (&left[i * n * n..][..n * n], &right[j * n * n..][..n * n]);
    (0..n * n).map(|at| (0..n).map(|k| a[at / n * n + k] * b[k * n + at % n]).sum()).collect()
}

/// Logarithms, one after another, and distances of pairs of points.
fn of_pairs<'a>(
    space: &Erased,
    p: impl Fn(usize) -> &'a [f64],
    q: impl Fn(usize) -> &'a [f64],
    count: usize,
) -> (Vec<f64>, Vec<f64>) {
    let len = space.point_len();
    let [mut a, mut b, mut v] = [(); 3].map(|_| vec![Lane::ZERO; len]);
    let (mut vectors, mut distances) = (vec![0.0; count * len], Vec::with_capacity(count));
    for (group, out) in vectors.chunks_mut(LANES * len).enumerate() {
        checkpoint();
        let at = lanes_of(group, count);
        gather(at.map(&p), &mut a);
        gather(at.map(&q), &mut b);
        let angle = space.log(&a, &b, &mut v);
        distances.extend(space.distance(&a, &b, &v, angle).to_array());
        scatter(&v, out);
    }
    distances.truncate(count);
    (vectors, distances)
}

/// The points that geodesics from a point reach at time one.
fn rays(space: &Erased, p: &[f64], vectors: &[f64]) -> Vec<f64> {
    let len = space.point_len();
    let count = vectors.len() / len;
    let start: Vec<Lane> = p.iter().map(|x| lane(*x)).collect();
    let [mut v, mut q] = [(); 2].map(|_| vec![Lane::ZERO; len]);
    let mut points = vec![0.0; vectors.len()];
    for (group, out) in points.chunks_mut(LANES * len).enumerate() {
        gather(lanes_of(group, count).map(|i| &vectors[i * len..][..len]), &mut v);
        space.ray(&start, &v, Lane::ONE, &mut q);
        scatter(&q, out);
    }
    points
}

/// The mean of the vectors near the mode of each window of vectors.
fn modes(vectors: &[f64], size: usize, window: usize) -> Vec<f64> {
    let count = vectors.len() / size;
    let rank = (window / 4).max(2).min(window - 1);
    let row = |i: usize| &vectors[i * size..][..size];
    let mut out = Vec::with_capacity(vectors.len());
    let mut apart = vec![0.0; window * window];
    let mut sorted = vec![0.0; window];
    for i in 0..count {
        checkpoint();
        // The first and the last vector are repeated beyond the ends.
        let rows: Vec<&[f64]> =
            (0..window).map(|k| row((i + k).saturating_sub(window / 2).min(count - 1))).collect();
        for a in 0..window {
            for b in 0..a {
                let square: f64 = rows[a].iter().zip(rows[b]).map(|(x, y)| (x - y).powi(2)).sum();
                apart[a * window + b] = square.sqrt();
                apart[b * window + a] = square.sqrt();
            }
        }
        let mut centre = (f64::INFINITY, 0);
        for a in 0..window {
            sorted.copy_from_slice(&apart[a * window..][..window]);
            let radius = *sorted.select_nth_unstable_by(rank, f64::total_cmp).1;
            if radius < centre.0 {
                centre = (radius, a);
            }
        }
        let (radius, centre) = centre;
        let near: Vec<&&[f64]> = (0..window)
            .filter(|b| apart[centre * window + b] <= 2.0 * radius + 1e-12)
            .map(|b| &rows[b])
            .collect();
        out.extend((0..size).map(|c| near.iter().map(|row| row[c]).sum::<f64>() / near.len() as f64));
    }
    out
}

/// The first quartile of the finite numbers.
fn quartile(values: Vec<f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().filter(|x| !x.is_nan()).collect();
    if values.is_empty() {
        return f64::NAN;
    }
    values.sort_by(f64::total_cmp);
    let at = 0.25 * (values.len() - 1) as f64;
    let (low, share) = (at as usize, at.fract());
    let high = (low + 1).min(values.len() - 1);
    values[low] + share * (values[high] - values[low])
}
