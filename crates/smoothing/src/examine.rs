//! Tests of whether the residuals of a fit are those of independent noise.
//!
//! Each test compares a statistic with a limit that data without a fault exceed about once in 10⁴ fits. A second limit on
//! the size of the effect is needed because negligible deviations are statistically significant in long recordings.

use crate::audit::{AtData, ResidualStatistics, median};
use crate::chi;
use symspline_core::monitor::checkpoint;
use symspline_core::space::Erased;

/// The limit, in standard deviations, of the mean square and of the autocorrelation.
const SIGNIFICANT: f64 = 4.5;
/// Ratios of residuals to σ between this factor and its inverse are negligible. The second factor is for robust losses,
/// where medians measure the ratio and grow with the share of outliers.
const RATIO: f64 = 1.1;
const ROBUST_RATIO: f64 = 1.6;
/// Autocorrelations below this are negligible.
const CORRELATED: f64 = 0.1;
/// The limit of the largest centred partial sum (Ploberger and Krämer 1992), and the negligible size as a fraction of √n,
/// which corresponds to steps of a quarter of the standard deviation.
const PARTIAL_SUM: f64 = 2.0;
const STEP: f64 = 0.0625;
/// The smallest limit of the largest residual. In long recordings, normal residuals exceed the limit with this probability.
const LARGEST: f64 = 6.0;
const PROBABILITY: f64 = 1e-5;
/// The share of the measurements that a robust loss may reject, the number of its standard errors by which chance may
/// exceed it, and the multiple of the corner of the loss beyond which measurements are rejected.
const REJECTED: f64 = 0.3;
const CHANCE: f64 = 2.0;
const BEYOND: f64 = 9.0;
/// More consecutive rejected measurements than this number, and than this share of all, are reported, because outliers of
/// a sensor are mostly isolated.
const RUN: f64 = 8.0;
const RUN_SHARE: f64 = 0.05;
/// The same for smoothing, where every datum is a point: six in a row are rare among 15 % of isolated outliers.
const RUN_OF_DATA: f64 = 5.0;
const SHARE_OF_DATA: f64 = 0.02;
/// Residuals below this fraction of σ are those of data without noise.
const EXACT: f64 = 1e-6;
/// Residuals of fewer measurements, or with a larger leverage, are not examined.
const FEWEST: usize = 5;
const LEVERAGE: f64 = 0.9;
/// For fits that estimate the noise level: the limit of the ratio of the residuals to the noise estimated from
/// neighbouring data, and the leverage up to which the residuals have nearly the covariance of the noise. Beyond this
/// leverage, only outliers are tested, with a limit multiplied by the third number, up to the fourth number.
const NEIGHBOURS: f64 = 1.75;
const MODERATE: f64 = 0.3;
const UNEVEN: f64 = 1.5;
const HIGH: f64 = 0.6;
/// For such fits, the least number of data, and the number of data on either side with which an outlier is compared.
const FEW_DATA: usize = 20;
const NEAR: usize = 10;
/// The efficiency of the median of squares as an estimate of the variance, relative to that of the mean square.
const EFFICIENCY: f64 = 0.37;

/// Residuals of one sensor in standard deviations, in the order of time.
pub struct Residuals<'a> {
    /// Rows of components, which are NaN without information.
    pub rows: &'a [f64],
    /// The number of components.
    pub d: usize,
    /// The mean variance of the fitted values in units of the noise.
    pub leverage: f64,
    /// The mean covariance of neighbouring fitted values, in the same units.
    pub between: f64,
    /// The squared length at which the loss begins to grow more slowly; None for least squares.
    pub corner: Option<f64>,
    /// Whether residuals that are too small are reported. They are expected for conditions imposed as measurements.
    pub exact: bool,
}

/// The result of the examination of one sensor.
#[derive(Clone, Debug)]
pub struct Finding {
    /// The ratio of the residuals to σ: 1 if σ is right, NaN if the ratio cannot be determined.
    pub ratio: f64,
    /// The degrees of freedom of the residuals.
    pub freedom: f64,
    /// The lag-one autocorrelation, corrected for the leverage.
    pub correlation: f64,
    /// Whether the residuals are too large.
    pub large: bool,
    /// Whether they are too small.
    pub small: bool,
    /// Whether they are correlated.
    pub correlated: bool,
    /// The first row after a change of the mean of the residuals.
    pub step: Option<usize>,
    /// Rows of outliers under least squares, in decreasing order of size.
    pub outliers: Vec<usize>,
    /// The largest residual.
    pub largest: f64,
    /// The share of the measurements that a robust loss rejects, if it is too large, else 0.
    pub rejected: f64,
    /// The first and the last of too many consecutive measurements that a robust loss rejects.
    pub run: Option<[usize; 2]>,
}

