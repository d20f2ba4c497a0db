//! Newton's method: the Jacobian of the C² condition by dual numbers, block by block.
//!
//! The residual at a node depends on the velocities of the node and of its two neighbours. The Jacobian is therefore
//! block tridiagonal, and cyclic for closed curves. One sweep with dual numbers differentiates with respect to one
//! coordinate at every third node at once.

use super::blocks::Blocks;
use super::chain::Chain;
use super::condition::sweep;
use super::end_kind::ChainEnds;
use super::node::NodeVectors;
use crate::monitor::checkpoint;
use crate::scalar::{Dual, Lane, Scalar};
use crate::space::Erased;

/// The Jacobian and the memory of its solver.
#[derive(Default)]
pub struct Newton {
    pub(super) blocks: Blocks,
    vectors: NodeVectors<Dual>,
    u: Vec<Dual>,
    r: Vec<Dual>,
}

/// `step ← −J⁻¹ r` for the residual in `chain.r`.
pub fn update(space: &Erased, chain: &mut Chain, ends: &ChainEnds, newton: &mut Newton, step: &mut [Lane]) {
    newton.differentiate(space, chain, ends);
    solve(chain, ends, newton, step);
}

/// The same with an existing Jacobian, which it overwrites.
pub fn solve(chain: &Chain, ends: &ChainEnds, newton: &mut Newton, step: &mut [Lane]) {
    step.copy_from_slice(&chain.r[..step.len()]);
    let (n, m) = (chain.n, chain.m);
    match ends {
        ChainEnds::Open(_) => newton.blocks.solve(n + 1, m, 1, step),
        ChainEnds::Periodic if n > 1 => newton.blocks.solve_cyclic(n, m, step),
        // One segment from a point to itself is a constant curve.
        ChainEnds::Periodic => step.fill(Lane::ZERO),
    }
    step.iter_mut().for_each(|x| *x = -*x);
}

impl Newton {
    /// Fills the blocks with the derivatives of the residual.
    pub(super) fn differentiate(&mut self, space: &Erased, chain: &mut Chain, ends: &ChainEnds) {
        let (n, m) = (chain.n, chain.m);
        let closed = matches!(ends, ChainEnds::Periodic);
        let nodes = if closed { n } else { n + 1 };
        self.blocks.clear(nodes, m);
        let zero = Dual::constant(Lane::ZERO);
        self.r.resize(chain.r.len(), zero);
        // A node never has two neighbours (including itself) of the same colour; the last two nodes of a closed curve
        // are treated separately.
        let color = |i: usize| if closed && i + 2 >= n { 3 + (n - 1 - i) } else { i % 3 };
        for c in 0..if closed { 5 } else { 3 } {
            if !(0..nodes).any(|i| color(i) == c) {
                continue;
            }
            for k in 0..m {
                self.u.clear();
                self.u.extend(chain.velocities().iter().map(|&u| Dual::constant(u)));
                for i in (0..nodes).filter(|&i| color(i) == c) {
                    self.u[i * m + k].d = Lane::ONE;
                }
                if closed {
                    let (first, last) = self.u.split_at_mut(n * m);
                    let mut seed: Vec<Lane> = first[..m].iter().map(|u| u.d).collect();
                    chain.across_closure(space, true, &mut seed);
                    last.iter_mut().zip(seed).for_each(|(u, d)| u.d = d);
                }
                checkpoint();
                sweep(space, chain, ends, &self.u, &mut self.r, &mut self.vectors, Lane::ZERO);
                for i in 0..nodes {
                    // A row depends on the coloured one of its three nodes. If two of them are equal (a closed curve
                    // of three points), the sum may be assigned to either.
                    for (side, block) in self.blocks.sides.iter_mut().enumerate() {
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
}
