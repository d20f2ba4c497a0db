//! The stages of a fit with a robust loss.
//!
//! A redescending loss has many minima. λ is wrong if it is chosen while outliers affect the curve, or from a curve
//! that rejects good data. Therefore data are selected first, λ is chosen from these, and the M-estimator is computed
//! with that λ:
//!
//! 1. *Rejecting*: least squares for a selection of data, which begins with a [`chain`](crate::chain). λ is chosen by
//!    restricted maximum likelihood, because cross-validation with γ > 1 forbids the curves that precise data need, so
//!    that good data would be rejected. The limit of a truncated loss falls from the largest residual to the noise
//!    (graduated non-convexity, Yang et al. 2020) until the selection does not change. Residuals are *deleted* ones,
//!    because ordinary residuals of selected data vanish where the curve follows each of them.
//! 2. *Chosen*: the same selection, with λ by the requested criterion.
//! 3. *Final*: iteratively reweighted least squares (Holland & Welsch 1977) with that λ, times the mean weight, and the
//!    noise level of the second stage. If that is much larger than in the first stage, or the curve of the second stage
//!    is far from selected data, λ is too large for them, because a redescending loss then treats every bend as outliers.
//!    The λ and the noise level of the first stage replace those of the second. If only data at the ends are far from it,
//!    because natural ends cannot follow an acceleration, the result is the curve of the second stage.
//!
//! If the curve follows nearly all data, the noise is too small to be estimated at this sampling rate. Deviations are
//! then those from interpolation, and only isolated data that deviate much more than others are rejected. The curve of
//! the first stage is the result.

use crate::chain;
use crate::chi;
use crate::problem::{Criterion, Loss, Selection};

/// The maximum number of iterations of the last stage, as a multiple of the requested limit: reweighted least squares
/// converge linearly, and slowly if a datum is near the corner of Huber's loss.
const FINAL_STEPS: usize = 20;
/// The steps, in standard deviations, that end the stages before the last.
const ROUGH_TOL: f64 = 0.03;
/// The maximum number of times that data are selected.
const ROUNDS: usize = 30;
/// Data beyond this quantile of the noise are rejected.
const KEPT: f64 = 0.999;
/// The factor of the squared limit from selection to selection.
const FALLS: f64 = 0.25;
/// The ratio of degrees of freedom to data above which the noise is too small to be estimated.
const ALL: f64 = 0.9;
/// The squared limit, relative to that of the selection, beyond which the final curve rejects selected data.
const LEFT: f64 = 2.0;
/// The number of degrees of freedom at either end that do not count for this.
const ENDS: usize = 3;
/// The ratio of the noise levels of the second and the first stage above which the curve of the second is too stiff.
const STIFFER: f64 = 2.0;
/// The limit for squared deviations of data whose noise is too small, in medians.
const GROSS: f64 = 900.0;
/// Deviations grow with the time between the neighbours, their squares about with this power.
const GROWTH: f64 = 5.0;
/// The numbers of data at the ends that are not rejected in that case, and of those on either side whose deviations are
/// compared.
const AT_ENDS: usize = 3;
const BESIDE: usize = 2;
const NEAR: usize = 10;
/// The least 1 − h, which is known up to rounding errors only.
const DELETED: f64 = 1e-6;
/// The least fraction of the data that must be selected for a result that can be trusted.
const LEAST_SELECTED: f64 = 0.6;
/// The squared residual, in corners of the loss, beyond which a datum is an outlier, and the displacement of the curve by
/// such a datum, in standard deviations of the curve without it, that is too large.
const OUTLYING: f64 = 9.0;
const DISPLACED: f64 = 5.0;
/// The weight of rejected data if there is no penalty, so that only data determine the curve.
const TINY: f64 = 1e-9;

/// The stage of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Least squares, the only stage of a fit that is not robust.
    Plain,
    /// The first stage of a robust fit.
    Rejecting,
    /// The second stage.
    Chosen,
    /// The last stage.
    Final,
}

