//! A space as a table of its operations.

use super::traits::{Ambient, Frame, Origin, Space};
use crate::curve::data::{Job, Moving};
use crate::fit::chain::{Chain, Run, Visit};
use crate::fit::end_kind::ChainEnds;
use crate::fit::node::{C2Residual, NodeVectors};
use crate::scalar::{LANES, Lane, Row, RowMut, Scalar};

/// The formulas of a [`Space`], and the loops over knots and samples that use them.
///
/// A space with cheap formulas has loops compiled for it alone; for other spaces one copy calls the formulas through
/// this table.
pub trait Kernels: Geometry {
    /// See `Chain::walk`.
    fn walk(&self, chain: &mut Chain, runs: &[Run; LANES]);
    /// See `Chain::walk_again`.
    fn walk_again(&self, chain: &mut Chain, runs: &[Run; LANES], visit: Visit);
    /// See `fit::sweep`.
    fn sweep(
        &self,
        chain: &mut Chain,
        ends: &ChainEnds,
        u: &[Lane],
        r: &mut [Lane],
        work: &mut NodeVectors<Lane>,
        at_rest: Lane,
    ) -> C2Residual;
    /// Evaluates a block of samples.
    fn samples(&self, job: &Job, out: &mut [f64]);
    /// See `Moving::push`.
    fn push(&self, moving: &Moving, motions: &[f64], out: &mut [f64]) -> bool;
    /// See `Moving::pull`.
    fn pull(&self, moving: &Moving, cotangents: &[f64], out: &mut [f64]) -> bool;
}

/// A space that is represented by its table of operations.
#[derive(Clone, Copy)]
pub struct Erased<'a>(pub &'a dyn Kernels);

