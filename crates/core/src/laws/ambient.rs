//! Laws of points and tangent vectors as arrays.

use super::draw::{
    Draw, STEPS, combined, distance, exp, is_other, length, log, minus, norm, rounding, scaled, step_between,
    tangent_at,
};
use super::verdict::{Verdict, within};
use crate::scalar::{Jet, LANES, Lane, lane};
use crate::space::{Ambient, Erased, Origin};

pub fn points(space: &Erased, draw: &mut Draw) -> Verdict {
    let p = draw.point(space);
    let mut q = p.clone();
    let off = space.project(&mut q);
    within(off, rounding(space, 20.0 * p.len() as f64, &[&p], &[]), "a random point is off")?;
    let again = q.clone();
    space.project(&mut q);
    if q.iter().zip(&again).any(|(a, b)| a.to_array() != b.to_array()) {
        return Err("projecting twice is not projecting once".into());
    }
    Ok(())
}

pub fn projection(space: &Erased, draw: &mut Draw) -> Verdict {
    for size in [1e-6, 0.02] {
        let p = draw.point(space);
        let noise = draw.noise(p.len());
        let largest = p.iter().fold(Lane::ONE, |m, x| m.max(x.abs()));
        let mut x: Vec<Lane> = p.iter().zip(&noise).map(|(p, n)| lane(size).mul_add(*n, *p)).collect();
        let off = space.project(&mut x);
        // From farther away a few steps of Newton's method do not reach a point.
        let near = off.simd_le(lane(0.05));
        let mut again = x.clone();
        let left = near.select(space.project(&mut again), Lane::ZERO);
        let change = near.select(norm(&minus(&again, &x)), Lane::ZERO);
        let allowed = rounding(space, 100.0 * p.len() as f64, &[&p, &x], &[]);
        within(left, allowed, &format!("off after noise of {size} was taken away"))?;
        within(change, allowed * largest, &format!("change of a point that was off by noise of {size}"))?;
    }
    Ok(())
}

pub fn tangent_projection(space: &Erased, draw: &mut Draw) -> Verdict {
    let p = draw.point(space);
    let noise = draw.noise(p.len());
    let mut v = noise.clone();
    let off = space.project_tangent(&p, &mut v);
    let allowed = rounding(space, 200.0 * p.len() as f64, &[&p], &[]);
    let mut again = v.clone();
    within(space.project_tangent(&p, &mut again), allowed, "off after the first projection")?;
    within(norm(&minus(&again, &v)), allowed * norm(&v), "change by a second projection")?;
    for scale in [1e-3, 1e3] {
        // The normal component is relative to the vector, in any unit, down to the size that counts as rounding.
        let mut w = scaled(&noise, scale);
        let part = space.project_tangent(&p, &mut w);
        within(
            (part - off).abs(),
            allowed + off * lane(1e-3),
            &format!("part that is off at {scale} of the size"),
        )?;
    }
    let mut zero = scaled(&noise, 0.0);
    space.project_tangent(&p, &mut zero);
    within(norm(&zero), Lane::ZERO, "projection of zero")
}

/// Moves along coordinates x from a random point, and to another representative of the end point.
fn way(space: &Erased, draw: &mut Draw, part: f64) -> [Vec<Lane>; 4] {
    let p = draw.point(space);
    let x = draw.coordinates(space, part);
    let v = tangent_at(space, &p, &x);
    let q = exp(space, &p, &v);
    [p, x, v, q]
}

pub fn exp_and_log(space: &Erased, draw: &mut Draw) -> Verdict {
    for part in STEPS {
        let [p, x, v, q] = way(space, draw, part);
        let q = draw.representative(space, &q);
        let (w, angle) = log(space, &p, &q);
        // Near the cut locus, rounding of q rotates the direction by this factor more.
        let near = lane(1.0 / (1.0 - part));
        let allowed = rounding(space, 300.0, &[&p, &q], &x) * near;
        within(
            length(space, &p, &minus(&w, &v)),
            allowed,
            &format!("log of exp at {part} of the largest step"),
        )?;
        let back = exp(space, &p, &w);
        within(distance(space, &back, &q), allowed, &format!("exp of log at {part} of the largest step"))?;
        if space.cut_angle().is_finite() && !angle.simd_lt(lane(space.cut_angle())).all() {
            return Err(format!("the deciding angle at {part} of the largest step is not below the limit"));
        }
        let [forth, here] = [distance(space, &p, &q), length(space, &p, &v)];
        within((forth - here).abs(), allowed, &format!("distance at {part} of the largest step"))?;
    }
    Ok(())
}

