//! Products of larger matrices in blocks that fit the cache.

use super::base::{Matrix, Storage};
use super::entry::{Entry, mul_add};
use crate::monitor::checkpoint;
use crate::scalar::{Lane, Scalar, few};

/// From this size on, one matrix at a time is faster than Jacobi's method on SIMD lanes, and products benefit
/// from blocks.
pub(super) const LARGE: usize = 11;
/// Bytes of the first cache that a block of columns may fill.
const BLOCK: usize = 24 << 10;

/// `A B` by blocks of columns that are copied to contiguous memory.
pub(super) fn times<S: Scalar, const D: usize, A: Storage>(
    a: &Matrix<S, D, A>,
    b: &Matrix<S, D, A>,
) -> Matrix<S, D, A> {
    // The number of sums that fit into registers.
    if size_of::<Entry<S, D>>() <= size_of::<Lane>() {
        times_in::<S, D, A, 3, 2>(a, b)
    } else {
        times_in::<S, D, A, 2, 1>(a, b)
    }
}

fn times_in<S: Scalar, const D: usize, A: Storage, const R: usize, const C: usize>(
    a: &Matrix<S, D, A>,
    b: &Matrix<S, D, A>,
) -> Matrix<S, D, A> {
    let (rows, inner, cols) = (a.rows(), a.cols(), b.cols());
    let zero = [S::constant(Lane::ZERO); D];
    let mut out = Matrix::zeros(rows, cols);
    let panels = cols.div_ceil(C);
    let at_once = (BLOCK / (inner * C * size_of::<Entry<S, D>>())).clamp(1, panels);
    // One panel is C columns, row by row.
    let mut block = vec![[zero; C]; at_once * inner];
    for first in (0..panels).step_by(at_once) {
        checkpoint();
        let here = at_once.min(panels - first);
        for p in 0..here {
            for k in 0..inner {
                for c in 0..C {
                    let j = (first + p) * C + c;
                    block[p * inner + k][c] = if j < cols { b[(k, j)] } else { zero };
                }
            }
        }
        let mut i = 0;
        while i < rows {
            let tall = i + R <= rows;
            for p in 0..here {
                let (panel, j) = (&block[p * inner..][..inner], (first + p) * C);
                if tall {
                    tile::<S, D, A, R, C>(a, panel, &mut out, (i, j));
                } else {
                    tile::<S, D, A, 1, C>(a, panel, &mut out, (i, j));
                }
            }
            i += if tall { R } else { 1 };
        }
    }
    out
}

/// R × C entries of a product, from (i, j) on.
#[inline]
fn tile<S: Scalar, const D: usize, A: Storage, const R: usize, const C: usize>(
    a: &Matrix<S, D, A>,
    panel: &[[Entry<S, D>; C]],
    out: &mut Matrix<S, D, A>,
    (i, j): (usize, usize),
) {
    let rows: [&[Entry<S, D>]; R] = few(|r| &a.data[(i + r) * panel.len()..][..panel.len()]);
    let mut sum = [[[S::constant(Lane::ZERO); D]; C]; R];
    for (k, b) in panel.iter().enumerate() {
        for r in 0..R {
            for c in 0..C {
                sum[r][c] = mul_add::<S, D, false>(rows[r][k], b[c], sum[r][c]);
            }
        }
    }
    let cols = out.cols();
    for r in 0..R {
        for c in 0..C.min(cols - j) {
            out[(i + r, j + c)] = sum[r][c];
        }
    }
}
