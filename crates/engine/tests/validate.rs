//! Every fault of the input is reported with its curve and node.

use symspline_engine::fit::{End, Ends, Problem};
use symspline_engine::space::Erased;
use symspline_engine::spaces::{AnySpace, Sphere};
use symspline_engine::validate::{Invalid, Reason, validate};

const T: [f64; 3] = [0.0, 1.0, 2.5];
const POINTS: [f64; 9] = [1.0, 0.0, 0.0, 0.8, 0.6, 0.0, 0.6, 0.64, 0.48];

fn problem<'a>(t: &'a [f64], points: &'a [f64], ends: [End<'a>; 2]) -> Problem<'a> {
    Problem { t, shared: true, points, offsets: &[0, 3], ends: Ends::Open(ends) }
}

fn found(problem: &Problem) -> Invalid {
    let sphere = Sphere::new(2).expect("it is a space");
    validate(&Erased(&sphere), problem, 1e-8).expect_err("the problem is invalid")
}

const NATURAL: [End; 2] = [End::Natural, End::Natural];

#[test]
fn valid_points_are_projected() {
    let mut points = POINTS;
    points[0] += 1e-9;
    let sphere = Sphere::new(2).expect("it is a space");
    let own = validate(&Erased(&sphere), &problem(&T, &points, NATURAL), 1e-8).expect("it is valid");
    assert_eq!(own[0], 1.0);
    assert_eq!(own[3..], POINTS[3..]);
}

#[test]
fn invalid_times_are_reported() {
    let fault = found(&problem(&[0.0, f64::NAN, 2.0], &POINTS, NATURAL));
    assert!(matches!(fault, Invalid { curve: 0, node: Some(1), reason: Reason::TimeNotFinite(_) }));
    let fault = found(&problem(&[0.0, 2.0, 1.0], &POINTS, NATURAL));
    assert_eq!(fault.reason, Reason::TimesNotIncreasing { before: 2.0, time: 1.0 });
    assert_eq!(fault.to_string(), "curve 0, node 2: its time 1 is not after the time 2 of the node before");
    let fault = found(&problem(&[-1e308, 0.0, 1e308], &POINTS, NATURAL));
    assert_eq!((fault.node, fault.reason), (None, Reason::TimesTooFarApart));
}

#[test]
fn invalid_points_are_reported() {
    let mut points = POINTS;
    points[3] = 2.0;
    let fault = found(&problem(&T, &points, NATURAL));
    assert!(
        matches!(fault, Invalid { node: Some(1), reason: Reason::OffSpace { distance, .. }, .. } if distance > 0.1)
    );
    points[3] = f64::NAN;
    let fault = found(&problem(&T, &points, NATURAL));
    assert!(
        matches!(fault, Invalid { node: Some(1), reason: Reason::OffSpace { distance, .. }, .. } if !distance.is_finite())
    );
}

#[test]
fn points_of_two_components_are_reported() {
    let space = AnySpace::new("o", &[2]).expect("it is a space");
    let points = [1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, -1.0];
    let fault =
        validate(&space.get(), &problem(&T, &points, NATURAL), 1e-8).expect_err("no curve joins them");
    assert_eq!(fault, Invalid { curve: 0, node: Some(1), reason: Reason::Disconnected });
}

#[test]
fn closed_curves_must_be_closed() {
    let periodic = |points| Problem { ends: Ends::Periodic, ..problem(&T, points, NATURAL) };
    let fault = found(&periodic(&POINTS));
    assert!(
        matches!(fault, Invalid { node: Some(2), reason: Reason::NotClosed { distance }, .. } if distance > 0.9)
    );
    let mut points = POINTS;
    points[6..].copy_from_slice(&[1.0, 1e-10, 0.0]);
    let sphere = Sphere::new(2).expect("it is a space");
    let own = validate(&Erased(&sphere), &periodic(&points), 1e-8).expect("it is closed");
    assert_eq!(own[6..], POINTS[..3]);
}

#[test]
fn invalid_end_vectors_are_reported() {
    let reason = |v: &[f64]| found(&problem(&T, &POINTS, [End::Natural, End::Velocity(v)])).reason;
    let start = |v: &[f64]| found(&problem(&T, &POINTS, [End::Acceleration(v), End::Natural])).reason;
    assert!(
        matches!(reason(&[0.0, f64::NAN, 0.0]), Reason::EndNotFinite(which, _) if which.velocity && !which.start)
    );
    assert!(
        matches!(start(&[1.0, 0.0, 0.0]), Reason::EndNotTangent { which, normal } if which.start && normal > 0.9)
    );
    let fast = reason(&[-6.4, 6.0, 0.0]);
    assert!(
        matches!(fast, Reason::EndTooFast { speed, segment: 1.5, angle, limit, .. } if speed > 8.0 && angle > limit)
    );
}

#[test]
fn lengths_must_be_consistent() {
    let lengths = |problem: &Problem| {
        assert!(matches!(found(problem).reason, Reason::Lengths(_)), "{:?}", problem.offsets)
    };
    lengths(&problem(&T[..2], &POINTS, NATURAL));
    lengths(&problem(&T, &POINTS[..6], NATURAL));
    lengths(&problem(&T, &POINTS, [End::Velocity(&[0.0; 2]), End::Natural]));
    for offsets in [&[] as &[usize], &[1, 3], &[0, 1, 3], &[0, 3, 2, 3]] {
        lengths(&Problem { offsets, shared: false, ..problem(&T, &POINTS, NATURAL) });
    }
}
