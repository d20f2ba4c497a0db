//! Block tridiagonal systems, open and cyclic, against their residual.

use symspline_engine::fit::Blocks;
use symspline_engine::scalar::{Lane, lane};

/// Pseudo-random numbers, equal in every run.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut x = seed;
    move || {
        x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((x >> 11) as f64) / (1_u64 << 52) as f64 - 1.0
    }
}

/// The largest residual of a random system, whose first pivot is zero.
fn defect(n: usize, m: usize, cyclic: bool) -> f64 {
    let mut next = noise((n * 10 + m) as u64);
    let mut blocks = Blocks::default();
    blocks.clear(n, m);
    for (side, block) in blocks.sides.iter_mut().enumerate() {
        for i in 0..n {
            for c in 0..m * m {
                let exists = cyclic || side == 1 || (side == 0 && i > 0) || (side == 2 && i + 1 < n);
                // With two nodes, the other node is both neighbours; it counts as the left one.
                let again = cyclic && n == 2 && side == 2;
                // The rows of a diagonal block have decreasing order of columns, so that every pivot requires an
                // exchange.
                let large = if side == 1 && c / m + c % m == m - 1 { 8.0 } else { 0.0 };
                let zero = side == 1 && c / m + c % m != m - 1;
                let x = if exists && !again { if zero { 0.0 } else { next() + large } } else { 0.0 };
                block[i * m * m + c] = lane(x);
            }
        }
    }
    let sides = blocks.sides.clone();
    let right: Vec<Lane> = (0..n * m).map(|_| lane(next())).collect();
    let mut x = right.clone();
    if cyclic {
        blocks.solve_cyclic(n, m, &mut x)
    } else {
        blocks.solve(n, m, 1, &mut x)
    }
    let mut worst = 0.0_f64;
    for i in 0..n {
        for r in 0..m {
            let mut sum = -right[i * m + r];
            for (side, j) in [(0, (i + n - 1) % n), (1, i), (2, (i + 1) % n)] {
                for c in 0..m {
                    sum += sides[side][(i * m + r) * m + c] * x[j * m + c];
                }
            }
            // NaN is not a solution.
            let d = sum.to_array()[0].abs();
            worst = if d <= worst { worst } else { d };
        }
    }
    worst
}

#[test]
fn open_systems_are_solved() {
    for n in [1, 2, 3, 7] {
        for m in 1..5 {
            let d = defect(n, m, false);
            assert!(d <= 1e-14, "{n} nodes of {m}: {d}");
        }
    }
}

#[test]
fn cyclic_systems_are_solved() {
    for n in [2, 3, 4, 7] {
        for m in 1..5 {
            let d = defect(n, m, true);
            assert!(d <= 1e-14, "{n} nodes of {m}: {d}");
        }
    }
}