impl Finding {
    /// Whether a test failed.
    pub fn failed(&self) -> bool {
        self.large
            || self.small
            || self.correlated
            || self.step.is_some()
            || !self.outliers.is_empty()
            || self.rejected > 0.0
            || self.run.is_some()
    }
}

impl Residuals<'_> {
    /// Examines the residuals.
    pub fn examine(&self) -> Finding {
        let d = self.d.max(1);
        let rows = self.rows;
        let has_information = |rows: &[f64]| rows.chunks_exact(d).filter(|row| any_known(row)).count();
        let (count, used) = (rows.iter().filter(|x| x.is_finite()).count(), has_information(rows));
        let left = 1.0 - self.leverage;
        let mut found = Finding {
            ratio: f64::NAN,
            freedom: 0.0,
            correlation: 0.0,
            large: false,
            small: false,
            correlated: false,
            step: None,
            outliers: Vec::new(),
            largest: 0.0,
            rejected: 0.0,
            run: None,
        };
        if used < FEWEST || left < 1.0 - LEVERAGE {
            return found;
        }
        found.freedom = count as f64 * left;
        let squares: Vec<f64> = rows.chunks_exact(d).map(|row| sum_of_squares(row).0).collect();
        let known = rows.chunks_exact(d).zip(&squares).filter(|(row, _)| any_known(row)).map(|(_, x)| *x);
        let scale = median(known.collect()) / median_of_chi_squared(count as f64 / used as f64) / left;
        let mut kept = rows.to_vec();
        let (square, efficiency, limit);
        if let Some(corner) = self.corner {
            // Outliers would dominate the mean square, so the median replaces it.
            (square, efficiency, limit) = (scale, EFFICIENCY, ROBUST_RATIO);
            let far: Vec<bool> = squares.iter().map(|x| *x > BEYOND * corner).collect();
            let share = far.iter().filter(|far| **far).count() as f64 / used as f64;
            let most = REJECTED + CHANCE * (REJECTED * (1.0 - REJECTED) / used as f64).sqrt();
            found.rejected = if share > most { share } else { 0.0 };
            found.run = long_run(&far, RUN.max(RUN_SHARE * far.len() as f64));
            let most = scale.max(1.0) * corner;
            for (row, _) in kept.chunks_exact_mut(d).zip(&squares).filter(|(_, x)| **x > most) {
                row.fill(f64::NAN);
            }
        } else {
            let sizes: Vec<f64> = rows.chunks_exact(d).map(largest_component).collect();
            found.largest = sizes.iter().copied().fold(0.0, f64::max);
            // If σ is too small, residuals are compared with their median instead.
            let most = largest_expected(count) * scale.max(1.0).sqrt();
            let (mut sum, mut inner) = (0.0, 0);
            for (i, row) in rows.chunks_exact(d).enumerate() {
                if sizes[i] > most {
                    found.outliers.push(i);
                } else {
                    let (square, known) = sum_of_squares(row);
                    (sum, inner) = (sum + square, inner + known);
                }
            }
            found.outliers.sort_by(|a, b| sizes[*b].total_cmp(&sizes[*a]));
            (square, efficiency, limit) = (sum / inner as f64 / left, 1.0, RATIO);
        }
        let freedom = count as f64 * left * efficiency;
        found.large = normal_of_chi_squared(square, freedom) > SIGNIFICANT && square > limit * limit;
        // With the hat matrix H, residuals have the covariance I − H if the curve is as rough as the penalty expects, and
        // (I − H)² if it is smoother.
        let least = square / left;
        found.small = self.exact
            && normal_of_chi_squared(least, freedom * left) < -SIGNIFICANT
            && least < RATIO.powi(-2)
            && least > EXACT * EXACT;
        found.ratio = if found.small { least } else { square }.sqrt();
        // Residuals smaller than σ contain only negligible effects.
        if found.small || square < EXACT * EXACT || has_information(&kept) < FEWEST {
            return found;
        }
        let (correlation, products) = autocorrelation(&kept, d);
        found.correlation = correlation + self.between / left;
        found.correlated =
            found.correlation * (products as f64).sqrt() > SIGNIFICANT && found.correlation > CORRELATED;
        let (value, step) = largest_partial_sum(&kept, d);
        let jumps = value > PARTIAL_SUM.max(STEP * ((kept.len() / d) as f64).sqrt());
        found.step = jumps.then_some(step);
        found
    }
}

fn any_known(row: &[f64]) -> bool {
    row.iter().any(|x| x.is_finite())
}

/// The sum of the squares of the known components, and their number.
fn sum_of_squares(row: &[f64]) -> (f64, usize) {
    row.iter().filter(|x| x.is_finite()).fold((0.0, 0), |(sum, count), x| (sum + x * x, count + 1))
}

