//! Tridiagonal equations in plain numbers, for solvers that are not compiled.

use crate::monitor::checkpoint;

/// Solves diagonally dominant equations by elimination without pivoting: `rows` gives, row by row, the entries before,
/// on and behind the diagonal, and every row of `x` has the same number of right-hand sides, which become the solutions.
pub fn solve(rows: &[[f64; 3]], x: &mut [f64]) {
    if rows.is_empty() {
        return;
    }
    let width = x.len() / rows.len();
    let mut pivots = vec![rows[0][1]];
    for i in 1..rows.len() {
        checkpoint();
        let ratio = rows[i][0] / pivots[i - 1];
        pivots.push(rows[i][1] - ratio * rows[i - 1][2]);
        let (before, own) = x[(i - 1) * width..].split_at_mut(width);
        own.iter_mut().zip(before).for_each(|(x, before)| *x -= ratio * *before);
    }
    for i in (0..rows.len()).rev() {
        checkpoint();
        let (own, behind) = x[i * width..].split_at_mut(width);
        // The last row has nothing behind it.
        let behind = behind.iter().copied().chain(std::iter::repeat(0.0));
        own.iter_mut().zip(behind).for_each(|(x, behind)| *x = (*x - rows[i][2] * behind) / pivots[i]);
    }
}