/// The data at a curve.
pub struct AtCurve<'a> {
    /// Times of the data.
    pub times: &'a [f64],
    /// Their weighted squared distances.
    pub squares: &'a [f64],
    /// The variances of the curve at the data, divided by those of the data.
    pub leverages: &'a [f64],
    /// The degrees of freedom of the curve.
    pub freedom: f64,
    /// Its λ.
    pub lam: Option<f64>,
    /// The squared distances of chosen data from the geodesics between their neighbours.
    pub deviations: &'a dyn Fn(&[usize]) -> Vec<f64>,
}

/// A loss function with its noise level.
pub struct Robust {
    loss: Loss,
    m: usize,
    /// The present stage.
    pub stage: Stage,
    /// Whether the selection can be trusted.
    pub selection: Selection,
    /// The standard deviation of the noise in a coordinate.
    sigma: f64,
    /// Whether the noise level was given.
    known: bool,
    /// λ, if it is given.
    lam: Option<f64>,
    /// The least standard deviation of the noise, which rounding of the points causes.
    rounding: f64,
    /// The selected data: one if included, otherwise zero.
    kept: Vec<f64>,
    /// The first selection.
    chain: Vec<f64>,
    /// Whether data have a weight.
    used: Vec<bool>,
    /// Earlier selections.
    seen: Vec<Vec<f64>>,
    /// The present limit for squared residuals.
    limit: f64,
    /// λ and the noise level of the first stage, until the last stage has used them.
    first: Option<(f64, f64)>,
    /// λ of the second stage, if its curve is near all selected data, until the last stage has used it.
    chosen: Option<f64>,
    /// Whether the last stage is least squares for the selected data.
    truncated: bool,
}

/// How the next stage obtains λ.
pub enum Lam {
    /// λ does not change.
    Same,
    /// λ is chosen from its whole range.
    Anew,
    /// λ is chosen, and the search begins near the present one.
    Near,
    /// λ is given.
    To(f64),
    /// λ is multiplied by a number.
    Times(f64),
}

impl Robust {
    /// Least squares.
    pub fn plain(m: usize) -> Self {
        Robust {
            loss: Loss::Linear,
            m,
            stage: Stage::Plain,
            selection: Selection::Sound,
            sigma: 0.0,
            known: false,
            lam: None,
            rounding: 0.0,
            kept: Vec::new(),
            chain: Vec::new(),
            used: Vec::new(),
            seen: Vec::new(),
            limit: f64::INFINITY,
            first: None,
            chosen: None,
            truncated: false,
        }
    }

    /// For a first selection of the data with nonzero weights.
    pub fn new(
        loss: Loss,
        m: usize,
        sigma: Option<f64>,
        lam: Option<f64>,
        kept: Vec<f64>,
        weights: &[f64],
        rounding: f64,
    ) -> Self {
        let used = weights.iter().map(|w| *w > 0.0).collect();
        let (stage, known, sigma) = (Stage::Rejecting, sigma.is_some(), sigma.unwrap_or(0.0));
        let chain = kept.clone();
        Robust { loss, stage, sigma, known, lam, rounding, kept, chain, used, ..Robust::plain(m) }
    }

    /// The residual beyond which the loss grows more slowly.
    fn corner(&self) -> f64 {
        self.sigma * self.loss.corner(self.m)
    }

    /// Whether the loss is that of the M-estimator, and not truncated.
    pub fn reweighs(&self) -> bool {
        self.stage == Stage::Final && !self.truncated
    }

    /// The factors of the weights of the data, given their weighted squared distances; None for one.
    pub fn factors(&self, squares: &[f64]) -> Option<Vec<f64>> {
        match self.stage {
            Stage::Plain => None,
            _ if self.reweighs() => Some(self.weights(squares)),
            // Without a penalty, a knot whose data are all rejected needs some data.
            _ if self.lam == Some(0.0) => Some(self.kept.iter().map(|kept| kept.max(TINY)).collect()),
            _ => Some(self.kept.clone()),
        }
    }

    fn weights(&self, squares: &[f64]) -> Vec<f64> {
        let corner = self.corner();
        squares.iter().map(|square| self.loss.weight(square / (corner * corner))).collect()
    }

