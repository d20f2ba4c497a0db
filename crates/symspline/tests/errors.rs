//! Whatever the input is, the answer is a curve or an error with fields: no panic, and no curve through other points.

use nalgebra::Isometry3;
use proptest::prelude::*;
use symspline::prelude::*;

const T: [f64; 3] = [0.0, 1.0, 2.5];
const P: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.8, 0.6, 0.0], [0.6, 0.64, 0.48]];

fn error(times: &[f64], points: &[[f64; 3]]) -> Error {
    CubicSpline::new(Sphere::<3>, times, points).expect_err("the input is invalid")
}

fn option_error(builder: symspline::Builder<Sphere<3>, [f64; 3]>) -> Error {
    builder.fit(&T, &P).expect_err("an option is invalid")
}

#[test]
fn times_must_increase_and_be_finite() {
    assert_eq!(
        error(&[0.0, 2.0, 1.0], &P),
        Error::UnsortedTimes { curve: 0, node: 2, before: 2.0, time: 1.0 }
    );
    assert!(matches!(error(&[2.0, 1.0, 0.0], &P), Error::UnsortedTimes { node: 1, .. }));
    assert!(matches!(error(&[0.0, 0.0, 1.0], &P), Error::UnsortedTimes { node: 1, .. }));
    assert!(
        matches!(error(&[0.0, f64::NAN, 1.0], &P), Error::TimeNotFinite { node: 1, time, .. } if time.is_nan())
    );
    assert!(matches!(error(&[0.0, 1.0, f64::INFINITY], &P), Error::TimeNotFinite { node: 2, .. }));
    assert_eq!(error(&[-1e308, 0.0, 1e308], &P), Error::TimesTooFarApart { curve: 0 });
}

#[test]
fn there_are_as_many_times_as_points() {
    let wrong = |expected, found| Error::LengthMismatch { curve: 0, what: "times", expected, found };
    assert_eq!(error(&T[..2], &P), wrong(3, 2));
    assert_eq!(error(&T, &P[..2]), wrong(2, 3));
    assert_eq!(error(&T[..1], &P[..1]), Error::TooFewPoints { curve: 0, points: 1 });
    assert_eq!(error(&[], &[]), Error::TooFewPoints { curve: 0, points: 0 });
    let none: [Vec<[f64; 3]>; 0] = [];
    let found = Batch::fit_shared(Sphere::<3>, &T, &none).expect_err("there is no curve");
    assert_eq!(found, Error::LengthMismatch { curve: 0, what: "curves", expected: 1, found: 0 });
    let short = AnySpace::new("s", &[2]).expect("it is a space");
    let found =
        CubicSpline::new(short, &T[..2], &[vec![1.0, 0.0, 0.0], vec![1.0]]).expect_err("it is too short");
    assert_eq!(found, Error::PointLength { curve: 0, node: 1, expected: 3, found: 1 });
}

#[test]
fn points_off_the_space_are_errors() {
    let mut points = P;
    points[1] = [0.0, 2.0, 0.0];
    assert!(
        matches!(error(&T, &points), Error::OffSpace { node: 1, distance, .. } if (distance - 1.0).abs() < 1e-12)
    );
    points[1] = [f64::NAN, 1.0, 0.0];
    assert!(matches!(error(&T, &points), Error::OffSpace { node: 1, .. }));
    points[1] = [0.0; 3];
    assert!(matches!(error(&T, &points), Error::OffSpace { node: 1, .. }));
    let reflection = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]];
    let found = CubicSpline::new(So3, &T[..2], &[reflection; 2]).expect_err("it is no rotation");
    assert!(matches!(found, Error::OffSpace { node: 0, .. }));
    let found = CubicSpline::new(PositiveDefinite::<3>, &T[..2], &[reflection; 2]);
    assert!(matches!(found, Err(Error::OffSpace { .. })));
    let columns = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 6.0, 7.0, 1.0];
    let space = AnySpace::new("se", &[3]).expect("it is a space");
    let found = CubicSpline::new(space, &T[..2], &[columns.to_vec(), columns.to_vec()]);
    assert!(matches!(found, Err(Error::OffSpace { .. })), "a pose is written row by row");
}

#[test]
fn quaternions_of_another_norm_are_errors() {
    for [w, x] in [[0.0, 0.0], [2.0, 0.0], [0.5, 0.0], [1.5, 1e-5], [0.0, 1.1], [1.0 + 1e-6, 0.0]] {
        let q = nalgebra::UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, x, 0.0, 0.0));
        let found = CubicSpline::new(So3, &T[..2], &[q, q]).expect_err("it is no rotation");
        assert!(matches!(found, Error::OffSpace { node: 0, .. }), "{found}");
        let pose = Isometry3::from_parts(nalgebra::Translation3::new(1.0, 2.0, 3.0), q);
        assert!(matches!(
            CubicSpline::new(Se3, &T[..2], &[pose, pose]),
            Err(Error::OffSpace { node: 0, .. })
        ));
        let found = CubicSpline::new(So3, &T[..2], &[glam::DQuat::from_xyzw(x, 0.0, 0.0, w); 2]);
        assert!(matches!(found, Err(Error::OffSpace { .. })));
    }
}

