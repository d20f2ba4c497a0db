//! The linear system for the changes of velocities: block tridiagonal, of one curve in sections or of a curve per lane.

use super::operators::{Matrix, Vector};
use super::polygon::Runs;
use crate::fit::Blocks;
use crate::scalar::{LANES, Lane, few, gather};
use std::collections::BTreeMap;

/// A row of blocks is solved if its residual is at most this part of the sum of its terms. Elimination leaves 1e-15, unless
/// a block on the diagonal is nearly singular although the system is not.
const SOLVED: f64 = 1e-12;
/// Below this ratio of numbers on the diagonal of a triangular factor, the solution would be rounding errors: the data do
/// not determine the curve near them.
const SINGULAR: f64 = 1e-12;
/// A solution that exceeds the right-hand side by this factor may be one of them.
const GROWN: f64 = 1e8;

/// The blocks of the system. A row contains those of the left neighbour, the node itself and the right neighbour first.
pub struct Jacobian<'a> {
    pub runs: Runs,
    pub m: usize,
    /// By node.
    pub rows: &'a [f64],
    /// At the ends of open curves, with a curve per lane.
    pub ends: [Option<Vec<Lane>>; 2],
}

impl Jacobian<'_> {
    /// The sides of a node on which blocks are, and the nodes there.
    fn neighbours(&self, i: usize) -> impl Iterator<Item = (usize, usize)> {
        let (nodes, closed) = (self.runs.nodes_each(), self.runs.closed);
        (0..3).filter_map(move |side| {
            let j = (i + nodes + side - 1) % nodes;
            (closed || j + 1 == i + side).then_some((side, j))
        })
    }

    /// The three blocks of a node of a curve.
    fn row(&self, curve: usize, i: usize, out: &mut [f64]) {
        let nodes = self.runs.nodes_each();
        let which = usize::from(i > 0);
        if let (true, Some(end)) = (i == 0 || i == self.runs.segments_each(), &self.ends[which]) {
            out.iter_mut().zip(end).for_each(|(out, x)| *out = x.as_array()[curve]);
            return;
        }
        let size = self.rows.len() / self.runs.nodes();
        out.copy_from_slice(&self.rows[(curve * nodes + i) * size..][..out.len()]);
    }

    /// The same of the transpose.
    fn column(&self, curve: usize, i: usize, work: &mut [f64], out: &mut [f64]) {
        let m = self.m;
        out.fill(0.0);
        // In the row of the neighbour the block is on the other side.
        for (side, row) in self.neighbours(i) {
            let out = &mut out[side * m * m..][..m * m];
            self.row(curve, row, work);
            let block = &work[(2 - side) * m * m..][..m * m];
            for (r, row) in block.chunks_exact(m).enumerate() {
                row.iter().enumerate().for_each(|(c, x)| out[c * m + r] = *x);
            }
        }
    }

    fn read(&self, curve: usize, i: usize, transposed: bool, work: &mut [f64], out: &mut [f64]) {
        if transposed { self.column(curve, i, work, out) } else { self.row(curve, i, out) }
    }
}

/// J⁻¹ x, or J⁻ᵀ x, node after node. NaN for curves with a singular system.
pub fn solve(jacobian: &Jacobian, x: &[f64], transposed: bool) -> Vec<f64> {
    let mut out = if jacobian.runs.curves() > 1 {
        solve_together(jacobian, x, transposed)
    } else {
        solve_in_sections(jacobian, x, transposed)
    };
    let size = jacobian.runs.nodes_each() * jacobian.m;
    for (curve, (x, out)) in x.chunks_exact(size).zip(out.chunks_exact_mut(size)).enumerate() {
        if !is_solution(jacobian, curve, x, transposed, out) {
            out.copy_from_slice(&solve_by_rotations(jacobian, curve, x, transposed));
        }
    }
    out
}

/// Whether y solves the system of a curve, up to rounding errors of each row of blocks (Oettli and Prager 1964), and is not
/// suspiciously large.
fn is_solution(jacobian: &Jacobian, curve: usize, x: &[f64], transposed: bool, y: &[f64]) -> bool {
    let (m, nodes) = (jacobian.m, jacobian.runs.nodes_each());
    let (mut work, mut row) = (vec![0.0; 3 * m * m], vec![0.0; 3 * m * m]);
    let most = |x: &[f64]| x.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    if most(y) > GROWN * most(x) {
        return false;
    }
    (0..nodes).all(|i| {
        jacobian.read(curve, i, transposed, &mut work, &mut row);
        let (mut largest, mut residual) = (f64::MIN_POSITIVE, 0.0_f64);
        for r in 0..m {
            let (mut sum, mut size) = (x[i * m + r], x[i * m + r].abs());
            for (side, j) in jacobian.neighbours(i) {
                for (block, y) in row[(side * m + r) * m..][..m].iter().zip(&y[j * m..][..m]) {
                    sum -= block * y;
                    size += (block * y).abs();
                }
            }
            (largest, residual) = (largest.max(size), residual.max(sum.abs()));
            if sum.is_nan() {
                return false;
            }
        }
        residual <= SOLVED * largest
    })
}

