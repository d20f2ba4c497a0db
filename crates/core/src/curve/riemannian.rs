//! Riemannian cubics: the initial value problem, and its derivative.
//!
//! Let ξ, a and j be the components of γ', ∇γ' and ∇²γ' in a frame that is parallel along γ. The components of the
//! curvature R are constants, and a Riemannian cubic satisfies
//!
//! ```text
//! ξ' = a,    a' = j,    j' = −R(a, ξ)ξ                                                                         (E)
//! ```
//!
//! (Noakes, Heinzinger and Paden 1989). With g = exp(x) k in the group and g' = gξ, the curve is exp_p(x), and
//!
//! ```text
//! S(x)x' = Wξ,    W' = −R(x, C(x)x')W,    S(x) = sinh(ad_x)/ad_x,    C(x) = (cosh(ad_x) − 1)/ad_x²,             (D)
//! ```
//!
//! where W is the action of k on tangent vectors: the parallel frame is the one at p, transported along the geodesic to
//! γ and multiplied by W. On tangent vectors, ad_x² is −P with P = R(·, x)x.
//!
//! If the curve moves by the field Y, the covariant derivatives U, A, J of γ', ∇γ', ∇²γ' in this direction satisfy
//!
//! ```text
//! Y' = U,   U' = A − R(Y, ξ)ξ,   A' = J − R(Y, ξ)a,   J' = −R(Y, ξ)j − R(A, ξ)ξ − R(a, U)ξ − R(a, ξ)U.          (J)
//! ```

use crate::matrix::{Matrix, determinant};
use crate::scalar::{Lane, lane};
use crate::space::{Ambient, Erased, Frame, Origin};

/// Relative changes at which sweeps over (E) and (D), and over (J), end.
const EXACT: f64 = 1e-15;
const LINEAR: f64 = 1e-7;
/// The maximum number of sweeps.
const SWEEPS: usize = 40;
/// The number of terms of power series in P, enough for steps of 0.7 radians: 0.7/π to the power of 24 is below rounding.
const TERMS: usize = 12;

/// The curvature tensor in the frames of a space.
pub struct Curvature {
    m: usize,
    /// i, j, k, l and the l-th coordinate of R(eᵢ, eⱼ)eₖ = [eₖ, [eᵢ, eⱼ]], where it is not zero.
    entries: Vec<([usize; 4], Lane)>,
}

/// Which argument of R is missing in a matrix.
#[derive(Clone, Copy)]
enum Missing {
    First,
    Second,
    Last,
}

impl Curvature {
    /// The curvature tensor of a space. It has the same components at all points, since isometries move the frames into
    /// each other, up to a parallel transport.
    pub fn new(space: &Erased) -> Self {
        let m = space.dim();
        let unit = |i: usize| -> Vec<Lane> { (0..m).map(|k| lane(f64::from(u8::from(k == i)))).collect() };
        let units: Vec<Vec<Lane>> = (0..m).map(unit).collect();
        let (mut entries, mut product) = (Vec::new(), vec![Lane::ZERO; m]);
        if space.curvature() > 0.0 {
            for at in 0..m * m * m {
                let (i, j, k) = (at / (m * m), at / m % m, at % m);
                space.triple(&units[k], &units[i], &units[j], &mut product);
                let nonzero = product.iter().enumerate().filter(|(_, x)| x.to_array()[0] != 0.0);
                entries.extend(nonzero.map(|(l, x)| ([i, j, k, l], *x)));
            }
        }
        Curvature { m, entries }
    }

    /// `R(x, y)z`.
    fn apply(&self, x: &[Lane], y: &[Lane], z: &[Lane], out: &mut [Lane]) {
        out.fill(Lane::ZERO);
        for ([i, j, k, l], r) in &self.entries {
            out[*l] = (x[*i] * y[*j] * *r).mul_add(z[*k], out[*l]);
        }
    }