    /// The sum over the data in the objective, given their weighted squared distances.
    pub fn misfit(&self, squares: &[f64]) -> f64 {
        match self.stage {
            Stage::Plain => squares.iter().sum(),
            _ if self.reweighs() => {
                let corner = self.corner();
                squares.iter().map(|square| self.loss.value(*square, corner)).sum()
            }
            _ => squares.iter().zip(&self.kept).map(|(square, kept)| kept * square).sum(),
        }
    }

    /// The pseudo-data of the M-estimator: see [`Loss::pseudo`]. None for a truncated loss.
    pub fn pseudo(&self, squares: &[f64]) -> Option<(Vec<f64>, f64)> {
        self.reweighs().then(|| self.loss.pseudo(self.corner(), squares, self.m))
    }

    /// How λ is chosen in this stage.
    pub fn criterion(&self, asked: Criterion) -> Criterion {
        if self.stage == Stage::Rejecting || self.truncated { Criterion::Reml } else { asked }
    }

    /// The step that ends the stage.
    pub fn tol(&self, asked: f64) -> f64 {
        if self.last() { asked } else { asked.max(ROUGH_TOL) }
    }

    /// The maximum number of iterations of the stage.
    pub fn most(&self, asked: usize) -> usize {
        if self.reweighs() { asked.saturating_mul(FINAL_STEPS) } else { asked }
    }

    /// Whether this is the last stage.
    pub fn last(&self) -> bool {
        matches!(self.stage, Stage::Plain | Stage::Final)
    }

    /// Whether the M-estimator rejects selected data, so that another stage follows.
    pub fn leaves(&self, squares: &[f64]) -> bool {
        self.reweighs() && self.lam.is_none() && self.left(squares).contains(&true)
    }

    /// The selected data that are far from the curve.
    fn left(&self, squares: &[f64]) -> Vec<bool> {
        let limit = LEFT * self.sigma * self.sigma * chi::quantile(self.m, KEPT);
        squares.iter().zip(&self.kept).map(|(square, kept)| *kept > 0.0 && *square > limit).collect()
    }

    /// Whether selected data other than those at the ends are far from the curve. Natural ends cannot follow a motion that
    /// accelerates there, and a redescending loss then leaves one datum after the other.
    fn leaves_inside(&self, at: &AtCurve) -> bool {
        let left = self.left(at.squares);
        let unit = (left.len() as f64 / at.freedom.max(1.0)).ceil() as usize;
        let mut reaches = [ENDS * unit; 2];
        for (end, reach) in reaches.iter_mut().enumerate() {
            for k in 0..left.len() {
                if k < *reach && left[if end == 0 { k } else { left.len() - 1 - k }] {
                    *reach = (*reach).max(k + unit + 1);
                }
            }
        }
        let last = left.len().saturating_sub(reaches[1]);
        left.get(reaches[0]..last).is_some_and(|inner| inner.contains(&true))
    }

    /// Whether an outlier moves the curve, given the factors of the pseudo-data and their leverages. Every loss that is
    /// not zero lets an outlier pull the curve, which other data prevent except in gaps.
    pub fn is_pulled(&self, squares: &[f64], factors: &[f64], leverages: &[f64]) -> bool {
        let outlying = OUTLYING * self.corner().powi(2);
        // Without a datum, the curve moves by h/(1 − h) times its residual, and its variance is 1/(1 − h) times as large.
        let moves = |square: f64, factor: f64, h: f64| h / (1.0 - h).max(DELETED) * square * factor * factor;
        squares.iter().zip(factors).zip(leverages).any(|((square, factor), h)| {
            *square > outlying && moves(*square, *factor, *h) > (DISPLACED * self.sigma).powi(2)
        })
    }

    /// The number of data with a weight that are not selected.
    pub fn rejected(&self) -> usize {
        self.kept.iter().zip(&self.used).filter(|(kept, used)| **kept == 0.0 && **used).count()
    }

