//! Laws of the triple product.

use super::draw::{Draw, combined, exp, minus, norm, rounding, scaled, step_between, tangent_at};
use super::verdict::{Verdict, within};
use crate::scalar::{Lane, dot, lane};
use crate::space::{Ambient, Erased, Frame, Origin};

fn triple(space: &Erased, a: &[Lane], b: &[Lane], c: &[Lane]) -> Vec<Lane> {
    let mut out = vec![Lane::ZERO; a.len()];
    space.triple(a, b, c, &mut out);
    out
}

fn sum(a: &[Lane], b: &[Lane]) -> Vec<Lane> {
    combined(a, 1.0, b)
}

pub fn lie_triple(space: &Erased, draw: &mut Draw) -> Verdict {
    let [a, b, c, d, e] = [(); 5].map(|()| draw.unit(space));
    let t = |a: &[Lane], b: &[Lane], c: &[Lane]| triple(space, a, b, c);
    let allowed = lane(100.0 * f64::EPSILON);
    within(norm(&sum(&t(&a, &b, &c), &t(&a, &c, &b))), allowed, "[a, [b, c]] + [a, [c, b]]")?;
    let cyclic = sum(&sum(&t(&a, &b, &c), &t(&b, &c, &a)), &t(&c, &a, &b));
    within(norm(&cyclic), allowed, "Jacobi's identity")?;
    // D = [[d, e], ·] is a derivation of [a, [b, c]].
    let derive = |x: &[Lane]| scaled(&t(x, &d, &e), -1.0);
    let rule = sum(&sum(&t(&derive(&a), &b, &c), &t(&a, &derive(&b), &c)), &t(&a, &b, &derive(&c)));
    within(norm(&minus(&derive(&t(&a, &b, &c)), &rule)), allowed, "the rule of products")
}

pub fn holonomy(space: &Erased, draw: &mut Draw) -> Verdict {
    // Transport around a small triangle rotates a vector by its area times the curvature. The mean over both
    // orientations and two sizes leaves an error of fourth order.
    let p = draw.point(space);
    let [a, b, c] = [(); 3].map(|()| draw.unit(space));
    let mut home = vec![Lane::ZERO; space.frame_len()];
    space.lift(&p, &mut home);
    let turn = |size: f64| {
        let corner = |x: &[Lane]| exp(space, &p, &tangent_at(space, &p, &scaled(x, size)));
        let (q, r) = (corner(&a), corner(&b));
        let around = |points: [&[Lane]; 3]| {
            let mut frame = home.clone();
            let mut chord = vec![Lane::ZERO; a.len()];
            let mut from = &p[..];
            for to in points {
                space.step(&mut frame, from, to, &mut chord);
                from = to;
            }
            let (mut v, mut x) = (vec![Lane::ZERO; p.len()], vec![Lane::ZERO; a.len()]);
            space.tangent(&home, &p, &c, &mut v);
            space.coordinates(&frame, &p, &v, &mut x);
            x
        };
        // Twice the area is size².
        scaled(&minus(&around([&q, &r, &p]), &around([&r, &q, &p])), 1.0 / (size * size))
    };
    let (fine, coarse) = (turn(0.02), turn(0.04));
    let found = scaled(&combined(&scaled(&fine, 4.0), -1.0, &coarse), 1.0 / 3.0);
    // In the frame after the triangle c is rotated back: by R(a, b)c = [c, [a, b]].
    let expected = triple(space, &c, &a, &b);
    let allowed = lane(3e-6) + rounding(space, 1e5, &[&p], &[]);
    within(norm(&minus(&found, &expected)), allowed, "turn around a triangle")
}

pub fn largest_curvature(space: &Erased, draw: &mut Draw) -> Verdict {
    let k = space.curvature();
    if k.is_nan() {
        return Ok(());
    }
    // K² = sup |[[a, b], c]| over unit vectors, (22), by alternately maximising over one of them.
    let mut best = Lane::ZERO;
    for _ in 0..8 {
        let [mut a, mut b, mut c] = [(); 3].map(|()| draw.unit(space));
        let mut size = Lane::ZERO;
        for _ in 0..60 {
            let d = triple(space, &c, &a, &b);
            size = norm(&d);
            if size.simd_eq(Lane::ZERO).any() {
                break;
            }
            let unit = |x: &[Lane]| {
                let scale = Lane::ONE / dot(x, x).sqrt();
                x.iter().map(|x| *x * scale).collect::<Vec<Lane>>()
            };
            // ⟨[c, [a, b]], d⟩ = ⟨[a, [c, d]], b⟩ = −⟨[b, [c, d]], a⟩ = −⟨[d, [a, b]], c⟩
            let d = unit(&d);
            c = unit(&scaled(&triple(space, &d, &a, &b), -1.0));
            b = unit(&triple(space, &a, &c, &d));
            a = unit(&scaled(&triple(space, &b, &c, &d), -1.0));
        }
        best = best.max(size);
    }
    let best = best.to_array().into_iter().fold(0.0, f64::max).sqrt();
    // Zero in flat spaces; in others the iteration ends within a millionth.
    if (best - k).abs() > 1e-5 {
        return Err(format!("it is {best:.9}, and the space says {k:.9}"));
    }
    Ok(())
}

pub fn stretch(space: &Erased, draw: &mut Draw) -> Verdict {
    for part in [1e-3, 0.1, 0.5] {
        // S(v)x = Σ ad²ʲ x/(2j+1)!
        let (v, x) = (draw.coordinates(space, part), draw.unit(space));
        let mut found = x.clone();
        space.stretch(&v, &mut found);
        let (mut expected, mut term) = (x.clone(), x.clone());
        for j in 1..40 {
            term = scaled(&triple(space, &v, &v, &term), 1.0 / ((2 * j) * (2 * j + 1)) as f64);
            expected = sum(&expected, &term);
        }
        let size = norm(&expected).max(Lane::ONE);
        within(norm(&minus(&found, &expected)), lane(50.0 * f64::EPSILON) * size, "S(v)x by its series")?;
        // S(v) = E_p(−v) ∘ D exp_p(v): how the end moves, transported back, by differences of order eight.
        let p = draw.point(space);
        let at = |s: f64| exp(space, &p, &tangent_at(space, &p, &combined(&v, s, &x)));
        let q = at(0.0);
        let mut moved = vec![Lane::ZERO; p.len()];
        for (k, w) in [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0].into_iter().enumerate() {
            let r = 0.01 * (k + 1) as f64;
            moved = sum(&moved, &scaled(&step_between(&at(r), &at(-r)), w / 0.01));
        }
        space.velocity(&q, &mut moved);
        let (mut frame, mut chord) = (vec![Lane::ZERO; space.frame_len()], vec![Lane::ZERO; x.len()]);
        space.lift(&p, &mut frame);
        space.step(&mut frame, &p, &q, &mut chord);
        let mut slope = vec![Lane::ZERO; x.len()];
        space.coordinates(&frame, &q, &moved, &mut slope);
        let allowed = rounding(space, 1e5, &[&p, &q], &v) * size;
        within(norm(&minus(&slope, &found)), allowed, &format!("D exp at {part} of the largest step"))?;
    }
    Ok(())
}
