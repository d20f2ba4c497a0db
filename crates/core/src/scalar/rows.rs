//! Conversion between rows of numbers in memory, one per lane, and SIMD lanes.

use super::few::few;
use super::types::{LANES, Lane};
use wide::bytemuck::cast;
use wide::f64x4;

/// The number of squares of four rows and four columns that are transposed in registers.
const PARTS: usize = LANES / 4;

/// Reads one row of numbers from each of several arrays: `out[c]` receives column c.
#[inline(always)]
pub fn gather(rows: [&[f64]; LANES], out: &mut [Lane]) {
    let len = out.len();
    let rows = rows.map(|row| &row[..len]);
    let mut c = 0;
    // Four columns at a time are transposed in registers.
    while c + 4 <= len {
        let row = |l: usize| f64x4::new([rows[l][c], rows[l][c + 1], rows[l][c + 2], rows[l][c + 3]]);
        let parts: [[f64x4; 4]; PARTS] = few(|part| f64x4::transpose(few(|i| row(4 * part + i))));
        for k in 0..4 {
            let column: [f64x4; PARTS] = few(|part| parts[part][k]);
            out[c + k] = cast(column);
        }
        c += 4;
    }
    while c < len {
        out[c] = Lane::new(few(|l| rows[l][c]));
        c += 1;
    }
}

/// Writes lanes as consecutive rows; `out` may contain fewer rows than there are lanes.
#[inline(always)]
pub fn scatter(lanes: &[Lane], out: &mut [f64]) {
    scatter_apart(lanes, lanes.len(), out);
}

/// The same with a distance of `stride` numbers between the starts of rows.
#[inline(always)]
pub fn scatter_apart(lanes: &[Lane], stride: usize, out: &mut [f64]) {
    let len = lanes.len();
    let mut c = 0;
    if out.len() >= (LANES - 1) * stride + len {
        while c + 4 <= len {
            let columns: [[f64x4; PARTS]; 4] = few(|k| cast(lanes[c + k]));
            for part in 0..PARTS {
                let rows = f64x4::transpose(few(|k| columns[k][part]));
                for l in 0..4 {
                    out[(4 * part + l) * stride + c..][..4].copy_from_slice(rows[l].as_array());
                }
            }
            c += 4;
        }
    }
    while c < len {
        let column = lanes[c].to_array();
        for (row, x) in out.chunks_mut(stride).zip(column) {
            row[c] = x;
        }
        c += 1;
    }
}
