//! Derivatives in time of the motion of a curve, and the transpose, where the formulas of a space do not give them.
//!
//! With the motion e(τ) of the curve in units of a segment, D_ε γ_τ = De and D_ε ∇γ_τ = D²e + R(e, γ_τ)γ_τ. On a segment, e is a
//! smooth function of τ, which is interpolated at Chebyshev nodes (Trefethen, *Approximation Theory and Approximation
//! Practice*, 2013, chapters 2 and 21). For arrays γ the acceleration is L(γ'') + Q(γ', γ') with a linear map L and a quadratic
//! form Q that depend on the point, so that De = L(e') + Q(γ', e). The transpose takes the same steps in reverse order.

use crate::curve::{Connection, Curves, Moving, Outside, Quantity, Times, evaluate, motion_len};
use crate::monitor::{Monitor, checkpoint};
use crate::scalar::{LANES, Lane, dot, few, gather, lane, scatter};
use crate::space::{Ambient, Erased, Frame, Origin};
use std::f64::consts::PI;
use std::sync::LazyLock;

/// The number of nodes.
const NODES: usize = 24;
/// The nodes reach beyond the ends of an interval by this part of its length, because differentiation near the first and last
/// node multiplies rounding errors by the fourth power of their number, and elsewhere by the square.
const BEYOND: f64 = 0.125;
/// Coefficients up to this, relative to the largest, are rounding errors.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// The number of coefficients of highest degree that must be rounding errors.
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

/// By node, the values of its cardinal function and of the derivative at a position per lane.
type Weights = [[Lane; NODES]; 2];

/// Interpolation on [0, 1] from the zeros of a Chebyshev polynomial by a polynomial with a number of coefficients. Coefficients
/// that are rounding errors are omitted, because differentiation would multiply them.
struct Interpolation {
    /// By degree and by node, the Chebyshev coefficients of the cardinal functions.
    coefficients: Vec<[f64; NODES]>,
    /// The weights at the nodes themselves: a node per lane, the last one is repeated.
    at_nodes: Vec<([usize; LANES], Weights)>,
}

/// By the number of coefficients.
static INTERPOLATIONS: LazyLock<Vec<Interpolation>> =
    LazyLock::new(|| (0..=NODES).map(Interpolation::new).collect());

/// cos of n times the angle of a node.
fn cosine(n: usize, node: usize) -> f64 {
    (PI * (n * (2 * node + 1)) as f64 / (2 * NODES) as f64).cos()
}

/// The nodes.
fn nodes() -> impl Iterator<Item = f64> {
    (0..NODES).map(|k| 0.5 + (0.5 + BEYOND) * cosine(1, k))
}

impl Interpolation {
    fn new(terms: usize) -> Self {
        let coefficient = |n: usize, k: usize| cosine(n, k) * if n == 0 { 1.0 } else { 2.0 } / NODES as f64;
        let coefficients = (0..terms).map(|n| std::array::from_fn(|k| coefficient(n, k))).collect();
        let mut interpolation = Interpolation { coefficients, at_nodes: Vec::new() };
        let nodes: Vec<f64> = nodes().collect();
        for first in (0..NODES).step_by(LANES) {
            let at = few(|l| (first + l).min(NODES - 1));
            let weights = interpolation.weights(Lane::new(at.map(|j| nodes[j])));
            interpolation.at_nodes.push((at, weights));
        }
        interpolation
    }

    fn weights(&self, x: Lane) -> Weights {
        let (one, two) = (Lane::ONE, lane(2.0));
        let rate = 1.0 / (0.5 + BEYOND);
        let y = (x - lane(0.5)) * lane(rate);
        // Tₙ and Uₙ₋₁; the derivative of Tₙ is n Uₙ₋₁.
        let (mut t, mut u) = ([one, y], [Lane::ZERO, one]);
        let mut weights = [[Lane::ZERO; NODES]; 2];
        for (n, coefficients) in self.coefficients.iter().enumerate() {
            let slope = u[0] * lane(rate * n as f64);
            let [values, slopes] = &mut weights;
            for ((value, by_x), c) in values.iter_mut().zip(slopes).zip(coefficients) {
                *value = t[0].mul_add(lane(*c), *value);
                *by_x = slope.mul_add(lane(*c), *by_x);
            }
            t = [t[1], (y * two).mul_sub(t[1], t[0])];
            u = [u[1], (y * two).mul_sub(u[1], u[0])];
        }
        weights
    }
}

