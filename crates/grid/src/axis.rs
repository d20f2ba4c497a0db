//! One axis of a grid: its knots, the conditions at its ends, and the runs of nodes in a row.

use symspline_core::curve::Outside;

/// A condition at one end of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Condition {
    /// Zero covariant acceleration.
    Natural,
    /// The first two segments are one cubic in normal coordinates.
    NotAKnot,
    /// Zero velocity.
    Clamped,
}

/// An axis of a grid.
#[derive(Clone, Copy)]
pub struct Axis<'a> {
    /// Increasing knots.
    pub knots: &'a [f64],
    /// The conditions at both ends; None for a periodic axis, whose first and last nodes have equal arrays.
    pub ends: Option<[Condition; 2]>,
    /// The policy for coordinates outside the knots.
    pub outside: Outside,
}

/// Consecutive nodes of a row with points. On a periodic axis, numbers continue after the last node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    pub first: usize,
    pub nodes: usize,
    /// Whether the run is a whole periodic row.
    pub closed: bool,
}

/// The segment of a coordinate between two nodes. Equal nodes stand for an isolated node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbours {
    pub left: usize,
    pub right: usize,
    pub x: f64,
}

impl Axis<'_> {
    /// The number of nodes of a row.
    pub fn nodes(&self) -> usize {
        self.knots.len()
    }

    /// The number of different nodes, after which numbers repeat.
    pub fn different(&self) -> usize {
        self.nodes() - usize::from(self.ends.is_none())
    }

    /// The index of a node whose number continues after the last one.
    pub fn index(&self, i: usize) -> usize {
        if i < self.nodes() { i } else { i - self.different() }
    }

    /// The knot with such a number.
    pub fn knot(&self, i: usize) -> f64 {
        let n = self.nodes();
        if i < n { self.knots[i] } else { self.knots[i - self.different()] + self.period() }
    }

    /// The length of the axis.
    pub fn period(&self) -> f64 {
        self.knots[self.nodes() - 1] - self.knots[0]
    }

    /// The segment of a coordinate, and the coordinate there: inside the knots if the axis repeats.
    pub fn locate(&self, x: f64) -> (usize, f64) {
        let (n, first) = (self.nodes(), self.knots[0]);
        let x = if self.outside == Outside::Wrap && !(first <= x && x <= self.knots[n - 1]) {
            let inside = x - ((x - first) / self.period()).floor() * self.period();
            inside.clamp(first, self.knots[n - 1])
        } else {
            x
        };
        (self.knots[1..n - 1].partition_point(|&t| t <= x), x)
    }

    /// The node at a coordinate, if there is one.
    pub fn node_at(&self, x: f64) -> Option<usize> {
        let (segment, x) = self.locate(x);
        [segment, segment + 1].into_iter().find(|&node| self.knots[node] == x)
    }

    /// The policy inside one segment.
    pub fn outside_segment(&self) -> Outside {
        if self.outside == Outside::Wrap { Outside::Continue } else { self.outside }
    }

    /// The conditions at the ends of a run; None for a closed run. Ends beside missing nodes are natural on natural
    /// axes, and otherwise not-a-knot.
    pub fn conditions(&self, run: Run) -> Option<[Condition; 2]> {
        if run.closed {
            return None;
        }
        let Some(ends) = self.ends else { return Some([Condition::NotAKnot; 2]) };
        let at_end = [run.first == 0, run.first + run.nodes == self.nodes()];
        Some([0, 1].map(|e| match ends[e] {
            Condition::Clamped if !at_end[e] => Condition::NotAKnot,
            condition => condition,
        }))
    }

    /// The runs of a row, given which of its nodes are valid.
    pub fn runs(&self, valid: impl Fn(usize) -> bool) -> Vec<Run> {
        let count = self.different();
        // A scan of a periodic row starts after a missing node, so that it divides no run.
        let start = match self.ends {
            Some(_) => 0,
            None => match (0..count).find(|&i| !valid(i)) {
                Some(missing) => missing + 1,
                None => return vec![Run { first: 0, nodes: self.nodes(), closed: true }],
            },
        };
        let mut runs = Vec::new();
        let mut first = None;
        for i in start..=start + count {
            let good = i < start + count && valid(self.index(i));
            match (good, first) {
                (true, None) => first = Some(i),
                (false, Some(from)) => {
                    let from_inside = if from >= count && self.ends.is_none() { from - count } else { from };
                    runs.push(Run { first: from_inside, nodes: i - from, closed: false });
                    first = None;
                }
                _ => {}
            }
        }
        runs
    }

    /// The coordinate in the numbering of a run, if the run contains it.
    pub fn coordinate_in(&self, run: Run, segment: usize, x: f64) -> Option<f64> {
        let (first, last) = (run.first as isize, (run.first + run.nodes - 1) as isize);
        // Segments of a periodic axis have several numbers.
        let turns: &[isize] = if self.ends.is_none() && !run.closed { &[0, 1, -1] } else { &[0] };
        turns.iter().find_map(|&turn| {
            let i = segment as isize + turn * self.different() as isize;
            if first <= i && i < last {
                Some(x + turn as f64 * self.period())
            } else if i == last && x == self.knots[segment] {
                Some(self.knot(run.first + run.nodes - 1))
            } else if i + 1 == first && x == self.knots[segment + 1] {
                Some(self.knot(run.first))
            } else {
                None
            }
        })
    }

    /// The segment from which a coordinate of a row is evaluated, if the row has nodes there.
    pub fn segment_at(&self, valid: impl Fn(usize) -> bool, x: f64) -> Option<Neighbours> {
        let (i, x) = self.locate(x);
        let segment = |left: usize, x: f64| Neighbours { left, right: left + 1, x };
        let isolated = |node: usize| Neighbours { left: node, right: node, x };
        let last = self.nodes() - 1;
        if valid(i) && valid(i + 1) {
            return Some(segment(i, x));
        }
        if valid(i) && x == self.knots[i] {
            return Some(match (i, self.ends) {
                (0, None) if valid(last - 1) => segment(last - 1, self.knots[last]),
                (1.., _) if valid(i - 1) => segment(i - 1, x),
                _ => isolated(i),
            });
        }
        if valid(i + 1) && x == self.knots[i + 1] {
            return Some(match self.ends {
                None if i + 1 == last && valid(1) => segment(0, self.knots[0]),
                _ if i + 1 < last && valid(i + 2) => segment(i + 1, x),
                _ => isolated(i + 1),
            });
        }
        None
    }
}
