//! Single parts of the core. As unit tests, they would compile the crate once more.

mod certificate {
    use symspline_core::fit::private::{contraction_bound, guaranteed_sweeps, invariant_radius};

    #[test]
    fn the_largest_step_matches_the_literature() {
        // The two roots meet at KD = 0.2610895, KV = 0.4420886 (from d/dV of (38), at 40 digits).
        let v = invariant_radius(0.261_089, 1.0, 0.0).expect("below the largest step");
        assert!((v - 0.442).abs() < 2e-3);
        assert!(invariant_radius(0.261_090, 1.0, 0.0).is_none());
        // KD and KV only.
        let (one, half) = (invariant_radius(0.2, 1.0, 0.0), invariant_radius(0.4, 0.5, 0.0));
        assert!((one.unwrap() - 0.5 * half.unwrap()).abs() < 1e-15);
    }

    #[test]
    fn the_inequality_holds_at_the_root_and_not_below() {
        for d in [1e-9, 1e-3, 0.1, 0.25] {
            let v = invariant_radius(d, 1.0, 0.0).unwrap();
            let excess = |v: f64| {
                let u: f64 = d + 2.0 * v;
                0.5 * u / u.sin() * (u - v) - v
            };
            assert!(excess(v) <= 1e-14 * v && excess(v * (1.0 - 1e-6)) > 0.0);
        }
    }

    #[test]
    fn the_contraction_matches_the_derivation() {
        let alpha = |d: f64| contraction_bound(d, 1.0, invariant_radius(d, 1.0, 0.0).unwrap());
        for (d, expected) in [(0.1, 0.533), (0.2, 0.665), (0.25, 0.857)] {
            assert!((alpha(d).unwrap() - expected).abs() < 1e-3);
        }
        // The bound reaches 1 slightly before the boundary of the region.
        assert!(alpha(0.26058).is_some() && alpha(0.26059).is_none());
        // In flat space the iteration contracts by one half.
        assert_eq!(contraction_bound(3.0, 0.0, 3.0), Some(0.5));
        assert_eq!(guaranteed_sweeps(0.5, 1e-12), 40.0);
        assert_eq!(guaranteed_sweeps(0.5, 0.0), 52.0);
    }

    #[test]
    fn given_velocities_must_fit() {
        let v = invariant_radius(0.1, 1.0, 0.3).unwrap();
        assert_eq!(v, 0.3);
        assert!(invariant_radius(0.1, 1.0, 1.2).is_none());
    }
}

mod homotopy {
    use symspline_core::fit::private::predict;
    use symspline_core::scalar::lane;

    /// The prediction for λ = `goal` from the curves at two values of λ; λ is 0 where no curve exists yet.
    fn predicted(curve: impl Fn(f64) -> f64, positions: [f64; 2], goal: f64) -> f64 {
        let mut u = [lane(0.0)];
        predict(&mut u, &positions.map(|at| vec![lane(curve(at))]), positions.map(lane), lane(goal));
        u[0].to_array()[0]
    }

    #[test]
    fn the_secant_of_velocities_over_lambda_is_followed() {
        let quadratic = |at: f64| at * (3.0 - 2.0 * at);
        for (positions, goal) in [([0.25, 0.625], 1.0), ([0.25, 0.3], 0.31), ([0.5, 0.75], 1.0)] {
            let found = predicted(quadratic, positions, goal);
            assert!((found - quadratic(goal)).abs() < 1e-14, "{positions:?}, {goal}: {found}");
        }
        // One curve predicts a line through zero, and no curve predicts zero.
        assert!((predicted(quadratic, [0.0, 0.25], 0.625) - 2.5 * quadratic(0.25)).abs() < 1e-15);
        assert_eq!(predicted(quadratic, [0.0, 0.0], 0.25), 0.0);
    }
}

mod locate {
    use proptest::prelude::*;
    use symspline_core::curve::Locator;

    proptest! {
        #[test]
        fn agrees_with_a_plain_search(
            gaps in prop::collection::vec(prop_oneof![1e-6..1e-3, 0.1..10.0f64], 1..200),
            positions in prop::collection::vec(-0.1..1.1f64, 1..50),
            indexed: bool,
        ) {
            let t: Vec<f64> = gaps.iter().scan(-3.0, |s, g| { *s += g; Some(*s) }).collect();
            prop_assume!(t.len() > 1);
            let last = t.len() - 2;
            let locator = Locator::new(&t, indexed);
            let mut hint = 0;
            let (a, b) = (t[0], t[last + 1]);
            for x in positions.iter().map(|p| a + p * (b - a)).chain(t.iter().copied()) {
                let plain = t.iter().rposition(|&k| k <= x).unwrap_or(0).min(last);
                hint = locator.find(x, hint);
                prop_assert_eq!(hint, plain);
            }
        }
    }
}

