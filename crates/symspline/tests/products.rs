//! A curve in a product is the curves in its factors, number by number.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use symspline::{SmoothingSpline, prelude::*};

const T: [f64; 6] = [0.0, 0.3, 1.0, 1.1, 2.0, 2.7];
const AT: [f64; 5] = [0.0, 0.07, 1.05, 1.9, 2.7];

type Matrix = [[f64; 3]; 3];
type Space = (So3, Euclidean<2>, Sphere<3>);
type Point = (Matrix, [f64; 2], [f64; 3]);
type Tangent = ([f64; 3], [f64; 2], [f64; 3]);
const SPACE: Space = (So3, Euclidean, Sphere);

fn rotation(t: f64) -> Matrix {
    let q = UnitQuaternion::from_scaled_axis(Vector3::new(0.9 * t, 0.3 - 0.2 * t * t, (2.0 * t).sin()));
    let m = q.to_rotation_matrix();
    std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]))
}

fn direction(t: f64) -> [f64; 3] {
    let (a, b) = (0.9 * t, 0.4 * (3.0 * t).sin());
    [a.cos() * b.cos(), a.sin() * b.cos(), b.sin()]
}

fn point(t: f64) -> Point {
    (rotation(t), [t * t, 100.0 * t.cos()], direction(t))
}

/// The points in each factor.
fn split(points: &[Point]) -> (Vec<Matrix>, Vec<[f64; 2]>, Vec<[f64; 3]>) {
    let mut parts = (Vec::new(), Vec::new(), Vec::new());
    for point in points {
        parts.0.push(point.0);
        parts.1.push(point.1);
        parts.2.push(point.2);
    }
    parts
}

type Factors =
    (CubicSpline<So3, Matrix>, CubicSpline<Euclidean<2>, [f64; 2]>, CubicSpline<Sphere<3>, [f64; 3]>);

/// The product is bit-identical to its factors.
fn same(spline: &CubicSpline<Space, Point>, (a, b, c): &Factors, times: &[f64]) {
    assert_eq!((spline.times(), spline.domain()), (a.times(), a.domain()));
    for &t in times {
        assert_eq!(spline.at(t), (a.at(t), b.at(t), c.at(t)));
        assert_eq!(spline.velocity(t), (a.velocity(t), b.velocity(t), c.velocity(t)));
        assert_eq!(spline.acceleration(t), (a.acceleration(t), b.acceleration(t), c.acceleration(t)));
        assert_eq!(spline.speed(t), a.speed(t).hypot(b.speed(t)).hypot(c.speed(t)));
    }
    let points: Vec<Point> = times.iter().map(|t| spline.at(*t)).collect();
    assert_eq!(spline.sample(times), Ok(points));
    let velocities: Vec<Tangent> = times.iter().map(|t| spline.velocity(*t)).collect();
    assert_eq!(spline.sample_velocity(times), Ok(velocities));
    let accelerations: Vec<Tangent> = times.iter().map(|t| spline.acceleration(*t)).collect();
    assert_eq!(spline.sample_acceleration(times), Ok(accelerations));
    let (p, q, r) = split(&spline.points());
    assert_eq!((p, q, r), (a.points(), b.points(), c.points()));
    let rates = a.velocities().into_iter().zip(b.velocities()).zip(c.velocities());
    assert_eq!(spline.velocities(), rates.map(|((a, b), c)| (a, b, c)).collect::<Vec<Tangent>>());
    let (report, [a, b, c]) = (spline.report(), [a.report(), b.report(), c.report()]);
    assert_eq!(report.residual, a.residual.max(b.residual).max(c.residual));
    assert_eq!(report.iterations, a.iterations.max(b.iterations).max(c.iterations));
}

fn fit(points: &[Point], ends: Ends<Tangent>, extrapolate: Extrapolate) -> CubicSpline<Space, Point> {
    let builder = CubicSpline::builder(SPACE).ends(ends).extrapolate(extrapolate);
    builder.fit(&T[..points.len()], points).expect("it is a curve")
}