    /// Adds the matrix of R without one of its arguments, row by row.
    fn add_matrix(&self, missing: Missing, x: &[Lane], y: &[Lane], out: &mut [Lane]) {
        for ([i, j, k, l], r) in &self.entries {
            let (a, b, column) = match missing {
                Missing::First => (j, k, i),
                Missing::Second => (i, k, j),
                Missing::Last => (i, j, k),
            };
            let at = l * self.m + column;
            out[at] = (x[*a] * *r).mul_add(y[*b], out[at]);
        }
    }
}

/// Gauss points in [0, 1], and matrices of the integrals from 0 to them and to equidistant outputs, the last of which is
/// 1.
pub struct CubicRule<'a> {
    /// The points.
    pub c: &'a [f64],
    /// Integrals to the points, row by row.
    pub nodes: &'a [f64],
    /// Integrals to the outputs.
    pub outputs: &'a [f64],
}

impl CubicRule<'_> {
    /// start + the integrals of n functions, given at the Gauss points.
    fn integrate(&self, matrix: &[f64], start: Option<&[Lane]>, rates: &[Lane], out: &mut [Lane]) {
        let size = self.c.len();
        let n = rates.len() / size;
        for (row, out) in matrix.chunks_exact(size).zip(out.chunks_exact_mut(n)) {
            match start {
                Some(start) => out.copy_from_slice(start),
                None => out.fill(Lane::ZERO),
            }
            for (factor, rates) in row.iter().zip(rates.chunks_exact(n)) {
                out.iter_mut().zip(rates).for_each(|(x, r)| *x = r.mul_add(lane(*factor), *x));
            }
        }
    }

    /// The integrals to 1.
    fn last(&self) -> &[f64] {
        &self.outputs[self.outputs.len() - self.c.len()..]
    }
}

/// Initial values on segments, one per lane, of which each is integrated in several steps.
pub struct Segments<'a> {
    /// The space.
    pub space: &'a Erased<'a>,
    /// Its curvature.
    pub curvature: &'a Curvature,
    /// The quadrature.
    pub rule: CubicRule<'a>,
    /// The number of steps.
    pub steps: usize,
}

/// ξ, a, j and R(a, ξ)ξ at the Gauss points.
struct Along {
    xi: Vec<Lane>,
    a: Vec<Lane>,
    j: Vec<Lane>,
    force: Vec<Lane>,
}

