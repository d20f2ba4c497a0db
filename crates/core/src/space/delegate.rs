//! Methods that a space takes from another one.

/// Implements methods of [`Ambient`](crate::space::Ambient) by those of another space: `delegate!(space => space.0; inner)`.
/// `Lane` must be in scope.
#[macro_export]
macro_rules! delegate {
    ($space:ident => $to:expr; $($name:ident),*) => { $($crate::delegate!(@ $name $space $to);)* };
    (@ $space:ident $to:expr; $name:ident($($arg:ident: $kind:ty),*) -> $result:ty) => {
        fn $name(&self $(, $arg: $kind)*) -> $result {
            let $space = self;
            $to.$name($($arg),*)
        }
    };
    (@ point_len $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; point_len() -> usize);
    };
    (@ point_shape $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; point_shape() -> Vec<usize>);
    };
    (@ is_complex $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; is_complex() -> bool);
    };
    (@ fiber_rank $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; fiber_rank() -> usize);
    };
    (@ cut_angle $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; cut_angle() -> f64);
    };
    (@ longest_handle $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; longest_handle() -> f64);
    };
    (@ injectivity_radius $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; injectivity_radius() -> f64);
    };
    (@ ray_len $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; ray_len() -> usize);
    };
    (@ prepare_ray $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; prepare_ray(p: &[Lane], v: &[Lane], prepared: &mut [Lane]) -> ());
    };
    (@ distance $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; distance(p: &[Lane], q: &[Lane], log: &[Lane], angle: Lane) -> Lane);
    };
    (@ pairing $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; pairing(p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane);
    };
    (@ raise $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; raise(p: &[Lane], gradient: &mut [Lane]) -> ());
    };
    (@ pull_back $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; pull_back(
            p: &[Lane], q: &[Lane], t: Lane, cotangent: &[Lane], to_p: &mut [Lane], to_q: &mut [Lane]
        ) -> Lane);
    };
    (@ transvect $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; transvect(p: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) -> ());
    };
    (@ parallel_transport $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; parallel_transport(p: &[Lane], q: &[Lane], v: &[Lane], x: &[Lane], out: &mut [Lane]) -> ());
    };
    (@ inner $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; inner(p: &[Lane], u: &[Lane], v: &[Lane]) -> Lane);
    };
    (@ project $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; project(x: &mut [Lane]) -> Lane);
    };
    (@ project_tangent $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; project_tangent(p: &[Lane], v: &mut [Lane]) -> Lane);
    };
    (@ random_point $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; random_point(noise: &mut [Lane]) -> ());
    };
    (@ violation $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; violation(x: &[f64]) -> String);
    };
    (@ imprecise_point $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; imprecise_point(points: &[f64]) -> Option<(usize, String)>);
    };
    (@ rounding $space:ident $to:expr) => {
        $crate::delegate!(@ $space $to; rounding(p: &[Lane]) -> Lane);
    };
}