/// The curves in the factors with the same options.
fn factors(points: &[Point], ends: Ends<Tangent>, extrapolate: Extrapolate) -> Factors {
    fn of<T, U: Clone>(ends: &Ends<T>, part: impl Fn(&T) -> U) -> Ends<U> {
        let end = |end: &End<T>| match end {
            End::Natural => End::Natural,
            End::NotAKnot => End::NotAKnot,
            End::Velocity(v) => End::Velocity(part(v)),
            End::Acceleration(v) => End::Acceleration(part(v)),
        };
        match ends {
            Ends::Open(ends) => Ends::Open([end(&ends[0]), end(&ends[1])]),
            Ends::Periodic => Ends::Periodic,
        }
    }
    let (a, b, c) = split(points);
    let t = &T[..points.len()];
    (
        CubicSpline::builder(So3).ends(of(&ends, |v| v.0)).extrapolate(extrapolate).fit(t, &a),
        CubicSpline::builder(Euclidean).ends(of(&ends, |v| v.1)).extrapolate(extrapolate).fit(t, &b),
        CubicSpline::builder(Sphere).ends(of(&ends, |v| v.2)).extrapolate(extrapolate).fit(t, &c),
    )
        .all()
}

trait All {
    type Curves;
    fn all(self) -> Self::Curves;
}

impl<A, B, C> All for (Result<A, Error>, Result<B, Error>, Result<C, Error>) {
    type Curves = (A, B, C);
    fn all(self) -> (A, B, C) {
        let why = "it is a curve";
        (self.0.expect(why), self.1.expect(why), self.2.expect(why))
    }
}

#[test]
fn curves_equal_those_of_the_factors_for_all_end_conditions() {
    let points = T.map(point);
    let free = factors(&points, Ends::default(), Extrapolate::Error);
    let at = |t: f64| (free.0.velocity(t), free.1.velocity(t), free.2.velocity(t));
    let bend = |t: f64| (free.0.acceleration(t), free.1.acceleration(t), free.2.acceleration(t));
    let rest = End::Velocity(([0.0; 3], [0.0; 2], [0.0; 3]));
    for ends in [
        Ends::default(),
        End::NotAKnot.into(),
        rest.into(),
        [End::Velocity(at(0.0)), End::Natural].into(),
        [End::NotAKnot, End::Acceleration(bend(2.7))].into(),
    ] {
        same(&fit(&points, ends, Extrapolate::Error), &factors(&points, ends, Extrapolate::Error), &AT);
    }
    let mut closed = points;
    closed[5] = closed[0];
    let periodic = Extrapolate::Periodic;
    let spline = fit(&closed, Ends::Periodic, periodic);
    same(&spline, &factors(&closed, Ends::Periodic, periodic), &[-3.0, 0.5, 9.0]);
    let gap = spline.velocity(0.0).1[1] - spline.velocity(2.7 - 1e-12).1[1];
    assert!(gap.abs() < 1e-6, "{gap}");
    // Two points.
    same(
        &fit(&points[..2], Ends::default(), Extrapolate::Error),
        &factors(&points[..2], Ends::default(), Extrapolate::Error),
        &[0.1],
    );
}

#[test]
fn curves_continue_as_their_factors_do() {
    let points = T.map(point);
    for policy in [Extrapolate::Geodesic, Extrapolate::Segment, Extrapolate::Periodic] {
        let ends = End::Natural.into();
        same(&fit(&points, ends, policy), &factors(&points, ends, policy), &[-0.3, 1.0, 3.1]);
    }
    let spline = fit(&points, Ends::default(), Extrapolate::Error);
    assert!(matches!(spline.try_at(3.0), Err(Error::OutsideDomain { time: 3.0, start: 0.0, end: 2.7 })));
}

#[test]
fn all_methods_fit_products() {
    let points = T.map(point);
    let expected = fit(&points, Ends::default(), Extrapolate::Error);
    for method in [Method::Newton, Method::QuasiNewton, Method::Homotopy] {
        let builder = CubicSpline::builder(SPACE).method(method).tol(1e-11).max_iter(100);
        let spline = builder.fit(&T, &points).expect("it is a curve");
        let [p, q] = [spline.at(1.5), expected.at(1.5)];
        assert!(p.0.iter().flatten().zip(q.0.iter().flatten()).all(|(p, q)| (p - q).abs() < 1e-9));
        assert!(p.2.iter().zip(q.2).all(|(p, q)| (p - q).abs() < 1e-9));
    }
}

