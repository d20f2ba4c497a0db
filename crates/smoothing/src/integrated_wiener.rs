//! The posterior of an integrated Wiener process whose third derivative is white noise.
//!
//! The process is the prior that belongs to the penalty ∫ x'''² (Wahba 1978). For noise of variance one, its intensity
//! is 1/λ. The state of value, velocity and acceleration is Markov. The square-root information form (Paige & Saunders
//! 1977) factors the precision by orthogonal transformations, and covariances are sums of squares. The unknowns are the
//! last state and the increments before it, so that nearly equal times cause no loss of accuracy.

use symspline_core::monitor::checkpoint;

/// The number of derivatives in a state.
const ORDER: usize = 3;
/// Rows have the columns of a state, of the next one, and of the first state of a closed curve.
const COLUMNS: usize = 3 * ORDER;
const BASE: usize = 2 * ORDER;

type Equation = [f64; COLUMNS];
type Square<const N: usize> = [[f64; N]; N];

/// The inverse of the lower Cholesky factor of the covariance of the increments after one unit of time,
/// `1/((5 − i − j) (2 − i)! (2 − j)!)`.
const WHITEN: Square<ORDER> = [
    [4.472_135_954_999_579, 0.0, 0.0],
    [-17.320_508_075_688_775, 6.928_203_230_275_509, 0.0],
    [20.0, -12.0, 3.0],
];
/// The variance of a coordinate at given times, for noise of variance one: of the value (`nu` = 0) or the velocity (1). λ is a
/// function of time, which is constant between data and the given times.
///
/// Times of the data must not decrease, and must lie within the period of a closed curve. Outside the data of an open
/// curve, the process continues with constant velocity. At least three data at different times are required, or two in
/// a closed curve.
pub fn process_variance(
    times: &[f64],
    weights: &[f64],
    lam: impl Fn(f64) -> f64,
    period: Option<f64>,
    x: &[f64],
    nu: usize,
) -> Vec<f64> {
    let (first, last) = (times[0], times[times.len() - 1]);
    // Scale times and weights so that all numbers are of moderate size.
    let unit = period.unwrap_or(last - first) / times.len() as f64;
    let inside = |t: f64| match period {
        Some(period) => (t - first).rem_euclid(period) / unit,
        None => (t.clamp(first, last) - first) / unit,
    };
    let mut sites: Vec<(f64, f64)> = times.iter().zip(weights).map(|(t, w)| (inside(*t), *w)).collect();
    sites.extend(x.iter().map(|t| (inside(*t), 0.0)));
    sites.sort_by(|a, b| a.0.total_cmp(&b.0));
    sites.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        kept.1 += if same { next.1 } else { 0.0 };
        same
    });
    let root = |t: f64| (lam(first + t * unit) / unit.powi(5)).sqrt();
    let chain = Chain::new(&sites, root, period.map(|period| period / unit));
    let covariances = chain.covariances();
    let variance = |t: &f64| {
        let at = sites.partition_point(|site| site.0 < inside(*t));
        let beyond = if period.is_some() { 0.0 } else { (t - t.clamp(first, last)) / unit };
        let c = &covariances[at];
        match nu {
            0 => c[0][0] + beyond * (2.0 * c[0][1] + beyond * c[1][1]),
            _ => c[1][1] / (unit * unit),
        }
    };
    x.iter().map(variance).collect()
}

/// The factored precision of the states.
struct Chain {
    /// For every state but the last: the time to the next one, and three rows for the increment until then with a
    /// triangle in their first columns.
    factors: Vec<(f64, [Equation; ORDER])>,
    /// The rows of the last state; of a closed curve that is the first one.
    end: Vec<Equation>,
    /// The number of states by which those of a closed curve were rotated; None for an open one.
    rotated: Option<usize>,
}