impl Segments<'_> {
    /// The numbers that [`shoot`](Segments::shoot) returns per segment.
    pub fn row_len(&self) -> usize {
        let m = self.curvature.m;
        3 * m + 13 * m * m + 1
    }

    /// Follows a Riemannian cubic from p, with the coordinates of ξ, a and j in units of a step.
    ///
    /// Returns, in this order: the coordinates of −log(q) at the end, ξ and a there, all in a frame at the end; the matrix from
    /// coordinates in the frame of the space at q to those in this frame; 1 if there was no conjugate point and q can be
    /// reached, 0 if there was one, and NaN if q is at the cut locus; and the derivatives of Y, U, A and J at the end with
    /// respect to ξ, a and j, four matrices m × 3m.
    pub fn shoot(&self, p: &[Lane], q: &[Lane], start: &[Lane], out: &mut [Lane]) {
        let (space, m) = (self.space, self.curvature.m);
        let mut p = p.to_vec();
        let (mut frame, mut state) = (vec![Lane::ZERO; space.frame_len()], start[..3 * m].to_vec());
        space.lift(&p, &mut frame);
        let columns = 3 * m;
        let mut change = vec![Lane::ZERO; 4 * m * columns];
        (0..3 * m).for_each(|i| change[(m + i) * columns + i] = Lane::ONE);
        let mut regular = Lane::ONE;
        let (mut x, mut w) = (vec![Lane::ZERO; m], vec![Lane::ZERO; m * m]);
        let (head, matrices) = out.split_at_mut(3 * m + m * m + 1);
        for _ in 0..self.steps {
            let along = self.follow(&state);
            self.derivatives(&along, &mut change);
            // The derivatives of Y and U with respect to a and j.
            let rows = change[..2 * m * columns].chunks_exact(columns);
            let block: Vec<Lane> = rows.flat_map(|row| &row[m..]).copied().collect();
            let positive = determinant(&Matrix::<Lane, 1>::read(2 * m, 2 * m, &block))[0].simd_gt(Lane::ZERO);
            regular = positive.select(regular, Lane::ZERO);
            self.end(&along, &mut state);
            self.develop(&along, self.rule.last(), &mut x, &mut w);
            self.advance(&mut p, &mut frame, &x);
            // Components in the frame that was transported along the geodesic.
            state.chunks_exact_mut(m).for_each(|v| turn(&w, v, 1));
            change.chunks_exact_mut(m * columns).for_each(|v| turn(&w, v, columns));
        }
        let mut chord = vec![Lane::ZERO; m];
        let angle = space.step(&mut frame, &p, q, &mut chord);
        for c in 0..m {
            head[c] = -chord[c];
        }
        head[m..3 * m].copy_from_slice(&state[..2 * m]);
        let (turns, last) = head[3 * m..].split_at_mut(m * m);
        let mut at_q = vec![Lane::ZERO; frame.len()];
        space.lift(q, &mut at_q);
        let (mut v, mut column) = (vec![Lane::ZERO; q.len()], vec![Lane::ZERO; m]);
        for c in 0..m {
            chord.fill(Lane::ZERO);
            chord[c] = Lane::ONE;
            space.tangent(&at_q, q, &chord, &mut v);
            space.coordinates(&frame, q, &v, &mut column);
            (0..m).for_each(|l| turns[l * m + c] = column[l]);
        }
        last[0] = angle.simd_lt(lane(space.cut_angle())).select(regular, lane(f64::NAN));
        matrices.copy_from_slice(&change);
    }

    /// Points at the outputs of each step, and the integral of |a|², all in units of a step.
    pub fn points(&self, p: &[Lane], start: &[Lane], out: &mut [Lane]) {
        let (space, m, len) = (self.space, self.curvature.m, p.len());
        let count = self.rule.outputs.len() / self.rule.c.len();
        let mut p = p.to_vec();
        let (mut frame, mut state) = (vec![Lane::ZERO; space.frame_len()], start[..3 * m].to_vec());
        space.lift(&p, &mut frame);
        let (mut x, mut w) = (vec![Lane::ZERO; count * m], vec![Lane::ZERO; m * m]);
        let mut v = vec![Lane::ZERO; len];
        let (points, energy) = out.split_at_mut(self.steps * count * len);
        energy[0] = Lane::ZERO;
        for points in points.chunks_exact_mut(count * len) {
            let along = self.follow(&state);
            for (weight, a) in self.rule.last().iter().zip(along.a.chunks_exact(m)) {
                a.iter().for_each(|a| energy[0] = (*a * lane(*weight)).mul_add(*a, energy[0]));
            }
            self.end(&along, &mut state);
            self.develop(&along, self.rule.outputs, &mut x, &mut w);
            for (x, point) in x.chunks_exact(m).zip(points.chunks_exact_mut(len)) {
                space.tangent(&frame, &p, x, &mut v);
                space.ray(&p, &v, Lane::ONE, point);
            }
            self.advance(&mut p, &mut frame, &x[(count - 1) * m..]);
            state.chunks_exact_mut(m).for_each(|v| turn(&w, v, 1));
        }
    }

    /// Moves point and frame along the geodesic with the coordinates x.
    fn advance(&self, p: &mut Vec<Lane>, frame: &mut [Lane], x: &[Lane]) {
        let [mut v, mut q] = [(); 2].map(|_| vec![Lane::ZERO; p.len()]);
        self.space.tangent(frame, p, x, &mut v);
        self.space.ray(p, &v, Lane::ONE, &mut q);
        let mut chord = vec![Lane::ZERO; x.len()];
        self.space.step(frame, p, &q, &mut chord);
        self.space.reorthonormalize(frame, &q);
        *p = q;
    }

    /// Solves (E) over unit time.
    fn follow(&self, start: &[Lane]) -> Along {
        let (rule, m) = (&self.rule, self.curvature.m);
        let (xi0, rest) = start.split_at(m);
        let (a0, j0) = rest.split_at(m);
        let numbers = || vec![Lane::ZERO; rule.c.len() * m];
        let mut along = Along { xi: numbers(), a: numbers(), j: numbers(), force: numbers() };
        for (node, c) in rule.c.iter().enumerate() {
            for k in 0..m {
                along.a[node * m + k] = j0[k].mul_add(lane(*c), a0[k]);
                let mean = j0[k].mul_add(lane(0.5 * c), a0[k]);
                along.xi[node * m + k] = mean.mul_add(lane(*c), xi0[k]);
            }
        }
        let mut before = numbers();
        for _ in 0..SWEEPS {
            for (node, force) in along.force.chunks_exact_mut(m).enumerate() {
                let [a, xi] = [&along.a, &along.xi].map(|x| &x[node * m..][..m]);
                self.curvature.apply(a, xi, xi, force);
                force.iter_mut().for_each(|f| *f = -*f);
            }
            rule.integrate(rule.nodes, Some(j0), &along.force, &mut along.j);
            rule.integrate(rule.nodes, Some(a0), &along.j, &mut along.a);
            before.copy_from_slice(&along.xi);
            rule.integrate(rule.nodes, Some(xi0), &along.a, &mut along.xi);
            if settled(&along.xi, &before, EXACT) {
                break;
            }
        }
        along
    }

    /// Replaces ξ, a and j by those at the end of the step.
    fn end(&self, along: &Along, state: &mut [Lane]) {
        let mut end = vec![Lane::ZERO; self.curvature.m];
        for (state, rates) in state.chunks_exact_mut(end.len()).zip([&along.a, &along.j, &along.force]) {
            self.rule.integrate(self.rule.last(), Some(state), rates, &mut end);
            state.copy_from_slice(&end);
        }
    }

    /// Solves (D) over unit time: x at the outputs of `integrals`, and W at the end.
    fn develop(&self, along: &Along, integrals: &[f64], x_out: &mut [Lane], w_out: &mut [Lane]) {
        let (rule, m) = (&self.rule, self.curvature.m);
        let size = rule.c.len();
        let numbers = |n: usize| vec![Lane::ZERO; size * n];
        let [mut x, mut before, mut rate] = [(); 3].map(|_| numbers(m));
        let [mut w, mut spin] = [(); 2].map(|_| numbers(m * m));
        let mut one = vec![Lane::ZERO; m * m];
        (0..m).for_each(|i| one[i * (m + 1)] = Lane::ONE);
        w.chunks_exact_mut(m * m).for_each(|w| w.copy_from_slice(&one));
        rule.integrate(rule.nodes, None, &along.xi, &mut x);
        let (alpha, beta) = coefficients();
        let [mut term, mut next, mut other] = [(); 3].map(|_| vec![Lane::ZERO; m]);
        let mut omega = vec![Lane::ZERO; m * m];
        for _ in 0..SWEEPS {
            for node in 0..size {
                let (x, w) = (&x[node * m..][..m], &w[node * m * m..][..m * m]);
                multiply(w, &along.xi[node * m..][..m], &mut term);
                // x' = S⁻¹Wξ and Cx', where S = sin √P/√P and C = (1 − cos √P)/P.
                let rate = &mut rate[node * m..][..m];
                for c in 0..m {
                    (rate[c], other[c]) = (term[c] * lane(alpha[0]), term[c] * lane(beta[0]));
                }
                for k in 1..TERMS {
                    self.curvature.apply(&term, x, x, &mut next);
                    std::mem::swap(&mut term, &mut next);
                    for c in 0..m {
                        rate[c] = term[c].mul_add(lane(alpha[k]), rate[c]);
                        other[c] = term[c].mul_add(lane(beta[k]), other[c]);
                    }
                    if largest(&term).simd_le(largest(rate) * lane(0.1 * EXACT)).all() {
                        break;
                    }
                }
                omega.fill(Lane::ZERO);
                self.curvature.add_matrix(Missing::Last, x, &other, &mut omega);
                let spin = &mut spin[node * m * m..][..m * m];
                spin.fill(Lane::ZERO);
                subtract_product(&omega, w, spin);
            }
            before.copy_from_slice(&x);
            rule.integrate(rule.nodes, None, &rate, &mut x);
            rule.integrate(rule.nodes, Some(&one), &spin, &mut w);
            if settled(&x, &before, EXACT) {
                break;
            }
        }
        rule.integrate(integrals, None, &rate, x_out);
        rule.integrate(rule.last(), Some(&one), &spin, w_out);
    }

    /// Solves (J) over unit time, for four matrices m × 3m of initial values.
    fn derivatives(&self, along: &Along, change: &mut [Lane]) {
        let (rule, m) = (&self.rule, self.curvature.m);
        let (size, n) = (rule.c.len(), 3 * m * m);
        // Matrices of R(·, ξ)ξ, R(·, ξ)a, R(·, ξ)j and R(a, ·)ξ + R(a, ξ)· at the nodes.
        let mut terms = vec![Lane::ZERO; size * 4 * m * m];
        for (node, terms) in terms.chunks_exact_mut(4 * m * m).enumerate() {
            let [xi, a, j] = [&along.xi, &along.a, &along.j].map(|x| &x[node * m..][..m]);
            let mut matrices = terms.chunks_exact_mut(m * m);
            for z in [xi, a, j] {
                if let Some(out) = matrices.next() {
                    self.curvature.add_matrix(Missing::First, xi, z, out);
                }
            }
            if let Some(out) = matrices.next() {
                self.curvature.add_matrix(Missing::Second, a, xi, out);
                self.curvature.add_matrix(Missing::Last, a, xi, out);
            }
        }
        let start: Vec<Vec<Lane>> = change.chunks_exact(n).map(<[Lane]>::to_vec).collect();
        let [y0, u0, a0, j0] = [0, 1, 2, 3].map(|i| &start[i]);
        let numbers = || vec![Lane::ZERO; size * n];
        let [mut y, mut u, mut a, mut j, mut before] = [(); 5].map(|_| numbers());
        let [mut rate_u, mut rate_a, mut rate_j] = [(); 3].map(|_| numbers());
        for (node, c) in rule.c.iter().enumerate() {
            for k in 0..n {
                let at = node * n + k;
                a[at] = j0[k].mul_add(lane(*c), a0[k]);
                let mean = j0[k].mul_add(lane(c / 2.0), a0[k]);
                u[at] = mean.mul_add(lane(*c), u0[k]);
                let mean = j0[k].mul_add(lane(c / 3.0), a0[k]).mul_add(lane(c / 2.0), u0[k]);
                y[at] = mean.mul_add(lane(*c), y0[k]);
            }
        }
        for _ in 0..SWEEPS {
            for (node, terms) in terms.chunks_exact(4 * m * m).enumerate() {
                let here = node * n..(node + 1) * n;
                let matrix = |i: usize| &terms[i * m * m..][..m * m];
                rate_j[here.clone()].fill(Lane::ZERO);
                for (i, x) in [(2, &y), (3, &u), (0, &a)] {
                    subtract_product(matrix(i), &x[here.clone()], &mut rate_j[here.clone()]);
                }
            }
            rule.integrate(rule.nodes, Some(j0), &rate_j, &mut j);
            rate_a.copy_from_slice(&j);
            for (node, terms) in terms.chunks_exact(4 * m * m).enumerate() {
                let here = node * n..(node + 1) * n;
                subtract_product(&terms[m * m..][..m * m], &y[here.clone()], &mut rate_a[here]);
            }
            rule.integrate(rule.nodes, Some(a0), &rate_a, &mut a);
            rate_u.copy_from_slice(&a);
            for (node, terms) in terms.chunks_exact(4 * m * m).enumerate() {
                let here = node * n..(node + 1) * n;
                subtract_product(&terms[..m * m], &y[here.clone()], &mut rate_u[here]);
            }
            rule.integrate(rule.nodes, Some(u0), &rate_u, &mut u);
            before.copy_from_slice(&y);
            rule.integrate(rule.nodes, Some(y0), &u, &mut y);
            if settled(&y, &before, LINEAR) {
                break;
            }
        }
        for ((out, start), rates) in
            change.chunks_exact_mut(n).zip(&start).zip([&u, &rate_u, &rate_a, &rate_j])
        {
            rule.integrate(rule.last(), Some(start), rates, out);
        }
    }
}