/// Generates three things from a list of methods: the table, the table of every space, and the space of every table.
macro_rules! table {
    ($($part:ident { $(fn $name:ident(&self $(, $arg:ident: $kind:ty)*) $(-> $result:ty)?;)* })*) => {
        /// The formulas of a [`Space`].
        pub trait Geometry: Send + Sync {
            $($(#[doc = concat!("See [`", stringify!($part), "`].")]
            fn $name(&self $(, $arg: $kind)*) $(-> $result)?;)*)*
            /// See [`Ambient::ray`].
            fn ray(&self, p: &[Lane], v: &[Lane], t: Row, out: RowMut);
            /// See [`Ambient::prepared_ray`].
            fn prepared_ray(&self, p: &[Lane], v: &[Lane], prepared: &[Lane], t: Row, out: RowMut);
            /// See [`Ambient::geodesic`].
            fn geodesic(&self, p: Row, q: Row, t: Row, out: RowMut);
            /// See [`Origin::inner_handles`].
            fn inner_handles(&self, chord: &[Lane], prepared: &[Lane], a: Row, b: Row, w_plus: RowMut, w_minus: RowMut);
            /// See [`Origin::triple`].
            fn triple(&self, a: Row, b: Row, c: Row, out: RowMut);
            /// See [`Origin::stretch`].
            fn stretch(&self, v: Row, x: RowMut);
        }

        impl<M: Space> Geometry for M {
            $($(fn $name(&self $(, $arg: $kind)*) $(-> $result)? { $part::$name(self $(, $arg)*) })*)*
            fn ray(&self, p: &[Lane], v: &[Lane], t: Row, out: RowMut) {
                match (t, out) {
                    (Row::Lane(t), RowMut::Lane(out)) => Ambient::ray(self, p, v, t[0], out),
                    (Row::Dual(t), RowMut::Dual(out)) => Ambient::ray(self, p, v, t[0], out),
                    (Row::Jet(t), RowMut::Jet(out)) => Ambient::ray(self, p, v, t[0], out),
                    _ => mixed(),
                }
            }
            fn prepared_ray(&self, p: &[Lane], v: &[Lane], prepared: &[Lane], t: Row, out: RowMut) {
                match (t, out) {
                    (Row::Lane(t), RowMut::Lane(out)) => Ambient::prepared_ray(self, p, v, prepared, t[0], out),
                    (Row::Dual(t), RowMut::Dual(out)) => Ambient::prepared_ray(self, p, v, prepared, t[0], out),
                    (Row::Jet(t), RowMut::Jet(out)) => Ambient::prepared_ray(self, p, v, prepared, t[0], out),
                    _ => mixed(),
                }
            }
            fn geodesic(&self, p: Row, q: Row, t: Row, out: RowMut) {
                match (p, q, t, out) {
                    (Row::Lane(p), Row::Lane(q), Row::Lane(t), RowMut::Lane(out)) => Ambient::geodesic(self, p, q, t[0], out),
                    (Row::Dual(p), Row::Dual(q), Row::Dual(t), RowMut::Dual(out)) => Ambient::geodesic(self, p, q, t[0], out),
                    (Row::Jet(p), Row::Jet(q), Row::Jet(t), RowMut::Jet(out)) => Ambient::geodesic(self, p, q, t[0], out),
                    _ => mixed(),
                }
            }
            fn inner_handles(&self, chord: &[Lane], prepared: &[Lane], a: Row, b: Row, w_plus: RowMut, w_minus: RowMut) {
                match (a, b, w_plus, w_minus) {
                    (Row::Lane(a), Row::Lane(b), RowMut::Lane(x), RowMut::Lane(y)) => Origin::inner_handles(self, chord, prepared, a, b, x, y),
                    (Row::Dual(a), Row::Dual(b), RowMut::Dual(x), RowMut::Dual(y)) => Origin::inner_handles(self, chord, prepared, a, b, x, y),
                    _ => mixed(),
                }
            }
            fn triple(&self, a: Row, b: Row, c: Row, out: RowMut) {
                match (a, b, c, out) {
                    (Row::Lane(a), Row::Lane(b), Row::Lane(c), RowMut::Lane(out)) => Origin::triple(self, a, b, c, out),
                    (Row::Dual(a), Row::Dual(b), Row::Dual(c), RowMut::Dual(out)) => Origin::triple(self, a, b, c, out),
                    _ => mixed(),
                }
            }
            fn stretch(&self, v: Row, x: RowMut) {
                match (v, x) {
                    (Row::Lane(v), RowMut::Lane(x)) => Origin::stretch(self, v, x),
                    (Row::Dual(v), RowMut::Dual(x)) => Origin::stretch(self, v, x),
                    _ => mixed(),
                }
            }
        }

        table!(@erased $($part { $(fn $name(&self $(, $arg: $kind)*) $(-> $result)?;)* })*);
    };
    (@erased
        Ambient { $(fn $a:ident(&self $(, $a_arg:ident: $a_kind:ty)*) $(-> $a_result:ty)?;)* }
        Frame { $(fn $f:ident(&self $(, $f_arg:ident: $f_kind:ty)*) $(-> $f_result:ty)?;)* }
        Origin { $(fn $o:ident(&self $(, $o_arg:ident: $o_kind:ty)*) $(-> $o_result:ty)?;)* }
        Space { $(fn $s:ident(&self $(, $s_arg:ident: $s_kind:ty)*) $(-> $s_result:ty)?;)* }
    ) => {
        impl Ambient for Erased<'_> {
            $(fn $a(&self $(, $a_arg: $a_kind)*) $(-> $a_result)? { self.0.$a($($a_arg),*) })*
            fn ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], t: S, out: &mut [S]) {
                self.0.ray(p, v, S::row(&[t]), S::row_mut(out));
            }
            fn prepared_ray<S: Scalar>(&self, p: &[Lane], v: &[Lane], prepared: &[Lane], t: S, out: &mut [S]) {
                self.0.prepared_ray(p, v, prepared, S::row(&[t]), S::row_mut(out));
            }
            fn geodesic<S: Scalar>(&self, p: &[S], q: &[S], t: S, out: &mut [S]) {
                self.0.geodesic(S::row(p), S::row(q), S::row(&[t]), S::row_mut(out));
            }
        }
        impl Frame for Erased<'_> {
            $(fn $f(&self $(, $f_arg: $f_kind)*) $(-> $f_result)? { self.0.$f($($f_arg),*) })*
        }
        impl Origin for Erased<'_> {
            $(fn $o(&self $(, $o_arg: $o_kind)*) $(-> $o_result)? { self.0.$o($($o_arg),*) })*
            fn inner_handles<S: Scalar>(&self, chord: &[Lane], prepared: &[Lane], a: &[S], b: &[S], w_plus: &mut [S], w_minus: &mut [S]) {
                self.0.inner_handles(chord, prepared, S::row(a), S::row(b), S::row_mut(w_plus), S::row_mut(w_minus));
            }
            fn triple<S: Scalar>(&self, a: &[S], b: &[S], c: &[S], out: &mut [S]) {
                self.0.triple(S::row(a), S::row(b), S::row(c), S::row_mut(out));
            }
            fn stretch<S: Scalar>(&self, v: &[S], x: &mut [S]) {
                self.0.stretch(S::row(v), S::row_mut(x));
            }
        }
        impl Space for Erased<'_> {
            $(fn $s(&self $(, $s_arg: $s_kind)*) $(-> $s_result)? { self.0.$s($($s_arg),*) })*
        }
    };
}

