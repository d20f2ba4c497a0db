//! Integrals against antiderivatives: the speed of every curve is a known function of time.

use symspline_core::curve::{ArcLength, Integrand, Times, energies, lengths};

/// Speeds (c + 1) |level + sin t| of curves c. At level 0 they have kinks at multiples of π.
struct Sines {
    curves: usize,
    level: f64,
    calls: usize,
}

fn smooth() -> Sines {
    Sines { curves: 2, level: 2.0, calls: 0 }
}

impl Integrand for Sines {
    type Error = &'static str;

    fn at(&mut self, times: Times, values: &mut [f64]) -> Result<(), &'static str> {
        assert_eq!(times.x.len(), self.curves * times.count);
        self.calls += 1;
        if self.calls > 1000 {
            return Err("the bisection does not end");
        }
        for (i, (x, value)) in times.x.iter().zip(values).enumerate() {
            *value = (i / times.count + 1) as f64 * (self.level + x.sin()).abs();
        }
        Ok(())
    }
}

/// An antiderivative of 2 + sin t.
fn length(t: f64) -> f64 {
    2.0 * t - t.cos()
}

const KNOTS: [f64; 8] = [0.3, 1.0, 4.0, 9.0, 0.5, 2.0, 2.5, 7.0];

#[test]
fn lengths_and_energies_are_integrals() {
    let found = lengths(&KNOTS, 2, 1e-14, &mut smooth()).unwrap();
    for (found, exact) in found.iter().zip([length(9.0) - length(0.3), 2.0 * (length(7.0) - length(0.5))]) {
        assert!((found - exact).abs() < 1e-12, "{found} instead of {exact}");
    }
    let found = energies(&KNOTS, 2, 1e-14, &mut smooth()).unwrap();
    // An antiderivative of (2 + sin t)².
    let whole = |t: f64| 4.5 * t - 4.0 * t.cos() - (2.0 * t).sin() / 4.0;
    let square = |a: f64, b: f64| whole(b) - whole(a);
    for (found, exact) in found.iter().zip([square(0.3, 9.0), 4.0 * square(0.5, 7.0)]) {
        assert!((found - exact).abs() < 1e-13 * exact, "{found} instead of {exact}");
    }
}

#[test]
fn arc_length_and_its_inverse() {
    let speed = &mut smooth();
    let arc = ArcLength::new(&KNOTS, 2, 1e-14, speed).unwrap();
    let times = [0.3, 3.0, 5.5, 8.9, 0.6, 2.0, 3.2, 7.0];
    let found = arc.at(&times, speed).unwrap();
    for (i, (found, t)) in found.iter().zip(times).enumerate() {
        let exact = if i < 4 { length(t) - length(0.3) } else { 2.0 * (length(t) - length(0.5)) };
        assert!((found - exact).abs() < 1e-12, "{found} instead of {exact} at {t}");
    }
    let back = arc.times_at(&found, speed).unwrap();
    for (back, t) in back.iter().zip(times) {
        assert!((back - t).abs() < 1e-11, "{back} instead of {t}");
    }
    // Two times in one interval, and in different segments.
    let found = arc.between(&[1.0, 0.4, 0.9, 2.1], &[1.0 + 1e-9, 8.0, 0.9, 6.9], speed).unwrap();
    assert!((found[0] - 1e-9 * (2.0 + 1f64.sin())).abs() < 1e-15);
    assert!((found[1] - (length(8.0) - length(0.4))).abs() < 1e-12);
    assert_eq!(found[2], 0.0);
    assert!((found[3] - 2.0 * (length(6.9) - length(2.1))).abs() < 1e-12);
}

/// The speed |(t − a)(t − b)|, or that of a curve which passes the places where this is zero at a small `distance`.
struct Turns {
    at: [f64; 2],
    distance: f64,
    values: usize,
}

impl Integrand for Turns {
    type Error = ();

    fn at(&mut self, times: Times, values: &mut [f64]) -> Result<(), ()> {
        self.values += values.len();
        for (t, value) in times.x.iter().zip(values) {
            *value = ((t - self.at[0]) * (t - self.at[1])).hypot(self.distance);
        }
        Ok(())
    }
}

#[test]
fn curves_that_stop_and_turn_anywhere() {
    for (i, j) in (0..40).flat_map(|i| (0..40).map(move |j| (i, j))) {
        let a = 0.3 + 8.7 * f64::from(i) / 39.0;
        let b = (a + 1e-6 * 1.4f64.powi(j)).min(9.0);
        let mut turns = Turns { at: [a, b], distance: 0.0, values: 0 };
        let whole = |t: f64| t * t * t / 3.0 - (a + b) * t * t / 2.0 + a * b * t;
        let exact = whole(9.0) - whole(0.3) + 2.0 * (whole(a) - whole(b));
        let length = lengths(&KNOTS[..4], 1, 1e-14, &mut turns).unwrap()[0];
        assert!(
            (length - exact).abs() < 4e-13 * exact,
            "{length} instead of {exact}, which turns at {a} and {b}"
        );
        // The square is a polynomial of degree four, which one level resolves; only close to four roots at almost one
        // place, which amplify rounding errors, are intervals short.
        assert!(turns.values < 1000, "{} values for turns at {a} and {b}", turns.values);
    }
}

