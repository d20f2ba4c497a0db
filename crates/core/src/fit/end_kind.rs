//! The kinds of end conditions, lane by lane.

use crate::scalar::{LANES, Lane, mask_from};

/// A condition at one end of an open curve, in the form that the solvers use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndKind {
    /// The velocity is prescribed (the paper's clamped ends, (19)).
    Velocity,
    /// The covariant acceleration is prescribed; natural ends (20) prescribe zero.
    Acceleration,
    /// Not-a-knot in normal coordinates at the neighbouring knot.
    NotAKnot,
    /// Velocity and acceleration are prescribed. The unknown is the control point after the additional knot.
    Both,
}

/// The ends of the chains of all lanes: closed, or the kind at either end of each lane.
#[derive(Clone, Copy)]
pub enum ChainEnds {
    /// The last node equals the first.
    Periodic,
    /// First and last node, lane by lane.
    Open([[EndKind; LANES]; 2]),
}

impl ChainEnds {
    /// The lanes in which the velocity at a node is prescribed, for n segments.
    pub fn given(&self, n: usize, node: usize) -> Lane {
        match self {
            ChainEnds::Open(kinds) if node == 0 => of_kind(&kinds[0], EndKind::Velocity),
            ChainEnds::Open(kinds) if node == n => of_kind(&kinds[1], EndKind::Velocity),
            _ => Lane::ZERO,
        }
    }
}

/// The lanes whose end is of a kind.
pub fn of_kind(kinds: &[EndKind; LANES], kind: EndKind) -> Lane {
    mask_from(|l| kinds[l] == kind)
}