#[test]
fn a_helix_is_a_geodesic_and_its_speed_is_the_root_of_the_sum_of_squares() {
    // Angle 2t on the circle, and height 3t.
    let helix = |t: f64| ([(2.0 * t).cos(), (2.0 * t).sin()], [3.0 * t]);
    let times = [0.0, 0.4, 1.0, 1.5];
    let spline =
        CubicSpline::new((Sphere::<2>, Euclidean::<1>), &times, &times.map(helix)).expect("it is a curve");
    let speed = 13.0_f64.sqrt();
    for t in [0.1, 0.77, 1.5] {
        assert!((spline.speed(t) - speed).abs() < 1e-12);
        assert!(
            (spline.at(t).0[0] - (2.0 * t).cos()).abs() < 1e-12 && spline.acceleration(t).1[0].abs() < 1e-11
        );
    }
    // The longest step is the longest distance in the product.
    assert!((spline.report().max_step - 0.6 * speed).abs() < 1e-12);
}

#[test]
fn batches_equal_the_fits_of_their_curves() {
    let points = T.map(point);
    let other = T.map(|t| point(0.4 * t));
    let x = [0.35, 0.9, 1.05];
    let single = |times: &[f64], points: &[Point]| {
        CubicSpline::builder(SPACE).ends(End::Natural).fit(times, points).expect("it is a curve")
    };
    let shared = Batch::builder(SPACE).ends(End::Natural).fit_shared(&T, &[points, other]);
    let shared = shared.expect("they are curves");
    let (long, short) = ((&T[..], &points[..]), (&T[1..4], &other[1..4]));
    let different =
        Batch::builder(SPACE).ends(End::Natural).fit_each(&[long, short]).expect("they are curves");
    for (batch, curves) in [
        (shared, [single(&T, &points), single(&T, &other)]),
        (different, [single(long.0, long.1), single(short.0, short.1)]),
    ] {
        let (samples, rates) =
            (batch.sample(&x).expect("inside"), batch.sample_velocity(&x).expect("inside"));
        for (c, curve) in curves.iter().enumerate() {
            assert_eq!((batch.len(), batch.reports()[c]), (2, *curve.report()));
            for (i, &t) in x.iter().enumerate() {
                assert_eq!((samples[c][i], rates[c][i]), (curve.at(t), curve.velocity(t)));
                assert_eq!(batch.curve(c).acceleration(t), curve.acceleration(t));
            }
        }
    }
}

#[test]
fn factors_named_when_the_program_runs_give_the_same_curve() {
    let points = T.map(point);
    let typed = fit(&points, Ends::default(), Extrapolate::Error);
    let space = [("so", 3), ("r", 2), ("sphere", 2)].map(|(name, size)| AnySpace::new(name, &[size]));
    let space = Product(space.map(|space| space.expect("it is a space")).to_vec());
    let rows = points.map(|(m, x, p)| vec![m.concat(), x.to_vec(), p.to_vec()]);
    let named = CubicSpline::new(space.clone(), &T, &rows).expect("it is a curve");
    for t in AT {
        let (m, x, p) = typed.at(t);
        assert_eq!(named.at(t), [m.concat(), x.to_vec(), p.to_vec()]);
        assert_eq!((named.velocity(t)[1..].to_vec(), named.speed(t)), {
            let (_, x, p) = typed.velocity(t);
            (vec![x.to_vec(), p.to_vec()], typed.speed(t))
        });
    }
    assert_eq!((named.points(), named.space()), (rows.to_vec(), &space));
    // A product of one factor is that space.
    let alone = Product(vec![Sphere::<3>]);
    let points = T.map(|t| vec![direction(t)]);
    let one = CubicSpline::new(alone.clone(), &T, &points).expect("it is a curve");
    let sphere = CubicSpline::new(Sphere::<3>, &T, &T.map(direction)).expect("it is a curve");
    assert_eq!((one.at(0.7)[0], one.report()), (sphere.at(0.7), sphere.report()));
    let found =
        CubicSpline::new(alone, &T, &T.map(|_| vec![[1.0, 1.0, 1.0]])).expect_err("it is off the sphere");
    assert!(matches!(found, Error::OffSpace { node: 0, .. }));
}

