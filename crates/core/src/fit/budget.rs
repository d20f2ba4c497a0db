//! How much work `auto` may spend, counted in evaluations of the C² condition.
//!
//! Budgets depend on the space, the number of points and the curve alone, never on the clock or on other curves, so that
//! results can be repeated and a batch gives the same curves as single fits.

use super::chain::Chain;
use super::end_kind::ChainEnds;
use super::problem::{Options, Solver};
use crate::scalar::{LANES, Lane, lane};
use crate::space::{Ambient, Erased};

/// Steps of Newton's method, alone or in a trust region, up to this dimension. Beyond it their number falls with its
/// square, as their cost grows.
pub const STEPS: f64 = 120.0;
/// Steps of Newton's method that take over from the quasi-Newton iteration.
pub const NEWTON: f64 = 50.0;
const DIMENSION: usize = 4;
/// Sweeps of Algorithm 1: within `auto`, within `auto` where it is the last solver that can be afforded, and by itself.
pub const SWEEPS: f64 = 2000.0;
pub const SWEEPS_TO_RESCUE: f64 = 5000.0;
pub const SWEEPS_ALONE: f64 = 10_000.0;
/// Residuals of the quasi-Newton iteration when it runs by itself.
pub const PATIENT: f64 = 300.0;
/// Fewer steps of Newton's method, or fewer sweeps, than these are not worth a start.
pub const FEWEST_STEPS: f64 = 20.0;
pub const FEWEST_SWEEPS: f64 = 40.0;
/// The search for other curves may cost so many times what the first one cost ...
const TIMES_FIRST: f64 = 2.0;
/// ... or, if that is more, so many evaluations up to [`DIMENSION`], beyond it as many fewer as its square.
const SEARCH: f64 = 25_600.0;
/// Where no curve was found yet, so many floating-point operations may be spent on each solver.
const RESCUE: f64 = 2e10;
/// Memory that the Jacobian of `auto` may take, in bytes.
const MEMORY: f64 = 1e9;
/// A bending energy costs about as much as so many evaluations.
pub const ENERGY: f64 = 10.0;

/// What solvers cost on a chain.
pub struct Costs {
    /// One step of Newton's method, in evaluations of the C² condition.
    pub step: f64,
    /// Steps of Newton's method for one start.
    pub steps: f64,
    /// Evaluations for the search beside a curve that was found with little work.
    search: f64,
    /// Evaluations for each solver where no curve was found.
    rescue: f64,
    /// Whether the Jacobian fits into memory.
    pub fits: bool,
}

impl Costs {
    /// On a chain in a space.
    pub fn of(space: &Erased, chain: &Chain, ends: &ChainEnds) -> Self {
        let (n, m) = (chain.n as f64, chain.m as f64);
        let shape = space.point_shape();
        // Operations on vectors are linear in their length, functions of matrices take products.
        let columns = shape.get(1).map_or(0.0, |&k| k as f64);
        let node = space.point_len() as f64 * if columns > 0.0 { 60.0 * columns } else { 20.0 };
        // The Jacobian takes a sweep with derivatives for every coordinate of three nodes, of closed curves five; the
        // block tridiagonal solve takes five products of blocks at every node.
        let colours = if matches!(ends, ChainEnds::Periodic) { 5.0 } else { 3.0 };
        let part = ((DIMENSION * DIMENSION) as f64 / (m * m)).min(1.0);
        Costs {
            step: 1.0 + 2.5 * colours * m + 5.0 * m * m * m / node,
            steps: (STEPS * part).max(FEWEST_STEPS),
            search: SEARCH * part,
            rescue: RESCUE / (LANES as f64 * n * node),
            fits: 3.0 * (n + 1.0) * m * m * (8 * LANES) as f64 <= MEMORY,
        }
    }

    /// One iteration of a solver.
    pub fn iteration(&self, solver: Solver) -> f64 {
        match solver {
            Solver::FixedPoint | Solver::QuasiNewton => 1.0,
            Solver::Newton | Solver::Homotopy | Solver::TrustRegion => self.step,
        }
    }

    /// Whether so many steps of Newton's method may be spent where no curve was found.
    pub fn can_rescue(&self, steps: f64) -> bool {
        self.fits && steps * self.step <= self.rescue
    }

    /// What the search for other curves may cost, given the work on the first one.
    pub fn for_search(&self, first: Lane) -> Lane {
        (lane(TIMES_FIRST) * first).max(lane(self.search))
    }

    /// What each solver may cost where no curve was found.
    pub fn for_rescue(&self) -> f64 {
        self.rescue.max(SWEEPS_TO_RESCUE)
    }
}

/// Iterations that the user left to each lane after those that were used.
pub fn left(options: &Options, used: &[usize; LANES]) -> Lane {
    let most = options.max_iter.map_or(f64::INFINITY, |n| n as f64);
    Lane::new(used.map(|used| (most - used as f64).max(0.0)))
}
