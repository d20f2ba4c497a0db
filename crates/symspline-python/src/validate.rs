//! Messages for invalid curves, with the names that arguments have in Python.

use crate::errors::{Invalid, format_index, number};
use crate::space::off_space;
use symspline_engine::validate::{Invalid as InvalidCurve, Reason};

/// The names of curves in messages: their indices in the user's batch, which may contain further curves.
pub struct Names<'a> {
    pub batch: &'a [usize],
    /// The numbers of these curves; None for the whole batch.
    pub chosen: Option<&'a [usize]>,
    /// Whether all curves have the same knots.
    pub shared: bool,
    /// The distance from the space within which points are valid.
    pub tol: f64,
}

/// The phrase for a curve of a batch; empty for a single curve.
pub fn of_curve(curve: usize, batch: &[usize]) -> String {
    if batch.is_empty() || batch.contains(&0) {
        String::new()
    } else {
        format!(" of curve {}", format_index(curve, batch))
    }
}

impl Names<'_> {
    /// The fault with a message that names the argument, its index, its value and the remedy.
    pub fn describe(&self, fault: InvalidCurve) -> Invalid {
        let curve = self.chosen.map_or(fault.curve, |chosen| chosen[fault.curve]);
        let message = self.message(curve, fault.node.unwrap_or(0), &fault.reason);
        Invalid::new(curve, fault.node, message)
    }

    fn message(&self, curve: usize, node: usize, reason: &Reason) -> String {
        let (of, tol) = (of_curve(curve, self.batch), self.tol);
        let knots = if self.shared || self.batch.is_empty() {
            String::new()
        } else {
            format!("[{}]", format_index(curve, self.batch))
        };
        match reason {
            Reason::TimeNotFinite(time) => {
                format!("t{knots}[{node}] is {}; times must be finite", number(*time))
            }
            Reason::TimesNotIncreasing { before, time } => {
                let repeats = before == time;
                let what = if repeats { "repeats" } else { "is before" };
                let hint = if repeats {
                    "remove one of two points with the same time, or give them different times"
                } else {
                    "sort times and points together, e.g. order = np.argsort(t)"
                };
                let (time, before, earlier) = (number(*time), number(*before), node - 1);
                format!(
                    "t{knots}[{node}] = {time} {what} t{knots}[{earlier}] = {before}; times must increase: {hint}"
                )
            }
            Reason::TimesTooFarApart => format!("t{knots} spans more than the largest floating-point number"),
            Reason::OffSpace { distance, condition } => {
                off_space(&format!("points[{node}]{of}"), *distance, tol, condition)
            }
            Reason::TooFewDigits(why) => format!("points[{node}]{of} {why}"),
            Reason::Disconnected => {
                format!(
                    "points[{node}] and points[{}]{of} have opposite determinants: no curve joins them",
                    node + 1
                )
            }
            Reason::NotClosed { distance } => format!(
                "bc_type='periodic' needs a closed curve, but the first and the last point{of} are {distance:.3e} \
                 apart (allowed: {tol:.0e}); repeat the first point at the end"
            ),
            Reason::EndNotFinite(which, value) => {
                format!("{which}{of} contains {}; it must be finite", number(*value))
            }
            Reason::EndNotTangent { which, normal } => format!(
                "{which}{of} is not tangent at its point: its normal component is {normal:.3e} (allowed: {tol:.0e}); \
                 use space.project_tangent(p, v)"
            ),
            Reason::EndTooFast { which, speed, segment, angle, limit } => format!(
                "{which}{of} has speed {speed:.6}, too fast for its segment of length {}: its control handle would \
                 pass the cut locus, angle {angle:.6} of {limit:.6}; in this direction the speed must stay below {:.6}",
                number(*segment),
                speed * limit / angle,
            ),
            // Arrays from Python have consistent lengths.
            reason => format!("{reason}{of}"),
        }
    }
}
