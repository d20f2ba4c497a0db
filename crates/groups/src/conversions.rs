//! Conversion of many rotations between matrices, unit quaternions and rotation vectors, one per SIMD lane.

use crate::rigid::{Quaternion, multiply, of_matrix, to_matrix};
use crate::rotations::{exp, log};
use std::sync::atomic::{AtomicBool, Ordering};
use symspline_core::monitor::{Monitor, checkpoint};
use symspline_core::parallel;
use symspline_core::scalar::{Each, LANES, Lane, dot, few, gather, lane, scatter};

/// Maximum number of rotations that one thread converts at a time.
const BLOCK: usize = 1024;
/// Number of rotations from which several threads are certainly faster.
const PARALLEL: usize = 1 << 15;
/// Numbers of a matrix, the longest form.
const MOST: usize = 9;

/// A form of rotations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Matrices, row by row.
    Matrix,
    /// Unit quaternions w, x, y, z; results have w ≥ 0.
    ScalarFirst,
    /// Unit quaternions x, y, z, w; results have w ≥ 0.
    ScalarLast,
    /// Axis times angle; results have angles from 0 to π.
    Vector,
}

impl Form {
    /// The form with a name.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "matrix" => Some(Form::Matrix),
            "scalar first" => Some(Form::ScalarFirst),
            "scalar last" => Some(Form::ScalarLast),
            "vector" => Some(Form::Vector),
            _ => None,
        }
    }

    /// The number of numbers of a rotation.
    pub fn count(self) -> usize {
        match self {
            Form::Matrix => 9,
            Form::ScalarFirst | Form::ScalarLast => 4,
            Form::Vector => 3,
        }
    }

    /// Unit quaternions, and how far off the numbers are: the largest entry of |RᵀR − 1|, infinite for reflections; the
    /// deviation of the norm of a quaternion from 1; for vectors that of the squared norm of the result, because sine
    /// and cosine of huge angles are inaccurate. It is infinite or NaN if a number is not finite.
    #[inline(always)]
    fn read(self, x: &[Lane; MOST]) -> (Quaternion<Lane>, Lane) {
        match self {
            Form::Matrix => {
                let column = |j: usize| [x[j], x[3 + j], x[6 + j]];
                let mut off = Lane::ZERO;
                for i in 0..3 {
                    for j in 0..=i {
                        let one = if i == j { Lane::ONE } else { Lane::ZERO };
                        let excess = (dot(&column(i), &column(j)) - one).abs();
                        off = excess.simd_gt(off).select(excess, off);
                    }
                }
                let (a, b) = (column(0), column(1));
                let normal: [Lane; 3] =
                    few(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]);
                // False for NaN in any entry, too.
                let proper = dot(&normal, &column(2)).simd_gt(Lane::ZERO);
                let minus_identity: [Lane; 9] = few(|i| if i % 4 == 0 { x[i] - Lane::ONE } else { x[i] });
                (of_matrix(minus_identity), proper.select(off, lane(f64::INFINITY)))
            }
            Form::ScalarFirst | Form::ScalarLast => {
                let q = if self == Form::ScalarFirst { few(|i| x[i]) } else { few(|i| x[(i + 3) % 4]) };
                let norm = dot(&q, &q).sqrt();
                (q.each(|c| c / norm), (norm - Lane::ONE).abs())
            }
            Form::Vector => {
                let q = exp(few(|i| x[i]));
                (q, (dot(&q, &q) - Lane::ONE).abs())
            }
        }
    }

    /// Writes unit quaternions in this form.
    #[inline(always)]
    fn write(self, q: Quaternion<Lane>, out: &mut [Lane; MOST]) {
        match self {
            Form::Matrix => *out = to_matrix(q),
            Form::ScalarFirst | Form::ScalarLast => {
                let negative = q[0].simd_lt(Lane::ZERO);
                let first = usize::from(self == Form::ScalarLast);
                for i in 0..4 {
                    let c = q[(i + first) % 4];
                    out[i] = negative.select(-c, c);
                }
            }
            Form::Vector => out[..3].copy_from_slice(&log(q).0),
        }
    }
}

/// Converts rotations from one form to another, and returns whether all are finite and within `tol` of rotations.
/// Results for those that are not have no meaning.
pub fn convert(from: Form, to: Form, tol: f64, input: &[f64], monitor: &Monitor, out: &mut [f64]) -> bool {
    let (len, size) = (from.count(), to.count());
    let long = out.len() > PARALLEL * size;
    let valid = AtomicBool::new(true);
    let blocks: Vec<_> = input.chunks(BLOCK * len).zip(out.chunks_mut(BLOCK * size)).collect();
    parallel::for_each(blocks, long, monitor, |(input, out)| {
        let (mut x, mut result) = ([Lane::ZERO; MOST], [Lane::ZERO; MOST]);
        let last = input.len() / len - 1;
        let mut within = true;
        for (group, out) in out.chunks_mut(LANES * size).enumerate() {
            let rows = few(|l| (group * LANES + l).min(last) * len);
            gather(rows.map(|start| &input[start..start + len]), &mut x[..len]);
            let (q, off) = from.read(&x);
            within &= off.simd_le(lane(tol)).all();
            to.write(q, &mut result);
            scatter(&result[..size], out);
        }
        if !within {
            valid.store(false, Ordering::Relaxed);
        }
    });
    valid.into_inner()
}

/// Replaces unit quaternions q₀, q₁, q₂, …, scalar first, by the products q₀, q₀q₁, q₀q₁q₂, …
pub fn accumulate(quaternions: &mut [[f64; 4]]) {
    let mut product = [Lane::ONE, Lane::ZERO, Lane::ZERO, Lane::ZERO];
    for own in quaternions {
        checkpoint();
        product = multiply(product, own.map(lane));
        // Otherwise rounding errors would accumulate in the length.
        let inverse = Lane::ONE / dot(&product, &product).sqrt();
        product = product.each(|x| x * inverse);
        *own = product.map(|x| x.as_array()[0]);
    }
}