/// Replaces an m × columns matrix x by Wx.
fn turn(w: &[Lane], x: &mut [Lane], columns: usize) {
    let before = x.to_vec();
    for (row, out) in w.chunks_exact(before.len() / columns).zip(x.chunks_exact_mut(columns)) {
        out.fill(Lane::ZERO);
        for (factor, x) in row.iter().zip(before.chunks_exact(columns)) {
            out.iter_mut().zip(x).for_each(|(o, x)| *o = factor.mul_add(*x, *o));
        }
    }
}

/// Wx for a vector x.
fn multiply(w: &[Lane], x: &[Lane], out: &mut [Lane]) {
    for (row, out) in w.chunks_exact(x.len()).zip(out) {
        *out = row.iter().zip(x).fold(Lane::ZERO, |sum, (w, x)| w.mul_add(*x, sum));
    }
}

/// Subtracts the product of an m × m matrix and a matrix x.
fn subtract_product(matrix: &[Lane], x: &[Lane], out: &mut [Lane]) {
    let m = matrix.len().isqrt();
    let columns = x.len() / m;
    for (row, out) in matrix.chunks_exact(m).zip(out.chunks_exact_mut(columns)) {
        for (factor, x) in row.iter().zip(x.chunks_exact(columns)) {
            out.iter_mut().zip(x).for_each(|(o, x)| *o = factor.mul_neg_add(*x, *o));
        }
    }
}

