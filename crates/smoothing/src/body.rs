//! Velocities of a curve in a group in the moving frame: components of g⁻¹g'.

use symspline_core::matrix::{Matrix, inverse};
use symspline_core::monitor::Monitor;
use symspline_core::rows;
use symspline_core::scalar::Lane;
use symspline_core::space::{Ambient, Erased, Origin};

/// A group, and the components of its velocities.
#[derive(Clone, Copy)]
pub struct Body<'a> {
    /// Its space.
    pub space: &'a Erased<'a>,
    /// For groups of matrices, the m rows that convert a matrix to its coordinates in the frame at the identity. Empty
    /// for rotations of three dimensions and unit quaternions, whose components are those of the angular velocity.
    pub inverse: &'a [f64],
}

impl Body<'_> {
    /// The number of components.
    pub fn size(&self) -> usize {
        if self.inverse.is_empty() { 3 } else { self.space.dim() }
    }

    /// The rotation matrices of points, nine numbers each.
    pub fn matrices(&self, p: &[f64]) -> Vec<f64> {
        if self.space.point_len() == 9 {
            return p.to_vec();
        }
        let matrix = |q: &[f64]| {
            let [w, x, y, z] = [q[0], q[1], q[2], q[3]];
            [
                [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
                [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
                [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
            ]
        };
        p.chunks_exact(4).flat_map(|q| matrix(q).into_iter().flatten()).collect()
    }

    /// g⁻¹v: angular velocities, or matrices.
    fn elements(&self, p: &[f64], v: &[f64], monitor: &Monitor) -> Vec<f64> {
        let len = self.space.point_len();
        let rows = p.chunks_exact(len).zip(v.chunks_exact(len));
        if !self.inverse.is_empty() {
            return self.by_matrices([p, v], monitor, |p, v| inverse(p).times(v), |p, v| inverse(p).times(v));
        }
        if len == 4 {
            return rows
                .flat_map(|(p, v)| {
                    let turn = cross(&p[1..], &v[1..]);
                    std::array::from_fn::<f64, 3, _>(|i| 2.0 * (p[0] * v[i + 1] - v[0] * p[i + 1] - turn[i]))
                })
                .collect();
        }
        rows.flat_map(|(p, v)| {
            let entry = |i: usize, j: usize| (0..3).map(|k| p[3 * k + i] * v[3 * k + j]).sum::<f64>();
            [entry(2, 1), entry(0, 2), entry(1, 0)]
        })
        .collect()
    }

    /// [a, b] for rows of elements.
    fn bracket(&self, a: &[f64], b: &[f64], monitor: &Monitor) -> Vec<f64> {
        if self.inverse.is_empty() {
            let rows = a.chunks_exact(3).zip(b.chunks_exact(3));
            return rows.flat_map(|(a, b)| cross(a, b)).collect();
        }
        self.by_matrices([a, b], monitor, |a, b| &a.times(b) - &b.times(a), |a, b| &a.times(b) - &b.times(a))
    }

    /// Applies a function of two matrices, real or complex, to rows.
    fn by_matrices(
        &self,
        rows: [&[f64]; 2],
        monitor: &Monitor,
        real: impl Fn(&Matrix<Lane, 1>, &Matrix<Lane, 1>) -> Matrix<Lane, 1> + Sync,
        complex: impl Fn(&Matrix<Lane, 2>, &Matrix<Lane, 2>) -> Matrix<Lane, 2> + Sync,
    ) -> Vec<f64> {
        let n = self.space.point_shape()[0];
        let mut out = vec![0.0; rows[0].len()];
        rows::map(self.space.point_len(), &rows, monitor, &mut out, |x, out| {
            if self.space.is_complex() {
                complex(&Matrix::read(n, n, &x[0]), &Matrix::read(n, n, &x[1])).write(out);
            } else {
                real(&Matrix::read(n, n, &x[0]), &Matrix::read(n, n, &x[1])).write(out);
            }
        });
        out
    }

    /// The components of elements.
    fn components(&self, elements: Vec<f64>) -> Vec<f64> {
        if self.inverse.is_empty() {
            return elements;
        }
        let len = self.space.point_len();
        let along = |x: &[f64], row: &[f64]| x.iter().zip(row).map(|(x, y)| x * y).sum::<f64>();
        elements
            .chunks_exact(len)
            .flat_map(|x| self.inverse.chunks_exact(len).map(move |row| along(x, row)))
            .collect()
    }

    /// The components of g⁻¹v.
    pub fn rates(&self, p: &[f64], v: &[f64], monitor: &Monitor) -> Vec<f64> {
        self.components(self.elements(p, v, monitor))
    }

    /// The derivatives of the rates with respect to one coordinate of a move along vectors b at p, and to its time
    /// derivative.
    ///
    /// With η = Σ ξ_j B_j, and B_j' = −[ω, B_j]/2 in parallel frames, δω = η' + [ω, η] = Σ ξ_j' B_j + ξ_j [ω, B_j]/2.
    pub fn derivatives(&self, p: &[f64], v: &[f64], b: &[f64], monitor: &Monitor) -> [Vec<f64>; 2] {
        let (omega, vector) = (self.elements(p, v, monitor), self.elements(p, b, monitor));
        let mut half = self.components(self.bracket(&omega, &vector, monitor));
        half.iter_mut().for_each(|x| *x *= 0.5);
        [half, self.components(vector)]
    }

    /// The matrices of ξ ↦ [e, ξ]/2 for the vectors e of a frame at p, in its coordinates.
    pub fn half_brackets(&self, p: &[f64], frame: &[f64], monitor: &Monitor) -> Vec<f64> {
        let (m, len) = (self.space.dim(), self.space.point_len());
        let at = p.repeat(m);
        let columns: Vec<[Vec<f64>; 2]> = frame
            .chunks_exact(len)
            .map(|vector| self.derivatives(&at, frame, &vector.repeat(m), monitor))
            .collect();
        // Row k of the j-th column belongs to the k-th vector e and the j-th coordinate ξ.
        let lanes =
            |x: &dyn Fn(usize, usize) -> f64| Matrix::<Lane, 1>::from_fn(m, m, |i, j| [Lane::splat(x(i, j))]);
        let back = inverse(&lanes(&|i, j| columns[j][1][i]));
        let mut out = Vec::with_capacity(m * m * m);
        for k in 0..m {
            let half = back.times(&lanes(&|i, j| columns[j][0][k * m + i]));
            out.extend(half.entries().iter().map(|x| x[0].as_array()[0]));
        }
        out
    }
}

/// a × b
pub fn cross(a: &[f64], b: &[f64]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
