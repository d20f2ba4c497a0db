//! How rotations of four dimensions and unitary matrices of two correspond to pairs of unit quaternions.

use crate::rigid::{Quaternion, Vector, inverse_sqrt};
use crate::unitary::UnitaryGroup;
use symspline_core::matrix::Known;
use symspline_core::scalar::{Each, Lane, Scalar, dot, few, lane};
use symspline_core::space::Ambient;

const HALF: Lane = lane(0.5);

/// Two unit quaternions.
pub type Pair<S> = [Quaternion<S>; 2];

/// How matrices correspond to pairs of quaternions.
pub trait Form: Copy + Send + Sync + 'static {
    /// The group by general formulas, for what is not done by quaternions.
    type General: Ambient;
    /// Whether the loops of a fit are compiled for this group alone.
    const HOT: bool;
    /// The number of coordinates of α; the other components are zero.
    const FIRST: usize;
    /// p* x
    fn relative<S: Scalar>(p: &[S], x: &[S]) -> [S; 16];
    /// p x
    fn times<S: Scalar>(p: &[S], x: &[S; 16]) -> [S; 16];
    /// The pair of 1 + E, accurate for small E.
    fn pair<S: Scalar>(e: &[S; 16]) -> Pair<S>;
    /// The vectors of a matrix Ω.
    fn vectors(omega: &[Lane; 16]) -> [Vector<Lane>; 2];
    /// The matrix of a pair: bilinear in a and b.
    fn matrix<S: Scalar>(a: Quaternion<S>, b: Quaternion<S>) -> [S; 16];
    /// The derivatives in the products aᵢ bₖ of a function of the matrix with a given gradient.
    #[inline(always)]
    fn by_products(gradient: &[Lane; 16]) -> [[Lane; 4]; 4] {
        let unit = |i: usize| few(|k| if i == k { Lane::ONE } else { Lane::ZERO });
        few(|i| few(|k| dot(&Self::matrix(unit(i), unit(k)), gradient)))
    }
}

/// Rotations of four dimensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FourDimensional;

/// The quaternion product eᵢ eⱼ is ± e_k with k = i xor j.
const fn negative(i: usize, j: usize) -> bool {
    matches!((i, j), (1, 1) | (2, 2) | (3, 3) | (1, 3) | (2, 1) | (3, 2))
}

/// The entry of eᵢ eⱼ ēₖ, as its index and whether it is negative.
const fn entry(i: usize, j: usize, k: usize) -> (usize, bool) {
    let (first, flipped) = (i ^ j, k != 0);
    (first ^ k, negative(i, j) != (negative(first, k) != flipped))
}

/// Σ ± mᵣⱼ over the four entries of x ↦ eᵢ x ēₖ, divided by four: aᵢ bₖ of a rotation m.
#[inline(always)]
fn component<S: Scalar>(m: &[S; 16], i: usize, k: usize) -> S {
    let term = |j: usize| {
        let (row, minus) = entry(i, j, k);
        let x = m[4 * row + j];
        if minus { -x } else { x }
    };
    ((term(0) + term(1)) + (term(2) + term(3))) * lane(0.25)
}

impl Form for FourDimensional {
    type General = UnitaryGroup<1>;
    const HOT: bool = true;
    const FIRST: usize = 3;
    #[inline(always)]
    fn relative<S: Scalar>(p: &[S], x: &[S]) -> [S; 16] {
        few(|c| {
            let (i, j) = (c / 4, c % 4);
            dot(&[p[i], p[4 + i], p[8 + i], p[12 + i]], &[x[j], x[4 + j], x[8 + j], x[12 + j]])
        })
    }
    #[inline(always)]
    fn times<S: Scalar>(p: &[S], x: &[S; 16]) -> [S; 16] {
        few(|c| {
            let (i, j) = (c / 4 * 4, c % 4);
            dot(&p[i..i + 4], &[x[j], x[4 + j], x[8 + j], x[12 + j]])
        })
    }
    /// The matrix of all products aᵢ bₖ has rank one: b is its longest row, up to scale (Shepperd's choice).
    #[inline(always)]
    fn pair<S: Scalar>(e: &[S; 16]) -> Pair<S> {
        let products: [[S; 4]; 4] =
            few(|i| few(|k| component(e, i, k) + if i + k == 0 { Lane::ONE } else { Lane::ZERO }));
        let (mut row, mut most) = (products[0], Lane::ZERO);
        for x in products {
            let size = dot(&x.each(|x| x.value()), &x.each(|x| x.value()));
            let better = size.simd_gt(most);
            most = better.select(size, most);
            row = few(|k| S::select(better, x[k], row[k]));
        }
        let scale = inverse_sqrt(dot(&row, &row));
        let b = row.each(|x| x * scale);
        [few(|i| dot(&products[i], &b)), b]
    }
    #[inline(always)]
    fn vectors(omega: &[Lane; 16]) -> [Vector<Lane>; 2] {
        [few(|i| component(omega, i + 1, 0)), few(|k| component(omega, 0, k + 1))]
    }
    #[inline(always)]
    fn matrix<S: Scalar>(a: Quaternion<S>, b: Quaternion<S>) -> [S; 16] {
        let products: [[S; 4]; 4] = few(|i| few(|k| a[i] * b[k]));
        few(|c| {
            // Four pairs (i, k) contribute to the entry (row, j): those with i ^ j ^ k = row.
            let (row, j) = (c / 4, c % 4);
            let term = |i: usize| {
                let k = i ^ j ^ row;
                let x = products[i][k];
                if entry(i, j, k).1 { -x } else { x }
            };
            (term(0) + term(1)) + (term(2) + term(3))
        })
    }
    #[inline(always)]
    fn by_products(gradient: &[Lane; 16]) -> [[Lane; 4]; 4] {
        few(|i| few(|k| component(gradient, i, k) * lane(4.0)))
    }
}