    /// Starts the next stage from a curve.
    pub fn next(&mut self, at: &AtCurve) -> Lam {
        match self.stage {
            Stage::Plain => Lam::Same,
            Stage::Rejecting => self.select(at),
            Stage::Chosen => self.finish(at),
            Stage::Final => match (self.chosen.take().filter(|_| !self.leaves_inside(at)), self.first.take())
            {
                (Some(lam), _) => {
                    self.truncated = true;
                    Lam::To(lam)
                }
                (None, Some((lam, sigma))) => {
                    self.sigma = sigma;
                    Lam::To(lam)
                }
                (None, None) => {
                    self.truncated = true;
                    Lam::Same
                }
            },
        }
    }

    /// Selects data again, or ends the first stage.
    fn select(&mut self, at: &AtCurve) -> Lam {
        let count = self.count();
        let squares = self.deleted(at);
        let interpolated = !self.known && at.freedom > ALL * count;
        self.selection = if interpolated { Selection::Interpolated } else { Selection::Sound };
        let next = if interpolated {
            self.sigma = self.scale(self.of_kept(&squares));
            self.gross(&squares, at)
        } else {
            let own = self.of_kept(&squares);
            let largest = own.iter().copied().fold(0.0, f64::max);
            if !self.known {
                self.sigma = self.scale(own);
            }
            let least = self.sigma * self.sigma * chi::quantile(self.m, KEPT);
            self.limit = (FALLS * self.limit.min(largest)).max(least);
            let within = |k: usize| f64::from(self.used[k] && squares[k] <= self.limit);
            let found: Vec<f64> = (0..squares.len()).map(within).collect();
            if self.limit > least && found == self.kept {
                // Nothing lies between this limit and the next one.
                return self.select(at);
            }
            found
        };
        let few =
            next.iter().sum::<f64>() < LEAST_SELECTED * self.used.iter().filter(|used| **used).count() as f64;
        let repeats = self.seen.contains(&next);
        if next == self.kept || repeats || few || self.seen.len() >= ROUNDS {
            if few {
                self.selection = Selection::Few;
            } else if self.selection == Selection::Sound && self.differs(&next) {
                self.selection = Selection::Unsettled;
            }
            self.first = at.lam.map(|lam| (lam, self.sigma));
            // The M-estimator is undefined for data without noise.
            let exact = !self.known && self.sigma <= self.rounding;
            if self.selection == Selection::Interpolated || exact {
                (self.stage, self.truncated) = (Stage::Final, true);
                return Lam::Same;
            }
            if self.lam.is_some() {
                return self.finish(at);
            }
            self.stage = Stage::Chosen;
            return Lam::Anew;
        }
        let before = std::mem::replace(&mut self.kept, next);
        self.seen.push(before);
        if self.lam.is_some() { Lam::Same } else { Lam::Near }
    }

    fn finish(&mut self, at: &AtCurve) -> Lam {
        self.stage = Stage::Final;
        if self.lam.is_some() {
            return Lam::Same;
        }
        // The noise level refers to the curve: that of the first stage may follow part of the noise.
        let first = self.sigma;
        if !self.known {
            self.sigma = self.scale(self.of_kept(&self.deleted(at)));
        }
        if (self.sigma > STIFFER * first || self.leaves_inside(at))
            && let Some((lam, sigma)) = self.first.take()
        {
            self.sigma = sigma;
            return Lam::To(lam);
        }
        self.chosen = at.lam;
        let weights = self.weights(at.squares);
        let sum: f64 = weights.iter().zip(&self.kept).map(|(weight, kept)| weight * kept).sum();
        Lam::Times(sum / self.count())
    }

    /// Whether another selection has not only changed near the limit.
    fn differs(&self, next: &[f64]) -> bool {
        /// The largest fraction of the data that counts as near the limit.
        const NEAR_LIMIT: f64 = 0.02;
        let changed = next.iter().zip(&self.kept).filter(|(a, b)| a != b).count();
        changed as f64 > 2.0 + NEAR_LIMIT * next.len() as f64
    }

    fn of_kept(&self, values: &[f64]) -> Vec<f64> {
        values.iter().zip(&self.kept).filter(|(_, kept)| **kept > 0.0).map(|(x, _)| *x).collect()
    }