pub fn tangent(space: &Erased, draw: &mut Draw) -> Verdict {
    for part in STEPS {
        let [p, x, _, exact] = way(space, draw, part);
        let q = draw.representative(space, &exact);
        let (v, _) = log(space, &p, &q);
        let mut w = v.clone();
        space.velocity(&p, &mut w);
        // Relative to the vector itself, however short it is, if a point is a class of arrays; otherwise rounding
        // moves q off the space.
        let size = norm(&v) + if is_other(&q, &exact) { Lane::ZERO } else { Lane::ONE };
        let allowed = rounding(space, 30.0, &[&p, &q], &x) * size;
        within(norm(&minus(&v, &w)), allowed, &format!("normal part of log at {part} of the largest step"))?;
    }
    Ok(())
}

pub fn geodesics(space: &Erased, draw: &mut Draw) -> Verdict {
    for part in STEPS {
        let [p, x, v, q] = way(space, draw, part);
        let allowed = rounding(space, 300.0, &[&p, &q], &x) * lane(1.0 / (1.0 - part));
        let mut at = vec![Lane::ZERO; p.len()];
        for t in [0.0, 0.3, 0.5, 1.0] {
            space.geodesic(&p, &q, lane(t), &mut at);
            let mut there = vec![Lane::ZERO; p.len()];
            space.ray(&p, &v, lane(t), &mut there);
            within(
                distance(space, &at, &there),
                allowed,
                &format!("[p, q]_{t} at {part} of the largest step"),
            )?;
        }
        // The geodesic transports its velocity and has no acceleration, by jets in t.
        let t = Jet { v: lane(0.3), d: Lane::ONE, dd: Lane::ZERO };
        let jets = |x: &[Lane]| -> Vec<Jet> {
            x.iter().map(|&v| Jet { v, d: Lane::ZERO, dd: Lane::ZERO }).collect()
        };
        let mut gamma = jets(&p);
        space.geodesic(&jets(&p), &jets(&q), t, &mut gamma);
        motion(space, &gamma, [&p, &v], allowed, "a geodesic")?;
        space.ray(&p, &v, t, &mut gamma);
        motion(space, &gamma, [&p, &v], allowed, "a ray")?;
    }
    Ok(())
}

/// A curve through a jet at t = 0.3 has the transported velocity v of its start, and no acceleration.
fn motion(space: &Erased, gamma: &[Jet], [start, v]: [&[Lane]; 2], allowed: Lane, what: &str) -> Verdict {
    let part = |f: fn(&Jet) -> Lane| -> Vec<Lane> { gamma.iter().map(f).collect() };
    let (p, raw, mut dd) = (part(|x| x.v), part(|x| x.d), part(|x| x.dd));
    let mut d = raw.clone();
    space.velocity(&p, &mut d);
    space.acceleration(&p, &raw, &mut dd);
    let mut transported = v.to_vec();
    space.parallel_transport(start, &p, &scaled(v, 0.3), v, &mut transported);
    within(length(space, &p, &minus(&d, &transported)), allowed, &format!("velocity of {what}"))?;
    within(length(space, &p, &dd), allowed * lane(10.0), &format!("acceleration of {what}"))
}

pub fn transvections(space: &Erased, draw: &mut Draw) -> Verdict {
    for part in [1e-6, 0.1, 0.4] {
        let [p, x, v, q] = way(space, draw, part);
        let w = draw.vector(space, &p, 0.2);
        let y = exp(space, &p, &w);
        let mut moved = vec![Lane::ZERO; p.len()];
        space.transvect(&p, &v, &y, &mut moved);
        // (10): the symmetry at p, then that at the middle of p and q.
        let symmetry = |o: &[Lane], y: &[Lane]| exp(space, o, &scaled(&log(space, o, y).0, -1.0));
        let middle = exp(space, &p, &scaled(&v, 0.5));
        let expected = symmetry(&middle, &symmetry(&p, &y));
        let allowed = rounding(space, 1000.0, &[&p, &q, &y, &expected], &x);
        within(
            distance(space, &moved, &expected),
            allowed,
            &format!("E_p(v) at {part} of the largest step"),
        )?;
        space.transvect(&p, &v, &p, &mut moved);
        within(distance(space, &moved, &q), allowed, "E_p(v) of p")?;
    }
    Ok(())
}