#[test]
fn points_of_two_components_and_open_polygons_are_errors() {
    let space = AnySpace::new("o", &[2]).expect("it is a space");
    let points = [vec![1.0, 0.0, 0.0, 1.0], vec![1.0, 0.0, 0.0, -1.0]];
    let found = CubicSpline::new(space, &T[..2], &points).expect_err("they are not connected");
    assert_eq!(found, Error::Disconnected { curve: 0, node: 0 });
    let found = option_error(CubicSpline::builder(Sphere::<3>).ends(Ends::Periodic));
    assert!(matches!(found, Error::NotClosed { curve: 0, distance } if (distance - 0.927).abs() < 1e-3));
}

#[test]
fn vectors_at_ends_are_finite_tangent_and_not_too_fast() {
    for wrong in [[1.0, 0.0, 0.0], [0.0, f64::NAN, 0.0], [0.0, 1e6, 0.0]] {
        let found =
            option_error(CubicSpline::builder(Sphere::<3>).ends([End::Velocity(wrong), End::Natural]));
        assert!(matches!(found, Error::InvalidEnd { curve: 0, start: true, .. }), "{found}");
        let found =
            option_error(CubicSpline::builder(Sphere::<3>).ends([End::Natural, End::Velocity(wrong)]));
        assert!(matches!(found, Error::InvalidEnd { start: false, .. }), "{found}");
    }
}

#[test]
fn options_are_finite_and_positive() {
    let of = |name| move |error| matches!(error, Error::InvalidOption { name: found, .. } if found == name);
    for value in [f64::NAN, -1.0, f64::INFINITY] {
        assert!(of("tol")(option_error(CubicSpline::builder(Sphere::<3>).tol(value))));
        assert!(of("point_tol")(option_error(CubicSpline::builder(Sphere::<3>).point_tol(value))));
        let smooth = |options: Smoothing| options.fit(Sphere::<3>, &T, &P).expect_err("an option is invalid");
        assert!(of("lam")(smooth(Smoothing::default().lam(value))));
        assert!(of("sigma")(smooth(Smoothing::default().sigma(value))));
        let found = smooth(Smoothing::default().weights(&[1.0, value, 1.0]));
        assert!(matches!(found, Error::InvalidWeight { index: 1, .. }));
    }
    assert!(of("max_iter")(option_error(CubicSpline::builder(Sphere::<3>).max_iter(0))));
}

#[test]
fn smoothing_needs_data_and_knots() {
    let smooth = |options: Smoothing, times: &[f64]| {
        options.fit(Sphere::<3>, times, &P[..times.len()]).expect_err("there is no curve")
    };
    let plain = Smoothing::default;
    assert!(matches!(smooth(plain().weights(&[]), &T), Error::LengthMismatch { what: "weights", .. }));
    assert!(matches!(smooth(plain().knots(&[]), &T), Error::NotSmoothed { .. }));
    assert!(matches!(smooth(plain().knots(&[0.0, 2.0]), &T), Error::NotSmoothed { .. }));
    assert!(matches!(smooth(plain().knots(&[0.0, 2.0, 1.0, 3.0]), &T), Error::UnsortedTimes { node: 2, .. }));
    assert!(matches!(smooth(plain().weights(&[0.0; 3]), &T), Error::NotSmoothed { .. }));
    assert!(matches!(smooth(plain().weights(&[0.0, 1.0, 0.0]), &T), Error::NotSmoothed { .. }));
    assert!(matches!(smooth(plain(), &[1.0, 1.0, 1.0]), Error::NotSmoothed { .. }));
    assert!(matches!(smooth(plain(), &[]), Error::TooFewPoints { points: 0, .. }));
    assert!(matches!(smooth(plain(), &[0.0, 2.0, 1.0]), Error::UnsortedTimes { node: 2, .. }));
    assert!(matches!(smooth(plain(), &[0.0, f64::NAN, 1.0]), Error::TimeNotFinite { node: 1, .. }));
}

#[test]
fn there_is_no_sphere_of_dimension_zero() {
    for error in [
        CubicSpline::new(Sphere::<1>, &T[..2], &[[1.0], [1.0]]).err(),
        CubicSpline::new(Sphere::<0>, &T[..2], &[[], []]).err(),
        CubicSpline::new(Euclidean::<0>, &T[..2], &[[], []]).err(),
        AnySpace::new("spere", &[2]).err(),
        AnySpace::new("sphere", &[2, 3]).err(),
        AnySpace::new("sphere", &[usize::MAX]).err(),
    ] {
        assert!(matches!(error, Some(Error::InvalidSpace { .. })), "{error:?}");
    }
}