/// ∫ √(t² + d²) dt = ½(t√(t² + d²) + d² arsinh(t/d)).
#[test]
fn curves_that_almost_stop() {
    for (i, j) in (0..40).flat_map(|i| (0..40).map(move |j| (i, j))) {
        let (center, d) = (0.2 + 1.0 * f64::from(i) / 39.0, 10f64.powf(-f64::from(j) / 5.0));
        let speed = &mut |times: Times, values: &mut [f64]| {
            times.x.iter().zip(values).for_each(|(t, value)| *value = (t - center).hypot(d));
        };
        let whole = |t: f64| (t * t.hypot(d) + d * d * (t / d).asinh()) / 2.0;
        let exact = whole(1.0 - center) - whole(0.3 - center);
        let length = lengths(&[0.3, 1.0], 1, 1e-14, &mut Function(speed)).unwrap()[0];
        assert!((length - exact).abs() < 1e-13 * exact, "{length} instead of {exact} at {center}, {d}");
    }
}

/// A speed without errors.
struct Function<'a>(&'a mut dyn FnMut(Times, &mut [f64]));

impl Integrand for Function<'_> {
    type Error = ();

    fn at(&mut self, times: Times, values: &mut [f64]) -> Result<(), ()> {
        (self.0)(times, values);
        Ok(())
    }
}

/// Rounding errors of any size end the bisection, and a kink of the square is bracketed.
#[test]
fn functions_that_polynomials_do_not_resolve() {
    for (size, most) in [(1e-9, 20_000), (1e-12, 3 * 33)] {
        let mut values = 0;
        let speed = &mut |times: Times, speeds: &mut [f64]| {
            values += speeds.len();
            times.x.iter().zip(speeds).for_each(|(t, speed)| *speed = 1.0 + size * (1e9 * t).sin());
        };
        let length = lengths(&KNOTS[..4], 1, 1e-14, &mut Function(speed)).unwrap()[0];
        assert!((length - 8.7).abs() < 9.0 * size && values <= most, "{length} from {values} values");
    }
    let speed = &mut |times: Times, speeds: &mut [f64]| {
        times.x.iter().zip(speeds).for_each(|(t, speed)| *speed = 1.0 + (t - 2.0).abs());
    };
    let length = lengths(&KNOTS[..4], 1, 1e-14, &mut Function(speed)).unwrap()[0];
    let exact = 8.7 + (1.7f64.powi(2) + 49.0) / 2.0;
    assert!((length - exact).abs() < 1e-9, "{length} instead of {exact}");
}

/// Rows of the table are equally long, although only one of the curves needs short intervals.
#[test]
fn arc_lengths_of_curves_with_and_without_a_stop() {
    let mut sines = Sines { curves: 2, level: 0.0, calls: 0 };
    let knots = [0.3, 1.0, 4.0, 9.0, 0.5, 1.0, 1.5, 2.0];
    let arc = ArcLength::new(&knots, 2, 1e-14, &mut sines).unwrap();
    let count = arc.times.len() / 2;
    assert!(count < 200);
    for (c, knots) in knots.chunks(4).enumerate() {
        let times = &arc.times[c * count..(c + 1) * count];
        assert!(times.is_sorted_by(|a, b| a < b) && knots.iter().all(|t| times.contains(t)));
    }
    // An antiderivative of |sin t|.
    let exact = |t: f64| 2.0 * (t / std::f64::consts::PI).floor() - (t % std::f64::consts::PI).cos();
    let times = [0.3, 3.13, 6.3, 0.5, 1.2, 2.0];
    let lengths = arc.at(&times, &mut sines).unwrap();
    for (i, (t, length)) in times.iter().zip(&lengths).enumerate() {
        let exact = if i < 3 { exact(*t) - exact(0.3) } else { 2.0 * (exact(*t) - exact(0.5)) };
        assert!((length - exact).abs() < 1e-13, "{length} instead of {exact} at {t}");
    }
    let back = arc.times_at(&lengths, &mut sines).unwrap();
    assert!(back.iter().zip(times).all(|(back, t)| (back - t).abs() < 1e-9), "{back:?}");
}

#[test]
fn an_error_ends_the_integration() {
    struct Failing;
    impl Integrand for Failing {
        type Error = ();
        fn at(&mut self, _: Times, _: &mut [f64]) -> Result<(), ()> {
            Err(())
        }
    }
    assert!(lengths(&KNOTS, 2, 1e-14, &mut Failing).is_err());
    assert!(ArcLength::new(&KNOTS, 1, 1e-14, &mut Failing).is_err());
}
