//! Laws of moving frames, and of the C² condition at the origin.

use super::draw::{Draw, combined, exp, length, log, minus, norm, rounding, scaled, tangent_at};
use super::verdict::{Verdict, within};
use crate::curve::{self, Curves, Times, motion_len};
use crate::scalar::{Dual, Lane, lane};
use crate::space::{Ambient, Erased, Frame, Origin};

struct Moving<'a> {
    space: &'a Erased<'a>,
    frame: Vec<Lane>,
    p: Vec<Lane>,
}

impl<'a> Moving<'a> {
    fn at(space: &'a Erased<'a>, p: &[Lane]) -> Self {
        let mut frame = vec![Lane::ZERO; space.frame_len()];
        space.lift(p, &mut frame);
        Moving { space, frame, p: p.to_vec() }
    }

    /// One step to q; returns the chord.
    fn step(&mut self, q: &[Lane]) -> Vec<Lane> {
        let mut chord = vec![Lane::ZERO; self.space.dim()];
        self.space.step(&mut self.frame, &self.p, q, &mut chord);
        self.p = q.to_vec();
        chord
    }

    fn coordinates(&self, v: &[Lane]) -> Vec<Lane> {
        let mut x = vec![Lane::ZERO; self.space.dim()];
        self.space.coordinates(&self.frame, &self.p, v, &mut x);
        x
    }

    fn tangent(&self, x: &[Lane]) -> Vec<Lane> {
        let mut v = vec![Lane::ZERO; self.p.len()];
        self.space.tangent(&self.frame, &self.p, x, &mut v);
        v
    }
}

/// The frame is one: coordinates and vectors are inverse, and lengths the same.
fn is_frame(moving: &Moving, draw: &mut Draw, allowed: Lane) -> Verdict {
    let x = draw.unit(moving.space);
    let v = moving.tangent(&x);
    within(norm(&minus(&moving.coordinates(&v), &x)), allowed, "coordinates of a vector")?;
    let mut w = v.clone();
    moving.space.velocity(&moving.p, &mut w);
    within(norm(&minus(&w, &v)), allowed * norm(&v), "normal part of a vector")?;
    if moving.space.curvature().is_nan() {
        return Ok(());
    }
    within((length(moving.space, &moving.p, &v) - Lane::ONE).abs(), allowed, "length of a vector")
}

pub fn coordinates(space: &Erased, draw: &mut Draw) -> Verdict {
    let p = draw.point(space);
    is_frame(&Moving::at(space, &p), draw, rounding(space, 30.0 * p.len() as f64, &[&p], &[]))
}

pub fn parallel(space: &Erased, draw: &mut Draw) -> Verdict {
    for part in [1e-9, 1e-3, 0.2, 0.7, 0.99] {
        let p = draw.point(space);
        let mut moving = Moving::at(space, &p);
        let (x, y) = (draw.coordinates(space, part), draw.unit(space));
        let (v, w) = (moving.tangent(&x), moving.tangent(&y));
        let q = exp(space, &p, &v);
        let q = draw.representative(space, &q);
        let allowed = rounding(space, 500.0, &[&p, &q], &x) * lane(1.0 / (1.0 - part));
        let chord = moving.step(&q);
        within(norm(&minus(&chord, &x)), allowed, &format!("chord at {part} of the largest step"))?;
        let mut transported = vec![Lane::ZERO; p.len()];
        space.parallel_transport(&p, &q, &log(space, &p, &q).0, &w, &mut transported);
        within(
            norm(&minus(&moving.coordinates(&transported), &y)),
            allowed * lane(10.0),
            &format!("coordinates of what is transported at {part} of the largest step"),
        )?;
    }
    Ok(())
}

pub fn long_walk(space: &Erased, draw: &mut Draw) -> Verdict {
    let home = draw.point(space);
    let mut p = home.clone();
    let mut moving = Moving::at(space, &p);
    for knot in 1..=607 {
        // Around one point: a walk in an unbounded space would leave the range of floating-point numbers, and in a
        // space with an indefinite metric no geodesic may lead back.
        p = exp(space, &home, &draw.vector(space, &home, 0.1));
        space.project(&mut p);
        moving.step(&p);
        // As often as in the fit.
        if knot % space.dim().max(8) == 0 {
            space.reorthonormalize(&mut moving.frame, &moving.p);
        }
    }
    // An error of the frame is amplified eightfold in the jump of the acceleration. Frames of motions and of
    // invertible matrices grow along the polygon.
    let grown = if space.curvature().is_nan() {
        lane(40.0) * norm(&moving.frame) * norm(&moving.frame)
    } else {
        Lane::ONE
    };
    is_frame(&moving, draw, rounding(space, 10.0, &[&p], &[]) * grown)
}