/// How many coefficients interpolate rows of values at the nodes up to rounding errors; None if all of them do not.
fn resolved(values: &[f64], len: usize) -> Option<usize> {
    let all = &INTERPOLATIONS[NODES].coefficients;
    let mut sizes = [0.0_f64; NODES];
    let mut sums = vec![0.0; len];
    for (size, coefficients) in sizes.iter_mut().zip(all) {
        sums.fill(0.0);
        for (row, c) in values.chunks_exact(len).zip(coefficients) {
            sums.iter_mut().zip(row).for_each(|(sum, x)| *sum += c * x);
        }
        *size = sums.iter().fold(0.0, |most, x| x.abs().max(most));
        if sums.iter().any(|x| x.is_nan()) {
            // The curve may not continue as far as the nodes: those of shorter parts are nearer.
            return None;
        }
    }
    let most = |last: usize| sizes[NODES - last..].iter().fold(0.0, |most: f64, x| most.max(*x));
    let (largest, highest) = (most(NODES), most(HIGHEST));
    let flat = highest <= NOISE * largest && highest > FLAT * most(LAST);
    if highest > ROUNDING * largest && !flat {
        return None;
    }
    let errors = highest.max(0.25 * ROUNDING * largest);
    Some(1 + sizes.iter().rposition(|x| *x > errors).unwrap_or(0))
}

/// One curve.
pub struct Rates<'a> {
    pub space: &'a Erased<'a>,
    pub moving: &'a Moving<'a>,
}

/// Samples in a part of one segment, by their numbers; derivatives are with respect to τ.
struct Group {
    segment: usize,
    /// The part begins at `part` times its width.
    part: usize,
    width: f64,
    /// The number of coefficients.
    terms: usize,
    samples: Vec<usize>,
}

impl Group {
    /// The samples on the lanes, by their numbers; the last one is repeated. With them, how many are not repeated, and τ.
    fn lanes(&self, rates: &Rates) -> impl Iterator<Item = ([usize; LANES], usize, Lane)> {
        self.samples.chunks(LANES).map(|samples| {
            let at: [usize; LANES] = few(|l| samples[l.min(samples.len() - 1)]);
            let taus = at.map(|i| rates.tau(self.segment, rates.moving.times.x[i]));
            (at, samples.len(), Lane::new(taus))
        })
    }

    /// The weights of the nodes, for a number of coefficients.
    fn weights(&self, tau: Lane, terms: usize) -> Weights {
        let position = tau / lane(self.width) - lane(self.part as f64);
        let [values, slopes] = INTERPOLATIONS[terms].weights(position);
        [values, slopes.map(|x| x / lane(self.width))]
    }
}

/// Rows of values at the nodes, interpolated, and the derivatives.
fn interpolate(weights: &Weights, values: &[f64], [value, slope]: [&mut [Lane]; 2]) {
    value.fill(Lane::ZERO);
    slope.fill(Lane::ZERO);
    for (j, row) in values.chunks_exact(value.len()).enumerate() {
        for (c, x) in row.iter().enumerate() {
            value[c] = weights[0][j].mul_add(lane(*x), value[c]);
            slope[c] = weights[1][j].mul_add(lane(*x), slope[c]);
        }
    }
}

/// The transpose: adds to rows for the nodes, lane by lane.
fn spread(weights: &[Lane; NODES], vector: &[Lane], rows: &mut [Lane]) {
    for (weight, row) in weights.iter().zip(rows.chunks_exact_mut(vector.len())) {
        row.iter_mut().zip(vector).for_each(|(sum, x)| *sum = weight.mul_add(*x, *sum));
    }
}