fn largest_component(row: &[f64]) -> f64 {
    row.iter().filter(|x| x.is_finite()).fold(0.0, |most, x| most.max(x.abs()))
}

/// χ² divided by its degrees of freedom, transformed to a standard normal score (Wilson and Hilferty 1931).
fn normal_of_chi_squared(ratio: f64, freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    (ratio.cbrt() - (1.0 - spread)) / spread.sqrt()
}

/// The median of the squared length of d independent standard normal numbers, for d rounded to one or more.
fn median_of_chi_squared(d: f64) -> f64 {
    chi::quantile(d.round_ties_even().max(1.0) as usize, 0.5)
}

/// The limit of the largest of independent normal residuals.
fn largest_expected(count: usize) -> f64 {
    LARGEST.max((2.0 * (count.max(1) as f64 / PROBABILITY).ln()).sqrt())
}

/// The first and the last of the longest run, if it exceeds `most`.
fn long_run(rejected: &[bool], most: f64) -> Option<[usize; 2]> {
    let (mut longest, mut start): ([usize; 2], _) = ([0, 0], 0);
    for (i, rejected) in rejected.iter().enumerate() {
        if !rejected {
            start = i + 1;
        } else if i + 1 - start > longest[1] - longest[0] {
            longest = [start, i + 1];
        }
    }
    let [start, end] = longest;
    (end > start && (end - start) as f64 > most).then(|| [start, end - 1])
}

/// The lag-one autocorrelation of all columns, and the number of products in the estimate.
fn autocorrelation(rows: &[f64], d: usize) -> (f64, usize) {
    let products = rows.iter().zip(&rows[d..]).map(|(x, y)| x * y).filter(|x| x.is_finite());
    let (sum, count) = products.fold((0.0, 0), |(sum, count), x| (sum + x, count + 1));
    let (square, known) = sum_of_squares(rows);
    let square = square / known as f64;
    (if count > 0 && square > 0.0 { sum / count as f64 / square } else { 0.0 }, count)
}

/// The largest centred partial sum of a column, divided by s√n, and the row after it.
fn largest_partial_sum(rows: &[f64], d: usize) -> (f64, usize) {
    let (mut largest, mut after) = (0.0, 0);
    for c in 0..d {
        let column: Vec<f64> = rows.iter().skip(c).step_by(d).copied().collect();
        let known: Vec<f64> = column.iter().copied().filter(|x| x.is_finite()).collect();
        if known.len() < FEWEST {
            continue;
        }
        let mean = known.iter().sum::<f64>() / known.len() as f64;
        let spread = known.iter().map(|x| (x - mean).powi(2)).sum::<f64>().sqrt();
        let mut sum: f64 = 0.0;
        for (i, x) in column.iter().enumerate().filter(|(_, x)| spread > 0.0 && x.is_finite()) {
            sum += x - mean;
            let size = sum.abs() / spread;
            if size > largest || (size == largest && i + 1 < after) {
                (largest, after) = (size, i + 1);
            }
        }
    }
    (largest, after)
}

/// The result for a curve whose noise level the fit estimates.
pub struct Estimated {
    /// The ratio of the residuals to the noise estimated from neighbouring data if it is too large, else 1.
    pub ratio: f64,
    /// The lag-one autocorrelation, corrected for the leverage, if it is too large or too small, else 0.
    pub correlation: f64,
    /// Outliers under least squares: their number, the index of the largest, and its size in standard deviations.
    pub outliers: (usize, usize, f64),
    /// The first and the last of too many consecutive data that a robust loss rejects.
    pub run: Option<[usize; 2]>,
    /// The sizes of the residuals in standard deviations.
    pub sizes: Vec<f64>,
}

