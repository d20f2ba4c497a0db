//! The determinant of a symmetric banded matrix A with a border, and the products bᵀA⁻¹c of several vectors.
//!
//! The matrix is eliminated row by row. Only the pivots within the bandwidth are stored, so that the work stays in the
//! cache of the processor. The vectors are further rows and columns of the border, which are not eliminated: what
//! remains of them is −bᵀA⁻¹c. With numbers that have a derivative, the derivatives are computed, too.

use symspline_core::monitor::checkpoint;
use symspline_core::scalar::{Lane, Scalar, lane};

/// The result of an elimination.
pub struct Eliminated<S> {
    /// ln det of the matrix without the last rows and columns.
    pub log_det: S,
    /// Its smallest pivot.
    pub least: Lane,
    /// What remains of the last rows and columns: the lower triangle, row by row.
    pub rest: Vec<S>,
}

/// Eliminates a matrix whose first `size` rows have `width` entries left of the diagonal. `fill` writes the entries of
/// such a row in front of the diagonal (zero in front of the first column), on it, and in the columns of the border.
/// `corner` holds the rows of the border, the last `kept` of which are not eliminated.
pub fn eliminate<S: Scalar>(
    size: usize,
    width: usize,
    mut corner: Vec<S>,
    kept: usize,
    fill: impl Fn(usize, &mut [S]),
) -> Eliminated<S> {
    let zero = S::constant(Lane::ZERO);
    let border = corner.len().isqrt();
    // Of each pivot 1/D, and the entries of L below it: in the next rows, and in the border.
    let below = width + border;
    let (mut inverses, mut columns) = (vec![zero; width], vec![zero; width * below]);
    let mut row = vec![zero; width + 1 + border];
    let mut pivots =
        Pivots { log_det: zero, product: S::constant(Lane::ONE), count: 0, least: lane(f64::INFINITY) };
    for i in 0..size {
        checkpoint();
        fill(i, &mut row);
        for c in 0..width {
            let at = (i + c) % width;
            let column = &mut columns[at * below..][..below];
            let minus = -row[c];
            column[width - 1 - c] = row[c] * inverses[at];
            let (next, side) = row[c + 1..].split_at_mut(width - c);
            next.iter_mut().zip(&column[..width - c]).for_each(|(x, l)| *x = minus.fma(*l, *x));
            side.iter_mut().zip(&column[width..]).for_each(|(x, l)| *x = minus.fma(*l, *x));
        }
        let (inverse, side) = (pivots.inverse(row[width]), &row[width + 1..]);
        let at = i % width;
        inverses[at] = inverse;
        let column = &mut columns[at * below + width..][..border];
        for (a, x) in side.iter().enumerate() {
            column[a] = *x * inverse;
            let minus = -column[a];
            corner[a * border..][..=a].iter_mut().zip(side).for_each(|(y, x)| *y = minus.fma(*x, *y));
        }
    }
    for k in 0..border - kept {
        let inverse = pivots.inverse(corner[k * border + k]);
        for a in k + 1..border {
            let minus = -(corner[a * border + k] * inverse);
            for b in k + 1..=a {
                corner[a * border + b] = minus.fma(corner[b * border + k], corner[a * border + b]);
            }
        }
    }
    let rows = border - kept..border;
    let rest = rows.clone().flat_map(|a| corner[a * border + rows.start..=a * border + a].to_vec()).collect();
    Eliminated { log_det: pivots.log_det(), least: pivots.least, rest }
}

/// The pivots that have been eliminated.
struct Pivots<S> {
    log_det: S,
    /// The product of the pivots whose logarithm is not yet part of `log_det`, and their number.
    product: S,
    count: usize,
    least: Lane,
}

impl<S: Scalar> Pivots<S> {
    /// Adds a pivot, and returns its inverse.
    fn inverse(&mut self, pivot: S) -> S {
        /// The number of pivots whose logarithm is computed at once.
        const AT_ONCE: usize = 4;
        let value = pivot.value();
        self.least = value.simd_lt(self.least).select(value, self.least);
        self.product = self.product * pivot;
        self.count += 1;
        if self.count == AT_ONCE {
            self.log_det = self.log_det();
            (self.product, self.count) = (S::constant(Lane::ONE), 0);
        }
        let inverse = Lane::ONE / value;
        pivot.compose([inverse, -(inverse * inverse), lane(2.0) * inverse * inverse * inverse])
    }

    fn log_det(&self) -> S {
        let x = self.product.value();
        let inverse = Lane::ONE / x;
        self.log_det + self.product.compose([x.ln(), inverse, -(inverse * inverse)])
    }
}