/// The largest of the absolute values.
fn largest(x: &[Lane]) -> Lane {
    x.iter().fold(Lane::ZERO, |most, x| most.max(x.abs()))
}

/// Whether the changes are small in relation to the largest value; also where numbers are not finite.
fn settled(x: &[Lane], before: &[Lane], part: f64) -> bool {
    let change = x.iter().zip(before).fold(Lane::ZERO, |most, (x, y)| most.max((*x - *y).abs()));
    !change.simd_gt(largest(x) * lane(part)).any()
}

/// The coefficients of √P/sin √P and tan(√P/2)/√P as power series in P: quotients of the series of 1 and
/// (1 − cos √P)/P by that of sin √P/√P.
fn coefficients() -> ([f64; TERMS], [f64; TERMS]) {
    let (mut sine, mut versine) = ([1.0; TERMS], [0.5; TERMS]);
    for k in 1..TERMS {
        let n = 2.0 * k as f64;
        sine[k] = -sine[k - 1] / (n * (n + 1.0));
        versine[k] = -versine[k - 1] / ((n + 1.0) * (n + 2.0));
    }
    let (mut alpha, mut beta) = ([1.0; TERMS], [0.0; TERMS]);
    for k in 1..TERMS {
        alpha[k] = -(1..=k).map(|i| sine[i] * alpha[k - i]).sum::<f64>();
    }
    for k in 0..TERMS {
        beta[k] = (0..=k).map(|i| versine[i] * alpha[k - i]).sum();
    }
    (alpha, beta)
}
