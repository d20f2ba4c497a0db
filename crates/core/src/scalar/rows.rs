//! Conversion between eight rows of numbers in memory and SIMD lanes.

use super::few::few;
use super::types::{LANES, Lane};
use wide::bytemuck::cast;
use wide::f64x4;

/// Reads one row of numbers from each of eight arrays: `out[c]` receives column c.
#[inline(always)]
pub fn gather(rows: [&[f64]; LANES], out: &mut [Lane]) {
    let len = out.len();
    let rows = rows.map(|row| &row[..len]);
    let mut c = 0;
    // Four columns at a time are transposed in registers.
    while c + 4 <= len {
        let row = |l: usize| f64x4::new([rows[l][c], rows[l][c + 1], rows[l][c + 2], rows[l][c + 3]]);
        let low = f64x4::transpose([row(0), row(1), row(2), row(3)]);
        let high = f64x4::transpose([row(4), row(5), row(6), row(7)]);
        for k in 0..4 {
            out[c + k] = cast([low[k], high[k]]);
        }
        c += 4;
    }
    while c < len {
        out[c] = Lane::new(few(|l| rows[l][c]));
        c += 1;
    }
}

/// Writes lanes as consecutive rows; `out` may contain fewer than eight.
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
            let [[a, b], [d, e], [f, g], [h, i]]: [[f64x4; 2]; 4] =
                [cast(lanes[c]), cast(lanes[c + 1]), cast(lanes[c + 2]), cast(lanes[c + 3])];
            let low = f64x4::transpose([a, d, f, h]);
            let high = f64x4::transpose([b, e, g, i]);
            for l in 0..4 {
                out[l * stride + c..][..4].copy_from_slice(low[l].as_array());
                out[(l + 4) * stride + c..][..4].copy_from_slice(high[l].as_array());
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