pub fn transport(space: &Erased, draw: &mut Draw) -> Verdict {
    for part in [1e-6, 0.1, 0.6, 0.95] {
        let [p, x, _, q] = way(space, draw, part);
        let q = draw.representative(space, &q);
        let (v, _) = log(space, &p, &q);
        let (a, b) = (draw.vector(space, &p, 0.1), draw.vector(space, &p, 0.1));
        let transported = |a: &[Lane]| {
            let mut out = vec![Lane::ZERO; p.len()];
            space.parallel_transport(&p, &q, &v, a, &mut out);
            out
        };
        let (at, bt) = (transported(&a), transported(&b));
        let allowed = rounding(space, 300.0, &[&p, &q], &x) * lane(1.0 / (1.0 - part));
        // K is NaN if the space has no metric.
        if !space.curvature().is_nan() {
            let change = (space.inner(&p, &a, &b) - space.inner(&q, &at, &bt)).abs();
            within(change, allowed, "inner product of what is transported")?;
        }
        let mut tangent = at.clone();
        space.velocity(&q, &mut tangent);
        within(
            norm(&minus(&tangent, &at)),
            allowed * norm(&at).max(Lane::ONE),
            "normal part of what is transported",
        )?;
        // A geodesic transports its own velocity: to minus the logarithm of its start.
        let back = log(space, &q, &p).0;
        within(
            length(space, &q, &combined(&transported(&v), 1.0, &back)),
            allowed * lane(10.0),
            "velocity transported along",
        )?;
    }
    Ok(())
}

pub fn turning(space: &Erased, draw: &mut Draw) -> Verdict {
    let (k, d) = (space.fiber_rank(), if space.is_complex() { 2 } else { 1 });
    if k == 0 {
        return Ok(());
    }
    // A geodesic X at t = 0, and the same lines at X e^{tA} with a skew-Hermitian A.
    let p = draw.point(space);
    let v = draw.vector(space, &p, 0.3);
    let mut gamma: Vec<Jet> = p.iter().map(|&v| Jet { v, d: Lane::ZERO, dd: Lane::ZERO }).collect();
    space.ray(&p, &v, Jet { v: Lane::ZERO, d: Lane::ONE, dd: Lane::ZERO }, &mut gamma);
    let noise = draw.noise(k * k * d);
    let entry = |m: &[Lane], i: usize, j: usize| -> [Lane; 2] {
        let at = (i * k + j) * d;
        [m[at], if d == 2 { m[at + 1] } else { Lane::ZERO }]
    };
    let times_a = |x: &[Lane]| -> Vec<Lane> {
        let mut out = vec![Lane::ZERO; x.len()];
        for (i, j, l) in (0..x.len() / d * k).map(|c| (c / k / k, c / k % k, c % k)) {
            let ([a, b], [e, f], [x, y]) = (entry(&noise, l, j), entry(&noise, j, l), entry(x, i, l));
            let (re, im) = (a - e, b + f);
            out[(i * k + j) * d] += x * re - y * im;
            if d == 2 {
                out[(i * k + j) * d + 1] += x * im + y * re;
            }
        }
        out
    };
    let part = |f: fn(&Jet) -> Lane| -> Vec<Lane> { gamma.iter().map(f).collect() };
    let (x, dx, ddx) = (part(|x| x.v), part(|x| x.d), part(|x| x.dd));
    let xa = times_a(&x);
    let raw = combined(&dx, 1.0, &xa);
    let mut turned = combined(&combined(&ddx, 2.0, &times_a(&dx)), 1.0, &times_a(&xa));
    let size = norm(&turned).max(Lane::ONE);
    let mut velocity = raw.clone();
    space.velocity(&x, &mut velocity);
    space.acceleration(&x, &raw, &mut turned);
    let allowed = rounding(space, 100.0, &[&p], &[]) * size;
    within(norm(&minus(&velocity, &v)), allowed, "velocity at a representative that turns")?;
    within(norm(&turned), allowed, "acceleration at a representative that turns")
}

pub fn derivatives(space: &Erased, draw: &mut Draw) -> Verdict {
    // The test includes logarithms beyond the power series, where the differences are less accurate.
    derivatives_at(space, draw, 0.3, 1.0)?;
    derivatives_at(space, draw, 0.7, 100.0)
}

