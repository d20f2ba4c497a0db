//! The knots of a curve in frames that are transported along its polygon, as in the fit.

use super::operators::{Few, Matrix, Vector, columns, unit};
use crate::monitor::checkpoint;
use crate::scalar::{Lane, lane};
use crate::space::{Ambient, Erased, Frame, Origin};
use smallvec::smallvec;

/// A knot: its point, and the frame there.
pub struct Node {
    pub p: Few<Lane>,
    pub frame: Few<Lane>,
}

/// Knots, chords and velocities of one curve.
pub struct Polygon {
    pub nodes: Vec<Node>,
    /// Chords in the frames of their first nodes.
    pub chords: Vec<Vector>,
    /// Velocities in the frames of the nodes.
    pub u: Vec<Vector>,
    /// For closed curves: from the frame of the first node to that of the last, which is at the same point.
    pub holonomy: Option<Matrix>,
}

impl Polygon {
    pub fn new(space: &Erased, points: &[f64], velocities: &[f64], closed: bool) -> Self {
        let (m, len) = (space.dim(), space.point_len());
        let lanes = |row: &[f64]| -> Few<Lane> { row.iter().map(|&x| lane(x)).collect() };
        let mut p = lanes(&points[..len]);
        let mut frame: Few<Lane> = smallvec![Lane::ZERO; space.frame_len()];
        space.lift(&p, &mut frame);
        let (mut nodes, mut chords) = (Vec::new(), Vec::new());
        let mut chord: Few<Lane> = smallvec![Lane::ZERO; m];
        for row in points[len..].chunks(len) {
            checkpoint();
            let q = lanes(row);
            nodes.push(Node { p: p.clone(), frame: frame.clone() });
            space.step(&mut frame, &p, &q, &mut chord);
            space.reorthonormalize(&mut frame, &q);
            chords.push(first(&chord));
            p = q;
        }
        nodes.push(Node { p, frame });
        let u =
            nodes.iter().zip(velocities.chunks(len)).map(|(node, u)| node.coordinates(space, u)).collect();
        let holonomy = closed.then(|| {
            let (start, end) = (&nodes[0], &nodes[nodes.len() - 1]);
            let still: Few<Lane> = smallvec![Lane::ZERO; len];
            let (mut here, mut there) = (still.clone(), still.clone());
            columns(m, m, |k, out| {
                start.tangent(space, k, &mut here);
                // The same point, possibly another array.
                space.parallel_transport(&start.p, &end.p, &still, &here, &mut there);
                space.coordinates(&end.frame, &end.p, &there, out);
            })
        });
        Polygon { nodes, chords, u, holonomy }
    }
}

impl Node {
    /// Coordinates of a tangent vector.
    pub fn coordinates(&self, space: &Erased, v: &[f64]) -> Vector {
        let v: Few<Lane> = v.iter().map(|&x| lane(x)).collect();
        let mut x: Few<Lane> = smallvec![Lane::ZERO; space.dim()];
        space.coordinates(&self.frame, &self.p, &v, &mut x);
        first(&x)
    }

    /// Eight vectors of the frame, from the k-th on.
    pub fn tangent(&self, space: &Erased, k: usize, out: &mut [Lane]) {
        let x: Few<Lane> = (0..space.dim()).map(|r| unit(r, k)).collect();
        space.tangent(&self.frame, &self.p, &x, out);
    }

    /// The frame vectors as columns.
    pub fn basis(&self, space: &Erased) -> Matrix {
        columns(space.point_len(), space.dim(), |k, out| self.tangent(space, k, out))
    }

    /// The tangent vector g with `Σ g δ = gradient · coordinates(δ)` for all tangent vectors δ: the shortest solution
    /// of `basisᵀ g = gradient`. It uses a QR factorisation of the basis, because its normal equations would square
    /// the condition number.
    pub fn gradient(&self, space: &Erased, gradient: &Vector) -> Vector {
        let (q, r) = self.basis(space).qr().unpack();
        let x = r.tr_solve_upper_triangular(gradient);
        q * x.unwrap_or_else(|| Vector::from_element(gradient.len(), f64::NAN))
    }
}

/// The numbers of the first lane.
fn first(x: &[Lane]) -> Vector {
    Vector::from_iterator(x.len(), x.iter().map(|x| x.as_array()[0]))
}
