//! The interpolation polygon, unrolled into a moving frame.
//!
//! The frame at p₀ is transported in parallel along the geodesics p₀p₁, p₁p₂, … Seen from the frames
//! every node is the origin, the polygon is its chords dᵢ (coordinates of `log_{pᵢ}(pᵢ₊₁)`), velocities
//! are coordinate vectors, and transport between neighbours is the identity.
//!
//! Chains of equal length occupy the lanes: curves of a batch, or sections of a long curve.

use crate::scalar::{LANES, Lane};

/// An end with two conditions, seen from the frame at b₂, which is transported from p₀.
#[derive(Clone, Default)]
pub struct Joint {
    /// The chords from b₂ to p₀ and to the next node, and what `Origin::prepare` computes for them.
    pub(super) chords: [Vec<Lane>; 2],
    pub(super) prepared: [Vec<Lane>; 2],
    /// Coordinates at the next node in its frame of the chain, converted to the frame transported along the second chord.
    pub(super) turn: Vec<Lane>,
    /// y
    pub(super) bend: Vec<Lane>,
    /// h', in units of the clock of the chain.
    pub(super) apart: Lane,
}

/// The data of one lane of a chain: a run of nodes of a curve. In a closed curve the numbering continues around the
/// curve.
#[derive(Clone, Copy)]
pub struct Run<'a> {
    /// All knots of the curve.
    pub t: &'a [f64],
    /// All points of the curve, one after another.
    pub points: &'a [f64],
    /// The first node.
    pub first: usize,
}

impl<'a> Run<'a> {
    /// Length of the segment after the i-th node.
    pub(super) fn h(&self, i: usize) -> f64 {
        let n = self.t.len() - 1;
        let k = self.first + i;
        // A remainder takes as long as dozens of other operations.
        let k = if k < n { k } else { k % n };
        self.t[k + 1] - self.t[k]
    }

    /// The point of the i-th node.
    pub fn point(&self, i: usize, len: usize) -> &'a [f64] {
        let last = self.t.len() - 1;
        let k = self.first + i;
        let k = if k <= last { k } else { k % last };
        &self.points[k * len..(k + 1) * len]
    }
}

/// A callback that receives a node and its velocity.
pub type Visit<'a> = &'a mut dyn FnMut(usize, &[Lane]);

/// A frame that moves along the polygon.
#[derive(Default)]
pub struct Walker {
    pub(super) frame: Vec<Lane>,
    pub(super) p: Vec<Lane>,
    pub(super) q: Vec<Lane>,
    pub(super) node: usize,
}

/// Unrolled polygons, one per lane, with the data of the solvers. Reused between fits.
#[derive(Default)]
pub struct Chain {
    /// Number of segments.
    pub n: usize,
    /// Dimension of the space.
    pub m: usize,
    /// Segment lengths hᵢ, in units of `clock`.
    pub h: Vec<Lane>,
    /// Chords dᵢ, m numbers each.
    pub chord: Vec<Lane>,
    /// The numbers that `Origin::prepare` computes for each chord.
    pub prepared: Vec<Lane>,
    /// The velocities uᵢ.
    pub(super) u: Vec<Lane>,
    /// Whether the last node equals the first.
    pub(super) closed: bool,
    /// The C² residual at each node.
    pub r: Vec<Lane>,
    /// Prescribed end vectors, in the frames of the ends.
    pub end_values: [Vec<Lane>; 2],
    /// The ends with two conditions.
    pub(super) joints: [Option<Joint>; 2],
    /// The factor of chords and velocities; see `Ambient::scales`.
    pub(super) scale: Lane,
    /// The factor of times.
    pub(super) clock: Lane,
    /// D of (21): the longest step of each lane.
    pub max_step: Lane,
    /// The longest chord of each lane. Without an invariant metric coordinates do not preserve lengths, and this is
    /// not D.
    pub longest: Lane,
    /// The largest deciding angle of a step of each lane, or an upper bound where it is small.
    pub widest: Lane,
    /// The largest |dᵢ|/hᵢ of each lane.
    pub pace: Lane,
    /// The growth of rounding errors in each lane; see `Origin::condition`.
    pub condition: Lane,
    /// Where neighbours lie at or beyond the cut locus: the first segment and its deciding angle.
    pub cut: [Option<(usize, f64)>; LANES],
    /// Where neighbours lie almost at the cut locus.
    pub almost_cut: [Option<(usize, f64)>; LANES],
    pub(super) walker: Walker,
    /// Frame and point at the first node.
    pub(super) start: (Vec<Lane>, Vec<Lane>),
    pub(super) ambient: Vec<Lane>,
    /// Zero, and a vector at the first and at the last node of a closed curve.
    pub(super) closure: [Vec<Lane>; 3],
}

impl Chain {
    /// Frame and point at the first node.
    pub fn home(&self) -> (&[Lane], &[Lane]) {
        (&self.start.0, &self.start.1)
    }

    /// The factor that converts energies to the units of knots and points.
    pub fn unit_of_energy(&self) -> Lane {
        self.clock * self.clock * self.clock / (self.scale * self.scale)
    }

    /// The velocities of all nodes.
    pub fn velocities(&self) -> &[Lane] {
        &self.u
    }

    /// The unknowns: the velocities of all nodes. In a closed curve the last node equals the first and is omitted.
    pub fn unknowns(&self) -> &[Lane] {
        &self.u[..self.count()]
    }

    pub(super) fn count(&self) -> usize {
        if self.closed { self.n * self.m } else { self.u.len() }
    }

    /// Makes the velocities readable while the rest of the chain changes.
    pub fn with_velocities<T>(&mut self, work: impl FnOnce(&mut Self, &[Lane]) -> T) -> T {
        let u = std::mem::take(&mut self.u);
        let result = work(self, &u);
        self.u = u;
        result
    }

    /// The length of the longer segment at a node. In a closed curve the end nodes have two segments, too.
    pub fn longer(&self, node: usize) -> Lane {
        let n = self.n;
        let (before, behind) =
            if self.closed { ((node + n - 1) % n, node % n) } else { (node.max(1) - 1, node.min(n - 1)) };
        self.h[before].max(self.h[behind])
    }

    /// Length of the i-th segment on each lane, in units of the knots.
    pub fn duration(&self, i: usize) -> Lane {
        self.h[i] / self.clock
    }
}
