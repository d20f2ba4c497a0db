//! Midpoints of geodesics, and their derivatives.

use symspline_core::monitor::Monitor;
use symspline_core::parallel;
use symspline_core::scalar::{Dual, LANES, Lane, Scalar, few, gather, lane, scatter};
use symspline_core::space::{Ambient, Erased};

/// The rows that one thread processes at a time.
const BLOCK: usize = 512;

/// Computes the midpoint of every pair of points p, q, and its derivative for tangent vectors at both: `vectors` and
/// `moved` are empty, or have the shape of the points.
pub fn midpoint(
    space: &Erased,
    points: [&[f64]; 2],
    vectors: [&[f64]; 2],
    monitor: &Monitor,
    out: &mut [f64],
    moved: &mut [f64],
) {
    let len = space.point_len();
    let size = BLOCK * len;
    let with_vectors = !moved.is_empty();
    let mut rest = moved;
    let blocks: Vec<_> = out
        .chunks_mut(size)
        .enumerate()
        .map(|(k, out)| {
            let (own, others) =
                std::mem::take(&mut rest).split_at_mut(if with_vectors { out.len() } else { 0 });
            rest = others;
            (k * size, out, own)
        })
        .collect();
    parallel::for_each(blocks, false, monitor, |(start, out, moved)| {
        let rows = out.len() / len;
        let mut lanes = vec![Lane::ZERO; len];
        let mut duals: [Vec<Dual>; 2] = std::array::from_fn(|_| vec![Dual::constant(Lane::ZERO); len]);
        let mut middle = duals[0].clone();
        for first in (0..rows).step_by(LANES) {
            // Unused lanes repeat the last row.
            let at: [usize; LANES] = few(|l| start + (first + l).min(rows - 1) * len);
            for e in 0..2 {
                gather(at.map(|i| &points[e][i..i + len]), &mut lanes);
                duals[e].iter_mut().zip(&lanes).for_each(|(dual, x)| *dual = Dual { v: *x, d: Lane::ZERO });
                if with_vectors {
                    gather(at.map(|i| &vectors[e][i..i + len]), &mut lanes);
                    duals[e].iter_mut().zip(&lanes).for_each(|(dual, x)| dual.d = *x);
                }
            }
            let [p, q] = &duals;
            space.geodesic(p, q, Dual::constant(lane(0.5)), &mut middle);
            let end = (first + LANES).min(rows);
            let values: Vec<Lane> = middle.iter().map(|x| x.v).collect();
            scatter(&values, &mut out[first * len..end * len]);
            if with_vectors {
                let mut derivatives: Vec<Lane> = middle.iter().map(|x| x.d).collect();
                space.velocity(&values, &mut derivatives);
                scatter(&derivatives, &mut moved[first * len..end * len]);
            }
        }
    });
}