/// Parts of segments that are resolved, and at their nodes the motions and states.
struct Resolved<'c> {
    groups: Vec<&'c Group>,
    fields: Vec<f64>,
    states: Vec<f64>,
}

/// The segments of groups as curves of their own, which continue beyond their ends, and the times of the nodes.
#[derive(Default)]
struct Parts {
    t: Vec<f64>,
    points: Vec<f64>,
    velocities: Vec<f64>,
    frames: Vec<f64>,
    x: Vec<f64>,
}

impl Parts {
    fn curves(&self) -> Curves<'_> {
        Curves { t: &self.t, nodes: 2, points: &self.points, velocities: &self.velocities, before: &[] }
    }

    fn times(&self) -> Times<'_> {
        Times { x: &self.x, count: NODES }
    }

    fn moving<'m>(&'m self, of: &Moving<'m>) -> Moving<'m> {
        let (curve, times, frames) = (self.curves(), self.times(), &self.frames);
        Moving { curve, times, frames, runs: 1, nu: 0, apart: false, ..*of }
    }
}

/// On the lanes, a point, the derivative of its array and ∇γ_τ, in units of the segment, and memory.
struct State {
    /// All three, one after the other.
    arrays: Vec<Lane>,
    connection: Connection,
    frame: Vec<Lane>,
    /// Coordinates of the velocity, of a vector, and of its bend.
    v: Vec<Lane>,
    x: Vec<Lane>,
    bent: Vec<Lane>,
    unit: Vec<Lane>,
    image: Vec<Lane>,
}

impl State {
    fn new(space: &Erased) -> Self {
        let (len, m) = (space.point_len(), space.dim());
        let zeros = |len: usize| vec![Lane::ZERO; len];
        State {
            arrays: zeros(3 * len),
            connection: Connection::new(len),
            frame: zeros(space.frame_len()),
            v: zeros(m),
            x: zeros(m),
            bent: zeros(m),
            unit: zeros(len),
            image: zeros(len),
        }
    }

    fn read(&mut self, states: &[f64], at: [usize; LANES]) {
        let len = self.arrays.len();
        gather(at.map(|i| &states[i * len..][..len]), &mut self.arrays);
    }

    fn len(&self) -> usize {
        self.unit.len()
    }

    /// ∇γ_τ.
    fn bend(&self) -> &[Lane] {
        &self.arrays[2 * self.len()..]
    }

    /// De = L(e') + Q(γ', e).
    fn covariant(&mut self, space: &Erased, e: &[Lane], slope: &[Lane], out: &mut [Lane]) {
        let (p, d) = self.arrays.split_at(e.len());
        self.connection.along(space, p, &d[..e.len()], e, slope, out);
    }

    /// The rows of the matrix of a linear map of arrays, times λ: its transpose.
    fn transpose(
        &mut self,
        cotangent: &[Lane],
        out: &mut [Lane],
        mut map: impl FnMut(&mut Self, &[Lane], &mut [Lane]),
    ) {
        let (mut unit, mut image) = (std::mem::take(&mut self.unit), std::mem::take(&mut self.image));
        for (i, out) in out.iter_mut().enumerate() {
            unit[i] = Lane::ONE;
            map(self, &unit, &mut image);
            *out = dot(&image, cotangent);
            unit[i] = Lane::ZERO;
        }
        (self.unit, self.image) = (unit, image);
    }

    /// The transpose of De: cotangent vectors for e and e'.
    fn covariant_transposed(
        &mut self,
        space: &Erased,
        cotangent: &[Lane],
        by_e: &mut [Lane],
        by_slope: &mut [Lane],
    ) {
        let len = self.len();
        self.transpose(cotangent, by_slope, |state, slope, out| {
            out.copy_from_slice(slope);
            state.connection.linear(space, &state.arrays[..len], out);
        });
        self.transpose(cotangent, by_e, |state, e, out| {
            let (p, d) = state.arrays.split_at(len);
            out.fill(Lane::ZERO);
            state.connection.add_form(space, p, &d[..len], e, out);
        });
    }