/// Solves the system of a curve by orthogonal transformations of two or three rows of blocks at a time. Other than
/// elimination of blocks, this needs no assumption on the blocks of the diagonal.
fn solve_by_rotations(jacobian: &Jacobian, curve: usize, x: &[f64], transposed: bool) -> Vec<f64> {
    let (m, nodes) = (jacobian.m, jacobian.runs.nodes_each());
    let (mut work, mut row) = (vec![0.0; 3 * m * m], vec![0.0; 3 * m * m]);
    // The blocks by their columns, with x behind them.
    let mut rows: Vec<BTreeMap<usize, Matrix>> = Vec::with_capacity(nodes);
    for i in 0..nodes {
        jacobian.read(curve, i, transposed, &mut work, &mut row);
        let mut blocks = BTreeMap::from([(nodes, Matrix::from_column_slice(m, 1, &x[i * m..][..m]))]);
        for (side, j) in jacobian.neighbours(i) {
            let block = Matrix::from_row_slice(m, m, &row[side * m * m..][..m * m]);
            *blocks.entry(j).or_insert_with(|| Matrix::zeros(m, m)) += block;
        }
        rows.push(blocks);
    }
    if rows.iter().flat_map(BTreeMap::values).flatten().any(|number| !number.is_finite()) {
        return vec![f64::NAN; nodes * m];
    }
    for i in 0..nodes {
        let mut involved = vec![i];
        let below = [i + 1, nodes - 1].into_iter().filter(|&k| k > i && k < nodes);
        involved.extend(below.filter(|&k| rows[k].contains_key(&i)));
        involved.dedup();
        let height = involved.len() * m;
        let mut columns: Vec<usize> = involved.iter().flat_map(|&k| rows[k].keys().copied()).collect();
        columns.sort_unstable();
        columns.dedup();
        let width = |j: usize| if j == nodes { 1 } else { m };
        let mut stacks: Vec<Matrix> = columns.iter().map(|&j| Matrix::zeros(height, width(j))).collect();
        for (at, &k) in involved.iter().enumerate() {
            for (stack, j) in stacks.iter_mut().zip(&columns) {
                if let Some(block) = rows[k].remove(j) {
                    stack.rows_mut(at * m, m).copy_from(&block);
                }
            }
        }
        let factor = stacks.remove(0).qr();
        rows[i].insert(i, factor.r());
        for (mut stack, &j) in stacks.into_iter().zip(&columns[1..]) {
            factor.q_tr_mul(&mut stack);
            for (at, &k) in involved.iter().enumerate() {
                rows[k].insert(j, stack.rows(at * m, m).into_owned());
            }
        }
    }
    let diagonal = |i: usize| rows[i][&i].diagonal().map(f64::abs);
    let largest = (0..nodes).map(|i| diagonal(i).max()).fold(0.0, f64::max);
    let smallest = (0..nodes).map(|i| diagonal(i).min()).fold(f64::INFINITY, f64::min);
    if smallest <= SINGULAR * largest {
        return vec![f64::NAN; nodes * m];
    }
    let mut out = Vector::zeros(nodes * m);
    for i in (0..nodes).rev() {
        let mut right = rows[i][&nodes].column(0).into_owned();
        for (&j, block) in rows[i].range(i + 1..nodes) {
            right -= block * out.rows(j * m, m);
        }
        let solved = rows[i][&i].solve_upper_triangular(&right);
        out.rows_mut(i * m, m).copy_from(&solved.unwrap_or_else(|| Vector::repeat(m, f64::NAN)));
    }
    out.as_slice().to_vec()
}

/// With a curve per lane.
fn solve_together(jacobian: &Jacobian, x: &[f64], transposed: bool) -> Vec<f64> {
    let (runs, m) = (jacobian.runs, jacobian.m);
    let (nodes, square, curves) = (runs.nodes_each(), m * m, runs.curve_of_lanes());
    let mut blocks = Blocks::default();
    blocks.clear(nodes, m);
    let mut rows: [Vec<f64>; LANES] = std::array::from_fn(|_| vec![0.0; 3 * square]);
    let (mut work, mut row) = (vec![0.0; 3 * square], vec![Lane::ZERO; 3 * square]);
    for i in 0..nodes {
        for (rows, curve) in rows.iter_mut().zip(curves) {
            jacobian.read(curve, i, transposed, &mut work, rows);
        }
        gather(few(|l| &rows[l][..]), &mut row);
        for (side, block) in row.chunks_exact(square).enumerate() {
            // With two nodes, the one before a node is the one behind it.
            let side = if runs.closed && nodes == 2 && side == 2 { 0 } else { side };
            let sum = &mut blocks.sides[side][i * square..][..square];
            sum.iter_mut().zip(block).for_each(|(sum, x)| *sum += *x);
        }
    }
    let mut lanes = vec![Lane::ZERO; nodes * m];
    gather(curves.map(|curve| &x[curve * nodes * m..][..nodes * m]), &mut lanes);
    if runs.closed {
        blocks.solve_cyclic(nodes, m, &mut lanes);
    } else {
        blocks.solve(nodes, m, 1, &mut lanes);
    }
    (0..runs.curves()).flat_map(|l| lanes.iter().map(move |x| x.as_array()[l])).collect()
}