    /// The number of selected data.
    fn count(&self) -> f64 {
        self.kept.iter().sum()
    }

    /// The squared residuals of all data from curves without them, divided by their variance for noise of variance one.
    fn deleted(&self, at: &AtCurve) -> Vec<f64> {
        let one = |k: usize| {
            let h = at.leverages[k];
            at.squares[k] / if self.kept[k] > 0.0 { (1.0 - h).max(DELETED) } else { 1.0 + h }
        };
        (0..at.squares.len()).map(one).collect()
    }

    /// The standard deviation of the noise from squares of the selected data.
    fn scale(&self, squares: Vec<f64>) -> f64 {
        /// Rounded data may have squares that are mostly zero. Part of a higher quantile then replaces the median.
        const HIGH: f64 = 0.8;
        const PART: f64 = 0.25;
        let of = |squares: Vec<f64>, share: f64| {
            chain::quantile(squares, share).unwrap_or(0.0) / chi::quantile(self.m, share)
        };
        let high = PART * of(squares.clone(), HIGH);
        of(squares, 0.5).max(high).sqrt().max(self.rounding)
    }

    /// A selection without isolated data that deviate much more than others, and with data that do not.
    fn gross(&self, squares: &[f64], at: &AtCurve) -> Vec<f64> {
        let times = at.times;
        let n = squares.len();
        let mut next = self.kept.clone();
        let used: Vec<usize> = (0..n).filter(|&k| self.used[k]).collect();
        let kept: Vec<usize> = used.iter().copied().filter(|&k| self.kept[k] > 0.0).collect();
        if kept.len() < 2 * AT_ENDS {
            return next;
        }
        // The product of the times to the selected data before and behind, the square of one of them at an end.
        let around = |k: usize| {
            let (from, to) = (kept.partition_point(|&i| i < k), kept.partition_point(|&i| i <= k));
            let before = from.checked_sub(1).map(|i| times[k] - times[kept[i]]);
            let behind = kept.get(to).map(|&i| times[i] - times[k]);
            before.or(behind).unwrap_or(0.0) * behind.or(before).unwrap_or(0.0)
        };
        let usual = chain::quantile(kept.iter().map(|&k| around(k)).collect(), 0.5).unwrap_or(1.0);
        let relative = |k: usize| squares[k] / (around(k) / usual).max(1.0).powf(0.5 * GROWTH);
        let of_kept: Vec<f64> = kept.iter().map(|&k| relative(k)).collect();
        let least = (self.rounding * self.rounding).max(chain::quantile(of_kept.clone(), 0.5).unwrap_or(0.0));
        // The path may bend more in one part than in another.
        let limit = |k: usize| {
            let at = kept.partition_point(|&i| i < k);
            let near = &of_kept[at.saturating_sub(NEAR)..(at + NEAR).min(kept.len())];
            GROSS * chain::quantile(near.to_vec(), 0.5).unwrap_or(0.0).max(least)
        };
        // An outlier moves the curve nearby, so that its neighbours seem to deviate as well, even more so next to gaps.
        let beside = (at.deviations)(&kept);
        for (place, &k) in kept.iter().enumerate() {
            let near = &beside[place.saturating_sub(BESIDE)..(place + BESIDE + 1).min(kept.len())];
            let isolated = near.iter().all(|x| *x <= beside[place]);
            let inside = place >= AT_ENDS && place + AT_ENDS < kept.len();
            if inside && isolated && of_kept[place] > limit(k) {
                next[k] = 0.0;
            }
        }
        // Data of a run return only from its ends, because the curve inside the run is not known. Data that the chain
        // omits do not agree with their neighbours.
        let selected =
            |place: Option<usize>| place.and_then(|i| used.get(i)).is_some_and(|&k| self.kept[k] > 0.0);
        for (place, &k) in used.iter().enumerate() {
            let beside_one = selected(place.checked_sub(1)) || selected(Some(place + 1));
            if self.chain[k] > 0.0 && self.kept[k] == 0.0 && beside_one && relative(k) <= limit(k) {
                next[k] = 1.0;
            }
        }
        next
    }
}