    /// Prepares [`curvature`](Self::curvature).
    fn prepare_curvature(&mut self, space: &Erased) {
        let len = self.len();
        let (p, d) = self.arrays.split_at(len);
        self.image.copy_from_slice(&d[..len]);
        space.velocity(p, &mut self.image);
        space.lift(p, &mut self.frame);
        space.coordinates(&self.frame, p, &self.image, &mut self.v);
    }

    /// `e ↦ R(e, γ_τ)γ_τ`, which is [γ_τ, [e, γ_τ]], in a frame.
    fn curvature(&mut self, space: &Erased, e: &[Lane], out: &mut [Lane]) {
        let p = &self.arrays[..e.len()];
        space.coordinates(&self.frame, p, e, &mut self.x);
        space.triple(&self.v, &self.x, &self.v, &mut self.bent);
        space.tangent(&self.frame, p, &self.bent, out);
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

    fn parts<'g>(&self, groups: impl Iterator<Item = &'g Group>) -> Parts {
        let Moving { curve, frames, len, .. } = *self.moving;
        let frame = self.space.frame_len();
        let mut parts = Parts::default();
        for group in groups {
            let Group { segment, part, width, .. } = *group;
            let ends = segment * len..(segment + 2) * len;
            // Times begin at 0, since nodes at late times would be rounded.
            let h = self.h(segment);
            parts.t.extend([0.0, h]);
            parts.points.extend_from_slice(&curve.points[ends.clone()]);
            parts.velocities.extend_from_slice(&curve.velocities[ends]);
            for e in 0..2 {
                parts.frames.extend_from_slice(&frames[self.moving.slot(segment, e) * frame..][..frame]);
            }
            parts.x.extend(nodes().map(|x| (part as f64 + x) * width * h));
        }
        parts
    }

    /// Points, derivatives of their arrays and ∇γ_τ at times of curves, in units of the segment of each.
    fn states(&self, curves: &Curves, times: &Times, segment: impl Fn(usize) -> usize) -> Vec<f64> {
        let len = self.moving.len;
        let samples = curves.points.len() / (curves.nodes * len) * times.count;
        let mut states = vec![0.0; 3 * len * samples];
        let go_on = |_| true;
        let (quantity, outside, monitor) = (Quantity::Jet, Outside::Continue, Monitor::new(&go_on));
        evaluate(self.space, curves, times, quantity, outside, &monitor, &mut states);
        for (i, state) in states.chunks_mut(3 * len).enumerate() {
            let h = self.h(segment(i));
            state[len..2 * len].iter_mut().for_each(|x| *x *= h);
            state[2 * len..].iter_mut().for_each(|x| *x *= h * h);
        }
        states
    }