/// Unitary matrices of two dimensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TwoDimensional;

/// x̄ y
#[inline(always)]
fn conjugate_times<S: Scalar>([a, b]: [S; 2], [c, d]: [S; 2]) -> [S; 2] {
    [a.fma(c, b * d), a.fma(d, -(b * c))]
}

/// The entries of a complex matrix of two rows.
#[inline(always)]
fn entries<S: Scalar>(x: &[S]) -> [[S; 2]; 4] {
    few(|i| [x[2 * i], x[2 * i + 1]])
}

impl Form for TwoDimensional {
    type General = UnitaryGroup<2, Known<2, 4>>;
    const HOT: bool = false;
    const FIRST: usize = 1;
    #[inline(always)]
    fn relative<S: Scalar>(p: &[S], x: &[S]) -> [S; 16] {
        let (p, x) = (entries(p), entries(x));
        few(|c| {
            if c > 7 {
                return S::constant(Lane::ZERO);
            }
            let (i, j) = (c / 4, c / 2 % 2);
            let (first, second) = (conjugate_times(p[i], x[j]), conjugate_times(p[2 + i], x[2 + j]));
            first[c % 2] + second[c % 2]
        })
    }
    #[inline(always)]
    fn times<S: Scalar>(p: &[S], x: &[S; 16]) -> [S; 16] {
        let (p, x) = (entries(p), entries(x));
        few(|c| {
            if c > 7 {
                return S::constant(Lane::ZERO);
            }
            let (i, j) = (c / 4 * 2, c / 2 % 2);
            let conjugate = |[re, im]: [S; 2]| [re, -im];
            let [first, second] = [0, 1].each(|k| conjugate_times(conjugate(p[i + k]), x[2 * k + j]));
            first[c % 2] + second[c % 2]
        })
    }
    /// The phase is the square root of the determinant d, (1 + d)/|1 + d| or i(1 − d)/|1 − d|.
    #[inline(always)]
    fn pair<S: Scalar>(e: &[S; 16]) -> Pair<S> {
        let (zero, [p, q, r, s]) = (S::constant(Lane::ZERO), entries(e));
        // d − 1 = tr E + det E
        let off: [S; 2] = few(|c| {
            let det = if c == 0 {
                p[0] * s[0] - p[1] * s[1] - (q[0] * r[0] - q[1] * r[1])
            } else {
                p[0] * s[1] + p[1] * s[0] - (q[0] * r[1] + q[1] * r[0])
            };
            p[c] + s[c] + det
        });
        let behind = off[0].value().simd_lt(lane(-1.0));
        let root = [S::select(behind, off[1], off[0] + lane(2.0)), S::select(behind, -off[0], off[1])];
        let scale = inverse_sqrt(dot(&root, &root));
        let z = root.each(|x| x * scale);
        // The matrix without its phase, (u, v; −v̄, ū): means of the two rows.
        let one = |[re, im]: [S; 2]| [re + Lane::ONE, im];
        let [u, v, w, x] = [one(p), q, r, one(s)].each(|y| conjugate_times(z, y));
        // Im z̄(1 + p) − Im z̄(1 + s) without the ones.
        let turn = conjugate_times(z, few(|c| p[c] - s[c]))[1];
        let b = [u[0] + x[0], turn, v[0] - w[0], v[1] + w[1]].each(|x| x * HALF);
        [[z[0], z[1], zero, zero], b]
    }
    #[inline(always)]
    fn vectors(omega: &[Lane; 16]) -> [Vector<Lane>; 2] {
        let [p, q, r, s] = entries(omega);
        let phase = [(p[1] + s[1]) * HALF, Lane::ZERO, Lane::ZERO];
        [phase, [p[1] - s[1], q[0] - r[0], q[1] + r[1]].each(|x| x * HALF)]
    }
    #[inline(always)]
    fn matrix<S: Scalar>([c, s, ..]: Quaternion<S>, [w, x, y, z]: Quaternion<S>) -> [S; 16] {
        let times = |[re, im]: [S; 2]| [c * re - s * im, c * im + s * re];
        let [p, q, r, s] = [[w, x], [y, z], [-y, z], [w, -x]].each(times);
        let zero = S::constant(Lane::ZERO);
        [p[0], p[1], q[0], q[1], r[0], r[1], s[0], s[1], zero, zero, zero, zero, zero, zero, zero, zero]
    }
}
