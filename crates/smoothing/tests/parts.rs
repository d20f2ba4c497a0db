//! Single parts of smoothing. As unit tests, they would compile the crate once more.

mod banded {
    use symspline_core::scalar::Lane;
    use symspline_smoothing::private::Banded;

    /// A diagonally dominant matrix, different on each lane.
    fn example(n: usize, w: usize) -> Banded {
        Banded::of(n, w, |at| {
            let (i, d) = (at / (w + 1), at % (w + 1));
            let x = ((i * 7 + d * 3) as f64).sin();
            Lane::new(std::array::from_fn(|l| if d == 0 { 4.0 + w as f64 + l as f64 } else { x }))
        })
    }

    #[test]
    fn solves_and_inverts() {
        for (n, w) in [(1, 3), (2, 3), (3, 3), (9, 3), (20, 6), (5, 6)] {
            let a = example(n, w);
            let mut factors = a.clone();
            factors.factor();
            let band = factors.inverse_band();
            for column in 0..n {
                let mut x = vec![Lane::ZERO; n];
                x[column] = Lane::ONE;
                factors.solve(1, &mut x);
                for i in 0..n {
                    let near = |j: usize| i.abs_diff(j) <= w;
                    let product =
                        (0..n).filter(|&j| near(j)).fold(Lane::ZERO, |sum, j| sum + a.at(i, j) * x[j]);
                    let wanted = if i == column { Lane::ONE } else { Lane::ZERO };
                    assert!((product - wanted).abs().simd_lt(Lane::splat(1e-14)).all());
                    if near(column) {
                        assert!((band.at(i, column) - x[i]).abs().simd_lt(Lane::splat(1e-15)).all());
                    }
                }
            }
        }
    }
}

mod elimination {
    use symspline_core::scalar::{Dual, Lane, Scalar, lane};
    use symspline_smoothing::private::eliminate;

    /// The matrix g G + P of lane 0 for diagonally dominant matrices G and P, the border last.
    fn entry(i: usize, j: usize, size: usize, g: f64) -> f64 {
        let (row, column) = (i.max(j), i.min(j));
        let [x, y] = [3.0, 5.0].map(|k| (k * (row * 7 + column * 3) as f64).sin());
        if row == column {
            (4.0 + x) * g + 8.0 + if row < size { 0.0 } else { 9.0 }
        } else {
            0.4 * (x * g + y)
        }
    }

    /// ln det of the leading rows, and the last pivot, by dense elimination.
    fn dense(size: usize, width: usize, border: usize, g: f64) -> (f64, f64) {
        let n = size + border;
        let mut a: Vec<Vec<f64>> = (0..n)
            .map(|i| {
                let near = |j: usize| i.max(j) >= size || i.abs_diff(j) <= width;
                (0..n).map(|j| if near(j) { entry(i, j, size, g) } else { 0.0 }).collect()
            })
            .collect();
        let mut log_det = 0.0;
        for k in 0..n - 1 {
            log_det += a[k][k].ln();
            for i in k + 1..n {
                let factor = a[i][k] / a[k][k];
                for j in k..n {
                    a[i][j] -= factor * a[k][j];
                }
            }
        }
        (log_det, a[n - 1][n - 1])
    }

    #[test]
    fn agrees_with_dense_elimination_and_its_derivative() {
        for (size, width, border) in [(1, 3, 1), (2, 3, 3), (9, 3, 1), (20, 7, 4), (5, 7, 2), (30, 4, 3)] {
            let number = |i: usize, j: usize| {
                let value = entry(i, j, size, 1.0);
                Dual::from_parts([lane(value), lane(value - entry(i, j, size, 0.0)), Lane::ZERO])
            };
            let corner =
                (0..border * border).map(|at| number(size + at / border, size + at % border)).collect();
            let found = eliminate(size, width, corner, 1, |i, row: &mut [Dual]| {
                for (c, x) in row.iter_mut().enumerate() {
                    *x = match (i + c).checked_sub(width) {
                        _ if c > width => number(size + c - width - 1, i),
                        Some(j) => number(i, j),
                        None => Dual::constant(Lane::ZERO),
                    };
                }
            });
            let h = 1e-4;
            let [before, at, after] = [1.0 - h, 1.0, 1.0 + h].map(|g| dense(size, width, border, g));
            let first = |x: Lane| x.as_array()[0];
            assert!((first(found.log_det.v) - at.0).abs() < 1e-12 * at.0.abs());
            assert!((first(found.rest[0].v) - at.1).abs() < 1e-12 * at.1.abs());
            assert!((first(found.log_det.d) - (after.0 - before.0) / (2.0 * h)).abs() < 1e-6);
            assert!((first(found.rest[0].d) - (after.1 - before.1) / (2.0 * h)).abs() < 1e-6);
            assert!(found.least.simd_gt(Lane::ZERO).all());
        }
    }
}