/// A chord and two handles, and w⁺ and w⁻.
fn segment(space: &Erased, draw: &mut Draw, part: f64) -> [Vec<Lane>; 5] {
    let d = draw.coordinates(space, part);
    let [a, b] = [(); 2].map(|()| {
        let handle = draw.coordinates(space, 0.2 * part);
        combined(&scaled(&d, 1.0 / 3.0), 1.0, &handle)
    });
    let [plus, minus] = legs_of(space, &d, &a, &b);
    [d, a, b, plus, minus]
}

fn legs_of(space: &Erased, d: &[Lane], a: &[Lane], b: &[Lane]) -> [Vec<Lane>; 2] {
    let mut prepared = vec![Lane::ZERO; space.chord_len()];
    space.prepare(d, &mut prepared);
    let mut w = [vec![Lane::ZERO; d.len()], vec![Lane::ZERO; d.len()]];
    let [plus, minus] = &mut w;
    space.inner_handles(d, &prepared, a, b, plus, minus);
    w
}

pub fn inner_handles(space: &Erased, draw: &mut Draw) -> Verdict {
    for part in [1e-6, 1e-2, 0.3, 0.6] {
        let [d, a, b, plus, minus_leg] = segment(space, draw, part);
        let p = draw.point(space);
        let first = Moving::at(space, &p);
        let q = exp(space, &p, &first.tangent(&d));
        let mut last = Moving::at(space, &p);
        last.step(&q);
        // w = log_p(E_p(−v)·q⁻), v = log_p(q⁺), and mirrored: (16).
        for (here, there, handle, other, w) in [
            (&first, &last, &a, scaled(&b, -1.0), &plus),
            (&last, &first, &scaled(&b, -1.0), a.clone(), &minus_leg),
        ] {
            let control = exp(space, &there.p, &there.tangent(&other));
            let mut moved = vec![Lane::ZERO; p.len()];
            space.transvect(&here.p, &scaled(&here.tangent(handle), -1.0), &control, &mut moved);
            let expected = here.coordinates(&log(space, &here.p, &moved).0);
            let allowed = rounding(space, 500.0, &[&p, &q, &control, &moved], &d);
            within(norm(&minus(w, &expected)), allowed, &format!("w at {part} of the largest step"))?;
        }
    }
    Ok(())
}

/// ⟨λ, motion of the samples⟩ = ⟨transpose of λ, motion of the control points⟩.
pub fn transposed_motion(space: &Erased, draw: &mut Draw) -> Verdict {
    let (m, len) = (space.dim(), space.point_len());
    let first = |x: &[Lane]| x.iter().map(|x| x.as_array()[0]).collect::<Vec<f64>>();
    for part in [1e-6, 0.1, 0.4] {
        let p = draw.point(space);
        let d = draw.coordinates(space, part);
        let start = Moving::at(space, &p);
        let q = exp(space, &p, &start.tangent(&d));
        let mut end = Moving::at(space, &p);
        end.step(&q);
        // Velocities that differ from the chord by a fifth of its length.
        let size = norm(&d) * lane(0.2);
        let mut velocity = |at: &Moving| {
            let bend: Vec<Lane> = draw.unit(space).iter().zip(&d).map(|(x, d)| *x * size + *d).collect();
            at.tangent(&scaled(&bend, 0.5))
        };
        let velocities = [first(&velocity(&start)), first(&velocity(&end))].concat();
        let (points, frames) =
            ([first(&p), first(&q)].concat(), [first(&start.frame), first(&end.frame)].concat());
        let (t, x) = ([1.0, 3.0], [1.0, 1.3, 1.9, 2.5, 2.9, 3.0]);
        let curve = Curves { t: &t, nodes: 2, points: &points, velocities: &velocities, before: &[] };
        let times = Times { x: &x, count: x.len() };
        let moving =
            curve::Moving { curve, times, frames: &frames, runs: 1, nu: 0, apart: false, dim: m, len };
        let motions = first(&draw.noise(motion_len(m)));
        let cotangents = first(&draw.noise(x.len() * len));
        let (mut moved, mut products) = (vec![0.0; x.len() * len], vec![0.0; motion_len(m)]);
        space.0.push(&moving, &motions, &mut moved);
        space.0.pull(&moving, &cotangents, &mut products);
        let sums = |a: &[f64], b: &[f64]| {
            a.iter().zip(b).fold((0.0, 0.0), |(sum, size), (a, b)| (sum + a * b, size + (a * b).abs()))
        };
        let ((forth, size), (back, _)) = (sums(&cotangents, &moved), sums(&products, &motions));
        let allowed = rounding(space, 500.0, &[&p, &q], &d) * lane(size);
        within(lane((forth - back).abs()), allowed, &format!("transpose at {part} of the largest step"))?;
    }
    Ok(())
}

