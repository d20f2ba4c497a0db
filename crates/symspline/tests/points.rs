//! The same curve, whatever the type of its points.

use mint::{ColumnMatrix3, ColumnMatrix4, RowMatrix3, RowMatrix4};
use nalgebra::{Isometry3, Matrix3, Matrix4, Rotation3, Translation3, UnitQuaternion, UnitVector3, Vector3};
use symspline::{Point, Row, Space, prelude::*};

const T: [f64; 5] = [0.0, 0.3, 1.0, 1.1, 2.0];
const AT: [f64; 4] = [0.05, 0.3, 0.77, 1.9];

fn quaternions() -> [UnitQuaternion<f64>; 5] {
    // Up to almost half a turn from the first to the last, and with any signs.
    let mut q =
        T.map(|t| UnitQuaternion::from_scaled_axis(Vector3::new(1.4 * t, 0.3 - t * t, (2.0 * t).sin())));
    q[3] = UnitQuaternion::new_unchecked(-q[3].into_inner());
    q
}

fn poses() -> [Isometry3<f64>; 5] {
    let mut i = 0;
    quaternions().map(|q| {
        i += 1;
        Isometry3::from_parts(Translation3::new(3.0 * T[i - 1], f64::from(i as u8), -200.0), q)
    })
}

/// Numbers of points and of velocities at some times.
fn numbers<S: Space, P: Point<S> + Row>(space: S, points: &[P]) -> [Vec<Vec<f64>>; 2]
where
    P::Tangent: Row,
{
    let spline = CubicSpline::new(space, &T, points).expect("it is a curve");
    let row = |write: &dyn Fn(&mut Vec<f64>)| {
        let mut row = Vec::new();
        write(&mut row);
        row
    };
    [
        AT.map(|t| row(&|row| spline.at(t).write(row))).to_vec(),
        AT.map(|t| row(&|row| spline.velocity(t).write(row))).to_vec(),
    ]
}

fn near(a: &[Vec<Vec<f64>>; 2], b: &[Vec<Vec<f64>>; 2]) {
    for (a, b) in a.iter().flatten().flatten().zip(b.iter().flatten().flatten()) {
        assert!((a - b).abs() < 1e-11 * b.abs().max(1.0), "{a} is not {b}");
    }
    assert_eq!(a.each_ref().map(|x| x.concat().len()), b.each_ref().map(|x| x.concat().len()));
}

#[test]
fn rotations_of_all_libraries_give_the_same_curve() {
    let q = quaternions();
    let expected = numbers(So3, &q);
    let m = q.map(|q| q.to_rotation_matrix());
    let rows = m.map(|m| std::array::from_fn::<_, 3, _>(|i| std::array::from_fn::<_, 3, _>(|j| m[(i, j)])));
    near(&numbers(So3, &rows), &expected);
    near(&numbers(So3, &m), &expected);
    near(&numbers::<_, Matrix3<f64>>(So3, &m.map(Rotation3::into_inner)), &expected);
    near(&numbers(So3, &q.map(|q| glam::DQuat::from_xyzw(q.i, q.j, q.k, q.w))), &expected);
    near(&numbers(So3, &m.map(|m| glam::DMat3::from_cols_slice(m.matrix().as_slice()))), &expected);
    let mint = q.map(|q| mint::Quaternion { s: q.w, v: mint::Vector3 { x: q.i, y: q.j, z: q.k } });
    near(&numbers(So3, &mint), &expected);
    near(&numbers(So3, &rows.map(RowMatrix3::from)), &expected);
    let columns = m.map(|m| ColumnMatrix3::from(m.into_inner().data.0));
    near(&numbers(So3, &columns), &expected);
}