mod gaps {
    use symspline_core::scalar::{Lane, lane};
    use symspline_smoothing::estimation::Matrices;
    use symspline_smoothing::gaps::{Block, Changes, Functionals, System};
    use symspline_smoothing::private::{
        Banded, Basis, Factored, LinearProblem, OVERLAP, PeriodicCorrection, Stencil,
    };
    use symspline_smoothing::{EndCondition, EndConditions, Penalty, positions};

    /// The values and their variances at the data of a fit with weights and λ of the segments, and the accelerations at the
    /// knots.
    fn fit(
        knots: &[f64],
        t: &[f64],
        y: &[f64],
        weights: &[f64],
        (lam, profile, penalty): (f64, &[f64], Penalty),
        ends: EndConditions,
    ) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let mut linear = LinearProblem::new(Basis::new(knots, ends), &positions(knots, t), weights, penalty);
        linear.set_profile(profile);
        let count = linear.basis.count();
        let periodic = linear.basis.is_closed().then(|| PeriodicCorrection::plain(OVERLAP, 1));
        let band = Banded::of(count, 3, |at| lane(linear.gram[at] + lam * linear.penalty[at]));
        let matrix = Factored::new(band, periodic.as_ref());
        let mut right = vec![0.0; count];
        linear
            .data
            .iter()
            .zip(weights.iter().zip(y))
            .for_each(|(row, (w, y))| row.spread(&[w * y], &mut right));
        periodic.iter().for_each(|periodic| periodic.fold(&mut right));
        let mut x: Vec<Lane> = right.iter().map(|x| lane(*x)).collect();
        matrix.solve(1, &mut x);
        let mut c: Vec<f64> = x.iter().map(|x| x.as_array()[0]).collect();
        periodic.iter().for_each(|periodic| periodic.extend(&mut c));
        let inverse = matrix.inverse_band();
        let of_rows = |rows: &[Stencil]| -> Vec<f64> {
            let value = |row: &Stencil| {
                let mut out = [0.0];
                row.apply(&c, &mut out);
                out[0]
            };
            rows.iter().map(value).collect()
        };
        let variances = linear.data.iter().map(|row| row.square(&inverse).as_array()[0]).collect();
        (of_rows(&linear.data), variances, of_rows(&linear.accelerations))
    }

    #[test]
    fn omitted_data_have_the_predictions_of_a_fit_without_them() {
        let n = 40;
        let knots: Vec<f64> = (0..=20).map(|i| f64::from(i) + 0.3 * (f64::from(i) * 1.7).sin()).collect();
        let span = knots[20] - knots[0];
        let t: Vec<f64> = (0..n).map(|i| knots[0] + span * (f64::from(i) + 0.5) / f64::from(n)).collect();
        let y: Vec<f64> = t.iter().map(|t| (0.7 * t).sin() + 0.3 * (9.0 * t).cos()).collect();
        let weights: Vec<f64> = t.iter().map(|t| 1.5 + t.cos()).collect();
        let lam = 0.4;
        let natural = EndConditions::Open([EndCondition::Natural; 2]);
        let free = EndConditions::Open([EndCondition::NotAKnot; 2]);
        let constant = [1.0; 20];
        let varying: Vec<f64> = (0..20).map(|i| f64::from(i).sin().exp()).collect();
        for (ends, penalty, profile) in [
            (natural, Penalty::Acceleration, &constant[..]),
            (EndConditions::Periodic, Penalty::Acceleration, &constant),
            (natural, Penalty::Acceleration, &varying),
            (EndConditions::Periodic, Penalty::Acceleration, &varying),
            (free, Penalty::Jerk, &varying),
        ] {
            let how = (lam, profile, penalty);
            let (values, _, accelerations) = fit(&knots, &t, &y, &weights, how, ends);
            let mut linear =
                LinearProblem::new(Basis::new(&knots, ends), &positions(&knots, &t), &weights, penalty);
            linear.set_profile(profile);
            let spacing = linear.basis.spacing;
            let accelerations: Vec<f64> = accelerations.iter().map(|a| a / (spacing * spacing)).collect();
            let band = (0..linear.gram.len()).map(|at| linear.gram[at] + lam * linear.penalty[at]).collect();
            let matrices: Matrices = [band, Vec::new(), Vec::new()];
            // λ is 0.7 in the segments of a block.
            let changes: Vec<f64> = profile.iter().map(|x| (0.7 - lam * x) * penalty.unit(spacing)).collect();
            let changes = Changes { lam: &changes, accelerations: &accelerations, penalised: penalty };
            let plain_system = System::new(&knots, ends, 1, &matrices, &[1.0]);
            let system = System::new(&knots, ends, 1, &matrices, &[1.0]).with_changes(Some(changes));
            let firsts: Vec<usize> = linear.data.iter().map(|row| row.first).collect();
            let rows = |scale: &dyn Fn(usize) -> f64| -> Vec<f64> {
                linear
                    .data
                    .iter()
                    .enumerate()
                    .flat_map(|(k, row)| row.factors.map(|x| x * scale(k)))
                    .collect()
            };
            let (weighed, plain) = (rows(&|k| weights[k].sqrt()), rows(&|_| 1.0));
            let residuals: Vec<f64> = (0..t.len()).map(|k| weights[k].sqrt() * (y[k] - values[k])).collect();
            // The last block wraps around to the start, and the second one is at an end.
            let lists: [Vec<usize>; 3] = [(10..17).collect(), (30..40).collect(), vec![37, 38, 39, 0, 1, 2]];
            for (list, segments) in lists.iter().zip([4..8, 14..20, 18..22]) {
                let all = Functionals { firsts: &firsts, factors: &weighed, sides: &[] };
                let probes = Functionals { firsts: &firsts, factors: &plain, sides: &[] };
                let fewer: Vec<f64> =
                    (0..t.len()).map(|k| if list.contains(&k) { 0.0 } else { weights[k] }).collect();
                let mut changed = profile.to_vec();
                segments.clone().for_each(|i| changed[i % 20] = 0.7 / lam);
                for (system, profile) in [(&plain_system, profile), (&system, &changed)] {
                    let block = Block { omitted: list, probes: 0..t.len(), segments: segments.clone() };
                    let found = system.without(&all, &residuals, 1, &probes, &[block]);
                    let how = (lam, profile, penalty);
                    let (again, variances, _) = fit(&knots, &t, &y, &fewer, how, ends);
                    for k in 0..t.len() {
                        assert!((values[k] + found.values[k] - again[k]).abs() < 1e-9);
                        assert!((found.variances[k] - variances[k]).abs() < 1e-8 * variances[k].max(1.0));
                    }
                }
            }
        }
    }
}

