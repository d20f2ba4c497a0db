//! Derivatives in time of the motion of a curve, and the transpose, where the formulas of a space do not give them.
//!
//! With the motion e(τ) of the curve in units of a segment, D_ε γ_τ = De and D_ε ∇γ_τ = D²e + R(e, γ_τ)γ_τ. On a segment, e is a
//! smooth function of τ, which is interpolated at Chebyshev nodes (Trefethen, *Approximation Theory and Approximation
//! Practice*, 2013, chapters 2 and 21). For arrays γ the acceleration is L(γ'') + Q(γ', γ') with a linear map L and a quadratic
//! form Q that depend on the point, so that De = L(e') + Q(γ', e). The transpose takes the same steps in reverse order.

use crate::curve::{Moving, Outside, Quantity, Times, connection, evaluate, motion_len};
use crate::monitor::{Monitor, checkpoint};
use crate::scalar::{LANES, Lane, dot, few, gather, lane, scatter};
use crate::space::{Ambient, Erased, Frame, Origin};
use std::f64::consts::PI;
use std::sync::LazyLock;

/// The number of nodes.
const NODES: usize = 17;
/// Coefficients of the highest degrees up to this, relative to the largest, are rounding errors.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// The number of coefficients of highest degree that are compared with rounding errors.
const HIGHEST: usize = 3;
/// Larger ones are rounding errors as well if they are below this, relative to the largest, and do not decrease: the highest
/// are above this part of the last ones.
const NOISE: f64 = 1e-9;
const FLAT: f64 = 0.05;
const LAST: usize = 8;
/// A segment is halved until its parts are resolved, up to this number of times.
const HALVINGS: usize = 7;
/// Parts of segments whose nodes are stored at the same time.
const TOGETHER: usize = 64;

/// Interpolation on [0, 1] at the zeros of a Chebyshev polynomial, none of which is an end.
struct Interpolation {
    nodes: Vec<f64>,
    /// By node, the Chebyshev coefficients of its cardinal function.
    coefficients: Vec<Vec<f64>>,
    /// By node, the derivatives of the cardinal functions there.
    slopes: Vec<Vec<f64>>,
}

static INTERPOLATION: LazyLock<Interpolation> = LazyLock::new(Interpolation::new);

impl Interpolation {
    fn new() -> Self {
        let cosine = |n: usize, k: usize| (PI * (n * (2 * k + 1)) as f64 / (2 * NODES) as f64).cos();
        let coefficient = |n: usize, k: usize| cosine(n, k) * if n == 0 { 1.0 } else { 2.0 } / NODES as f64;
        let mut found = Interpolation {
            nodes: (0..NODES).map(|k| 0.5 + 0.5 * cosine(1, k)).collect(),
            coefficients: (0..NODES).map(|k| (0..NODES).map(|n| coefficient(n, k)).collect()).collect(),
            slopes: Vec::new(),
        };
        found.slopes = found.nodes.iter().map(|&x| found.weights(x)[1].clone()).collect();
        found
    }

    /// The cardinal functions at a position, and their derivatives.
    fn weights(&self, x: f64) -> [Vec<f64>; 2] {
        let y = 2.0 * x - 1.0;
        // Tₙ, and its derivative in x, 2n Uₙ₋₁.
        let (mut t, mut u) = ([1.0, y], [1.0, 2.0 * y]);
        let (mut values, mut slopes) = (vec![1.0], vec![0.0]);
        for n in 1..NODES {
            values.push(t[1]);
            slopes.push(2.0 * n as f64 * u[0]);
            t = [t[1], 2.0 * y * t[1] - t[0]];
            u = [u[1], 2.0 * y * u[1] - u[0]];
        }
        let sum = |c: &Vec<f64>, x: &[f64]| c.iter().zip(x).map(|(c, x)| c * x).sum();
        [values, slopes].map(|x| self.coefficients.iter().map(|c| sum(c, &x)).collect())
    }

    /// Whether the coefficients of the highest degrees of rows of values at the nodes are rounding errors.
    fn resolves(&self, values: &[f64], len: usize) -> bool {
        let coefficient = |n: usize, c: usize| {
            let terms = values.chunks_exact(len).zip(&self.coefficients);
            terms.map(|(row, coefficients)| row[c] * coefficients[n]).sum::<f64>()
        };
        let largest = values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let most = |last: usize| {
            let columns = (NODES - last..NODES).flat_map(|n| (0..len).map(move |c| (n, c)));
            columns.fold(0.0, |most: f64, (n, c)| most.max(coefficient(n, c).abs())) / largest
        };
        let highest = most(HIGHEST);
        // NaN stays NaN in every part.
        !(highest > ROUNDING) || (highest <= NOISE && highest > FLAT * most(LAST))
    }
}