#[test]
fn poses_of_all_libraries_give_the_same_curve() {
    let expected = numbers(Se3, &poses());
    let m = poses().map(|pose| pose.to_homogeneous());
    near(&numbers::<_, Matrix4<f64>>(Se3, &m), &expected);
    let rows = m.map(|m| std::array::from_fn::<_, 4, _>(|i| std::array::from_fn::<_, 4, _>(|j| m[(i, j)])));
    near(&numbers(Se3, &rows), &expected);
    near(&numbers(Se3, &rows.map(RowMatrix4::from)), &expected);
    near(&numbers(Se3, &m.map(|m| ColumnMatrix4::from(m.data.0))), &expected);
    let glam = m.map(|m| glam::DMat4::from_cols_slice(m.as_slice()));
    near(&numbers(Se3, &glam), &expected);
    near(&numbers(Se3, &glam.map(glam::DAffine3::from_mat4)), &expected);
}

#[test]
fn directions_and_positions_of_all_libraries_give_the_same_curve() {
    let v = quaternions().map(|q| q * Vector3::x());
    let (arrays, glam) = (v.map(|v| [v.x, v.y, v.z]), v.map(|v| glam::DVec3::new(v.x, v.y, v.z)));
    let mint = arrays.map(mint::Vector3::from);
    let expected = numbers(Sphere::<3>, &arrays);
    near(&numbers::<Sphere<3>, Vector3<f64>>(Sphere, &v), &expected);
    near(&numbers(Sphere::<3>, &v.map(UnitVector3::new_normalize)), &expected);
    near(&numbers(Sphere::<3>, &glam), &expected);
    near(&numbers(Sphere::<3>, &mint), &expected);
    let expected = numbers(Euclidean::<3>, &arrays);
    near(&numbers(Euclidean::<3>, &v.map(nalgebra::Point3::from)), &expected);
    near(&numbers(Euclidean::<3>, &glam), &expected);
    near(&numbers(Euclidean::<3>, &arrays.map(mint::Point3::from)), &expected);
    let named = AnySpace::new("r", &[3]).expect("it is a space");
    near(&numbers(named, &arrays.map(Vec::from)), &expected);
}

#[test]
fn matrices_are_written_row_by_row() {
    let root = |t: f64| nalgebra::Matrix2::new(1.0 + t, 0.3 * t, -0.2, 1.0);
    let m = T.map(|t| root(t) * root(t).transpose());
    let expected = numbers(PositiveDefinite::<2>, &m.map(|m| [[m.m11, m.m12], [m.m21, m.m22]]));
    near(&numbers(PositiveDefinite::<2>, &m), &expected);
    let planes = T.map(|t| root(t).qr().q().fixed_columns::<1>(0).into_owned());
    let expected = numbers(Grassmannian::<1, 2>, &planes.map(|m| [[m[0]], [m[1]]]));
    near(&numbers(Grassmannian::<1, 2>, &planes), &expected);
}

#[test]
fn body_velocities_are_derivatives_of_quaternions_and_poses() {
    let (h, t) = (1e-5, 0.8);
    let spline = CubicSpline::new(So3, &T, &quaternions()).expect("it is a curve");
    let rate = |t: f64| (spline.at(t - h).inverse() * spline.at(t + h)).scaled_axis() / (2.0 * h);
    assert!((rate(t) - spline.body_velocity(t)).norm() < 1e-8);
    let change = (spline.body_velocity(t + h) - spline.body_velocity(t - h)) / (2.0 * h);
    assert!((change - spline.body_acceleration(t)).norm() < 1e-7 * change.norm().max(1.0));
    let path = CubicSpline::new(Se3, &T, &poses()).expect("it is a curve");
    let twist = path.body_velocity(t);
    let step = path.at(t - h).inverse() * path.at(t + h);
    assert!((step.rotation.scaled_axis() / (2.0 * h) - twist.angular).norm() < 1e-7);
    let moved = (path.at(t + h).translation.vector - path.at(t - h).translation.vector) / (2.0 * h);
    assert!((path.at(t).rotation.inverse() * moved - twist.linear).norm() < 1e-5);
    // A curve with the velocities of another one at its ends is that curve.
    let ends = [End::Velocity(path.velocity(0.0)), End::Velocity(path.velocity(2.0))];
    let clamped = CubicSpline::builder(Se3).ends(ends).fit(&T, &poses()).expect("it is a curve");
    assert!((clamped.at(0.6).to_homogeneous() - path.at(0.6).to_homogeneous()).norm() < 1e-8);
}

