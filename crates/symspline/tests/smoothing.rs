//! Smoothing has the limits, the scales and the symmetries that it must have.

use symspline::prelude::*;

/// Pseudo-random numbers between −1 and 1, equal in every run.
fn noise(i: usize) -> f64 {
    let x = (i as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ (x >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    ((x ^ (x >> 32)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// Irregular times, and noisy values of a sine.
fn data(n: usize) -> (Vec<f64>, Vec<[f64; 1]>) {
    let t: Vec<f64> = (0..n).map(|i| 0.1 * (i as f64 + 0.3 * noise(i))).collect();
    let y = t.iter().enumerate().map(|(i, t)| [t.sin() + 0.1 * noise(1000 + i)]).collect();
    (t, y)
}

fn smooth(
    options: Smoothing,
    t: &[f64],
    y: &[[f64; 1]],
) -> symspline::SmoothingSpline<Euclidean<1>, [f64; 1]> {
    options.fit(Euclidean::<1>, t, y).expect("there is a curve")
}

#[test]
fn the_curve_is_the_line_of_regression_for_large_lam_and_interpolates_for_small() {
    let (t, y) = data(40);
    let stiff = smooth(Smoothing::default().lam(1e9), &t, &y);
    let (mean_t, mean_y) = (t.iter().sum::<f64>() / 40.0, y.iter().map(|y| y[0]).sum::<f64>() / 40.0);
    let (mut up, mut down) = (0.0, 0.0);
    for (t, y) in t.iter().zip(&y) {
        up += (t - mean_t) * (y[0] - mean_y);
        down += (t - mean_t) * (t - mean_t);
    }
    for x in [0.5, 2.0, 3.5] {
        assert!((stiff.at(x)[0] - mean_y - up / down * (x - mean_t)).abs() < 1e-6);
    }
    assert_eq!(smooth(Smoothing::default().lam(0.01), &t, &y).smoothing_report().lam, 0.01);
    let soft = smooth(Smoothing::default().lam(1e-12), &t, &y);
    assert!(t.iter().zip(&y).all(|(t, y)| (soft.at(*t)[0] - y[0]).abs() < 1e-6));
}

#[test]
fn deviations_have_the_scale_of_the_noise() {
    let (t, y) = data(60);
    let found = smooth(Smoothing::default(), &t, &y);
    let report = found.smoothing_report();
    // Uniform noise of 0.1.
    assert!((report.sigma - 0.1 / 3.0_f64.sqrt()).abs() < 0.015, "{report:?}");
    assert!(found.std(3.0) < report.sigma && found.std(3.0) < found.std(t[0]));
    assert!((found.at(3.0)[0] - 3.0_f64.sin()).abs() < 4.0 * found.std(3.0));
    let lam = report.lam;
    let [one, two] =
        [0.1, 0.2].map(|sigma| smooth(Smoothing::default().lam(lam).sigma(sigma), &t, &y).std(3.0));
    assert!((two / one - 2.0).abs() < 1e-12);
    // A spline with knots of its own has no freedom between them.
    let own = smooth(Smoothing::default().lam(lam).sigma(0.1).knots(&t), &t, &y);
    let middle = 0.5 * (t[30] + t[31]);
    let all = smooth(Smoothing::default().lam(lam).sigma(0.1), &t, &y);
    assert!(own.at(middle) == all.at(middle) && own.std(middle) < all.std(middle));
}

#[test]
fn outliers_move_a_robust_curve_less() {
    let (t, mut y) = data(60);
    y[30][0] += 5.0;
    let error = |loss| (smooth(Smoothing::default().loss(loss), &t, &y).at(t[30])[0] - t[30].sin()).abs();
    let [square, huber, cauchy] = [Loss::Linear, Loss::Huber, Loss::Cauchy].map(error);
    assert!(huber < 0.1 && cauchy < 0.1 && square > 3.0 * huber, "{square} {huber} {cauchy}");
    let mut weights = vec![1.0; 60];
    weights[30] = 0.0;
    let left_out = smooth(Smoothing::default().weights(&weights), &t, &y);
    assert!((left_out.at(t[30])[0] - t[30].sin()).abs() < 0.1);
}

#[test]
fn periodic_curves_close() {
    let t: Vec<f64> = (0..40).map(|i| f64::from(i) / 40.0).collect();
    let angle = |i: usize| std::f64::consts::TAU * t[i] + 0.05 * noise(i);
    let y: Vec<[f64; 2]> = (0..40).map(|i| [angle(i).cos(), angle(i).sin()]).collect();
    let knots: Vec<f64> = t.iter().copied().chain([1.0]).collect();
    let found =
        Smoothing::default().knots(&knots).periodic().fit(Sphere::<2>, &t, &y).expect("there is a curve");
    let off = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    assert!(off(found.at(0.0), found.at(1.0)) < 1e-12);
    assert!(off(found.velocity(0.0), found.velocity(1.0)) < 1e-9);
}