mod linearized {
    use symspline_core::scalar::lane;
    use symspline_smoothing::private::{Basis, LinearProblem, WIDTH};
    use symspline_smoothing::{EndCondition, EndConditions, Penalty};

    const BAND: usize = WIDTH + 1;

    const KNOTS: [f64; 6] = [0.0, 0.5, 2.0, 2.25, 4.0, 5.0];

    /// The value of the spline with given coefficients.
    fn value(basis: &Basis, c: &[f64], segment: usize, position: f64, nu: usize) -> f64 {
        let mut out = [0.0];
        basis.row(segment, position, nu).apply(c, &mut out);
        out[0]
    }

    #[test]
    fn is_a_natural_cubic_spline() {
        for count in 2..=6 {
            let basis = Basis::new(&KNOTS[..count], EndConditions::Open([EndCondition::Natural; 2]));
            let c: Vec<f64> = (0..count).map(|i| (3.0 * i as f64).cos()).collect();
            let last = count - 2;
            for (segment, position) in [(0, 0.0), (last, 1.0)] {
                assert!(value(&basis, &c, segment, position, 2).abs() < 1e-13);
            }
            for i in 0..last {
                for nu in 0..3 {
                    let [left, right] = [(i, 1.0), (i + 1, 0.0)].map(|(s, p)| value(&basis, &c, s, p, nu));
                    assert!((left - right).abs() < 1e-13, "{count} {i} {nu}: {left} {right}");
                }
            }
            // Derivatives against differences.
            let h = 1e-4;
            for segment in 0..=last {
                for nu in 0..2 {
                    let step = 2.0 * h * basis.h(segment);
                    let [a, b] = [0.4 - h, 0.4 + h].map(|p| value(&basis, &c, segment, p, nu));
                    assert!(((b - a) / step - value(&basis, &c, segment, 0.4, nu + 1)).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn reproduces_straight_lines() {
        for ends in [EndCondition::Natural, EndCondition::Velocity] {
            let basis = Basis::new(&KNOTS, EndConditions::Open([ends; 2]));
            for segment in 0..5 {
                let ones = value(&basis, &[1.0; 6], segment, 0.3, 0);
                assert!((ones - 1.0).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn energy_matches_the_second_derivative() {
        let basis = Basis::new(&KNOTS, EndConditions::Open([EndCondition::Natural; 2]));
        let linearized = LinearProblem::new(basis, &[(0, 0.0)], &[0.0], Penalty::Acceleration);
        let c: Vec<f64> = (0..6).map(|i| (2.0 * i as f64).sin()).collect();
        let mut accelerations = vec![0.0; 6];
        linearized
            .accelerations
            .iter()
            .zip(&mut accelerations)
            .for_each(|(row, x)| row.apply(&c, std::slice::from_mut(x)));
        let mass = linearized.times_metric(&accelerations, 1);
        let energy: f64 = accelerations.iter().zip(&mass).map(|(a, b)| a * b).sum();
        let form: f64 = (0..6)
            .flat_map(|i| (0..=WIDTH.min(i)).map(move |d| (i, d)))
            .map(|(i, d)| linearized.penalty[i * BAND + d] * c[i] * c[i - d] * if d > 0 { 2.0 } else { 1.0 })
            .sum();
        let simpson: f64 = (0..5)
            .map(|s| {
                let [a, b, d] = [0.0, 0.5, 1.0].map(|p| value(&linearized.basis, &c, s, p, 2).powi(2));
                linearized.basis.h(s) * (a + 4.0 * b + d) / 6.0
            })
            .sum();
        assert!((energy / simpson - 1.0).abs() < 1e-13 && (form / simpson - 1.0).abs() < 1e-13);
    }

    #[test]
    fn not_a_knot_ends_reproduce_cubics() {
        let basis = Basis::new(&KNOTS, EndConditions::Open([EndCondition::NotAKnot; 2]));
        let linearized = LinearProblem::new(basis, &[(0, 0.0)], &[0.0], Penalty::Jerk);
        let basis = &linearized.basis;
        let c: Vec<f64> = (0..6).map(|i| (2.0 * i as f64).sin()).collect();
        for [outer, inner] in [[0, 1], [4, 3]] {
            let [a, b] = [outer, inner].map(|segment| value(basis, &c, segment, 0.5, 3));
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        // ∫ x'''² of a function whose third derivative is constant on every segment.
        let square = |s: usize| value(basis, &c, s, 0.5, 3).powi(2) * basis.h(s);
        let exact: f64 = (0..5).map(square).sum();
        let acceleration = |(_, i): (usize, usize)| {
            let mut x = [0.0];
            linearized.accelerations[i].apply(&c, &mut x);
            lane(x[0])
        };
        let energy = linearized.energy(false, acceleration).as_array()[0];
        let form: f64 = (0..6)
            .flat_map(|i| (0..=WIDTH.min(i)).map(move |d| (i, d)))
            .map(|(i, d)| linearized.penalty[i * BAND + d] * c[i] * c[i - d] * if d > 0 { 2.0 } else { 1.0 })
            .sum();
        assert!((energy / exact - 1.0).abs() < 1e-12 && (form / exact - 1.0).abs() < 1e-11);
    }
}

mod chi {
    use symspline_smoothing::chi::{quantile, ratio_quantile};

    #[test]
    fn quantiles_of_ratios_match_tables() {
        // Abramowitz & Stegun, table 26.9.
        for (m, n, wanted) in [(1, 1, 161.4), (3, 3, 9.277), (3, 12, 3.49), (2, 60, 3.15)] {
            let found = ratio_quantile(m, n, 0.95) / m as f64;
            assert!((found / wanted - 1.0).abs() < 0.01, "{m} {n}: {found}");
        }
    }

    #[test]
    fn quantiles_match_tables() {
        // Abramowitz & Stegun, table 26.8; two degrees of freedom are −2 ln(1 − p).
        let known = [
            (1, 0.95, 3.841_458_820_694_124),
            (3, 0.5, 2.365_973_884_375_338),
            (6, 0.99, 16.811_893_829_770_93),
            (30, 0.05, 18.492_660_981_953_467),
            (2, 0.82, -2.0 * f64::ln(0.18)),
        ];
        for (m, p, wanted) in known {
            assert!((quantile(m, p) / wanted - 1.0).abs() < 1e-12, "{m} {p}: {}", quantile(m, p));
        }
        assert_eq!(quantile(4, 0.0), 0.0);
        assert_eq!(quantile(4, 1.0), f64::INFINITY);
    }
}

mod cyclic {
    use symspline_core::scalar::{Lane, lane};
    use symspline_smoothing::private::{Banded, Factored, PeriodicCorrection};

    #[test]
    fn closes_and_inverts() {
        for (count, m, width) in [(3, 1, 3), (4, 1, 3), (9, 1, 3), (3, 2, 7), (5, 2, 7), (8, 2, 7)] {
            let (sine, cosine) = 0.7_f64.sin_cos();
            let turn = if m == 1 { vec![1.0] } else { vec![cosine, -sine, sine, cosine] };
            let periodic = PeriodicCorrection { overlap: 3, m, turn };
            let long = (count + 3) * m;
            let whole = Banded::of(long, width, |at| {
                let (i, d) = (at / (width + 1), at % (width + 1));
                lane(if d == 0 {
                    20.0
                } else if d <= i {
                    ((i * 7 + d * 3) as f64).sin()
                } else {
                    0.0
                })
            });
            let dense = |i: usize, j: usize| if i.abs_diff(j) <= width { whole.at(i, j) } else { Lane::ZERO };
            let factored = Factored::new(whole.clone(), Some(&periodic));
            let band = factored.inverse_band();
            assert!(factored.least_pivot().simd_gt(Lane::ZERO).all());
            for column in 0..count * m {
                let mut x = vec![Lane::ZERO; count * m];
                x[column] = Lane::ONE;
                factored.solve(1, &mut x);
                periodic.extend_lanes(&mut x);
                // The product with EᵀAE is the unit vector again.
                let product: Vec<f64> = (0..long)
                    .map(|i| (0..long).fold(Lane::ZERO, |sum, j| sum + dense(i, j) * x[j]).as_array()[0])
                    .collect();
                let mut product = product;
                periodic.fold(&mut product);
                for (i, y) in product.iter().enumerate() {
                    assert!((y - f64::from(i == column)).abs() < 1e-13, "{count} {m}: {i} {column} {y}");
                }
                for i in 0..long {
                    if i.abs_diff(column) <= width {
                        assert!((band.at(i, column) - x[i]).abs().simd_lt(lane(1e-14)).all());
                    }
                }
            }
        }
    }
}

mod calibrate {
    use symspline_smoothing::calibrate::{LEVEL, Predicted, factor_of};
    use symspline_smoothing::chi;

    /// Errors of known variance have the factor that they were made with; the F distribution enlarges it for few blocks.
    #[test]
    fn the_factor_is_that_of_the_errors() {
        // Quantiles of the normal distribution in an order without a pattern stand for random numbers.
        let count = 20_011;
        for k in [1.0_f64, 2.5, 8.0] {
            let predicted: Vec<Predicted> = (0..count)
                .map(|i| {
                    let part = |step: usize| ((i * step % count) as f64 + 0.5) / count as f64;
                    let v = 3.0 + 37.0 * part(7919);
                    // The mean of three squares is χ² with three degrees of freedom divided by three.
                    let square = chi::quantile(3, part(104_729)) / 3.0;
                    let whole = v + (k * k - 1.0) * (v - 1.0) + 1.0;
                    Predicted { square: square * whole, variance: v, at_data: 1.0, distance: 0.0 }
                })
                .collect();
            assert!((factor_of(&predicted, 3, 1e6) / k - 1.0).abs() < 0.02, "{k}");
            let few = (chi::ratio_quantile(3, 12, LEVEL) / chi::quantile(3, LEVEL)).sqrt();
            assert!((factor_of(&predicted, 3, 4.0) / (k * few) - 1.0).abs() < 0.03, "{k}");
            assert!(factor_of(&predicted[..2], 3, 4.0).is_nan());
        }
    }
}

mod loss {
    use symspline_smoothing::Loss;

    #[test]
    fn slopes_match_the_loss() {
        // ψ is half the gradient of ρ(|r|²), ψ' its divergence over m.
        let (corner, h) = (0.7, 1e-4);
        for loss in [Loss::Linear, Loss::Huber, Loss::Cauchy] {
            for r in [[0.3, 0.1, 0.2], [1.1, -0.4, 0.5], [4.0, 1.0, -3.0]] {
                let square = |r: [f64; 3]| r.iter().map(|x| x * x).sum::<f64>();
                let value = |r: [f64; 3]| loss.value(square(r), corner);
                let moved = |c: usize, by: f64| {
                    let mut x = r;
                    x[c] += by;
                    x
                };
                let (factor, slope) = loss.slopes(square(r) / (corner * corner), 3);
                let mut divergence = 0.0;
                for c in 0..3 {
                    let (up, down) = (value(moved(c, h)), value(moved(c, -h)));
                    assert!((factor * r[c] - (up - down) / (4.0 * h)).abs() < 1e-7);
                    divergence += (up + down - 2.0 * value(r)) / (2.0 * h * h) / 3.0;
                }
                assert!((slope - divergence).abs() < 1e-5, "{loss:?} {r:?}: {slope} {divergence}");
            }
        }
    }
}