#[test]
fn neighbouring_samples_have_quaternions_of_the_same_sign() {
    // Two full turns.
    let times: Vec<f64> = (0..17).map(f64::from).collect();
    let turn = |t: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), t * std::f64::consts::FRAC_PI_4);
    let points: Vec<_> = times.iter().map(|t| turn(*t)).collect();
    let spline = CubicSpline::new(So3, &times, &points).expect("it is a curve");
    let x: Vec<f64> = (0..161).map(|i| f64::from(i) / 10.0).collect();
    let samples = spline.sample(&x).expect("times are inside");
    assert!(samples.windows(2).all(|pair| pair[0].coords.dot(&pair[1].coords) > 0.9));
    let batch = Batch::fit_shared(So3, &times, &[points.clone(), points]).expect("they are curves");
    let samples = batch.sample(&x).expect("times are inside");
    assert_eq!((samples[0][0], &samples[0]), (samples[1][0], &samples[1]));
}

#[test]
fn curves_of_a_batch_are_those_of_single_fits() {
    let all = quaternions();
    let (long, short) = ((&T[..], &all[..]), (&T[1..4], &all[1..4]));
    let batch = Batch::fit_each(So3, &[long, short]).expect("they are curves");
    let x = [0.35, 0.9, 1.05];
    let samples = batch.sample(&x).expect("times are inside");
    let rates = batch.sample_velocity(&x).expect("times are inside");
    for (c, (times, points)) in [long, short].into_iter().enumerate() {
        let single = CubicSpline::new(So3, times, points).expect("it is a curve");
        for (i, t) in x.into_iter().enumerate() {
            assert_eq!(samples[c][i].coords.map(f64::abs), single.at(t).coords.map(f64::abs));
            assert_eq!(rates[c][i], single.velocity(t));
            assert_eq!(batch.curve(c).velocity(t), single.velocity(t));
        }
    }
    assert!(batch.sample(&[0.1]).is_err(), "the second curve begins later");
}

#[test]
fn curves_are_read_as_they_were_written() {
    let spline = CubicSpline::new(Se3, &T, &poses()).expect("it is a curve");
    let text = serde_json::to_string(&spline).expect("it is written");
    let read: CubicSpline<Se3, Isometry3<f64>> = serde_json::from_str(&text).expect("it is read");
    assert_eq!(AT.map(|t| read.at(t)), AT.map(|t| spline.at(t)));
    let space = AnySpace::new("sphere", &[1]).expect("it is a space");
    let spline = CubicSpline::new(space, &T[..2], &[vec![1.0, 0.0], vec![0.0, 1.0]]).expect("it is a curve");
    let text = serde_json::to_string(&spline).expect("it is written");
    let read: CubicSpline<AnySpace, Vec<f64>> = serde_json::from_str(&text).expect("it is read");
    assert_eq!((read.at(0.1), read.space()), (spline.at(0.1), spline.space()));
    let velocity = text.split("\"velocities\":").nth(1).expect("it has velocities");
    let across = text.replace(velocity, "[5.0,1.0,1.0,0.0]}");
    assert!(
        serde_json::from_str::<CubicSpline<AnySpace, Vec<f64>>>(&across).is_err(),
        "a velocity is not tangent"
    );
    // What was changed in the file is noticed.
    for (good, bad) in [("[1.0,0.0,", "[1.5,0.0,"), ("\"times\":[0.0", "\"times\":[0.5"), ("[1]", "[2]")] {
        assert!(text.contains(good), "{text}");
        let read: Result<CubicSpline<AnySpace, Vec<f64>>, _> = serde_json::from_str(&text.replace(good, bad));
        assert!(read.is_err(), "{bad}");
    }
}