#[test]
fn times_outside_the_knots_are_errors_unless_extrapolation_is_requested() {
    let spline = CubicSpline::new(Sphere::<3>, &T, &P).expect("it is a curve");
    let text = spline.try_at(f64::NAN).unwrap_err().to_string();
    assert_eq!(text, "the time is NaN, but times must be finite");
    for time in [-1e-9, 2.500001, f64::NAN, f64::INFINITY] {
        assert!(matches!(spline.try_at(time), Err(Error::OutsideDomain { start: 0.0, end: 2.5, .. })));
        assert!(spline.sample(&[0.0, time]).is_err() && spline.sample_velocity(&[time]).is_err());
    }
    // The last knot up to rounding is the knot.
    assert_eq!(spline.at(2.5 * (1.0 + f64::EPSILON)), spline.at(2.5));
    for policy in [Extrapolate::Geodesic, Extrapolate::Segment] {
        let spline =
            CubicSpline::builder(Sphere::<3>).extrapolate(policy).fit(&T, &P).expect("it is a curve");
        let square: f64 = spline.at(7.0).iter().map(|x| x * x).sum();
        assert!((square - 1.0).abs() < 1e-13 && spline.try_at(f64::NAN).is_err());
    }
    let panic = std::panic::catch_unwind(|| spline.at(3.0));
    assert!(panic.is_err());
}

#[test]
fn errors_of_batches_name_the_curve() {
    let mut bad = P;
    bad[2] = [-0.8, -0.6, 0.0];
    let found = Batch::fit_shared(Sphere::<3>, &T, &[P, P, bad]).expect_err("one curve is invalid");
    assert!(matches!(found, Error::CutLocus { curve: 2, node: 1, .. }), "{found}");
    let found =
        Batch::fit_each(Sphere::<3>, &[(&T[..], &P[..]), (&T[..2], &P[..])]).expect_err("times are missing");
    assert_eq!(found, Error::LengthMismatch { curve: 1, what: "times", expected: 3, found: 2 });
}

#[test]
fn translations_of_poses_are_kept() {
    let poses = [0.0, 1.0, 3.0].map(|x| Isometry3::translation(x, 2.0 * x, -x));
    let path = CubicSpline::new(Se3, &[0.0, 1.0, 3.0], &poses).expect("it is a curve");
    let moved = path.at(2.0).translation.vector;
    assert!((moved - nalgebra::Vector3::new(2.0, 4.0, -2.0)).norm() < 1e-13);
}

/// Numbers as broken files contain them.
fn hostile() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -2.0..2.0,
        1 => prop::sample::select(vec![0.0, -0.0, 1.0, f64::NAN, f64::INFINITY, 1e308, 1e-308, 5e-324]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    /// No input of any size causes a panic, and a curve passes through its points.
    #[test]
    fn any_input_is_a_curve_or_an_error(
        mut times in prop::collection::vec(hostile(), 0..6),
        numbers in prop::collection::vec(prop::collection::vec(hostile(), 0..5), 0..6),
        (name, size) in prop::sample::select(
            vec![("s", 2), ("h", 2), ("r", 2), ("so", 2), ("se", 2), ("spd", 2), ("rp", 2), ("u", 1), ("gl", 2), ("ch", 1)],
        ),
        tol in hostile(), point_tol in hostile(), lam in hostile(), at in hostile(),
        (sorted, noisy, periodic) in (any::<bool>(), any::<bool>(), any::<bool>()),
    ) {
        if sorted {
            times.sort_by(f64::total_cmp);
            times.dedup();
        }
        let space = AnySpace::new(name, &[size]).expect("it is a space");
        // Some points have the right length, and some lie on the sphere.
        let points: Vec<Vec<f64>> = numbers
            .into_iter()
            .map(|mut x| {
                if sorted {
                    x.resize(space.point_len(), 0.5);
                    let norm = x.iter().map(|x| x * x).sum::<f64>().sqrt();
                    if name == "s" || name == "rp" {
                        x.iter_mut().for_each(|x| *x /= norm);
                    }
                }
                x
            })
            .take(if sorted { times.len() } else { 9 })
            .collect();
        if noisy {
            let soft = Smoothing::default().lam(lam).fit(space, &times, &points);
            if let Ok(soft) = soft {
                let _ = soft.try_at(at);
            }
            return Ok(());
        }
        let mut builder = CubicSpline::builder(space);
        if !sorted {
            builder = builder.tol(tol).point_tol(point_tol);
        }
        if periodic {
            builder = builder.ends(Ends::Periodic);
        }
        if let Ok(spline) = builder.fit(&times, &points) {
            let _ = spline.try_at(at);
            let size = points.iter().flatten().fold(1.0_f64, |m, x| m.max(x.abs()));
            for (t, p) in times.iter().zip(spline.points()) {
                let found = spline.at(*t);
                let off = |sign: f64| found.iter().zip(&p).all(|(a, b)| (a - sign * b).abs() < 1e-6 * size);
                prop_assert!(off(1.0) || (name == "rp" && off(-1.0)), "{found:?} is not {p:?}");
            }
        }
    }
}