fn derivatives_at(space: &Erased, draw: &mut Draw, part: f64, loose: f64) -> Verdict {
    // Between points that move, the second derivative of the array by differences of the first.
    let p = draw.point(space);
    let [u, v] = [(); 2].map(|()| draw.vector(space, &p, 0.3));
    let x = draw.coordinates(space, part);
    let w = tangent_at(space, &p, &x);
    let q = exp(space, &p, &w);
    let transported = {
        let mut out = vec![Lane::ZERO; p.len()];
        space.parallel_transport(&p, &q, &w, &v, &mut out);
        out
    };
    let at = |s: f64| -> Vec<Jet> {
        let t = Jet { v: lane(s), d: Lane::ONE, dd: Lane::ZERO };
        let mut ends =
            [&p, &q].map(|p| p.iter().map(|&v| Jet { v, d: Lane::ZERO, dd: Lane::ZERO }).collect::<Vec<_>>());
        space.ray(&p, &u, t, &mut ends[0]);
        space.ray(&q, &transported, t, &mut ends[1]);
        let mut out = ends[0].clone();
        let tau = Jet { v: lane(0.4 + 0.1 * s), d: lane(0.1), dd: Lane::ZERO };
        space.geodesic(&ends[0], &ends[1], tau, &mut out);
        out
    };
    // Differences of order eight.
    const STEP: f64 = 0.005;
    const WEIGHTS: [f64; 4] = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];
    let here = at(0.0);
    let (mut d, mut dd) = (vec![Lane::ZERO; p.len()], vec![Lane::ZERO; p.len()]);
    for (k, w) in WEIGHTS.into_iter().enumerate() {
        let r = STEP * (k + 1) as f64;
        let (a, b) = (at(r), at(-r));
        let values = |x: &[Jet]| x.iter().map(|x| x.v).collect::<Vec<_>>();
        let steps = step_between(&values(&a), &values(&b));
        for ((d, dd), (step, (a, b))) in d.iter_mut().zip(&mut dd).zip(steps.iter().zip(a.iter().zip(&b))) {
            *d += *step * lane(w / STEP);
            *dd += (a.d - b.d) * lane(w / STEP);
        }
    }
    let scale = norm(&here.iter().map(|x| x.v).collect::<Vec<_>>());
    let allowed = rounding(space, loose * 3000.0 / STEP, &[&p, &q], &x) * scale.max(Lane::ONE);
    within(
        norm(&minus(&d, &here.iter().map(|x| x.d).collect::<Vec<_>>())),
        allowed,
        "first derivative of [p, q]_t",
    )?;
    within(
        norm(&minus(&dd, &here.iter().map(|x| x.dd).collect::<Vec<_>>())),
        allowed * lane(10.0),
        "second derivative of [p, q]_t",
    )
}

pub fn not_finite(space: &Erased, draw: &mut Draw) -> Verdict {
    let (p, mut q) = (draw.point(space), draw.point(space));
    q[0] = lane(f64::NAN);
    let (v, angle) = log(space, &p, &q);
    let found = angle.is_nan() | v.iter().fold(Lane::ZERO, |any, x| any | x.is_nan());
    let mut r = q.clone();
    let off = space.project(&mut r);
    if !found.all() {
        return Err("log of NaN is a number".into());
    }
    if off.simd_le(Lane::ONE).any() {
        return Err("NaN counts as a point".into());
    }
    Ok(())
}

pub fn lanes(space: &Erased, draw: &mut Draw) -> Verdict {
    (0..STEPS.len()).step_by(LANES).try_for_each(|first| lanes_from(space, draw, first))
}

/// Steps of very different lengths in the lanes, and each beside copies of itself.
fn lanes_from(space: &Erased, draw: &mut Draw, first: usize) -> Verdict {
    let p = draw.point(space);
    let x = draw.coordinates(space, 1.0);
    // The next step is in a distant part of the list.
    let parts = Lane::new(std::array::from_fn(|l| STEPS[(first + 3 * l) % STEPS.len()]));
    let x: Vec<Lane> = x.iter().map(|x| *x * parts).collect();
    let v = tangent_at(space, &p, &x);
    let q = exp(space, &p, &v);
    let (w, _) = log(space, &p, &q);
    let mut far = x.clone();
    space.stretch(&x, &mut far);
    for l in 0..LANES {
        let alone = |x: &[Lane]| -> Vec<Lane> { x.iter().map(|x| lane(x.as_array()[l])).collect() };
        let same = |a: &[Lane], b: &[Lane]| {
            a.iter().zip(b).all(|(a, b)| a.as_array()[0].to_bits() == b.as_array()[l].to_bits())
        };
        let mut stretched = alone(&x);
        space.stretch(&alone(&x), &mut stretched);
        if !same(&exp(space, &alone(&p), &alone(&v)), &q)
            || !same(&log(space, &alone(&p), &alone(&q)).0, &w)
            || !same(&stretched, &far)
        {
            return Err(format!("lane {l} has other bits beside its neighbours"));
        }
    }
    Ok(())
}