impl Estimated {
    /// Examines residuals (n, d), scaled to weight one, and squared deviations from neighbours, both as
    /// [`AtData::residuals`] returns them.
    pub fn new(rows: &[f64], d: usize, neighbours: &[f64], leverage: f64, robust: bool) -> Self {
        let d = d.max(1);
        let used: Vec<usize> =
            rows.chunks_exact(d).enumerate().filter(|(_, row)| any_known(row)).map(|(i, _)| i).collect();
        let (count, entries) = (used.len(), rows.iter().filter(|x| x.is_finite()).count());
        let chi = median_of_chi_squared(entries as f64 / count.max(1) as f64);
        let moderate = leverage <= MODERATE;
        // The variance divided by the median of squared lengths.
        let variance = 1.0 / chi / if leverage < 1.0 { 1.0 - leverage } else { f64::NAN };
        // The limits are larger for few data, which vary more.
        let few = 1.0 + 2.0 / (count.max(1) as f64).sqrt();
        let limit = largest_expected(entries) * few * if moderate { 1.0 } else { UNEVEN };
        let own = ResidualStatistics::new(rows, d, neighbours, limit, variance);
        let (scale, noise) = (own.medians[0] * variance, own.medians[1] / chi);
        // If the median residual is zero, the curve is exact. Equal neighbours, as of rounded data, contain no estimate of
        // the noise.
        let enough = count >= FEW_DATA
            && leverage <= HIGH
            && scale > 0.0
            && noise > 0.0
            && neighbours.iter().filter(|x| x.is_finite()).count() >= FEW_DATA / 2;
        let stiff = enough && moderate && scale > (NEIGHBOURS * few).powi(2) * noise;
        let unit = if scale > 0.0 { scale.sqrt() } else { f64::INFINITY };
        let sizes: Vec<f64> = own.sizes.iter().map(|size| size / unit).collect();
        let correlation = if own.square > 0.0 { own.lagged / own.square } else { 0.0 } + leverage;
        let correlated = correlation.abs() > CORRELATED.max(SIGNIFICANT / (own.products as f64).sqrt());
        // Where the noise is larger along a part of the curve, neighbouring residuals are large as well.
        let isolated = |i: &usize| {
            let near = [&sizes[i.saturating_sub(NEAR)..*i], &sizes[i + 1..(i + 1 + NEAR).min(sizes.len())]];
            sizes[*i] > limit * median(near.concat()).max(1.0)
        };
        let far = |i: &usize| sizes[*i] > limit;
        let outliers: Vec<usize> =
            (0..sizes.len()).filter(|i| enough && !robust && far(i) && isolated(i)).collect();
        let largest = outliers.iter().copied().rev().max_by(|a, b| sizes[*a].total_cmp(&sizes[*b]));
        // A burst of motion looks like consecutive outliers.
        let rejected: Vec<bool> = used.iter().map(far).collect();
        let run = long_run(&rejected, RUN_OF_DATA.max(SHARE_OF_DATA * count as f64)).filter(|_| robust);
        Estimated {
            ratio: if stiff { (scale / noise).sqrt() } else { 1.0 },
            correlation: if enough && moderate && correlated { correlation } else { 0.0 },
            outliers: largest.map_or((0, 0, 0.0), |i| (outliers.len(), i, sizes[i])),
            run: run.map(|run| run.map(|k| used[k])),
            sizes,
        }
    }

    /// Whether a test failed.
    pub fn failed(&self) -> bool {
        self.ratio > 1.0 || self.correlation != 0.0 || self.outliers.0 > 0 || self.run.is_some()
    }
}

/// What is wrong with the residuals of a curve.
pub enum Complaint {
    /// A robust loss may have selected the data of this part wrongly, see [`AtData::bypassed`].
    Bypassed([usize; 2]),
    /// The residuals do not agree with the given standard deviation. Rows without information are omitted.
    Given(Finding),
    /// Those of a fit that estimates its noise level failed a test.
    Estimated(Estimated),
}

/// A curve with its data, to be examined.
pub struct Examined<'a> {
    /// The data and the points of the curve.
    pub data: AtData<'a>,
    /// Residuals, scaled to weight one, and deviations from neighbours, see [`Estimated::new`].
    pub rows: &'a [f64],
    /// See `rows`.
    pub neighbours: &'a [f64],
    /// The mean leverage of the data.
    pub leverage: f64,
    /// The standard deviation of the noise, if it is given.
    pub sigma: Option<f64>,
}

impl Examined<'_> {
    /// Examines the residuals of a fit whose loss has a corner, see [`Residuals`].
    pub fn complaint(&self, space: &Erased, d: usize, corner: Option<f64>) -> Option<Complaint> {
        checkpoint();
        let d = d.max(1);
        let robust = corner.is_some();
        let estimated = || Estimated::new(self.rows, d, self.neighbours, self.leverage, robust);
        let Some(sigma) = self.sigma else {
            let found = estimated();
            let part = robust.then(|| self.data.bypassed(space, &found.sizes)).flatten();
            return part
                .map(Complaint::Bypassed)
                .or_else(|| found.failed().then_some(Complaint::Estimated(found)));
        };
        let sizes =
            || self.rows.chunks_exact(d).map(|row| largest_component(row) / sigma).collect::<Vec<f64>>();
        if let Some(part) = robust.then(|| self.data.bypassed(space, &sizes())).flatten() {
            return Some(Complaint::Bypassed(part));
        }
        let known = self.rows.chunks_exact(d).filter(|row| any_known(row));
        let rows: Vec<f64> = known.flatten().map(|x| x / sigma).collect();
        let given = Residuals { rows: &rows, d, leverage: self.leverage, between: 0.0, corner, exact: true };
        Some(given.examine()).filter(Finding::failed).map(Complaint::Given)
    }
}
