//! The work that `auto` may spend, counted in evaluations of the C² condition.
//!
//! Budgets depend only on the space, the number of points and the curve, never on run time or on other curves.
//! Results are therefore reproducible, and a batch gives the same curves as single fits.

use super::chain::Chain;
use super::end_kind::ChainEnds;
use super::problem::{Options, Solver};
use crate::scalar::{LANES, Lane, lane};
use crate::space::{Ambient, Erased};

/// Steps of Newton's method, alone or in a trust region, up to this dimension. In higher dimensions their number
/// decreases with the square of the dimension, as the cost of a step grows.
pub const STEPS: f64 = 120.0;
/// Steps of Newton's method that take over from the quasi-Newton iteration.
pub const NEWTON: f64 = 50.0;
const DIMENSION: usize = 4;
/// Sweeps of Algorithm 1: within `auto`, within `auto` if it is the last affordable solver, and alone.
pub const SWEEPS: f64 = 2000.0;
pub const SWEEPS_TO_RESCUE: f64 = 5000.0;
pub const SWEEPS_ALONE: f64 = 10_000.0;
/// Residual evaluations of the quasi-Newton iteration when it runs alone.
pub const PATIENT: f64 = 300.0;
/// A solver is not started for fewer steps of Newton's method, or fewer sweeps, than these.
pub const FEWEST_STEPS: f64 = 20.0;
pub const FEWEST_SWEEPS: f64 = 40.0;
/// The search for further solutions may cost this multiple of the cost of the first one ...
const TIMES_FIRST: f64 = 2.0;
/// ... or, if that is more, this many evaluations up to [`DIMENSION`]. Beyond it their number decreases with the
/// square of the dimension.
const SEARCH: f64 = 25_600.0;
/// If no curve has been found, each solver may spend this many floating-point operations.
const RESCUE: f64 = 2e10;
/// Bytes that the Jacobian may occupy in `auto`.
const MEMORY: f64 = 1e9;
/// The number of curves whose work and memory is counted. It is the largest number of lanes, whatever that of the
/// processor is: budgets, and thus results, do not depend on it.
const TOGETHER: f64 = 8.0;
/// A bending energy costs about as much as this many evaluations.
pub const ENERGY: f64 = 10.0;

/// The cost of the solvers on a chain.
pub struct Costs {
    /// One step of Newton's method, in evaluations of the C² condition.
    pub step: f64,
    /// Steps of Newton's method for one start.
    pub steps: f64,
    /// Evaluations for the search for further solutions if the first one was cheap.
    search: f64,
    /// Evaluations for each solver if no curve has been found.
    rescue: f64,
    /// Whether the Jacobian fits into memory.
    pub fits: bool,
}

impl Costs {
    /// For a chain in a space.
    pub fn of(space: &Erased, chain: &Chain, ends: &ChainEnds) -> Self {
        let (n, m) = (chain.n as f64, chain.m as f64);
        let shape = space.point_shape();
        // The cost of an operation is linear in the length of vectors; functions of matrices need products.
        let columns = shape.get(1).map_or(0.0, |&k| k as f64);
        let node = space.point_len() as f64 * if columns > 0.0 { 60.0 * columns } else { 20.0 };
        // The Jacobian takes one sweep with derivatives for every coordinate of three nodes, or of five nodes in a
        // closed curve. The block tridiagonal solve takes five products of blocks at every node.
        let colours = if matches!(ends, ChainEnds::Periodic) { 5.0 } else { 3.0 };
        let part = ((DIMENSION * DIMENSION) as f64 / (m * m)).min(1.0);
        Costs {
            step: 1.0 + 2.5 * colours * m + 5.0 * m * m * m / node,
            steps: (STEPS * part).max(FEWEST_STEPS),
            search: SEARCH * part,
            rescue: RESCUE / (TOGETHER * n * node),
            fits: 3.0 * (n + 1.0) * m * m * 8.0 * TOGETHER <= MEMORY,
        }
    }

    /// One iteration of a solver.
    pub fn iteration(&self, solver: Solver) -> f64 {
        match solver {
            Solver::FixedPoint | Solver::QuasiNewton => 1.0,
            Solver::Newton | Solver::Homotopy | Solver::TrustRegion => self.step,
        }
    }

    /// Whether this many steps of Newton's method are affordable if no curve has been found.
    pub fn can_rescue(&self, steps: f64) -> bool {
        self.fits && steps * self.step <= self.rescue
    }

    /// The budget of the search for further solutions, given the work on the first one.
    pub fn for_search(&self, first: Lane) -> Lane {
        (lane(TIMES_FIRST) * first).max(lane(self.search))
    }

    /// The budget of each solver if no curve has been found.
    pub fn for_rescue(&self) -> f64 {
        self.rescue.max(SWEEPS_TO_RESCUE)
    }
}

/// Iterations of each lane that remain of the user's limit.
pub fn left(options: &Options, used: &[usize; LANES]) -> Lane {
    let most = options.max_iter.map_or(f64::INFINITY, |n| n as f64);
    Lane::new(used.map(|used| (most - used as f64).max(0.0)))
}