/// One curve.
pub struct Rates<'a> {
    pub space: &'a Erased<'a>,
    pub moving: &'a Moving<'a>,
}

/// Samples in a part of one segment, by their numbers, and the weights of the nodes at each; derivatives are with respect to
/// τ.
struct Group {
    segment: usize,
    /// The part begins at `part` times its width.
    part: usize,
    width: f64,
    samples: Vec<usize>,
    weights: Vec<[Vec<f64>; 2]>,
}

impl Group {
    /// Rows of values at the nodes, interpolated at samples, and the derivatives.
    fn interpolate(&self, samples: &[usize; LANES], values: &[f64], len: usize) -> [Vec<Lane>; 2] {
        [0, 1].map(|k| {
            let at = samples.map(|i| &self.weights[i][k]);
            let mut sum = vec![Lane::ZERO; len];
            for (j, row) in values.chunks_exact(len).enumerate() {
                let weight = Lane::new(at.map(|weights| weights[j]));
                sum.iter_mut().zip(row).for_each(|(sum, x)| *sum = weight.mul_add(lane(*x), *sum));
            }
            sum
        })
    }

    /// The samples on the lanes, by their places in the group; the last one is repeated.
    fn lanes(&self) -> impl Iterator<Item = [usize; LANES]> {
        let count = self.samples.len();
        (0..count).step_by(LANES).map(move |first| few(|l| (first + l).min(count - 1)))
    }
}

/// Parts of segments that are resolved.
struct Resolved<'c> {
    groups: Vec<&'c Group>,
    /// The times of the nodes, and the states there.
    x: Vec<f64>,
    states: Vec<f64>,
}

/// On the lanes, a point, the derivative of its array and ∇γ_τ, in units of the segment.
struct State {
    p: Vec<Lane>,
    d: Vec<Lane>,
    w: Vec<Lane>,
}

impl State {
    fn read(states: &[f64], len: usize, at: [usize; LANES]) -> Self {
        let part = |k: usize| {
            let mut lanes = vec![Lane::ZERO; len];
            gather(at.map(|i| &states[(3 * i + k) * len..][..len]), &mut lanes);
            lanes
        };
        State { p: part(0), d: part(1), w: part(2) }
    }
}

