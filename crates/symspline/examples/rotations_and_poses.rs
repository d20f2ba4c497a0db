//! Rotations, poses, a batch of curves and noisy data, with the types of nalgebra.
//!
//! `cargo run --example rotations_and_poses --features nalgebra`

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use symspline::prelude::*;

fn main() -> Result<(), Error> {
    let times = [0.0, 0.4, 1.0, 1.7, 2.0];
    // A rotation about a fixed axis; signs of quaternions need not agree.
    let axis = Vector3::y_axis();
    let mut quaternions = times.map(|t| UnitQuaternion::from_axis_angle(&axis, 0.8 * t));
    quaternions[2] = UnitQuaternion::new_unchecked(-quaternions[2].into_inner());

    let spline = CubicSpline::builder(So3).ends(NotAKnot).fit(&times, &quaternions)?;
    let q: UnitQuaternion<f64> = spline.at(0.7);
    let w: Vector3<f64> = spline.body_velocity(0.7);
    println!("angle {:.6}, rate {:.6} {:.6} {:.6}", q.angle(), w.x, w.y, w.z);
    assert!((q.angle() - 0.56).abs() < 1e-12 && (w - Vector3::new(0.0, 0.8, 0.0)).norm() < 1e-12);

    // A screw motion along the same axis.
    let poses = times.map(|t| {
        Isometry3::from_parts(
            Translation3::new(0.0, 3.0 * t, 0.0),
            UnitQuaternion::from_axis_angle(&axis, 0.8 * t),
        )
    });
    let path = CubicSpline::new(Se3, &times, &poses)?;
    let twist = path.body_velocity(1.0);
    println!("angular {:.3?}, linear {:.3?}", twist.angular.as_slice(), twist.linear.as_slice());
    assert!((twist.linear - Vector3::new(0.0, 3.0, 0.0)).norm() < 1e-11);
    assert!((path.at(0.7).translation.vector.y - 2.1).abs() < 1e-12);

    // A rotation and a position with a curve each: a product.
    let parts =
        times.map(|t| (UnitQuaternion::from_axis_angle(&axis, 0.8 * t), Vector3::new(3.0 * t, t * t, 0.0)));
    let apart = CubicSpline::builder((So3, Euclidean::<3>)).ends(NotAKnot).fit(&times, &parts)?;
    let (rotation, position) = apart.at(0.7);
    println!(
        "angle {:.6}, position {:.6?}, speed {:.6}",
        rotation.angle(),
        position.as_slice(),
        apart.speed(0.7)
    );
    assert!((position - Vector3::new(2.1, 0.49, 0.0)).norm() < 1e-12);
    assert!((apart.speed(0.7) - (0.64_f64 + 9.0 + 1.96).sqrt()).abs() < 1e-12);

    // Opposite directions have no unique geodesic.
    let directions = [Vector3::x(), -Vector3::x(), Vector3::y(), Vector3::z(), Vector3::x()];
    match CubicSpline::new(Sphere::<3>, &times, &directions) {
        Err(Error::CutLocus { curve, node, angle, limit }) => {
            println!("curve {curve}, node {node}: angle {angle:.3} of {limit:.3}");
            assert_eq!((curve, node), (0, 0));
        }
        other => panic!("{other:?}"),
    }
    match CubicSpline::new(Sphere::<3>, &[0.0, 1.0, 0.5], &directions[2..]) {
        Err(Error::UnsortedTimes { node, .. }) => assert_eq!(node, 2),
        other => panic!("{other:?}"),
    }

    let many = [directions[2..].to_vec(), vec![Vector3::z(), Vector3::x(), Vector3::y()]];
    let batch = Batch::fit_shared(Sphere::<3>, &times[..3], &many)?;
    let samples = batch.sample(&[0.0, 0.2, 1.0])?;
    println!("curve 1 at time 0.2: {:.6?}", samples[1][1].as_slice());
    assert!((samples[1][2] - Vector3::y()).norm() < 1e-14);

    // A noisy turn of directions, with one outlier.
    let t: Vec<f64> = (0..60).map(|i| f64::from(i) / 10.0).collect();
    let mut noisy: Vec<Vector3<f64>> = t
        .iter()
        .map(|t| {
            Vector3::new((0.4 * t).cos(), (0.4 * t).sin(), 0.05 * (1e4 * (1.0 + t).sin()).fract()).normalize()
        })
        .collect();
    noisy[20] = Vector3::z();
    let soft = Smoothing::default().loss(Loss::Huber).fit(Sphere::<3>, &t, &noisy)?;
    let direction = soft.at(3.3);
    println!("smooth {:.3?} ± {:.3}", direction.as_slice(), soft.std(3.3));
    assert!((direction - Vector3::new(1.32_f64.cos(), 1.32_f64.sin(), 0.0)).norm() < 0.03);
    Ok(())
}