impl Chain {
    /// For different times with their weights, and the root of λ as a function of time.
    fn new(sites: &[(f64, f64)], root: impl Fn(f64) -> f64, period: Option<f64>) -> Self {
        let count = sites.len();
        let step = |i: usize| match (sites.get(i + 1), period) {
            (Some(next), _) => next.0 - sites[i].0,
            (None, period) => sites[0].0 + period.unwrap_or(0.0) - sites[i].0,
        };
        let root_after = |i: usize| root(sites[i].0 + 0.5 * step(i));
        // The first increment of a closed curve is not eliminated. It is the longest, so that its rows are not large.
        let longest = (0..count).max_by(|a, b| step(*a).total_cmp(&step(*b))).unwrap_or(0);
        let rotated = period.map(|_| longest);
        let first = rotated.unwrap_or(0);
        let observation = |i: usize, column: usize| {
            let mut row = [0.0; COLUMNS];
            row[column] = sites[(first + i) % count].1.sqrt();
            row
        };
        let mut known = vec![observation(0, 0)];
        let mut factors = Vec::with_capacity(count);
        if rotated.is_some() {
            // The first state has its columns at the end.
            known = vec![observation(0, BASE)];
            known.extend(increment(step(first), root_after(first)));
            known.push(observation(1, 0));
        }
        for i in usize::from(rotated.is_some())..count - usize::from(rotated.is_none()) {
            checkpoint();
            let (h, root) = (step((first + i) % count), root_after((first + i) % count));
            let next = if rotated.is_some() && i + 1 == count { BASE } else { ORDER };
            let mut rows = whitened(root).to_vec();
            rows.extend(known.iter().map(|row| in_increment(row, h, next)));
            triangularise(&mut rows, 0, ORDER);
            factors.push((h, [rows[0], rows[1], rows[2]]));
            known = rows.split_off(ORDER);
            if next == ORDER {
                known.push(observation(i + 1, ORDER));
            }
            triangularise(&mut known, ORDER, COLUMNS);
            // The next state takes the first columns.
            known.iter_mut().for_each(|row| {
                row.copy_within(next..next + ORDER, 0);
                row[ORDER..BASE].fill(0.0);
            });
        }
        triangularise(&mut known, 0, ORDER);
        // Too few data do not determine the variances.
        known.resize(known.len().max(ORDER), [0.0; COLUMNS]);
        Chain { factors, end: known, rotated }
    }

    /// The covariances of the states, by substitution from the last one.
    fn covariances(&self) -> Vec<Square<ORDER>> {
        let end = product(&inverse_of_triangle(&self.end), &inverse_of_triangle(&self.end));
        // The covariances of the next state, and of that with the last one, which is the first of a closed curve.
        let (mut next, mut cross) = (end, end);
        let mut out = vec![end];
        for (i, (h, rows)) in self.factors.iter().rev().enumerate() {
            let (back, scale, inverse) = (taylor(-h), deviations(*h), inverse_of_triangle(rows));
            // The state is `back (next − D ε)` with the increment `ε = −R⁻¹(N next + B base) + R⁻¹e` for noise e.
            let part = |from: usize| -> Square<ORDER> {
                from_entries(|a, b| {
                    scale[a] * (0..ORDER).map(|k| inverse[a][k] * rows[k][from + b]).sum::<f64>()
                })
            };
            let (mut of_next, mut of_base) = (part(ORDER), part(BASE));
            (0..ORDER).for_each(|a| of_next[a][a] += 1.0);
            if i == 0 && self.rotated.is_some() {
                // The next state is the first one, which has its columns at the end.
                of_base = [[0.0; ORDER]; ORDER];
                of_next = part(BASE);
                (0..ORDER).for_each(|a| of_next[a][a] += 1.0);
            }
            let noise: Square<ORDER> = from_entries(|a, b| scale[a] * inverse[a][b]);
            let [of_next, of_base, noise] = [of_next, of_base, noise].map(|x| times(&back, &x));
            let mixed = times(&times(&of_next, &cross), &transposed(&of_base));
            let parts = [
                product(&times(&of_next, &next), &of_next),
                product(&times(&of_base, &end), &of_base),
                product(&noise, &noise),
                mixed,
                transposed(&mixed),
            ];
            next = from_entries(|a, b| parts.iter().map(|part| part[a][b]).sum());
            let (through, own) = (times(&of_next, &cross), times(&of_base, &end));
            cross = from_entries(|a, b| through[a][b] + own[a][b]);
            out.push(next);
        }
        if let Some(rotated) = self.rotated {
            // The last state is the first one.
            out.rotate_left(1);
            out.reverse();
            out.rotate_right(rotated);
        } else {
            out.reverse();
        }
        out
    }
}

