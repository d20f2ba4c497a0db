//! The laws that every symmetric space obeys, for the tests of a new one: [`check`] runs all of them. They require
//! the feature `laws`.
//!
//! They use only the operations of a space. Every law draws its data at random, with a case in every lane, over
//! decades of step lengths up to just before the cut locus and with random representatives of points. It returns the
//! error that it found if that exceeds `allowed` rounding errors (times the condition reported by the space).

mod algebra;
mod ambient;
mod draw;
mod frame;
mod verdict;

pub use draw::Draw;
pub use verdict::Verdict;

use crate::scalar::LANES;
use crate::space::Erased;

/// One law.
pub type Law = fn(&Erased, &mut Draw) -> Verdict;

/// All laws, by name.
pub static LAWS: &[(&str, Law)] = &[
    ("points are projected to themselves", ambient::points),
    ("exp and log are inverse", ambient::exp_and_log),
    ("log is tangent at any representative", ambient::tangent),
    ("geodesics join their ends and transport their velocity", ambient::geodesics),
    ("a transvection is the product of two symmetries", ambient::transvections),
    ("transport preserves the inner product", ambient::transport),
    ("derivatives are those of the arrays", ambient::derivatives),
    ("nothing is found in what is not finite", ambient::not_finite),
    ("lanes do not see each other", ambient::lanes),
    ("coordinates and tangent vectors are inverse", frame::coordinates),
    ("a frame moves in parallel", frame::parallel),
    ("a frame stays one for 600 knots", frame::long_walk),
    ("handles are the logarithms of the C2 condition", frame::inner_handles),
    ("the motion of samples has a transpose", frame::transposed_motion),
    ("duals contain the derivatives of the handles", frame::duals),
    ("the deciding angle is that of the logarithm", frame::angle),
    ("the condition bounds the growth of errors", frame::condition),
    ("the triple product is a Lie triple", algebra::lie_triple),
    ("the triple product is the curvature", algebra::holonomy),
    ("K is the largest curvature", algebra::largest_curvature),
    ("the stretch is the derivative of exp", algebra::stretch),
    ("what is beside the space is projected to a point", ambient::projection),
    ("any array is projected to a tangent vector", ambient::tangent_projection),
    ("acceleration does not see how a representative turns", ambient::turning),
];

/// The number of cases of every law.
const CASES: usize = 8;

/// Runs all laws; returns the violations.
pub fn check(space: &Erased, seed: u64) -> Vec<String> {
    let run = |(i, (name, law)): (usize, &(&str, Law))| {
        let mut draw = Draw::new(seed.wrapping_mul(1_000_003).wrapping_add(i as u64));
        let found = (0..CASES / LANES).try_for_each(|_| law(space, &mut draw));
        found.err().map(|why| format!("{name}: {why}"))
    };
    LAWS.iter().enumerate().filter_map(run).collect()
}