mod rows {
    use proptest::prelude::*;
    use symspline_core::scalar::{LANES, Lane, few, gather, scatter};

    proptest! {
        #[test]
        fn scatter_undoes_gather(len in 1..11_usize, rows in 1..=LANES) {
            let data: Vec<f64> = (0..LANES * len).map(|i| i as f64).collect();
            let mut lanes = vec![Lane::ZERO; len];
            gather(few(|l| &data[l * len..(l + 1) * len]), &mut lanes);
            for c in 0..len {
                prop_assert_eq!(lanes[c].to_array(), few(|l| (l * len + c) as f64));
            }
            let mut out = vec![0.0; rows * len];
            scatter(&lanes, &mut out);
            prop_assert_eq!(&out[..], &data[..rows * len]);
        }
    }
}

mod time_law {
    use symspline_core::search::Path;

    /// A straight line from rest to rest: full acceleration, the largest speed, full deceleration.
    #[test]
    fn a_trapezoid() {
        let n = 1000;
        let (length, limit, top) = (3.0_f64, 2.0_f64, 2.5_f64);
        let h = vec![length / n as f64; n];
        let mut most = vec![top; n + 1];
        (most[0], most[n]) = (0.0, 0.0);
        let (zeros, ones) = (vec![0.0; 2 * n], vec![1.0; 2 * n]);
        let path = Path { h: &h, most: &most, forms: [&zeros, &zeros, &ones], limits: &[limit * limit] };
        let (largest, following) = path.backward();
        let u = path.forward(&largest, &following, Some(0.0));
        for (k, u) in u.iter().enumerate() {
            let x = k as f64 * h[0];
            let exact = (2.0 * limit * x).min(2.0 * limit * (length - x)).min(top);
            assert!((u - exact).abs() < 1e-9, "{k} {u} {exact}");
        }
    }

    /// On a circle of radius 1 with any u, the limit is `u² + a² ≤ A²`.
    #[test]
    fn a_circle() {
        let n = 4000;
        let h = vec![1.5 / n as f64; n];
        let most = vec![2.0; n + 1];
        let (zeros, ones) = (vec![0.0; 2 * n], vec![1.0; 2 * n]);
        let path = Path { h: &h, most: &most, forms: [&ones, &zeros, &ones], limits: &[4.0] };
        let (largest, following) = path.backward();
        let u = path.forward(&largest, &following, Some(0.0));
        for (k, pair) in u.windows(2).enumerate() {
            let a = (pair[1] - pair[0]) / (2.0 * h[k]);
            assert!(pair[0].hypot(a) <= 2.0 + 1e-12 && pair[1].hypot(a) <= 2.0 + 1e-12);
        }
        // du/dx = 2 √(4 − u²): u = 2 sin 2x up to 2.
        for (k, u) in u.iter().enumerate() {
            let exact = 2.0 * (2.0 * k as f64 * h[0]).min(std::f64::consts::FRAC_PI_2).sin();
            assert!((u - exact).abs() < 5e-3, "{k} {u} {exact}");
        }
    }

    /// Limits that only a lower speed at the end of an interval can keep.
    #[test]
    fn a_bend_in_the_path() {
        let h = [0.1, 0.1];
        let most = [10.0, 1.0, 10.0];
        // The second interval turns sharply at its start: p = 100 there.
        let (p, q, r) = ([0.0, 100.0, 0.0, 0.0], [0.0; 4], [1.0; 4]);
        let path = Path { h: &h, most: &most, forms: [&p, &q, &r], limits: &[1.0] };
        let (largest, following) = path.backward();
        assert!(following[1] < 10.0 && largest[1] <= 0.1 + 1e-9);
        let u = path.forward(&largest, &following, Some(0.0));
        assert!(u[1] > 0.05 && u[1] <= 0.1 + 1e-9, "{u:?}");
    }
}

mod roots {
    use proptest::prelude::*;
    use std::convert::Infallible;
    use symspline_core::search::{Bracket, roots};

    fn solved(brackets: &[Bracket], f: impl Fn(usize, f64) -> f64) -> (Vec<f64>, usize) {
        let mut calls = 0;
        let found = roots::<Infallible>(brackets, |index, x| {
            calls += 1;
            Ok(index.iter().zip(x).map(|(&i, &x)| f(i, x)).collect())
        });
        (found.unwrap(), calls)
    }

