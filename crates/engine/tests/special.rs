//! The special functions against values of 40 digits (`reference/make_special.py`).

use symspline_engine::scalar::{Jet, Lane, few, lane};
use symspline_engine::special::{Trig, arc_defect, slerp, theta_over_sin};

const REFERENCE: &str = include_str!("reference/special.csv");

fn jet(x: f64) -> Jet {
    Jet { v: lane(x), d: Lane::ONE, dd: Lane::ZERO }
}

fn first(x: Lane) -> f64 {
    x.to_array()[0]
}

fn rows() -> impl Iterator<Item = (&'static str, f64, [f64; 3])> {
    REFERENCE.lines().map(|line| {
        let mut cells = line.split(',');
        let name = cells.next().unwrap();
        let numbers: Vec<f64> = cells.map(|c| c.parse().unwrap()).collect();
        (name, numbers[0], [numbers[1], numbers[2], numbers[3]])
    })
}

/// A few units in the last place of the function's size near x. Zeros of cos and sin are as accurate as their
/// argument, and √x has an error of half a unit.
fn allowed(name: &str, x: f64, value: f64) -> f64 {
    let oscillation = match name {
        "c" if x > 0.0 => 1.0 + x.sqrt(),
        "s" if x > 0.0 => 1.0 / (1.0 + x).sqrt() * (1.0 + x.sqrt()),
        "k" | "j" if x > 2.0 => 4.0 * (1.0 + x.sqrt()) / x,
        _ => 0.0,
    };
    // exp(√−x) inherits √−x times the rounding error of its argument.
    let growth = if x < -2.0 && name != "arc" { (-x).sqrt() } else { 1.0 };
    6.0 * f64::EPSILON * (value.abs() * growth.max(1.0) + oscillation)
}

#[test]
fn values_are_accurate_to_a_few_units() {
    for (name, x, [value, ..]) in rows() {
        let y = lane(x);
        let t = Trig::new(y);
        let found = first(match name {
            "c" => t.c,
            "s" => t.s,
            "k" => t.k,
            "j" => t.j,
            _ => theta_over_sin(y, || lane(2.0) - y),
        });
        let error = (found - value).abs();
        assert!(error <= allowed(name, x, value), "{name}({x}) = {found}, not {value}: {error:e}");
    }
}

#[test]
fn derivatives_are_accurate() {
    for (name, x, [_, d1, d2]) in rows() {
        let y = jet(x);
        let t = Trig::new(y);
        let found = match name {
            "c" => t.c,
            "s" => t.s,
            "k" => t.k,
            "j" => t.j,
            _ => theta_over_sin(y, || lane(2.0 - x)),
        };
        for (order, found, value) in [(1, first(found.d), d1), (2, first(found.dd), d2)] {
            // Beyond the series the quotient rule cancels a few digits; nothing is smaller than
            // the function's size over x^order there.
            let scale = value.abs() + if x.abs() > 0.05 { 4.0 / x.abs().powi(order) } else { 0.0 };
            let growth = if x < -2.0 { first(t.c.v).abs().max(1.0) / x.abs() } else { 0.0 };
            let allowed = 50.0 * f64::EPSILON * (scale + growth);
            assert!((found - value).abs() <= allowed, "d{order} {name}({x}) = {found}, not {value}");
        }
    }
}

#[test]
fn a_lane_does_not_depend_on_its_neighbours() {
    // As many neighbours as fit, so that lanes are in different branches.
    const OTHERS: [f64; 7] = [1e-9, 0.05, 0.5, 2.0, -3.0, 50.0, f64::NAN];
    let beside = |x: f64, shift: usize| {
        Lane::new(few(|l| if l == 0 { x } else { OTHERS[(shift + l) % OTHERS.len()] }))
    };
    let xs: Vec<f64> = rows().filter(|r| r.0 != "arc").map(|r| r.1).collect();
    for (x, shift) in xs.iter().flat_map(|x| (0..OTHERS.len()).map(move |shift| (x, shift))) {
        let alone = Trig::new(lane(*x));
        let mixed = Trig::new(beside(*x, shift));
        for (a, b) in [(alone.c, mixed.c), (alone.s, mixed.s), (alone.k, mixed.k), (alone.j, mixed.j)] {
            assert_eq!(first(a).to_bits(), first(b).to_bits(), "at {x}");
        }
        if *x < 2.0 {
            let alone = theta_over_sin(lane(*x), || lane(2.0 - x));
            let row = beside(*x, shift).min(lane(1.9));
            let mixed = theta_over_sin(row, || lane(2.0) - row);
            assert_eq!(first(alone).to_bits(), first(mixed).to_bits(), "at {x}");
        }
    }
}

#[test]
fn the_remainder_of_the_arc_matches_the_arc() {
    // θ/sin θ = 1 + y e, with derivatives e + y e' and 2e' + y e''.
    for y in [1e-9, 1e-3, 0.0074, 0.0076, 0.05, 0.089, 0.091, 0.2, 0.29, 0.31, 0.4, 0.5, 0.59, 0.61, 0.8, 1.0]
    {
        let (x, e) = (jet(y), arc_defect(jet(y)));
        let (f, g) = (theta_over_sin(x, || lane(2.0 - y)), e * x + Lane::ONE);
        for (order, found, value) in [(0, g.v, f.v), (1, g.d, f.d), (2, g.dd, f.dd)] {
            let (found, value) = (first(found), first(value));
            let allowed = [4.0, 16.0, 200.0][order] * f64::EPSILON;
            assert!((found - value).abs() <= allowed, "d{order} at {y}: {found}, not {value}");
        }
    }
}

#[test]
fn slerp_weights_are_quotients_of_sines() {
    for angle in [0.0, 1e-12, 1e-6, 0.01, 0.3, 0.45, 1.0, 2.0, 3.0] {
        for t in [-0.5, 0.0, 1e-9, 0.25, 0.5, 1.0, 1.7] {
            let sin_ratio = |t: f64| if angle == 0.0 { t } else { (t * angle).sin() / angle.sin() };
            let y = 2.0 * (angle / 2.0).sin().powi(2);
            let [from, to] = slerp(lane(t), lane(y), || lane(2.0 * (angle / 2.0).cos().powi(2)));
            // Near the antipode the quotient amplifies rounding by 1/sin.
            let allowed = 20.0 * f64::EPSILON * (1.0 + 1.0 / (1e-300 + (std::f64::consts::PI - angle)));
            assert!((first(from) - sin_ratio(1.0 - t)).abs() <= allowed, "from at {angle}, {t}");
            assert!((first(to) - sin_ratio(t)).abs() <= allowed, "to at {angle}, {t}");
        }
    }
    // Hyperbolic weights.
    let [_, to] = slerp(lane(0.25), lane(1.0 - 1.5_f64.cosh()), || lane(1.0 + 1.5_f64.cosh()));
    assert!((first(to) - 0.375_f64.sinh() / 1.5_f64.sinh()).abs() < 1e-15);
}