impl Rates<'_> {
    fn h(&self, segment: usize) -> f64 {
        let t = self.moving.curve.t;
        t[segment + 1] - t[segment]
    }

    fn segment(&self, x: f64) -> usize {
        let t = self.moving.curve.t;
        t[1..t.len() - 1].partition_point(|&t| t <= x)
    }

    fn tau(&self, segment: usize, x: f64) -> f64 {
        (x - self.moving.curve.t[segment]) / self.h(segment)
    }

    /// Points, derivatives of their arrays and ∇γ_τ at times, in units of the segment of each.
    fn states(&self, x: &[f64], segment: impl Fn(usize) -> usize) -> Vec<f64> {
        let len = self.moving.len;
        let mut states = vec![0.0; 3 * len * x.len()];
        let go_on = |_| true;
        let (times, monitor) = (Times { x, count: x.len() }, Monitor::new(&go_on));
        let (quantity, outside) = (Quantity::Jet, Outside::Continue);
        evaluate(self.space, &self.moving.curve, &times, quantity, outside, &monitor, &mut states);
        for (i, state) in states.chunks_mut(3 * len).enumerate() {
            let h = self.h(segment(i));
            state[len..2 * len].iter_mut().for_each(|x| *x *= h);
            state[2 * len..].iter_mut().for_each(|x| *x *= h * h);
        }
        states
    }

    /// Passes the samples to a function, some parts of segments at a time, with the states of all samples. A part is resolved
    /// if the motion for an arbitrary motion of the control points is.
    fn for_each(&self, mut work: impl FnMut(&Resolved, &[f64])) {
        let (x, len, m) = (self.moving.times.x, self.moving.len, self.moving.dim);
        let samples = self.states(x, |i| self.segment(x[i]));
        let size = motion_len(m);
        let probe: Vec<f64> = (0..(self.moving.curve.nodes - 1) * size)
            .map(|i| if i % size < 4 * m { ((i % size) as f64 * 2.399_963).cos() } else { 0.0 })
            .collect();
        // Segment, part, and samples.
        let mut rest: Vec<(usize, usize, Vec<usize>)> = vec![];
        let mut order: Vec<usize> = (0..x.len()).collect();
        order.sort_by_key(|&i| self.segment(x[i]));
        for samples in order.chunk_by(|&i, &j| self.segment(x[i]) == self.segment(x[j])) {
            rest.push((self.segment(x[samples[0]]), 0, samples.to_vec()));
        }
        for halvings in 0..=HALVINGS {
            let (mut rough, width) = (Vec::new(), 0.5_f64.powi(halvings as i32));
            for some in rest.chunks(TOGETHER) {
                checkpoint();
                let group = |(segment, part, samples): &(usize, usize, Vec<usize>)| {
                    let weights = samples.iter().map(|&i| {
                        let position = self.tau(*segment, x[i]) / width - *part as f64;
                        let [values, mut slopes] = INTERPOLATION.weights(position);
                        slopes.iter_mut().for_each(|x| *x /= width);
                        [values, slopes]
                    });
                    Group {
                        segment: *segment,
                        part: *part,
                        width,
                        weights: weights.collect(),
                        samples: samples.clone(),
                    }
                };
                let groups: Vec<Group> = some.iter().map(group).collect();
                let times = |group: &Group| {
                    let (from, h) = (self.moving.curve.t[group.segment], self.h(group.segment));
                    let (part, width) = (group.part as f64, group.width);
                    INTERPOLATION.nodes.iter().map(move |x| from + (part + x) * width * h)
                };
                let times: Vec<f64> = groups.iter().flat_map(times).collect();
                let probes = self.motions(&times, &probe);
                let row = NODES * len;
                let is_good = |g: &usize| {
                    halvings == HALVINGS || INTERPOLATION.resolves(&probes[g * row..][..row], len)
                };
                let (good, bad): (Vec<usize>, Vec<usize>) = (0..groups.len()).partition(is_good);
                for g in bad {
                    let (segment, part, samples) = &some[g];
                    let (right, left): (Vec<usize>, Vec<usize>) = samples
                        .iter()
                        .partition(|&&i| self.tau(*segment, x[i]) / width - *part as f64 >= 0.5);
                    for (half, samples) in [left, right].into_iter().enumerate() {
                        if !samples.is_empty() {
                            rough.push((*segment, 2 * part + half, samples));
                        }
                    }
                }
                let x: Vec<f64> = good.iter().flat_map(|&g| &times[g * NODES..][..NODES]).copied().collect();
                let groups: Vec<&Group> = good.iter().map(|&g| &groups[g]).collect();
                let states = self.states(&x, |i| groups[i / NODES].segment);
                work(&Resolved { groups, x, states }, &samples);
            }
            rest = rough;
        }
    }

    /// The motion of the curve at times.
    fn motions(&self, x: &[f64], motions: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; x.len() * self.moving.len];
        let moving = Moving { times: Times { x, count: x.len() }, nu: 0, ..*self.moving };
        self.space.0.push(&moving, motions, &mut out);
        out
    }

    /// De = L(e') + Q(γ', e) on the lanes.
    fn covariant(&self, State { p, d, .. }: &State, [e, slope]: &[Vec<Lane>; 2]) -> Vec<Lane> {
        connection(self.space, p, d, e, slope)
    }

    /// De at the nodes of a part.
    fn at_nodes(&self, width: f64, states: &[f64], field: &[f64]) -> Vec<f64> {
        let len = self.moving.len;
        let mut out = vec![0.0; field.len()];
        for (first, out) in out.chunks_mut(LANES * len).enumerate() {
            let at: [usize; LANES] = few(|l| (first * LANES + l).min(NODES - 1));
            let state = State::read(states, len, at);
            let mut both = [vec![Lane::ZERO; len], vec![Lane::ZERO; len]];
            gather(at.map(|j| &field[j * len..][..len]), &mut both[0]);
            for (k, row) in field.chunks_exact(len).enumerate() {
                let weight = Lane::new(at.map(|j| INTERPOLATION.slopes[j][k] / width));
                both[1].iter_mut().zip(row).for_each(|(sum, x)| *sum = weight.mul_add(lane(*x), *sum));
            }
            scatter(&self.covariant(&state, &both), out);
        }
        out
    }

    /// The rows of a matrix that represents a linear map of arrays, times λ: its transpose.
    fn transpose(&self, cotangent: &[Lane], mut map: impl FnMut(&[Lane]) -> Vec<Lane>) -> Vec<Lane> {
        let mut unit = vec![Lane::ZERO; cotangent.len()];
        (0..cotangent.len())
            .map(|i| {
                unit[i] = Lane::ONE;
                let product = dot(&map(&unit), cotangent);
                unit[i] = Lane::ZERO;
                product
            })
            .collect()
    }

    /// The transpose of De: cotangent vectors for e and e'.
    fn covariant_transposed(&self, State { p, d, .. }: &State, cotangent: &[Lane]) -> [Vec<Lane>; 2] {
        let none = vec![Lane::ZERO; p.len()];
        [
            self.transpose(cotangent, |e| connection(self.space, p, d, e, &none)),
            self.transpose(cotangent, |slope| connection(self.space, p, d, &none, slope)),
        ]
    }

    /// `e ↦ R(e, γ_τ)γ_τ`, which is [γ_τ, [e, γ_τ]], in a frame.
    fn curvature(&self, State { p, d, .. }: &State) -> impl Fn(&[Lane]) -> Vec<Lane> {
        let (space, m) = (self.space, self.moving.dim);
        let (mut frame, mut v, mut velocity) =
            (vec![Lane::ZERO; space.frame_len()], vec![Lane::ZERO; m], d.clone());
        space.velocity(p, &mut velocity);
        space.lift(p, &mut frame);
        space.coordinates(&frame, p, &velocity, &mut v);
        move |e| {
            let (mut x, mut bent, mut out) =
                (vec![Lane::ZERO; m], vec![Lane::ZERO; m], vec![Lane::ZERO; p.len()]);
            space.coordinates(&frame, p, e, &mut x);
            space.triple(&v, &x, &v, &mut bent);
            space.tangent(&frame, p, &bent, &mut out);
            out
        }
    }

    /// γ_τ for ν = 1 and ∇γ_τ for ν = 2, and its derivative along the curve, at samples.
    fn rates(&self, group: &Group, at: &[usize; LANES], nodes: &[f64], state: &State) -> [Vec<Lane>; 2] {
        if self.moving.nu == 1 {
            let mut velocity = state.d.clone();
            self.space.velocity(&state.p, &mut velocity);
            return [velocity, state.w.clone()];
        }
        let len = self.moving.len;
        let bends: Vec<f64> = nodes.chunks(3 * len).flat_map(|state| &state[2 * len..]).copied().collect();
        [state.w.clone(), self.covariant(state, &group.interpolate(at, &bends, len))]
    }

    /// See [`Moving::push`].
    pub fn push(&self, motions: &[f64], out: &mut [f64]) {
        let (len, m, x) = (self.moving.len, self.moving.dim, self.moving.times.x);
        let nu = self.moving.nu as i32;
        let (size, mut still) = (motion_len(m), motions.to_vec());
        // Only the motion at fixed parameters.
        still.chunks_mut(size).for_each(|row| row[4 * m..].fill(0.0));
        self.for_each(|Resolved { groups, x: at_nodes, states }, samples| {
            let fields = self.motions(at_nodes, &still);
            let row = NODES * len;
            for ((group, states), field) in groups.iter().zip(states.chunks(3 * row)).zip(fields.chunks(row))
            {
                let h = self.h(group.segment);
                let [dt, dh] = [0, 1].map(|k| motions[group.segment * size + 4 * m + k]);
                let moved = if nu == 1 { field.to_vec() } else { self.at_nodes(group.width, states, field) };
                for at in group.lanes() {
                    let state = State::read(samples, len, at.map(|i| group.samples[i]));
                    let mut change = self.covariant(&state, &group.interpolate(&at, &moved, len));
                    if nu == 2 {
                        let bent = self.curvature(&state)(&group.interpolate(&at, field, len)[0]);
                        change.iter_mut().zip(&bent).for_each(|(x, y)| *x += *y);
                    }
                    let [rate, next] = self.rates(group, &at, states, &state);
                    for (l, &i) in at.iter().enumerate() {
                        let i = group.samples[i];
                        let shift = -(dt + self.tau(group.segment, x[i]) * dh) / h;
                        for c in 0..len {
                            let [change, rate, next] = [&change, &rate, &next].map(|v| v[c].as_array()[l]);
                            out[i * len + c] =
                                (change + shift * next - nu as f64 * dh / h * rate) / h.powi(nu);
                        }
                    }
                }
            }
        });
    }

    /// See [`Moving::pull`].
    pub fn pull(&self, cotangents: &[f64], out: &mut [f64]) {
        let (len, m, x) = (self.moving.len, self.moving.dim, self.moving.times.x);
        let (nu, size) = (self.moving.nu as i32, motion_len(m));
        let segments = self.moving.curve.nodes - 1;
        let mut products = vec![0.0; segments * size];
        self.for_each(|Resolved { groups, x: at_nodes, states }, samples| {
            let row = NODES * len;
            let mut sources = vec![0.0; at_nodes.len() * len];
            for ((group, states), source) in
                groups.iter().zip(states.chunks(3 * row)).zip(sources.chunks_mut(row))
            {
                let h = self.h(group.segment);
                let mut direct = vec![0.0; row];
                for (first, at) in group.lanes().enumerate() {
                    let used = (group.samples.len() - first * LANES).min(LANES);
                    let numbers = at.map(|i| group.samples[i]);
                    let state = State::read(samples, len, numbers);
                    let mut cotangent = vec![Lane::ZERO; len];
                    gather(numbers.map(|i| &cotangents[i * len..][..len]), &mut cotangent);
                    cotangent.iter_mut().for_each(|x| *x *= lane(h.powi(-nu)));
                    let [by_e, by_slope] = self.covariant_transposed(&state, &cotangent);
                    let bent =
                        if nu == 2 { self.transpose(&cotangent, self.curvature(&state)) } else { Vec::new() };
                    let [rate, next] = self.rates(group, &at, states, &state);
                    let [rate, next] = [rate, next].map(|v| dot(&v, &cotangent));
                    for l in 0..used {
                        let [values, slopes] = &group.weights[at[l]];
                        for j in 0..NODES {
                            for c in 0..len {
                                let [e, slope] = [&by_e, &by_slope].map(|v| v[c].as_array()[l]);
                                source[j * len + c] += values[j] * e + slopes[j] * slope;
                                if nu == 2 {
                                    direct[j * len + c] += values[j] * bent[c].as_array()[l];
                                }
                            }
                        }
                        let [rate, next] = [rate, next].map(|x| x.as_array()[l] / h);
                        let sums = &mut out[group.segment * size + 4 * m..][..2];
                        sums[0] -= next;
                        sums[1] -= next * self.tau(group.segment, x[numbers[l]]) + nu as f64 * rate;
                    }
                }
                if nu == 2 {
                    let moved = self.at_nodes_transposed(group.width, states, source);
                    source.iter_mut().zip(moved.iter().zip(&direct)).for_each(|(x, (y, z))| *x = y + z);
                }
            }
            let moving =
                Moving { times: Times { x: at_nodes, count: at_nodes.len() }, nu: 0, ..*self.moving };
            self.space.0.pull(&moving, &sources, &mut products);
        });
        for (out, products) in out.chunks_mut(size).zip(products.chunks(size)) {
            out[..4 * m].iter_mut().zip(products).for_each(|(sum, x)| *sum += x);
        }
    }

    /// The transpose of [`at_nodes`](Self::at_nodes).
    fn at_nodes_transposed(&self, width: f64, states: &[f64], cotangents: &[f64]) -> Vec<f64> {
        let len = self.moving.len;
        let mut out = vec![0.0; cotangents.len()];
        for first in (0..NODES).step_by(LANES) {
            let at: [usize; LANES] = few(|l| (first + l).min(NODES - 1));
            let state = State::read(states, len, at);
            let mut cotangent = vec![Lane::ZERO; len];
            gather(at.map(|j| &cotangents[j * len..][..len]), &mut cotangent);
            let [by_e, by_slope] = self.covariant_transposed(&state, &cotangent);
            for l in 0..LANES.min(NODES - first) {
                let j = at[l];
                for c in 0..len {
                    out[j * len + c] += by_e[c].as_array()[l];
                    for (k, weight) in INTERPOLATION.slopes[j].iter().enumerate() {
                        out[k * len + c] += weight / width * by_slope[c].as_array()[l];
                    }
                }
            }
        }
        out
    }
}
