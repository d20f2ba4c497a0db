//! Newton's method: the Jacobian of the C² condition by dual numbers, block by block.
//!
//! The defect at a node depends on the velocities there and at its two neighbours, so that the Jacobian
//! is block tridiagonal, cyclic for closed curves. One sweep with dual numbers differentiates by one
//! coordinate at every third node at once.

use super::chain::Chain;
use super::condition::{ChainEnds, NodeVectors, residual_of};
use crate::scalar::{Dual, Lane, Scalar};
use crate::space::Space;

/// The Jacobian and memory to solve with it.
#[derive(Default)]
pub struct Newton {
    /// Blocks of m × m numbers, row by row: those left of, on and right of the diagonal.
    blocks: [Vec<Lane>; 3],
    vectors: NodeVectors<Dual>,
    u: Vec<Dual>,
    r: Vec<Dual>,
    /// Right sides of the cyclic system: m columns and the defect.
    sides: Vec<Lane>,
}

/// `step ← −J⁻¹ r` for the defect in `chain.r`.
pub fn update<M: Space>(
    space: &M,
    chain: &mut Chain,
    ends: &ChainEnds,
    newton: &mut Newton,
    step: &mut [Lane],
) {
    newton.differentiate(space, chain, ends);
    step.copy_from_slice(&chain.r);
    let (n, m) = (chain.n, chain.m);
    match ends {
        ChainEnds::Open(_) => newton.solve(n + 1, m, 1, step),
        ChainEnds::Periodic if n > 1 => {
            newton.solve_cyclic(n, m, step);
            let (first, last) = step.split_at_mut(n * m);
            last.copy_from_slice(&first[..m]);
            chain.across_seam(space, true, last);
        }
        // One segment from a point to itself: the curve stands still.
        ChainEnds::Periodic => step.fill(Lane::ZERO),
    }
    step.iter_mut().for_each(|x| *x = -*x);
}

impl Newton {
    /// Fills the blocks with the derivatives of the defect.
    fn differentiate<M: Space>(&mut self, space: &M, chain: &mut Chain, ends: &ChainEnds) {
        let (n, m) = (chain.n, chain.m);
        let closed = matches!(ends, ChainEnds::Periodic);
        let nodes = if closed { n } else { n + 1 };
        for block in &mut self.blocks {
            block.clear();
            block.resize(nodes * m * m, Lane::ZERO);
        }
        let zero = Dual::constant(Lane::ZERO);
        self.r.resize(chain.r.len(), zero);
        // No node has two neighbours (itself included) of one colour; those before the seam are special.
        let color = |i: usize| if closed && i + 2 >= n { 3 + (n - 1 - i) } else { i % 3 };
        for c in 0..if closed { 5 } else { 3 } {
            if !(0..nodes).any(|i| color(i) == c) {
                continue;
            }
            for k in 0..m {
                self.u.clear();
                self.u.extend(chain.u.iter().map(|&u| Dual::constant(u)));
                for i in (0..nodes).filter(|&i| color(i) == c) {
                    self.u[i * m + k].d = Lane::ONE;
                }
                if closed {
                    let (first, last) = self.u.split_at_mut(n * m);
                    let mut seed: Vec<Lane> = first[..m].iter().map(|u| u.d).collect();
                    chain.across_seam(space, true, &mut seed);
                    last.iter_mut().zip(seed).for_each(|(u, d)| u.d = d);
                }
                residual_of(space, chain, ends, &self.u, &mut self.r, &mut self.vectors);
                for i in 0..nodes {
                    // A row sees the coloured one of its three nodes; of two equal ones (a closed curve of
                    // three points) the sum goes to either.
                    for (side, block) in self.blocks.iter_mut().enumerate() {
                        let j = match side {
                            0 if i > 0 => i - 1,
                            0 if closed => n - 1,
                            1 => i,
                            2 if i + 1 < nodes => i + 1,
                            2 if closed => 0,
                            _ => continue,
                        };
                        let again = closed && n == 2 && side == 2;
                        if color(j) == c && !again {
                            for row in 0..m {
                                block[(i * m + row) * m + k] = self.r[i * m + row].d;
                            }
                        }
                    }
                }
            }
        }
    }

    /// Solves the block tridiagonal system of the first nodes in place, for several right sides:
    /// `x` holds m × `columns` numbers a node.
    fn solve(&mut self, nodes: usize, m: usize, columns: usize, x: &mut [Lane]) {
        let [lower, diagonal, upper] = &mut self.blocks;
        let (block, size) = (m * m, m * columns);
        let width = m + columns;
        let mut work = vec![Lane::ZERO; m * (m + width)];
        for i in 0..nodes {
            if i > 0 {
                // Row i less lower · (the row above, solved for its node).
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
            // [D | U | x], and D⁻¹ times the rest.
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
    fn solve_cyclic(&mut self, n: usize, m: usize, x: &mut [Lane]) {
        let (block, columns) = (m * m, m + 1);
        let last = n - 1;
        let [lower, diagonal, upper] = &self.blocks;
        let at = |b: &[Lane], i: usize| b[i * block..][..block].to_vec();
        // How the other nodes see the last one, and it them.
        let (first_sees, before_sees) = (at(lower, 0), at(upper, last - 1));
        let (sees_before, sees_first, own) = (at(lower, last), at(upper, last), at(diagonal, last));
        let mut sides = std::mem::take(&mut self.sides);
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
                    // With two nodes the first and the one before the last are one.
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
        self.sides = sides;
    }
}

/// `c −= a b` for an m × m matrix a and m × `columns` matrices b and c.
fn subtract_product(a: &[Lane], b: &[Lane], c: &mut [Lane], m: usize, columns: usize) {
    for r in 0..m {
        for k in 0..m {
            let factor = -a[r * m + k];
            for j in 0..columns {
                c[r * columns + j] = factor.mul_add(b[k * columns + j], c[r * columns + j]);
            }
        }
    }
}

/// Gauss–Jordan elimination of the first m columns of m rows, with row exchanges lane by lane.
fn eliminate(a: &mut [Lane], m: usize, width: usize) {
    for k in 0..m {
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
