//! The nodes near a coordinate on which its value depends.

use crate::axis::{Axis, Condition};
use symspline_core::curve::Outside;

/// The nodes of a window on either side of a segment. The influence of a node decays by 0.27 per node on equal knots:
/// 0.27²⁴ = 2e-14.
const REACH: usize = 24;

/// A part of an axis. On a periodic axis, numbers of nodes continue after the last node.
pub struct Window {
    /// The first node.
    pub first: usize,
    knots: Vec<f64>,
    ends: Option<[Condition; 2]>,
    outside: Outside,
}

impl Window {
    /// The first node of the window around a coordinate, and the number of nodes.
    pub fn extent(axis: &Axis, x: f64) -> (usize, usize) {
        let (n, most) = (axis.nodes(), 2 * (REACH + 1));
        let periodic = usize::from(axis.ends.is_none());
        if n <= most + periodic {
            return (0, n);
        }
        let (segment, _) = axis.locate(x);
        let first = if axis.ends.is_none() {
            (segment + axis.different() - REACH) % axis.different()
        } else {
            segment.saturating_sub(REACH).min(n - most)
        };
        (first, most)
    }

    /// The window with this extent. Its ends inside the axis are natural on natural axes, and otherwise not-a-knot.
    pub fn new(axis: &Axis, (first, nodes): (usize, usize)) -> Window {
        let whole = nodes == axis.nodes();
        let inside =
            |condition| if condition == Condition::Natural { condition } else { Condition::NotAKnot };
        let ends = match axis.ends {
            None if whole => None,
            None => Some([Condition::NotAKnot; 2]),
            Some([a, b]) => Some([
                if first == 0 { a } else { inside(a) },
                if first + nodes == axis.nodes() { b } else { inside(b) },
            ]),
        };
        let knots = (first..first + nodes).map(|node| axis.knot(node)).collect();
        let outside = if whole { axis.outside } else { axis.outside_segment() };
        Window { first, knots, ends, outside }
    }

    /// The window as an axis.
    pub fn axis(&self) -> Axis<'_> {
        Axis { knots: &self.knots, ends: self.ends, outside: self.outside }
    }

    /// A coordinate of the axis in the numbering of the window.
    pub fn coordinate(&self, axis: &Axis, x: f64) -> f64 {
        if axis.outside != Outside::Wrap || self.knots.len() == axis.nodes() {
            return x;
        }
        let (segment, x) = axis.locate(x);
        if segment < self.first { x + axis.period() } else { x }
    }
}