table! {
    Ambient {
        fn point_len(&self) -> usize;
        fn point_shape(&self) -> Vec<usize>;
        fn is_complex(&self) -> bool;
        fn fiber_rank(&self) -> usize;
        fn is_connected(&self) -> bool;
        fn component(&self, p: &[f64]) -> bool;
        fn scales(&self) -> bool;
        fn cut_angle(&self) -> f64;
        fn longest_handle(&self) -> f64;
        fn injectivity_radius(&self) -> f64;
        fn longest_ray(&self) -> f64;
        fn ray_len(&self) -> usize;
        fn prepare_ray(&self, p: &[Lane], v: &[Lane], prepared: &mut [Lane]);
        fn log(&self, p: &[Lane], q: &[Lane], out: &mut [Lane]) -> Lane;
        fn distance(&self, p: &[Lane], q: &[Lane], log: &[Lane], angle: Lane) -> Lane;
        fn pairing(&self, p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane;
        fn raise(&self, p: &[Lane], gradient: &mut [Lane]);
        fn pull_back(&self, p: &[Lane], q: &[Lane], t: Lane, cotangent: &[Lane], to_p: &mut [Lane], to_q: &mut [Lane]) -> Lane;
        fn transvect(&self, p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]);
        fn parallel_transport(&self, p: &[Lane], q: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]);
        fn velocity(&self, gamma: &[Lane], d: &mut [Lane]);
        fn acceleration(&self, gamma: &[Lane], d: &[Lane], dd: &mut [Lane]);
        fn inner(&self, p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane;
        fn project(&self, x: &mut [Lane]) -> Lane;
        fn project_tangent(&self, p: &[Lane], v: &mut [Lane]) -> Lane;
        fn random_point(&self, noise: &mut [Lane]);
        fn violation(&self, x: &[f64]) -> String;
        fn imprecise_point(&self, points: &[f64]) -> Option<(usize, String)>;
        fn rounding(&self, p: &[Lane]) -> Lane;
    }
    Frame {
        fn frame_len(&self) -> usize;
        fn lift(&self, p: &[Lane], frame: &mut [Lane]);
        fn step(&self, frame: &mut [Lane], p: &[Lane], q: &[Lane], chord: &mut [Lane]) -> Lane;
        fn reorthonormalize(&self, frame: &mut [Lane], p: &[Lane]);
        fn coordinates(&self, frame: &[Lane], p: &[Lane], v: &[Lane], x: &mut [Lane]);
        fn products(&self, frame: &[Lane], p: &[Lane], cotangent: &[Lane], x: &mut [Lane]);
        fn tangent(&self, frame: &[Lane], p: &[Lane], x: &[Lane], v: &mut [Lane]);
    }
    Origin {
        fn dim(&self) -> usize;
        fn chord_len(&self) -> usize;
        fn curvature(&self) -> f64;
        fn prepare(&self, chord: &[Lane], prepared: &mut [Lane]);
        fn angle(&self, v: &[Lane]) -> Lane;
        fn condition(&self, chord: &[Lane]) -> Lane;
    }
    Space {
        fn angle_at(&self, p: &[Lane], v: &[Lane]) -> Lane;
    }
}

/// The table was called with numbers of different kinds.
#[cold]
fn mixed() -> ! {
    unreachable!("numbers of one kind, with no more derivatives than the solvers ask for")
}