    proptest! {
        #[test]
        fn roots_of_cubic_polynomials(at in prop::collection::vec(-0.9..0.9_f64, 1..20), steep in 0.0..50.0_f64) {
            let f = |i: usize, x: f64| (x - at[i]) * (1.0 + steep * (x - at[i]).powi(2));
            let bracket = |i: usize| {
                Bracket { ends: [-1.0, 1.0], values: [f(i, -1.0), f(i, 1.0)], guess: 0.1, tol: 0.0 }
            };
            let brackets: Vec<Bracket> = (0..at.len()).map(bracket).collect();
            let (found, calls) = solved(&brackets, f);
            for (x, root) in found.iter().zip(&at) {
                prop_assert!((x - root).abs() <= 4.0 * f64::EPSILON, "{x} {root}");
            }
            // Bisection alone would take more than 50.
            prop_assert!(calls < 25, "{calls}");
        }
    }

    #[test]
    fn ends_jumps_and_values_that_are_not_numbers() {
        let own = |values| Bracket { ends: [1.0, 2.0], values, guess: 1.5, tol: 0.0 };
        // The root is an end.
        assert_eq!(solved(&[own([0.0, 1.0]), own([-1.0, 0.0])], |_, _| 1.0).0, [1.0, 2.0]);
        let (jump, calls) = solved(&[own([-1.0, 1.0])], |_, x| if x < 1.3 { -1.0 } else { 1.0 });
        assert!((jump[0] - 1.3).abs() < 1e-15 && calls < 70);
        assert!((1.0..=2.0).contains(&solved(&[own([-1.0, 1.0])], |_, _| f64::NAN).0[0]));
    }
}

mod closest {
    use std::convert::Infallible;
    use std::f64::consts::{PI, TAU};
    use symspline_core::search::{Distances, TimeSamples, closest};

    /// The distance d(x) = 3 + cos(2πx − ½) of one target, whose derivative is unknown before some time.
    struct Wave {
        unknown_before: f64,
    }

    fn distance(x: f64) -> f64 {
        3.0 + (TAU * x - 0.5).cos()
    }

    impl Distances for Wave {
        type Error = Infallible;

        fn of_samples(&mut self, _: &[usize], number: &[usize]) -> Result<Vec<f64>, Infallible> {
            Ok(number.iter().map(|&i| distance(i as f64)).collect())
        }

        fn at(&mut self, _: &[usize], x: &[f64]) -> Result<[Vec<f64>; 2], Infallible> {
            let slope = |&x: &f64| {
                if x < self.unknown_before { f64::NAN } else { -TAU * (TAU * x - 0.5).sin() * distance(x) }
            };
            Ok([x.iter().map(|&x| distance(x)).collect(), x.iter().map(slope).collect()])
        }
    }

    /// The distance increases at both ends of the only interval, so that the minimum is found by division.
    #[test]
    fn minima_without_a_change_of_sign_at_the_ends_are_found() {
        for unknown_before in [0.0, 0.1, 0.4] {
            let samples = TimeSamples { count: 2, times: &[0.0, 1.0], lengths: &[0.0, 20.0] };
            let found = closest(samples, 0, &[0], &mut Wave { unknown_before }).unwrap();
            assert!((found[0].distance - 2.0).abs() < 1e-12, "{unknown_before}: {found:?}");
            assert!((found[0].time - (PI + 0.5) / TAU).abs() < 1e-7, "{unknown_before}: {found:?}");
        }
    }
}

#[cfg(feature = "dense")]
mod general {
    use symspline_core::matrix::{Matrix, exp_any_minus_one, log_any_one_plus};
    use symspline_core::scalar::{Jet, Lane, Scalar, lane};

    #[test]
    fn the_logarithm_of_an_exponential_has_its_derivatives() {
        // Small ones need no roots; the largest turns by 2.94 and needs Schur's form. t A has the derivatives A and 0.
        for size in [0.01, 0.3, 1.0, 1.2] {
            // Near a rotation by π rounding errors grow with each derivative, by the square of the distance from π.
            let slack = (std::f64::consts::PI - 2.45 * size).min(1.0);
            let a = [[0.3, -2.5], [2.4, 0.1]].map(|row| row.map(|x| x * size));
            let t = Jet::from_parts([Lane::ONE, Lane::ONE, Lane::ZERO]);
            let ta = Matrix::<Jet, 1>::from_fn(2, 2, |i, j| [t * lane(a[i][j])]);
            let (log, _) = log_any_one_plus(&exp_any_minus_one(&ta));
            for i in 0..2 {
                for j in 0..2 {
                    let found = log[(i, j)][0].parts().map(|x| x.to_array()[0]);
                    for (order, expected) in [a[i][j], a[i][j], 0.0].into_iter().enumerate() {
                        let allowed = 1e-13 * size / slack.powi(2 * order as i32);
                        assert!((found[order] - expected).abs() < allowed, "{} at {size}", found[order]);
                    }
                }
            }
        }
    }
}