/// The state after the time h of a process without increment.
fn taylor(h: f64) -> Square<ORDER> {
    [[1.0, h, 0.5 * h * h], [0.0, 1.0, h], [0.0, 0.0, 1.0]]
}

/// The powers D of h with which the standard deviations of the increments of value, velocity and acceleration scale.
fn deviations(h: f64) -> [f64; ORDER] {
    [h.powf(2.5), h.powf(1.5), h.sqrt()]
}

/// Rows for an increment in units of D.
fn whitened(root: f64) -> [Equation; ORDER] {
    WHITEN.map(|entries| std::array::from_fn(|c| entries.get(c).map_or(0.0, |x| x * root)))
}

/// Rows for the increment from the first state, whose columns are at the end, to the second one.
fn increment(h: f64, root: f64) -> [Equation; ORDER] {
    let (forward, scale) = (taylor(h), deviations(h));
    whitened(root).map(|row| {
        let mut out = [0.0; COLUMNS];
        for b in 0..ORDER {
            out[b] = row[b] / scale[b];
        }
        for b in 0..ORDER {
            out[BASE + b] = -(0..ORDER).map(|k| out[k] * forward[k][b]).sum::<f64>();
        }
        out
    })
}

/// A row in which the next state in the columns from `next` on and the increment replace a state.
fn in_increment(row: &Equation, h: f64, next: usize) -> Equation {
    let (back, scale) = (taylor(-h), deviations(h));
    let mut out = *row;
    for b in 0..ORDER {
        let moved = (0..ORDER).map(|k| row[k] * back[k][b]).sum::<f64>();
        out[next + b] += moved;
        out[b] = -moved * scale[b];
    }
    out
}

/// Transforms rows so that they have zeros below the diagonal that begins in the first of the columns `from..to`, by
/// reflections (Householder). Rows with large entries come first, so that small ones keep their accuracy (Cox & Higham
/// 1998).
fn triangularise(rows: &mut Vec<Equation>, from: usize, to: usize) {
    let mut top = 0;
    for column in from..to {
        let Some(largest) =
            (top..rows.len()).max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()))
        else {
            return;
        };
        rows.swap(top, largest);
        let pivot = rows[top][column];
        if pivot == 0.0 {
            continue;
        }
        let norm =
            pivot.abs() * rows[top..].iter().map(|row| (row[column] / pivot).powi(2)).sum::<f64>().sqrt();
        let end = -norm.copysign(pivot);
        // The vector of the reflection, relative to its first entry.
        let first = pivot - end;
        let v: Vec<f64> = rows[top + 1..].iter().map(|row| row[column] / first).collect();
        for c in column..COLUMNS {
            let along = rows[top][c] + rows[top + 1..].iter().zip(&v).map(|(row, v)| v * row[c]).sum::<f64>();
            let along = along * first / -end;
            rows[top][c] -= along;
            rows[top + 1..].iter_mut().zip(&v).for_each(|(row, v)| row[c] -= v * along);
        }
        rows[top + 1..].iter_mut().for_each(|row| row[column] = 0.0);
        top += 1;
    }
    if to == COLUMNS {
        rows.truncate(top);
    }
}

/// The inverse of the upper triangle in the first columns.
fn inverse_of_triangle(rows: &[Equation]) -> Square<ORDER> {
    let mut inverse = [[0.0; ORDER]; ORDER];
    for column in 0..ORDER {
        for a in (0..=column).rev() {
            let unit = f64::from(a == column);
            let sum: f64 = (a + 1..=column).map(|k| rows[a][k] * inverse[k][column]).sum();
            inverse[a][column] = (unit - sum) / rows[a][a];
        }
    }
    inverse
}

fn from_entries(entry: impl Fn(usize, usize) -> f64) -> Square<ORDER> {
    std::array::from_fn(|a| std::array::from_fn(|b| entry(a, b)))
}

fn transposed(x: &Square<ORDER>) -> Square<ORDER> {
    from_entries(|a, b| x[b][a])
}

fn times(x: &Square<ORDER>, y: &Square<ORDER>) -> Square<ORDER> {
    from_entries(|a, b| (0..ORDER).map(|k| x[a][k] * y[k][b]).sum())
}

/// x yᵀ.
fn product(x: &Square<ORDER>, y: &Square<ORDER>) -> Square<ORDER> {
    times(x, &transposed(y))
}