    /// Passes the samples to a function, some parts of segments at a time, with the states of all samples. A part is resolved
    /// if the motion of the curve with given motions of the control points is.
    fn for_each(&self, motions: &[f64], mut work: impl FnMut(&Resolved, &[f64])) {
        let (x, len) = (self.moving.times.x, self.moving.len);
        let segments: Vec<usize> = x.iter().map(|&x| self.segment(x)).collect();
        let samples = self.states(&self.moving.curve, &self.moving.times, |i| segments[i]);
        let mut order: Vec<usize> = (0..x.len()).collect();
        order.sort_by_key(|&i| segments[i]);
        let whole = |samples: &[usize]| Group {
            segment: segments[samples[0]],
            part: 0,
            width: 1.0,
            terms: NODES,
            samples: samples.to_vec(),
        };
        let mut rest: Vec<Group> = order.chunk_by(|&i, &j| segments[i] == segments[j]).map(whole).collect();
        for halvings in 0..=HALVINGS {
            let mut rough = Vec::new();
            for groups in rest.chunks_mut(TOGETHER) {
                checkpoint();
                let fields = self.motions(groups.iter(), motions);
                let row = NODES * len;
                let (mut good, mut bad) = (Vec::new(), Vec::new());
                for (g, group) in groups.iter_mut().enumerate() {
                    let terms = resolved(&fields[g * row..][..row], len);
                    if terms.is_none() && halvings < HALVINGS {
                        bad.push(g);
                    } else {
                        group.terms = terms.unwrap_or(NODES);
                        good.push(g);
                    }
                }
                for g in bad {
                    let Group { segment, part, width, ref samples, .. } = groups[g];
                    let (right, left): (Vec<usize>, Vec<usize>) =
                        samples.iter().partition(|&&i| self.tau(segment, x[i]) / width - part as f64 >= 0.5);
                    for (half, samples) in [left, right].into_iter().enumerate() {
                        if !samples.is_empty() {
                            let (part, width) = (2 * part + half, 0.5 * width);
                            rough.push(Group { segment, part, width, terms: NODES, samples });
                        }
                    }
                }
                let groups: Vec<&Group> = good.iter().map(|&g| &groups[g]).collect();
                let mut states = Vec::new();
                // Derivatives of first order need them at samples only.
                if self.moving.nu > 1 {
                    let parts = self.parts(groups.iter().copied());
                    states = self.states(&parts.curves(), &parts.times(), |i| groups[i / NODES].segment);
                }
                let fields = good.iter().flat_map(|&g| &fields[g * row..][..row]).copied().collect();
                work(&Resolved { groups, fields, states }, &samples);
            }
            rest = rough;
        }
    }

    /// Arbitrary motions of all control points.
    fn arbitrary(&self) -> Vec<f64> {
        let (m, size) = (self.moving.dim, motion_len(self.moving.dim));
        let number = |i: usize| if i % size < 4 * m { ((i % size) as f64 * 2.399_963).cos() } else { 0.0 };
        (0..self.moving.curve.nodes * size).map(number).collect()
    }

