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

/// The bisection ends when the error no longer halves, which takes rounding errors and kinks for each other.
#[test]
fn kinks_cost_some_digits() {
    let found = lengths(&KNOTS[..4], 1, 1e-14, &mut Sines { curves: 1, level: 0.0, calls: 0 }).unwrap()[0];
    let exact = 4.0 + 0.3f64.cos() - (9.0 - 2.0 * std::f64::consts::PI).cos();
    assert!((found - exact).abs() < 1e-9, "{found} instead of {exact}");
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