/// With a section of one curve per lane: the first nodes of the runs separate the others, which are eliminated.
fn solve_in_sections(jacobian: &Jacobian, x: &[f64], transposed: bool) -> Vec<f64> {
    let (runs, m) = (jacobian.runs, jacobian.m);
    let (nodes, square, count) = (runs.nodes_each(), m * m, runs.count);
    let start = |run: usize| runs.first(run);
    let inner = |run: usize| start(run) + 1..if run + 1 < count { start(run + 1) } else { nodes };
    let longest = (0..count).map(|run| inner(run).len()).max().unwrap_or(0);
    // The columns of x, and of the separators at both ends of a section.
    let columns = 2 * m + 1;
    let mut blocks = Blocks::default();
    blocks.clear(longest, m);
    let mut inside = vec![Lane::ZERO; longest * m * columns];
    let (mut work, mut row) = (vec![0.0; 3 * square], vec![0.0; 3 * square]);
    let set = |to: &mut [Lane], l: usize, k: usize, x: f64| {
        let mut numbers = to[k].to_array();
        numbers[l] += x;
        to[k] = Lane::new(numbers);
    };
    for run in 0..LANES {
        for k in 0..longest {
            let Some(i) = (if run < count { inner(run).nth(k) } else { None }) else {
                (0..m).for_each(|r| set(&mut blocks.sides[1], run, k * square + r * m + r, 1.0));
                continue;
            };
            jacobian.read(0, i, transposed, &mut work, &mut row);
            for r in 0..m {
                set(&mut inside, run, (k * m + r) * columns, x[i * m + r]);
                for c in 0..m {
                    let [before, here, behind] = few(|side| row[side * square + r * m + c]);
                    let at = k * square + r * m + c;
                    set(&mut blocks.sides[1], run, at, here);
                    let column = (k * m + r) * columns + 1 + c;
                    if k == 0 {
                        set(&mut inside, run, column, before);
                    } else {
                        set(&mut blocks.sides[0], run, at, before);
                    }
                    if i + 1 == inner(run).end {
                        set(&mut inside, run, column + m, behind);
                    } else {
                        set(&mut blocks.sides[2], run, at, behind);
                    }
                }
            }
        }
    }
    if longest > 0 {
        blocks.solve(longest, m, columns, &mut inside);
    }
    // x of the k-th inner node of a run, less its changes with the separators.
    let solved = |run: usize, k: usize, r: usize, column: usize| {
        inside[(k * m + r) * columns + column].as_array()[run]
    };
    let mut system = Matrix::zeros(count * m, count * m);
    let mut right = Matrix::zeros(count * m, 1);
    for run in 0..count {
        jacobian.read(0, start(run), transposed, &mut work, &mut row);
        let before = (run + count - 1) % count;
        let behind = (run + 1) % count;
        for r in 0..m {
            right[(run * m + r, 0)] += x[start(run) * m + r];
            for c in 0..m {
                let [left, here, next] = few(|side| row[side * square + r * m + c]);
                system[(run * m + r, run * m + c)] += here;
                // The neighbours are inner nodes, or separators themselves.
                for (factor, of, is_left) in [(left, before, true), (next, run, false)] {
                    if inner(of).is_empty() {
                        let other = if is_left { before } else { behind };
                        system[(run * m + r, other * m + c)] += factor;
                        continue;
                    }
                    let k = if is_left { inner(of).len() - 1 } else { 0 };
                    right[(run * m + r, 0)] -= factor * solved(of, k, c, 0);
                    for column in 0..m {
                        let end = (of + 1) % count;
                        system[(run * m + r, of * m + column)] -= factor * solved(of, k, c, 1 + column);
                        system[(run * m + r, end * m + column)] -= factor * solved(of, k, c, 1 + m + column);
                    }
                }
            }
        }
    }
    let separators = system.lu().solve(&right).unwrap_or_else(|| right.map(|_| f64::NAN));
    let mut out = vec![0.0; nodes * m];
    for run in 0..count {
        let end = (run + 1) % count;
        out[start(run) * m..][..m].copy_from_slice(&separators.as_slice()[run * m..][..m]);
        for (k, i) in inner(run).enumerate() {
            for r in 0..m {
                let coupled = (0..m).map(|c| {
                    solved(run, k, r, 1 + c) * separators[run * m + c]
                        + solved(run, k, r, 1 + m + c) * separators[end * m + c]
                });
                out[i * m + r] = solved(run, k, r, 0) - coupled.sum::<f64>();
            }
        }
    }
    out
}
