//! Closed forms of curves, and what they do beyond their knots.

use symspline::prelude::*;

const T: [f64; 4] = [0.0, 0.4, 1.0, 1.5];

fn near<const N: usize>(a: [f64; N], b: [f64; N]) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12 * b.abs().max(1.0)), "{a:?} is not {b:?}");
}

#[test]
fn points_of_a_geodesic_give_that_geodesic() {
    let circle = |t: f64| [(2.0 * t).cos(), 0.6 * (2.0 * t).sin(), 0.8 * (2.0 * t).sin()];
    let spline = CubicSpline::builder(Sphere::<3>)
        .extrapolate(Extrapolate::Geodesic)
        .fit(&T, &T.map(circle))
        .expect("it is a curve");
    for t in [-1.0, 0.7, 1.5, 4.0] {
        near(spline.at(t), circle(t));
        near([spline.speed(t)], [2.0]);
    }
    near(spline.acceleration(0.7), [0.0; 3]);
    let line = |t: f64| [(0.5 * t).cosh(), 0.0, (0.5 * t).sinh()];
    let spline = CubicSpline::new(Hyperbolic::<3>, &T, &T.map(line)).expect("it is a curve");
    near(spline.at(1.2), line(1.2));
    near([spline.speed(0.1)], [0.5]);
}

#[test]
fn ends_are_natural_by_default() {
    let spline = CubicSpline::new(Euclidean::<1>, &T, &T.map(|t| [t * t])).expect("it is a curve");
    near(spline.acceleration(T[0]), [0.0]);
    near(spline.acceleration(T[T.len() - 1]), [0.0]);
    assert!(spline.acceleration(1.0)[0] > 1.0);
}

#[test]
fn cubics_of_flat_space_are_exact_and_continue() {
    let cubic = |t: f64| [t * t * t - 2.0 * t, 3.0 - t * t];
    let rate = |t: f64| [3.0 * t * t - 2.0, -2.0 * t];
    let fit = |extrapolate| {
        CubicSpline::builder(Euclidean::<2>)
            .ends([End::Velocity(rate(0.0)), End::Acceleration([9.0, -2.0])])
            .extrapolate(extrapolate)
            .fit(&T, &T.map(cubic))
            .expect("it is a curve")
    };
    let spline = fit(Extrapolate::Segment);
    for t in [-0.5, 0.2, 1.1, 2.0] {
        near(spline.at(t), cubic(t));
        near(spline.velocity(t), rate(t));
    }
    let straight = fit(Extrapolate::Geodesic);
    let [p, v] = [cubic(1.5), rate(1.5)];
    near(straight.at(3.5), [p[0] + 2.0 * v[0], p[1] + 2.0 * v[1]]);
    near(fit(Extrapolate::Periodic).at(1.7), spline.at(0.2));
}

#[test]
fn an_evaluator_returns_the_points_of_the_curve() {
    let factor = |name, size| AnySpace::new(name, &[size]).expect("it is a space");
    let space = Product(vec![factor("sphere", 2), factor("so", 3)]);
    let turn = |t: f64| vec![t.cos(), -t.sin(), 0.0, t.sin(), t.cos(), 0.0, 0.0, 0.0, 1.0];
    let points: Vec<Vec<Vec<f64>>> =
        T.iter().map(|&t| vec![vec![(t * t).cos(), (t * t).sin(), 0.0], turn(t * t)]).collect();
    let spline = CubicSpline::builder(space)
        .extrapolate(Extrapolate::Geodesic)
        .fit(&T, &points)
        .expect("it is a curve");
    let mut evaluator = spline.evaluator();
    // Within a segment, to others and back, at knots, and beyond them.
    for t in [0.1, 0.2, 0.4, 0.5, 1.4, 0.3, 1.5, 1.6, 1.7, -0.1, -0.2, 0.0, 0.05] {
        assert_eq!(evaluator.at(t), spline.at(t));
    }
    assert!(evaluator.try_at(f64::NAN).is_err());
    assert_eq!(evaluator.at(0.7), spline.at(0.7));
}

#[test]
fn the_limit_of_the_cut_locus_is_pi_on_the_sphere() {
    let found =
        CubicSpline::new(Sphere::<2>, &T[..2], &[[1.0, 0.0], [-1.0, 0.0]]).expect_err("they are opposite");
    let pi = std::f64::consts::PI;
    assert!(
        matches!(found, Error::CutLocus { angle, limit, .. } if (limit - pi).abs() < 1e-12 && (angle - pi).abs() < 1e-12)
    );
}

#[test]
fn curves_are_shared_between_threads() {
    fn shared<T: Clone + Send + Sync + std::fmt::Debug>() {}
    shared::<CubicSpline<So3, [[f64; 3]; 3]>>();
    shared::<Batch<AnySpace, Vec<f64>>>();
    shared::<symspline::SmoothingSpline<Se3, [[f64; 4]; 4]>>();
    shared::<Error>();
}