#[test]
fn neighbouring_samples_have_quaternions_of_the_same_sign() {
    let times: Vec<f64> = (0..17).map(f64::from).collect();
    let turn = |t: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), t * std::f64::consts::FRAC_PI_4);
    let points: Vec<_> = times.iter().map(|t| (turn(*t), Vector3::new(*t, 0.0, 1.0))).collect();
    let spline = CubicSpline::new((So3, Euclidean::<3>), &times, &points).expect("it is a curve");
    let x: Vec<f64> = (0..161).map(|i| f64::from(i) / 10.0).collect();
    let samples = spline.sample(&x).expect("times are inside");
    assert!(samples.windows(2).all(|pair| pair[0].0.coords.dot(&pair[1].0.coords) > 0.9));
    let (rate, velocity): (Vector3<f64>, Vector3<f64>) = spline.velocity(3.3);
    assert!((rate.z - std::f64::consts::FRAC_PI_4).abs() < 1e-12 && (velocity.x - 1.0).abs() < 1e-12);
}

/// Noisy rotations and positions.
fn noisy() -> (Vec<f64>, Vec<(Matrix, [f64; 2])>) {
    let noise = |i: u32| (1e4 * f64::from(i).sin()).fract();
    let t: Vec<f64> = (0..50).map(|i| 0.05 * f64::from(i)).collect();
    let points = (0..50).map(|i| {
        let t = 0.05 * f64::from(i);
        (rotation(t + 0.01 * noise(i + 1)), [t.sin() + 0.1 * noise(i + 100), t + 5.0 * noise(i + 200)])
    });
    (t, points.collect())
}

fn smooth(options: &Smoothing) -> SmoothingSpline<(So3, Euclidean<2>), (Matrix, [f64; 2])> {
    let (t, points) = noisy();
    options.fit((So3, Euclidean), &t, &points).expect("there is a curve")
}

#[test]
fn smoothing_chooses_lam_and_sigma_in_every_factor() {
    let (t, mut points) = noisy();
    points[49].0 = points[0].0;
    points[49].1 = points[0].1;
    let (turns, shifts): (Vec<Matrix>, Vec<[f64; 2]>) = points.iter().copied().unzip();
    let weights: Vec<f64> = (0..50).map(|i| 1.0 + 0.5 * f64::from(i % 3)).collect();
    let plain = Smoothing::default;
    for options in [
        plain(),
        plain().criterion(Criterion::Reml).gamma(1.0).weights(&weights),
        plain().loss(Loss::Huber).knots(&[0.0, 0.5, 1.0, 1.7, 2.45]),
        plain().sigma(0.1).criterion(Criterion::Cp),
        plain().lam(1e-4).periodic().extrapolate(Extrapolate::Periodic),
    ] {
        let soft = options.fit((So3, Euclidean::<2>), &t, &points).expect("there is a curve");
        let turn = options.fit(So3, &t, &turns).expect("there is a curve");
        let shift = options.fit(Euclidean::<2>, &t, &shifts).expect("there is a curve");
        assert_eq!(soft.smoothing_report(), [turn.smoothing_report(), shift.smoothing_report()]);
        for x in [0.0, 0.33, 2.0] {
            assert_eq!(soft.at(x), (turn.at(x), shift.at(x)));
            assert_eq!(soft.velocity(x), (turn.velocity(x), shift.velocity(x)));
            assert_eq!(soft.std(x), [turn.std(x), shift.std(x)]);
        }
        assert_eq!(soft.clone().into_spline().at(0.4), soft.at(0.4));
    }
}

#[test]
fn lam_and_sigma_are_given_for_all_factors_or_for_each() {
    let lam = |options: Smoothing| smooth(&options).smoothing_report().map(|report| report.lam);
    let plain = Smoothing::default;
    assert_eq!(lam(plain().lam(0.01)), [0.01, 0.01]);
    assert_eq!(lam(plain().lam([0.01, 2.0])), [0.01, 2.0]);
    assert_eq!(lam(plain().lam(vec![0.01, 2.0])), [0.01, 2.0]);
    let [chosen, given] = lam(plain().lam([None, Some(2.0)]));
    assert_eq!([chosen, given], [lam(plain())[0], 2.0]);
    let sigma = smooth(&plain().lam(0.01).sigma([0.1, 3.0])).smoothing_report().map(|report| report.sigma);
    assert_eq!(sigma, [0.1, 3.0]);
    let (t, points) = noisy();
    let fit =
        |options: Smoothing| options.fit((So3, Euclidean::<2>), &t, &points).expect_err("it is refused");
    assert_eq!(
        fit(plain().lam([1.0; 3])),
        Error::LengthMismatch { curve: 0, what: "values of lam", expected: 2, found: 3 }
    );
    assert!(matches!(fit(plain().sigma([1.0, -1.0])), Error::InvalidOption { name: "sigma", .. }));
}

