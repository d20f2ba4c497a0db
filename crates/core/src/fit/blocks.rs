//! Block tridiagonal systems, open or cyclic: the Jacobian of the C² condition.

use crate::monitor::checkpoint;
use crate::scalar::Lane;

/// Blocks of m × m numbers, row by row: left of, on and right of the diagonal. In a cyclic system the first row's
/// left block belongs to the last node, and the last row's right block to the first.
#[derive(Default)]
pub struct Blocks {
    /// The blocks of all rows.
    pub sides: [Vec<Lane>; 3],
    /// Right-hand sides of the cyclic system: m columns and the given one.
    columns: Vec<Lane>,
}

impl Blocks {
    /// All zero.
    pub fn clear(&mut self, nodes: usize, m: usize) {
        for block in &mut self.sides {
            block.clear();
            block.resize(nodes * m * m, Lane::ZERO);
        }
    }

    /// `A x`; in a closed curve the first and the last node are neighbours.
    pub fn times(&self, nodes: usize, m: usize, closed: bool, x: &[Lane], out: &mut [Lane]) {
        out.fill(Lane::ZERO);
        self.each(nodes, m, closed, |at, i, j| out[i] = at.mul_add(x[j], out[i]));
    }

    /// `Aᵀ x`.
    pub fn transposed_times(&self, nodes: usize, m: usize, closed: bool, x: &[Lane], out: &mut [Lane]) {
        out.fill(Lane::ZERO);
        self.each(nodes, m, closed, |at, i, j| out[j] = at.mul_add(x[i], out[j]));
    }

    /// Passes every number with its row and column to a function.
    fn each(&self, nodes: usize, m: usize, closed: bool, mut f: impl FnMut(Lane, usize, usize)) {
        for (side, block) in self.sides.iter().enumerate() {
            for i in 0..nodes {
                let inside = i + side >= 1 && i + side <= nodes;
                if !(inside || closed) {
                    continue;
                }
                let j = (i + side + nodes - 1) % nodes;
                for (at, number) in block[i * m * m..(i + 1) * m * m].iter().enumerate() {
                    f(*number, i * m + at / m, j * m + at % m);
                }
            }
        }
    }

    /// Solves the block tridiagonal system of the first nodes in place for several right-hand sides, and overwrites
    /// the blocks. `x` has m × `columns` numbers per node.
    pub fn solve(&mut self, nodes: usize, m: usize, columns: usize, x: &mut [Lane]) {
        let [lower, diagonal, upper] = &mut self.sides;
        let (block, size) = (m * m, m * columns);
        let width = m + columns;
        let mut work = vec![Lane::ZERO; m * (m + width)];
        for i in 0..nodes {
            if i > 0 {
                // Row i minus lower · (the row above, solved for its node).
                let (before, here) = x[(i - 1) * size..].split_at_mut(size);
                subtract_product(&lower[i * block..][..block], before, &mut here[..size], m, columns);
                let (above, _) = upper[(i - 1) * block..].split_at(block);
                subtract_product(
                    &lower[i * block..][..block],
                    above,
                    &mut diagonal[i * block..][..block],
                    m,
                    m,
                );
            }
            // [D | U | x], and D⁻¹ times U and x.
            for r in 0..m {
                let row = &mut work[r * (m + width)..][..m + width];
                row[..m].copy_from_slice(&diagonal[i * block + r * m..][..m]);
                row[m..2 * m].copy_from_slice(&upper[i * block + r * m..][..m]);
                row[2 * m..].copy_from_slice(&x[i * size + r * columns..][..columns]);
            }
            eliminate(&mut work, m, m + width);
            for r in 0..m {
                let row = &work[r * (m + width)..][..m + width];
                upper[i * block + r * m..][..m].copy_from_slice(&row[m..2 * m]);
                x[i * size + r * columns..][..columns].copy_from_slice(&row[2 * m..]);
            }
        }
        for i in (0..nodes - 1).rev() {
            let (here, behind) = x[i * size..].split_at_mut(size);
            subtract_product(&upper[i * block..][..block], &behind[..size], here, m, columns);
        }
    }

    /// The same for a closed curve of n nodes: the last node is eliminated at the end.
    pub fn solve_cyclic(&mut self, n: usize, m: usize, x: &mut [Lane]) {
        let (block, columns) = (m * m, m + 1);
        let last = n - 1;
        let [lower, diagonal, upper] = &self.sides;
        let at = |b: &[Lane], i: usize| b[i * block..][..block].to_vec();
        // The coupling of the other nodes to the last one, and of the last one to them.
        let (first_sees, before_sees) = (at(lower, 0), at(upper, last - 1));
        let (sees_before, sees_first, own) = (at(lower, last), at(upper, last), at(diagonal, last));
        let mut sides = std::mem::take(&mut self.columns);
        sides.clear();
        sides.resize(last * m * columns, Lane::ZERO);
        for i in 0..last {
            for r in 0..m {
                let row = &mut sides[(i * m + r) * columns..][..columns];
                row[m] = x[i * m + r];
                for c in 0..m {
                    if i == 0 {
                        row[c] += first_sees[r * m + c];
                    }
                    // With two nodes, the first node is also the one before the last.
                    if i == last - 1 && last > 1 {
                        row[c] += before_sees[r * m + c];
                    }
                }
            }
        }
        self.solve(last, m, columns, &mut sides);
        let mut work = vec![Lane::ZERO; m * columns];
        for r in 0..m {
            work[r * columns..][..m].copy_from_slice(&own[r * m..][..m]);
            work[r * columns + m] = x[last * m + r];
        }
        let rows = m * columns;
        subtract_product(&sees_before, &sides[(last - 1) * rows..][..rows], &mut work, m, columns);
        if last > 1 {
            subtract_product(&sees_first, &sides[..rows], &mut work, m, columns);
        }
        eliminate(&mut work, m, columns);
        for r in 0..m {
            x[last * m + r] = work[r * columns + m];
        }
        for i in 0..last {
            for r in 0..m {
                let row = &sides[(i * m + r) * columns..][..columns];
                x[i * m + r] = (0..m).fold(row[m], |sum, c| sum - row[c] * x[last * m + c]);
            }
        }
        self.columns = sides;
    }
}

/// `c −= a b` for an m × m matrix a and m × `columns` matrices b and c.
fn subtract_product(a: &[Lane], b: &[Lane], c: &mut [Lane], m: usize, columns: usize) {
    for r in 0..m {
        checkpoint();
        for k in 0..m {
            let factor = -a[r * m + k];
            for j in 0..columns {
                c[r * columns + j] = factor.mul_add(b[k * columns + j], c[r * columns + j]);
            }
        }
    }
}

/// Gauss–Jordan elimination of the first m columns of m rows, with row exchanges lane by lane.
pub fn eliminate(a: &mut [Lane], m: usize, width: usize) {
    for k in 0..m {
        checkpoint();
        for i in k + 1..m {
            let larger = a[i * width + k].abs().simd_gt(a[k * width + k].abs());
            if larger.any() {
                for j in k..width {
                    let (x, y) = (a[k * width + j], a[i * width + j]);
                    (a[k * width + j], a[i * width + j]) = (larger.select(y, x), larger.select(x, y));
                }
            }
        }
        let inverse = Lane::ONE / a[k * width + k];
        a[k * width + k..][..width - k].iter_mut().for_each(|x| *x *= inverse);
        for i in (0..m).filter(|&i| i != k) {
            let factor = -a[i * width + k];
            for j in k..width {
                a[i * width + j] = factor.mul_add(a[k * width + j], a[i * width + j]);
            }
        }
    }
}
