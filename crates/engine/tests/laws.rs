//! Every space obeys every law.

use symspline_engine::laws::check;
use symspline_engine::spaces::{AnySpace, all};

/// A few sizes of every kind: the smallest, one for every branch of the code, and one of another shape.
const SIZES: &[(&str, &[&[usize]])] = &[
    ("euclidean", &[&[1], &[3]]),
    ("torus", &[&[1], &[2], &[7]]),
    ("sphere", &[&[1], &[2], &[3], &[6]]),
    ("hyperbolic", &[&[1], &[2], &[3], &[6]]),
    ("ds", &[&[2], &[3], &[6]]),
    ("ads", &[&[2], &[3], &[6]]),
    ("rp", &[&[1], &[2], &[3], &[12]]),
    ("cp", &[&[1], &[3], &[5]]),
    ("ch", &[&[1], &[2], &[3]]),
    ("hp", &[&[1], &[2]]),
    ("gr", &[&[1, 3], &[2, 4], &[2, 5], &[3, 7], &[4, 5]]),
    ("cgr", &[&[1, 3], &[2, 4], &[2, 5]]),
    ("so", &[&[2], &[3], &[4], &[5]]),
    ("o", &[&[2], &[3], &[4]]),
    ("u", &[&[1], &[2], &[3], &[4]]),
    ("su", &[&[2], &[3], &[4]]),
    ("spd", &[&[1], &[2], &[3], &[4]]),
    ("hpd", &[&[1], &[2], &[3]]),
    ("sspd", &[&[2], &[3], &[4]]),
    ("logspd", &[&[1], &[2], &[3], &[4]]),
    ("siegel", &[&[1], &[2]]),
    ("se", &[&[2], &[3]]),
    ("gl", &[&[1], &[2], &[3], &[4]]),
    ("cgl", &[&[1], &[2]]),
    ("aff", &[&[1], &[2]]),
    ("sim", &[&[2], &[3]]),
    ("sl", &[&[2], &[3]]),
    ("sp", &[&[2], &[4]]),
    ("lorentz", &[&[1], &[3]]),
    ("igr", &[&[0, 1, 1, 2], &[1, 0, 2, 1], &[1, 1, 2, 2], &[0, 2, 1, 3]]),
];

#[test]
fn every_space_obeys_every_law() {
    let mut broken = Vec::new();
    for (name, sizes) in SIZES {
        for parameters in *sizes {
            let space = AnySpace::new(name, parameters).unwrap();
            for seed in 0..3 {
                broken.extend(
                    check(&space.get(), seed).into_iter().map(|why| format!("{name} {parameters:?}: {why}")),
                );
            }
        }
    }
    assert!(broken.is_empty(), "{} laws broken:\n{}", broken.len(), broken.join("\n"));
}

#[test]
fn every_kind_of_space_is_tested() {
    for entry in all() {
        assert!(SIZES.iter().any(|(name, _)| *name == entry.names[0]), "add {} to SIZES", entry.names[0]);
    }
}