#[test]
fn products_are_read_as_they_were_written() {
    let spline = fit(&T.map(point), Ends::default(), Extrapolate::Error);
    let text = serde_json::to_string(&spline).expect("it is written");
    let read: CubicSpline<Space, Point> = serde_json::from_str(&text).expect("it is read");
    assert_eq!(AT.map(|t| (read.at(t), read.velocity(t))), AT.map(|t| (spline.at(t), spline.velocity(t))));
    let space = Product(vec![AnySpace::new("r", &[1]).expect("it is a space"); 2]);
    let points = [vec![vec![1.0], vec![2.0]], vec![vec![3.0], vec![5.0]]];
    let spline = CubicSpline::new(space, &T[..2], &points).expect("it is a curve");
    let text = serde_json::to_string(&spline).expect("it is written");
    assert!(text.contains("\"points\":[1.0,3.0,2.0,5.0]"), "factor after factor: {text}");
    let read = |text: &str| serde_json::from_str::<CubicSpline<Product<AnySpace>, Vec<Vec<f64>>>>(text);
    let same = read(&text).expect("it is read");
    assert_eq!((same.points(), same.space()), (spline.points(), spline.space()));
    for (good, bad) in
        [("[1.0,3.0,", "[1.0,3.0,4.0,"), ("\"r\"", "\"s\""), ("{\"name\":\"euclidean\",\"sizes\":[1]},", "")]
    {
        let changed = text.replacen(good, bad, 1);
        assert!(read(&changed).is_err() || changed == text, "{changed}");
    }
}

fn error(points: &[Point]) -> Error {
    CubicSpline::new(SPACE, &T[..points.len()], points).expect_err("the input is invalid")
}

#[test]
fn errors_name_the_factor() {
    let points = [0.0, 0.3, 1.0].map(point);
    let mut off = points;
    off[2].1[0] = f64::NAN;
    let found = error(&off);
    let Error::InFactor { factor: 1, space, error: cause } = &found else { panic!("{found}") };
    assert!(matches!(**cause, Error::OffSpace { curve: 0, node: 2, .. }), "{cause}");
    assert_eq!(space, "Euclidean");
    assert!(found.to_string().starts_with("factor 1, Euclidean: curve 0, node 2: "), "{found}");

    // All factors are validated before a curve is fitted, and the first one counts.
    off[1].2 = [0.0; 3];
    assert!(matches!(error(&off), Error::InFactor { factor: 1, .. }));
    let mut far = points;
    far[1].2 = far[0].2.map(|x| -x);
    let found = error(&far);
    let Error::InFactor { factor: 2, error: cause, .. } = found else { panic!("{found}") };
    assert!(matches!(*cause, Error::CutLocus { node: 0, .. }), "{cause}");

    let closed = CubicSpline::builder(SPACE).ends(Ends::Periodic).fit(&T[..3], &points);
    assert!(
        matches!(closed, Err(Error::InFactor { factor: 0, error, .. }) if matches!(*error, Error::NotClosed { .. }))
    );
    let fast = End::Velocity(([0.0; 3], [0.0; 2], [0.0, 1e6, 0.0]));
    let found = CubicSpline::builder(SPACE).ends([fast, End::Natural]).fit(&T[..3], &points);
    assert!(
        matches!(found, Err(Error::InFactor { factor: 2, error, .. }) if matches!(*error, Error::InvalidEnd { start: true, .. }))
    );
    let found = CubicSpline::builder(SPACE).tol(0.0).max_iter(1).method(Method::Newton).fit(&T[..3], &points);
    assert!(
        matches!(found, Err(Error::InFactor { error, .. }) if matches!(*error, Error::Unconverged { .. }))
    );

    // Of a batch, the error is that of the first curve.
    let found = Batch::fit_shared(SPACE, &T[..3], &[points, far, off]).expect_err("two are invalid");
    let Error::InFactor { factor: 1, error: cause, .. } = found else { panic!("{found}") };
    assert!(matches!(*cause, Error::OffSpace { curve: 2, .. }), "{cause}");
    let found = Batch::fit_shared(SPACE, &T[..3], &[points, far]).expect_err("one has no curve");
    assert!(
        matches!(found, Error::InFactor { factor: 2, error, .. } if matches!(*error, Error::CutLocus { curve: 1, .. }))
    );
    let mut noisy = points;
    noisy[1].2 = [2.0, 0.0, 0.0];
    let found = Smoothing::default().fit(SPACE, &T[..3], &noisy).expect_err("it is off the sphere");
    assert!(matches!(found, Error::InFactor { factor: 2, .. }));
}

