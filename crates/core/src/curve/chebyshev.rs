//! Smooth functions on [0, 1] as Chebyshev series, which are interpolated at more and more nodes until they are resolved
//! (Trefethen, *Approximation Theory and Approximation Practice*, 2013, chapters 2 to 4).

use crate::scalar::{LANES, Lane, few, lane};
use std::f64::consts::PI;
use std::sync::LazyLock;

/// The number of [`LEVELS`].
const COUNT: usize = 3;
/// The degree of the first level, and the number of coefficients of highest degree that are compared with each other.
const FIRST: usize = 8;
/// The degree of the last level.
pub const MOST: usize = FIRST << (COUNT - 1);
/// The number of coefficients of highest degree that are compared with rounding errors.
const HIGHEST: usize = 3;
const _: () = assert!(FIRST.is_multiple_of(LANES) && HIGHEST <= LANES);
/// Rounding errors of [`HIGHEST`] coefficients are hardly ever all smaller than this part of those of [`FIRST`].
const FLAT: f64 = 0.05;

/// The interpolation by polynomials of degree N at N + 1 nodes.
pub struct Level {
    /// N.
    degree: usize,
    /// By node, the weights of its value in the coefficients of degrees 1 to N.
    weights: Vec<Vec<Lane>>,
}

/// Interpolations of increasing degree; each has the nodes of those before it.
pub static LEVELS: LazyLock<[Level; COUNT]> =
    LazyLock::new(|| [0, 1, 2].map(|level| Level::new(FIRST << level)));

/// 1/2 for the first and the last of the numbers up to `degree`.
fn halved(i: usize, degree: usize) -> f64 {
    if i == 0 || i == degree { 0.5 } else { 1.0 }
}

impl Level {
    fn new(degree: usize) -> Self {
        let weight = |k: usize, n: usize| {
            let cosine = (PI * (n * k % (2 * degree)) as f64 / degree as f64).cos();
            2.0 / degree as f64 * halved(k, degree) * halved(n, degree) * cosine
        };
        let lanes = |k: usize| (1..=degree).step_by(LANES).map(move |n| Lane::new(few(|l| weight(k, n + l))));
        Level { degree, weights: (0..=degree).map(|k| lanes(k).collect()).collect() }
    }

    /// Whether no level follows.
    pub fn is_last(&self) -> bool {
        self.degree == MOST
    }

    /// The distance of its nodes among those of the last level.
    fn stride(&self) -> usize {
        MOST / self.degree
    }

    /// The nodes that the level before does not have, by their numbers in the last level.
    pub fn new_nodes(&self) -> impl Iterator<Item = usize> {
        let (stride, all) = (self.stride(), self.degree == FIRST);
        (0..=self.degree).filter(move |k| all || k % 2 == 1).map(move |k| k * stride)
    }

    /// Its values among those at the nodes of the last level.
    pub fn values(&self, values: &[f64]) -> impl Iterator<Item = f64> {
        values.iter().step_by(self.stride()).copied()
    }

    /// The coefficients of degrees 1 to N of every column of values at the nodes of the last level, column by column.
    pub fn coefficients(&self, values: &[f64], columns: usize) -> Vec<Lane> {
        let lanes = self.degree / LANES;
        let mut coefficients = vec![Lane::ZERO; columns * lanes];
        for (weights, values) in self.weights.iter().zip(values.chunks(columns * self.stride())) {
            for (column, value) in coefficients.chunks_mut(lanes).zip(values) {
                column.iter_mut().zip(weights).for_each(|(c, weight)| *c = weight.mul_add(lane(*value), *c));
            }
        }
        coefficients
    }

    /// The coefficient of degree 0 of one column of values.
    pub fn constant(&self, values: &[f64]) -> f64 {
        let terms = self.values(values).enumerate().map(|(k, value)| halved(k, self.degree) * value);
        terms.sum::<f64>() / self.degree as f64
    }
}

/// A node of the last level, in [0, 1].
pub fn node(k: usize) -> f64 {
    0.5 + 0.5 * (PI * k as f64 / MOST as f64).cos()
}

/// The largest coefficient of a column, and the largest of those of highest degree, which is about the error.
pub fn sizes(column: &[Lane]) -> [f64; 2] {
    let most = |x: &[f64]| x.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
    let all = column.iter().fold(Lane::ZERO, |most, c| most.max(c.abs()));
    [most(&all.to_array()), most(&column[column.len() - 1].to_array()[LANES - HIGHEST..])]
}

/// Whether the coefficients of the highest degrees do not decrease, as those of rounding errors.
pub fn is_flat(column: &[Lane]) -> bool {
    let first = FIRST / LANES;
    let [most, highest] = sizes(&column[column.len() - first..]);
    column.len() > first && highest > FLAT * most
}

/// The derivatives of columns at a position: Σ 2n cₙ Uₙ₋₁.
pub fn differentiate(coefficients: &[Lane], position: f64, out: &mut [f64]) {
    let lanes = coefficients.len() / out.len();
    let y = 2.0 * position - 1.0;
    let mut first = [1.0; LANES];
    for n in 1..LANES {
        first[n] = 2.0 * y * first[n - 1] - if n > 1 { first[n - 2] } else { 0.0 };
    }
    // Uₙ₊ₖ = 2 Tₖ Uₙ − Uₙ₋ₖ for the number k of lanes, a power of two, with U₋₁ = 0 and U₋ₙ = −Uₙ₋₂.
    let turn = lane(2.0 * (0..LANES.ilog2()).fold(y, |t, _| 2.0 * t * t - 1.0));
    let mut before = Lane::new(few(|l| if l + 1 < LANES { -first[LANES - 2 - l] } else { 0.0 }));
    let mut u = Lane::new(first);
    let mut weights = [Lane::ZERO; MOST / LANES];
    for (block, weights) in weights[..lanes].iter_mut().enumerate() {
        *weights = u * Lane::new(few(|l| 2.0 * (block * LANES + l + 1) as f64));
        (before, u) = (u, turn.mul_sub(u, before));
    }
    for (sum, column) in out.iter_mut().zip(coefficients.chunks(lanes)) {
        let terms = column.iter().zip(&weights);
        *sum = terms.fold(Lane::ZERO, |sum, (c, weight)| c.mul_add(*weight, sum)).reduce_add();
    }
}