pub fn duals(space: &Erased, draw: &mut Draw) -> Verdict {
    let [d, a, b, ..] = segment(space, draw, 0.4);
    let (x, y) = (draw.unit(space), draw.unit(space));
    let mut prepared = vec![Lane::ZERO; space.chord_len()];
    space.prepare(&d, &mut prepared);
    let seeded =
        |v: &[Lane], d: &[Lane]| -> Vec<Dual> { v.iter().zip(d).map(|(&v, &d)| Dual { v, d }).collect() };
    let mut w = [seeded(&d, &d), seeded(&d, &d)];
    {
        let [plus, minus] = &mut w;
        space.inner_handles(&d, &prepared, &seeded(&a, &x), &seeded(&b, &y), plus, minus);
    }
    let step = 1e-3;
    // Richardson's extrapolation of central differences.
    let slope = |h: f64| {
        let at = |s: f64| legs_of(space, &d, &combined(&a, s, &x), &combined(&b, s, &y));
        let (forth, back) = (at(h), at(-h));
        [0, 1].map(|k| scaled(&minus(&forth[k], &back[k]), 0.5 / h))
    };
    let (fine, coarse) = (slope(step), slope(2.0 * step));
    for k in 0..2 {
        let expected = scaled(&combined(&scaled(&fine[k], 4.0), -1.0, &coarse[k]), 1.0 / 3.0);
        let found: Vec<Lane> = w[k].iter().map(|w| w.d).collect();
        // The error of the difference is about h⁴.
        within(norm(&minus(&found, &expected)), lane(1e-9) * space.condition(&d), "derivative of w")?;
    }
    Ok(())
}

pub fn angle(space: &Erased, draw: &mut Draw) -> Verdict {
    if !space.cut_angle().is_finite() {
        return Ok(());
    }
    for part in [0.9, 0.99, 0.9999] {
        let (p, x) = (draw.point(space), draw.coordinates(space, part));
        let q = exp(space, &p, &tangent_at(space, &p, &x));
        let limit = space.cut_angle();
        let (_, found) = log(space, &p, &q);
        // Directions without an angle are drawn by length.
        let expected = space.angle(&x);
        let turned = expected.simd_gt(lane(0.5 * part * limit));
        let off = turned.select((found - expected).abs(), Lane::ZERO);
        within(off, lane(1e-12 / (1.0 - part)), &format!("angle at {part} of the limit"))?;
    }
    Ok(())
}

pub fn condition(space: &Erased, draw: &mut Draw) -> Verdict {
    // Accurate up to the growth of errors.
    let far = if space.cut_angle().is_finite() { 0.6 } else { 2.5 };
    for part in [0.1, 0.3, far] {
        let [d, a, b, plus, minus_leg] = segment(space, draw, part);
        // A few ulps, because rounding during the transport matters, too.
        let change = 16.0 * f64::EPSILON;
        let nudge = |x: &[Lane], draw: &mut Draw| combined(x, change, &draw.unit(space));
        let moved = legs_of(space, &nudge(&d, draw), &nudge(&a, draw), &nudge(&b, draw));
        let grown = norm(&minus(&moved[0], &plus)).max(norm(&minus(&moved[1], &minus_leg))) / lane(change);
        within(
            grown,
            lane(30.0) * space.condition(&d),
            &format!("growth of errors at {part} of the largest step"),
        )?;
    }
    Ok(())
}
