//! Energies of the segments and leverages of the data in the linearised smoothing problem, with another λ on each segment.

use crate::adaptive::{Sums, Track};
use crate::cyclic::PeriodicCorrection;
use crate::linearized::{LinearProblem, SegmentEnergy};
use crate::misfit::{Misfit, of_each};
use std::borrow::Cow;
use symspline_core::scalar::{LANES, Lane, few, lane};

/// A curve with one λ, linearised.
pub struct Local<'a> {
    /// The problem with one λ for all segments.
    pub linearized: &'a LinearProblem,
    /// The dimension of the space.
    pub m: usize,
    /// Residuals, and their weights for one noise level.
    pub misfit: &'a Misfit<'a>,
    /// The periodic continuation of a closed curve.
    pub periodic: Option<&'a PeriodicCorrection>,
    /// Accelerations at the knots.
    pub accelerations: &'a [f64],
}

impl Local<'_> {
    /// The solutions for at most as many tracks as there are lanes.
    pub fn sums(&self, tracks: &[Track]) -> Vec<Sums> {
        let (linearized, m) = (self.linearized, self.m);
        let basis = &linearized.basis;
        let (segments, count) = (basis.knots() - 1, basis.count());
        let of_lane = |l: usize| &tracks[l.min(tracks.len() - 1)];
        let noisy = tracks.iter().any(|track| track.vary.noise);
        let misfits: Vec<Cow<Misfit>> = (0..LANES)
            .map(|l| {
                let track = of_lane(l);
                if !track.vary.noise || l >= tracks.len() {
                    return Cow::Borrowed(self.misfit);
                }
                let mut own = self.misfit.clone();
                own.reweigh(linearized, &track.factors, m);
                Cow::Owned(own)
            })
            .collect();
        let lams: Vec<Lane> = (0..segments).map(|i| Lane::new(few(|l| of_lane(l).lams[i]))).collect();
        let parts: Vec<SegmentEnergy> =
            (0..segments).map(|i| SegmentEnergy::new(basis, linearized.penalised, i)).collect();
        let wide = count.min(4);
        let mut penalty = vec![Lane::ZERO; count * 4];
        for (part, lam) in parts.iter().zip(&lams) {
            for a in 0..wide {
                for b in 0..=a {
                    penalty[(part.first() + a) * 4 + a - b] += *lam * lane(part.entry(a, b));
                }
            }
        }
        let whole = self.misfit.whole(linearized, m, false, self.periodic, |coupled, at| {
            let seen = if noisy {
                Lane::new(few(|l| misfits[l].gram(coupled, at)))
            } else {
                lane(self.misfit.gram(coupled, at))
            };
            seen + of_each(&penalty, coupled, at)
        });
        let factors = whole.factored();
        let pulls: Vec<Vec<f64>> = if noisy {
            misfits.iter().map(|misfit| misfit.pull(linearized, m)).collect()
        } else {
            vec![self.misfit.pull(linearized, m)]
        };
        let pull = |k: usize| {
            if noisy { Lane::new(few(|l| pulls[l][k])) } else { lane(pulls[0][k]) }
        };
        // Half the gradient of the energy at the accelerations a.
        let mut x: Vec<Lane> = (0..count * m).map(pull).collect();
        let bends = |i: usize, c: usize| [i, i + 1].map(|knot| self.accelerations[knot * m + c]);
        for (i, (part, lam)) in parts.iter().zip(&lams).enumerate() {
            for c in 0..m {
                for a in 0..wide {
                    x[(part.first() + a) * m + c] -= *lam * lane(part.pull(a, bends(i, c)));
                }
            }
        }
        if let Some(periodic) = self.periodic {
            x = fold_lanes(periodic, &x);
        }
        factors.solve(m, &mut x);
        if let Some(periodic) = self.periodic {
            periodic.extend_lanes(&mut x);
        }
        let inverse = factors.inverse_band();
        let mean = factors.mean(&inverse);
        let process = (linearized.free() as f64 - linearized.null()) / segments as f64;
        let mut energies = vec![Lane::ZERO; segments];
        let mut freedoms = vec![Lane::ZERO; segments];
        for (i, (part, lam)) in parts.iter().zip(&lams).enumerate() {
            let moved = |end: usize, c: usize| part.ends[end].of_lanes(&x, m, c) + lane(bends(i, c)[end]);
            let energy = (0..m).map(|c| part.value([moved(0, c), moved(1, c)]));
            energies[i] = *lam * energy.fold(Lane::ZERO, |sum, x| sum + x);
            freedoms[i] = lane(process) - *lam * part.trace(count, |a, b| mean.at(a, b));
        }
        let data = &linearized.data;
        let mut squares: Vec<Lane> =
            (0..data.len()).map(|k| self.misfit.square(&data[k], k, m, &x)).collect();
        let known = noisy || tracks.iter().any(Track::is_to_place);
        let leverage = |k: usize| self.misfit.leverage(&data[k], k, m, &inverse, &mean);
        let mut leverages: Vec<Lane> =
            (0..data.len()).map(|k| if known { leverage(k) } else { Lane::ZERO }).collect();
        if noisy {
            for k in 0..data.len() {
                let factor = Lane::new(few(|l| of_lane(l).factors[k]));
                squares[k] *= factor;
                leverages[k] *= factor;
            }
        }
        let (log_det, least) = (factors.log_det(), factors.least_pivot());
        let lane_of = |x: &[Lane], l: usize| x.iter().map(|x| x.as_array()[l]).collect::<Vec<f64>>();
        let whole = squares.iter().chain(&energies).fold(Lane::ZERO, |sum, x| sum + *x);
        let of = |l: usize| Sums {
            energies: lane_of(&energies, l),
            freedoms: lane_of(&freedoms, l),
            squares: lane_of(&squares, l),
            leverages: lane_of(&leverages, l),
            whole: whole.as_array()[l],
            log_det: log_det.as_array()[l],
            sound: least.as_array()[l] > 0.0 && log_det.as_array()[l].is_finite(),
        };
        (0..tracks.len()).map(of).collect()
    }
}

/// [`PeriodicCorrection::fold`] for all lanes.
fn fold_lanes(periodic: &PeriodicCorrection, x: &[Lane]) -> Vec<Lane> {
    let columns: [Vec<f64>; LANES] = std::array::from_fn(|l| {
        let mut column: Vec<f64> = x.iter().map(|x| x.as_array()[l]).collect();
        periodic.fold(&mut column);
        column
    });
    (0..columns[0].len()).map(|k| Lane::new(few(|l| columns[l][k]))).collect()
}