    /// The motion of the curve at the nodes of groups.
    fn motions<'g>(&self, groups: impl Iterator<Item = &'g Group> + Clone, motions: &[f64]) -> Vec<f64> {
        let size = motion_len(self.moving.dim);
        let parts = self.parts(groups.clone());
        // No segment begins at the second knot of a part.
        let rest = vec![0.0; size];
        let rows = groups.flat_map(|group| motions[group.segment * size..][..size].iter().chain(&rest));
        let mut out = vec![0.0; parts.x.len() * self.moving.len];
        self.space.0.push(&parts.moving(self.moving), &rows.copied().collect::<Vec<f64>>(), &mut out);
        out
    }

    /// The states at the nodes of one of the groups; none for ν = 1.
    fn part<'s>(&self, states: &'s [f64], group: usize) -> &'s [f64] {
        let row = 3 * NODES * self.moving.len;
        if self.moving.nu == 1 { &[] } else { &states[group * row..][..row] }
    }

    /// De at the nodes of a part.
    fn at_nodes(&self, group: &Group, states: &[f64], field: &[f64], state: &mut State, out: &mut [f64]) {
        let len = self.moving.len;
        let [mut e, mut slope, mut change] = [(); 3].map(|()| vec![Lane::ZERO; len]);
        for ((at, weights), out) in
            INTERPOLATIONS[group.terms].at_nodes.iter().zip(out.chunks_mut(LANES * len))
        {
            state.read(states, *at);
            interpolate(weights, field, [&mut e, &mut slope]);
            slope.iter_mut().for_each(|x| *x *= lane(1.0 / group.width));
            state.covariant(self.space, &e, &slope, &mut change);
            scatter(&change, out);
        }
    }

    /// The transpose of [`at_nodes`](Self::at_nodes).
    fn at_nodes_transposed(
        &self,
        group: &Group,
        states: &[f64],
        cotangents: &[f64],
        state: &mut State,
        rows: &mut [Lane],
    ) {
        let len = self.moving.len;
        let [mut cotangent, mut by_e, mut by_slope] = [(); 3].map(|()| vec![Lane::ZERO; len]);
        for (k, (at, [values, slopes])) in INTERPOLATIONS[group.terms].at_nodes.iter().enumerate() {
            state.read(states, *at);
            gather(at.map(|j| &cotangents[j * len..][..len]), &mut cotangent);
            without_repeated(&mut cotangent, NODES - k * LANES);
            state.covariant_transposed(self.space, &cotangent, &mut by_e, &mut by_slope);
            by_slope.iter_mut().for_each(|x| *x *= lane(1.0 / group.width));
            spread(values, &by_e, rows);
            spread(slopes, &by_slope, rows);
        }
    }

    /// For ν = 1 and 2, γ_τ and ∇γ_τ at samples, and their derivatives along the curve.
    fn rates(
        &self,
        (group, tau): (&Group, Lane),
        nodes: &[f64],
        state: &mut State,
        [rate, next]: [&mut [Lane]; 2],
    ) {
        let len = self.moving.len;
        if self.moving.nu == 1 {
            rate.copy_from_slice(&state.arrays[len..2 * len]);
            self.space.velocity(&state.arrays[..len], rate);
            next.copy_from_slice(state.bend());
            return;
        }
        let [mut bend, mut slope] = [(); 2].map(|()| vec![Lane::ZERO; len]);
        // Accelerations have more coefficients.
        let weights = group.weights(tau, NODES);
        for (j, node) in nodes.chunks_exact(3 * len).enumerate() {
            for (c, x) in node[2 * len..].iter().enumerate() {
                bend[c] = weights[0][j].mul_add(lane(*x), bend[c]);
                slope[c] = weights[1][j].mul_add(lane(*x), slope[c]);
            }
        }
        rate.copy_from_slice(state.bend());
        state.covariant(self.space, &bend, &slope, next);
    }

    /// See [`Moving::push`].
    pub fn push(&self, motions: &[f64], out: &mut [f64]) {
        let (len, m) = (self.moving.len, self.moving.dim);
        let nu = self.moving.nu as i32;
        let (size, mut still) = (motion_len(m), motions.to_vec());
        // Only the motion at fixed parameters.
        still.chunks_mut(size).for_each(|row| row[4 * m..].fill(0.0));
        let mut state = State::new(self.space);
        let [mut e, mut slope, mut change, mut rate, mut next, mut bent] =
            [(); 6].map(|()| vec![Lane::ZERO; len]);
        let mut moved = vec![0.0; NODES * len];
        // For ν = 2, accelerations are interpolated as well: they are resolved where an arbitrary motion is.
        let probe = self.arbitrary();
        let tested = if nu == 1 { &still } else { &probe };
        self.for_each(tested, |Resolved { groups, fields, states }, samples| {
            let moved_nodes = (nu == 2).then(|| self.motions(groups.iter().copied(), &still));
            let fields = moved_nodes.as_ref().unwrap_or(fields);
            for (g, (group, field)) in groups.iter().zip(fields.chunks(NODES * len)).enumerate() {
                let (h, states) = (self.h(group.segment), self.part(states, g));
                let [dt, dh] = [0, 1].map(|k| motions[group.segment * size + 4 * m + k]);
                if nu == 1 {
                    moved.copy_from_slice(field);
                } else {
                    self.at_nodes(group, states, field, &mut state, &mut moved);
                }
                for (at, used, tau) in group.lanes(self) {
                    let weights = group.weights(tau, group.terms);
                    state.read(samples, at);
                    interpolate(&weights, &moved, [&mut e, &mut slope]);
                    state.covariant(self.space, &e, &slope, &mut change);
                    if nu == 2 {
                        interpolate(&weights, field, [&mut e, &mut slope]);
                        state.prepare_curvature(self.space);
                        state.curvature(self.space, &e, &mut bent);
                        change.iter_mut().zip(&bent).for_each(|(x, y)| *x += *y);
                    }
                    if dt != 0.0 || dh != 0.0 {
                        self.rates((group, tau), states, &mut state, [&mut rate, &mut next]);
                        let (shift, by_h) =
                            (tau.mul_add(lane(-dh), lane(-dt)) / lane(h), lane(-nu as f64 * dh / h));
                        for (c, change) in change.iter_mut().enumerate() {
                            *change = shift.mul_add(next[c], by_h.mul_add(rate[c], *change));
                        }
                    }
                    change.iter_mut().for_each(|x| *x *= lane(h.powi(-nu)));
                    for (l, i) in at[..used].iter().enumerate() {
                        let out = &mut out[i * len..][..len];
                        out.iter_mut().zip(&change).for_each(|(out, x)| *out = x.as_array()[l]);
                    }
                }
            }
        });
    }

    /// See [`Moving::pull`].
    pub fn pull(&self, cotangents: &[f64], out: &mut [f64]) {
        let (len, m) = (self.moving.len, self.moving.dim);
        let (nu, size) = (self.moving.nu as i32, motion_len(m));
        let probe = self.arbitrary();
        let mut state = State::new(self.space);
        let [mut cotangent, mut by_e, mut by_slope, mut rate, mut next, mut bent] =
            [(); 6].map(|()| vec![Lane::ZERO; len]);
        let [mut rows, mut direct] = [(); 2].map(|()| vec![Lane::ZERO; NODES * len]);
        let sums = |rows: &[Lane], sums: &mut [f64]| {
            sums.iter_mut().zip(rows).for_each(|(sum, x)| *sum = x.reduce_add());
        };
        self.for_each(&probe, |Resolved { groups, states, .. }, samples| {
            let mut sources = vec![0.0; groups.len() * NODES * len];
            for (g, (group, source)) in groups.iter().zip(sources.chunks_mut(NODES * len)).enumerate() {
                let (h, states) = (self.h(group.segment), self.part(states, g));
                rows.fill(Lane::ZERO);
                direct.fill(Lane::ZERO);
                let mut of_times = [Lane::ZERO; 2];
                for (at, used, tau) in group.lanes(self) {
                    let weights = group.weights(tau, group.terms);
                    state.read(samples, at);
                    gather(at.map(|i| &cotangents[i * len..][..len]), &mut cotangent);
                    without_repeated(&mut cotangent, used);
                    cotangent.iter_mut().for_each(|x| *x *= lane(h.powi(-nu)));
                    state.covariant_transposed(self.space, &cotangent, &mut by_e, &mut by_slope);
                    spread(&weights[0], &by_e, &mut rows);
                    spread(&weights[1], &by_slope, &mut rows);
                    if nu == 2 {
                        state.prepare_curvature(self.space);
                        state.transpose(&cotangent, &mut bent, |state, e, out| {
                            state.curvature(self.space, e, out)
                        });
                        spread(&weights[0], &bent, &mut direct);
                    }
                    self.rates((group, tau), states, &mut state, [&mut rate, &mut next]);
                    let [rate, next] = [&rate, &next].map(|v| dot(v, &cotangent));
                    of_times[0] -= next;
                    of_times[1] -= next.mul_add(tau, rate * lane(nu as f64));
                }
                sums(&rows, source);
                if nu == 2 {
                    rows.copy_from_slice(&direct);
                    self.at_nodes_transposed(group, states, source, &mut state, &mut rows);
                    sums(&rows, source);
                }
                let of_segment = &mut out[group.segment * size + 4 * m..][..2];
                of_segment.iter_mut().zip(of_times).for_each(|(sum, x)| *sum += x.reduce_add() / h);
            }
            let parts = self.parts(groups.iter().copied());
            let mut products = vec![0.0; 2 * groups.len() * size];
            self.space.0.pull(&parts.moving(self.moving), &sources, &mut products);
            for (group, products) in groups.iter().zip(products.chunks(2 * size)) {
                let of_segment = &mut out[group.segment * size..][..4 * m];
                of_segment.iter_mut().zip(products).for_each(|(sum, x)| *sum += x);
            }
        });
    }
}

/// Removes a vector from the lanes that repeat the last one.
fn without_repeated(vector: &mut [Lane], used: usize) {
    let on: Lane = Lane::new(few(|l| if l < used { 1.0 } else { 0.0 }));
    vector.iter_mut().for_each(|x| *x *= on);
}