#[test]
fn errors_of_times_and_options_are_those_of_the_product() {
    let points = [0.0, 0.3, 1.0].map(point);
    let fit = |times: &[f64]| CubicSpline::new(SPACE, times, &points).expect_err("the times are invalid");
    assert!(matches!(fit(&[0.0, 1.0, 1.0]), Error::UnsortedTimes { node: 2, .. }));
    assert!(matches!(fit(&[0.0, f64::NAN, 1.0]), Error::TimeNotFinite { node: 1, .. }));
    assert!(matches!(fit(&[0.0, 1.0]), Error::LengthMismatch { what: "times", .. }));
    let found = CubicSpline::builder(SPACE).tol(-1.0).fit(&T[..3], &points);
    assert!(matches!(found, Err(Error::InvalidOption { name: "tol", .. })));
    assert!(matches!(error(&points[..1]), Error::TooFewPoints { points: 1, .. }));
}

#[test]
fn points_have_one_entry_per_factor() {
    let space = Product(vec![AnySpace::new("r", &[1]).expect("it is a space"); 2]);
    let fit = |points: &[Vec<Vec<f64>>]| {
        CubicSpline::new(space.clone(), &T[..points.len()], points).expect_err("the points are invalid")
    };
    let good = vec![vec![1.0], vec![2.0]];
    assert_eq!(
        fit(&[good.clone(), vec![vec![1.0]]]),
        Error::FactorCount { curve: 0, node: 1, expected: 2, found: 1 }
    );
    assert_eq!(
        fit(&[good.clone(), vec![vec![1.0]; 3]]),
        Error::FactorCount { curve: 0, node: 1, expected: 2, found: 3 }
    );
    let found = fit(&[good.clone(), vec![vec![1.0], vec![2.0, 3.0]]]);
    let Error::InFactor { factor: 1, error: cause, space: name } = found else { panic!("{found}") };
    assert_eq!(*cause, Error::PointLength { curve: 0, node: 1, expected: 1, found: 2 });
    assert_eq!(name, "AnySpace(\"euclidean\", [1])");
    let points = [good.clone(), good.clone()];
    for wrong in [vec![vec![1.0]], vec![vec![1.0], vec![1.0, 2.0]]] {
        let builder = CubicSpline::builder(space.clone()).ends(End::Velocity(wrong));
        assert!(builder.fit(&T[..2], &points).is_err());
    }
    let none: Product<AnySpace> = Product(Vec::new());
    let empty: [Vec<Vec<f64>>; 2] = Default::default();
    let found = CubicSpline::new(none, &T[..2], &empty).expect_err("it has no factor");
    assert!(matches!(found, Error::InvalidSpace { .. }));
    let found = CubicSpline::new((Sphere::<1>, Sphere::<2>), &T[..2], &[([1.0], [1.0, 0.0]); 2]);
    assert!(
        matches!(found, Err(Error::InFactor { factor: 0, error, .. }) if matches!(*error, Error::InvalidSpace { .. }))
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// No points of any number of factors cause a panic, and a curve passes through its points.
    #[test]
    fn any_input_is_a_curve_or_an_error(
        points in prop::collection::vec(prop::collection::vec(prop::collection::vec(-2.0..2.0_f64, 0..3), 0..4), 0..5),
        sizes in prop::collection::vec(1..3_usize, 0..4),
        (fitting, noisy) in (any::<bool>(), any::<bool>()),
    ) {
        let space = Product(sizes.iter().map(|size| AnySpace::new("r", &[*size]).expect("it is a space")).collect());
        let mut points = points;
        if fitting {
            for point in &mut points {
                point.resize(sizes.len(), Vec::new());
                point.iter_mut().zip(&sizes).for_each(|(row, size)| row.resize(*size, 0.5));
            }
        }
        let times: Vec<f64> = (0..points.len()).map(|i| i as f64).collect();
        if noisy {
            let _ = Smoothing::default().lam(1.0).fit(space, &times, &points);
        } else if let Ok(spline) = CubicSpline::new(space, &times, &points) {
            prop_assert_eq!(spline.points(), points);
        } else {
            prop_assert!(!fitting || points.len() < 2 || sizes.is_empty());
        }
    }
}
