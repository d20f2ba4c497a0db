//! Integrals against antiderivatives: the speed of every curve is a known function of time.

use symspline_core::curve::{ArcLength, Integrand, Times, energies, lengths};

/// Speeds (c + 1) |sin t| of curves c, whose lengths have kinks at multiples of π.
struct Sines {
    curves: usize,
    calls: usize,
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
            *value = (i / times.count + 1) as f64 * x.sin().abs();
        }
        Ok(())
    }
}

/// The integral of |sin t| from 0 to t.
fn length(t: f64) -> f64 {
    2.0 * (t / std::f64::consts::PI).floor() + 1.0 - (t % std::f64::consts::PI).cos()
}

const KNOTS: [f64; 8] = [0.3, 1.0, 4.0, 9.0, 0.5, 2.0, 2.5, 7.0];

#[test]
fn lengths_and_energies_are_integrals() {
    let found = lengths(&KNOTS, 2, 1e-14, &mut Sines { curves: 2, calls: 0 }).unwrap();
    for (found, exact) in found.iter().zip([length(9.0) - length(0.3), 2.0 * (length(7.0) - length(0.5))]) {
        assert!((found - exact).abs() < 1e-12, "{found} instead of {exact}");
    }
    let found = energies(&KNOTS, 2, 1e-14, &mut Sines { curves: 2, calls: 0 }).unwrap();
    let square = |a: f64, b: f64| (b - a) / 2.0 - ((2.0 * b).sin() - (2.0 * a).sin()) / 4.0;
    for (found, exact) in found.iter().zip([square(0.3, 9.0), 4.0 * square(0.5, 7.0)]) {
        assert!((found - exact).abs() < 1e-13 * exact, "{found} instead of {exact}");
    }
}

#[test]
fn arc_length_and_its_inverse() {
    let speed = &mut Sines { curves: 2, calls: 0 };
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
    assert!((found[0] - 1e-9 * 1f64.sin()).abs() < 1e-17);
    assert!((found[1] - (length(8.0) - length(0.4))).abs() < 1e-12);
    assert_eq!(found[2], 0.0);
    assert!((found[3] - 2.0 * (length(6.9) - length(2.1))).abs() < 1e-12);
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
