//! Microbenchmarks of the kernels: `cargo bench -p symspline-benches`. One core; divan prints the time per
//! sample or per knot as the throughput.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use symspline_engine::curve::{Curves, Outside, Quantity, Times, evaluate};
use symspline_engine::fit::{End, Ends, Method, Options, Problem, fit};
use symspline_engine::monitor::Monitor;
use symspline_engine::parallel::set_num_threads;
use symspline_engine::space::Erased;
use symspline_engine::spaces::Sphere;

fn main() {
    set_num_threads(1);
    divan::main();
}

const ON: fn(usize) -> bool = |_| true;
const OPTIONS: Options = Options { method: Method::Auto, tol: 1e-12, max_iter: None, certify: None };

/// A smooth curve on S³ with steps of about 0.3 rad.
fn points(n: usize) -> Vec<f64> {
    let point = |i: usize| {
        let t = 0.1 * i as f64;
        let (a, b, c) = (1.0 + 0.3 * t.sin(), 3.0 * t, (1.3 * t).cos());
        [a.cos() * b.cos(), a.cos() * b.sin(), a.sin() * c.cos(), a.sin() * c.sin()]
    };
    (0..n).flat_map(point).collect()
}

fn fitted(n: usize) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let (space, t, p) = (sphere(), knots(n), points(n));
    let mut u = vec![0.0; p.len()];
    run(&space, &t, &p, &[0, n], &mut u);
    (t, p, u)
}

fn sphere() -> Sphere {
    Sphere::new(3).unwrap()
}

fn knots(n: usize) -> Vec<f64> {
    (0..n).map(|i| i as f64).collect()
}

fn run(space: &Sphere, t: &[f64], points: &[f64], offsets: &[usize], u: &mut [f64]) {
    let ends = Ends::Open([End::Natural, End::Natural]);
    let problem = Problem { t, shared: true, points, offsets, ends };
    black_box(fit(&Erased(space), &problem, &OPTIONS, &Monitor::new(&ON), u));
}

#[divan::bench(args = [10, 100, 1000, 100_000])]
fn fit_one(bencher: Bencher, n: usize) {
    let (t, p) = (knots(n), points(n));
    let mut u = vec![0.0; p.len()];
    bencher.counter(ItemsCount::new(n)).bench_local(|| run(&sphere(), &t, &p, &[0, n], &mut u));
}

#[divan::bench]
fn fit_1000_curves_of_20(bencher: Bencher) {
    let (t, p) = (knots(20), points(20_000));
    let offsets: Vec<usize> = (0..=1000).map(|i| i * 20).collect();
    let mut u = vec![0.0; p.len()];
    bencher.counter(ItemsCount::new(20_000_usize)).bench_local(|| run(&sphere(), &t, &p, &offsets, &mut u));
}

#[divan::bench(args = [Quantity::Point, Quantity::Velocity, Quantity::Acceleration])]
fn evaluate_sorted(bencher: Bencher, quantity: Quantity) {
    evaluate_at(bencher, quantity, |i| i as f64 * 999.0 / 1e5);
}

#[divan::bench(args = [Quantity::Point, Quantity::Velocity, Quantity::Acceleration])]
fn evaluate_anywhere(bencher: Bencher, quantity: Quantity) {
    evaluate_at(bencher, quantity, |i| (i as f64 * 618.033_988_749_895) % 999.0);
}

/// One time per call of the crate for Rust users, at increasing times.
#[divan::bench]
fn at_one_time(bencher: Bencher) {
    let (t, p) = (knots(1000), points(1000));
    let spline = symspline::CubicSpline::new(symspline::Sphere::<4>, &t, p.as_chunks::<4>().0).unwrap();
    call_at(bencher, |x| black_box(spline.at(x))[0]);
}

/// The same in a product of two spheres.
#[divan::bench]
fn at_one_time_of_a_product(bencher: Bencher) {
    let (t, p) = (knots(1000), points(1000));
    let pairs: Vec<_> = p.as_chunks::<4>().0.iter().map(|p| (*p, *p)).collect();
    let space = (symspline::Sphere::<4>, symspline::Sphere::<4>);
    let spline = symspline::CubicSpline::new(space, &t, &pairs).unwrap();
    call_at(bencher, |x| black_box(spline.at(x)).0[0]);
}

fn call_at(bencher: Bencher, at: impl Fn(f64) -> f64) {
    let times: Vec<f64> = (0..10_000).map(|i| i as f64 * 0.0999).collect();
    bencher.counter(ItemsCount::new(times.len())).bench_local(|| times.iter().map(|x| at(*x)).sum::<f64>());
}

fn evaluate_at(bencher: Bencher, quantity: Quantity, time: impl Fn(usize) -> f64) {
    const SAMPLES: usize = 100_000;
    let (t, points, velocities) = fitted(1000);
    let x: Vec<f64> = (0..SAMPLES).map(time).collect();
    let curves = Curves { t: &t, nodes: 1000, points: &points, velocities: &velocities, before: &[] };
    let times = Times { x: &x, count: SAMPLES };
    let mut out = vec![0.0; 4 * SAMPLES];
    bencher.counter(ItemsCount::new(SAMPLES)).bench_local(|| {
        let monitor = Monitor::new(&ON);
        evaluate(&Erased(&sphere()), &curves, &times, quantity, Outside::Continue, &monitor, &mut out);
    });
}
