//! Residuals of measurements at a curve, and their derivatives.

use crate::body::{Body, cross};
use crate::motion::{BadRow, Motion, STEP, applied, coordinates};
use crate::problem::Loss;
use std::ops::Range;
use symspline_core::memory;
use symspline_core::monitor::{Monitor, checkpoint};
use symspline_core::rows::Operation;
use symspline_core::space::Origin;

/// The whitened residuals of a user's function, and how many belong to a time.
pub type Residuals = (Vec<f64>, usize);
/// A function of the motion of some parts and of all parameters that returns whitened residuals.
pub type Function<'a> = &'a (dyn Fn(&[Motion], &[f64]) -> Residuals + Sync);

/// A change of the motion along one coordinate: the part of the term that changes, and the derivatives of its points,
/// velocities and accelerations; empty where they vanish.
pub type Change = (usize, Vec<Vec<f64>>);
/// A function of the motion, all parameters and changes of the motion that returns the derivatives of whitened residuals:
/// for each residual one per change, and then one per parameter of the term.
pub type Derivatives<'a> = &'a (dyn Fn(&[Motion], &[f64], Vec<Change>) -> Vec<f64> + Sync);

/// What a sensor reports.
#[derive(Clone, Copy)]
pub enum Sensor<'a> {
    /// Points with equal noise in all directions: the residual is −log_γ(y).
    Points {
        /// The points.
        y: &'a [f64],
    },
    /// Points with information matrices RᵀR: the residual is R log_y(γ) in a frame at y.
    Information {
        /// The points.
        y: &'a [f64],
        /// The frames there.
        frames: &'a [f64],
        /// R, m × m numbers each.
        roots: &'a [f64],
    },
    /// Velocities at measured points: the residual is the transported velocity minus the measured one.
    Velocities {
        /// The points.
        y: &'a [f64],
        /// The velocities.
        v: &'a [f64],
        /// The frames there.
        frames: &'a [f64],
    },
    /// Velocities in the moving frame of a group.
    Rates {
        /// The group.
        body: Body<'a>,
        /// The components.
        omega: &'a [f64],
        /// The first parameter of their bias.
        bias: Option<usize>,
    },
    /// Known directions in the frame of the body: the residual is Rᵀr − s.
    Directions {
        /// The group.
        body: Body<'a>,
        /// s: one or several vectors per time.
        seen: &'a [f64],
        /// r.
        reference: &'a [f64],
    },
    /// Accelerations without gravity in the frame of the body: Rᵀ(a − g) + ω' × l + ω × (ω × l).
    Force {
        /// The group.
        body: Body<'a>,
        /// The accelerations.
        f: &'a [f64],
        /// g.
        gravity: &'a [f64],
        /// The first parameter of their bias.
        bias: Option<usize>,
        /// l, if it is known; otherwise empty.
        arm: &'a [f64],
        /// The first parameter of l.
        unknown_arm: Option<usize>,
    },
    /// A function of the user.
    Function {
        /// The function.
        call: Function<'a>,
        /// The highest derivative that it needs.
        nu: usize,
        /// Its derivatives; None to compute them by differences.
        derivatives: Option<Derivatives<'a>>,
    },
}

/// Measurements of one kind.
#[derive(Clone)]
pub struct Term<'a> {
    /// What the sensor reports.
    pub sensor: Sensor<'a>,
    /// Times, without their unknown offset.
    pub times: &'a [f64],
    /// The parts of the space on which the residuals depend.
    pub parts: Vec<usize>,
    /// Standard deviations of all residuals, and the number of residuals of a measurement. Functions have none: they
    /// return residuals in standard deviations.
    pub noise: &'a [f64],
    /// See `noise`.
    pub size: usize,
    /// The loss.
    pub loss: Loss,
    /// The parameter that is added to the times.
    pub offset: Option<usize>,
    /// The other parameters on which the residuals depend.
    pub parameters: Vec<Range<usize>>,
}

/// Residuals at a curve and their derivatives, whitened: their noise has variance one.
#[derive(Default)]
pub struct Linearised {
    /// The number of residuals of a measurement.
    pub size: usize,
    /// What the sensors would read minus what they read.
    pub residuals: Vec<f64>,
    /// Derivatives with respect to the move of the curve, its velocity and its acceleration, `size` × m numbers each for
    /// m coordinates of all parts; empty where they vanish.
    pub jacobians: [Vec<f64>; 3],
    /// Derivatives with respect to the parameters, `size` × p numbers each; empty where they vanish.
    pub parameters: Vec<f64>,
}

/// Where the coordinates of a term are among those of the curve and of all parameters.
pub struct Columns<'a> {
    /// The first coordinate of each part, and their number.
    pub first: &'a [usize],
    /// The number of parameters.
    pub parameters: usize,
}

impl Columns<'_> {
    fn count(&self) -> usize {
        self.first[self.first.len() - 1]
    }
}

impl Term<'_> {
    /// The highest derivative that the residuals need.
    pub fn order(&self) -> usize {
        match self.sensor {
            Sensor::Points { .. } | Sensor::Information { .. } | Sensor::Directions { .. } => 0,
            Sensor::Velocities { .. } | Sensor::Rates { .. } => 1,
            Sensor::Force { .. } => 2,
            Sensor::Function { nu, .. } => nu,
        }
    }

    /// Whether the residuals are coordinates in frames along the curve.
    fn has_frames(&self) -> bool {
        matches!(self.sensor, Sensor::Points { .. })
    }

    /// The times with their offset.
    pub fn shifted(&self, values: &[f64]) -> Vec<f64> {
        let offset = self.offset.map_or(0.0, |at| values[at]);
        self.times.iter().map(|t| t + offset).collect()
    }

    /// The residuals, whitened.
    pub fn residuals(
        &self,
        motion: &[Motion],
        values: &[f64],
        monitor: &Monitor,
    ) -> Result<Residuals, BadRow> {
        let own = &motion[0];
        let space = own.space;
        let mut found = match self.sensor {
            Sensor::Points { y } => {
                let logs = applied(space, Operation::Log, &[&own.p, y], monitor)?;
                coordinates(space, &own.p, &own.frames, &logs).into_iter().map(|x| -x).collect()
            }
            Sensor::Information { y, frames, roots } => {
                let logs = applied(space, Operation::Log, &[y, &own.p], monitor)?;
                let m = space.dim();
                let logs = coordinates(space, y, frames, &logs);
                let rows = roots.chunks_exact(m * m).zip(logs.chunks_exact(m));
                rows.flat_map(|(root, x)| root.chunks_exact(m).map(|row| dot(row, x))).collect()
            }
            Sensor::Velocities { y, v, frames } => {
                let there = applied(space, Operation::Transport, &[&own.p, y, &own.v], monitor)?;
                let off: Vec<f64> = there.iter().zip(v).map(|(there, v)| there - v).collect();
                coordinates(space, y, frames, &off)
            }
            Sensor::Rates { body, omega, bias } => {
                biased(body.rates(&own.p, &own.v, monitor), bias, body.size(), values, omega)
            }
            Sensor::Directions { body, seen, reference } => {
                let turned = turned(&body.matrices(&own.p), reference);
                turned.iter().zip(seen).map(|(x, s)| x - s).collect()
            }
            Sensor::Force { body, f, gravity, bias, arm, unknown_arm } => {
                let rotations = body.matrices(&own.p);
                let free: Vec<f64> =
                    motion[1].a.iter().zip(gravity.iter().cycle()).map(|(a, g)| a - g).collect();
                let mut read = turned(&rotations, &free);
                let arm = unknown_arm.map_or(arm, |at| &values[at..at + 3]);
                if !arm.is_empty() {
                    let rates = body.rates(&own.p, &own.v, monitor);
                    let changes = body.rates(&own.p, &own.a, monitor);
                    let rows =
                        read.chunks_exact_mut(3).zip(rates.chunks_exact(3)).zip(changes.chunks_exact(3));
                    for ((read, omega), change) in rows {
                        let (first, second) = (cross(change, arm), cross(omega, &cross(omega, arm)));
                        (0..3).for_each(|i| read[i] += first[i] + second[i]);
                    }
                }
                biased(read, bias, 3, values, f)
            }
            Sensor::Function { call, .. } => return Ok(call(motion, values)),
        };
        found.iter_mut().zip(self.noise).for_each(|(x, noise)| *x /= noise);
        Ok((found, self.size))
    }

    /// The residuals and their derivatives at a motion.
    fn derivatives(
        &self,
        motion: &[Motion],
        values: &[f64],
        columns: &Columns,
        monitor: &Monitor,
    ) -> Result<Linearised, BadRow> {
        let (residuals, size) = self.residuals(motion, values, monitor)?;
        let (m, p, n) = (columns.count(), columns.parameters, self.times.len());
        memory::require(
            (n * size * (m * (self.order() + 1) + p)) as f64,
            "the derivatives of the measurements",
            "Use fewer measurements, or average them",
        );
        let mut found = Linearised { size, residuals, ..Linearised::default() };
        let (own, body_first) = (&motion[0], columns.first[self.parts[0]]);
        let whitened = |at: usize| 1.0 / self.noise[at];
        match self.sensor {
            Sensor::Points { .. } => {
                // The gradient of d²/2 is −log_γ(y), so that the identity yields the exact gradient.
                found.jacobians[0] = vec![0.0; n * size * m];
                let rows = found.jacobians[0].chunks_exact_mut(m).enumerate();
                rows.for_each(|(at, row)| row[body_first + at % size] = whitened(at));
            }
            Sensor::Rates { body, bias, .. } => {
                for nu in 0..2 {
                    found.jacobians[nu] = vec![0.0; n * size * m];
                }
                for j in 0..own.space.dim() {
                    let each = body.derivatives(&own.p, &own.v, &own.vectors(j), monitor);
                    for (jacobian, column) in found.jacobians.iter_mut().zip(each) {
                        let rows = jacobian.chunks_exact_mut(m).zip(column).enumerate();
                        rows.for_each(|(at, (row, x))| row[body_first + j] = x * whitened(at));
                    }
                }
                if let Some(bias) = bias {
                    found.parameters = vec![0.0; n * size * p];
                    let rows = found.parameters.chunks_exact_mut(p).enumerate();
                    rows.for_each(|(at, row)| row[bias + at % size] = whitened(at));
                }
                return Ok(found);
            }
            Sensor::Directions { body, reference, .. } => {
                // δ(Rᵀr) = −η × Rᵀr.
                let turned = turned(&body.matrices(&own.p), reference);
                found.jacobians[0] = vec![0.0; n * size * m];
                for j in 0..own.space.dim() {
                    let moves = body.rates(&own.p, &own.vectors(j), monitor);
                    let each = turned.chunks_exact(size).zip(moves.chunks_exact(3));
                    let column =
                        each.flat_map(|(rows, eta)| rows.chunks_exact(3).flat_map(move |x| cross(x, eta)));
                    let rows = found.jacobians[0].chunks_exact_mut(m).zip(column).enumerate();
                    rows.for_each(|(at, (row, x))| row[body_first + j] = x * whitened(at));
                }
            }
            Sensor::Function { derivatives: Some(call), .. } => {
                self.given(call, motion, values, columns, monitor, &mut found)?;
                return Ok(found);
            }
            _ => self.differences(motion, values, columns, monitor, &mut found)?,
        }
        self.of_parameters(motion, values, p, monitor, &mut found)?;
        Ok(found)
    }

    /// Computes derivatives by the function of the user.
    fn given(
        &self,
        call: Derivatives,
        motion: &[Motion],
        values: &[f64],
        columns: &Columns,
        monitor: &Monitor,
        found: &mut Linearised,
    ) -> Result<(), BadRow> {
        let (m, p, parameters) =
            (columns.count(), columns.parameters, self.parameters.iter().cloned().flatten());
        let (mut changes, mut targets) = (Vec::new(), Vec::new());
        for (i, (part, own)) in self.parts.iter().zip(motion).enumerate() {
            for nu in 0..=self.order() {
                for j in 0..own.space.dim() {
                    checkpoint();
                    changes.push((i, own.change(j, nu, monitor)?));
                    targets.push((nu, columns.first[*part] + j));
                }
            }
        }
        let parameters: Vec<usize> = parameters.collect();
        let derivatives = call(motion, values, changes);
        for nu in 0..=self.order() {
            found.jacobians[nu] = vec![0.0; found.residuals.len() * m];
        }
        if !parameters.is_empty() {
            found.parameters = vec![0.0; found.residuals.len() * p];
        }
        for (at, row) in derivatives.chunks_exact(targets.len() + parameters.len()).enumerate() {
            let (of_changes, of_parameters) = row.split_at(targets.len());
            for ((nu, column), x) in targets.iter().zip(of_changes) {
                found.jacobians[*nu][at * m + column] = *x;
            }
            parameters.iter().zip(of_parameters).for_each(|(k, x)| found.parameters[at * p + k] = *x);
        }
        Ok(())
    }

    /// Computes derivatives with respect to the motion by central differences.
    fn differences(
        &self,
        motion: &[Motion],
        values: &[f64],
        columns: &Columns,
        monitor: &Monitor,
        found: &mut Linearised,
    ) -> Result<(), BadRow> {
        let m = columns.count();
        let mut moved: Vec<Motion> = motion.iter().map(copied).collect();
        for nu in 0..=self.order() {
            found.jacobians[nu] = vec![0.0; found.residuals.len() * m];
        }
        for (i, (part, own)) in self.parts.iter().zip(motion).enumerate() {
            for nu in 0..=self.order() {
                let step = own.step(nu);
                for j in 0..own.space.dim() {
                    checkpoint();
                    let mut side = |step: f64| {
                        moved[i] = own.moved(j, nu, step, monitor)?;
                        self.residuals(&moved, values, monitor)
                    };
                    let (after, before) = (side(step)?.0, side(-step)?.0);
                    let column = after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * step));
                    let rows = found.jacobians[nu].chunks_exact_mut(m).zip(column);
                    rows.for_each(|(row, x)| row[columns.first[*part] + j] = x);
                }
            }
            moved[i] = copied(own);
        }
        Ok(())
    }

    /// Computes derivatives with respect to the parameters by central differences.
    fn of_parameters(
        &self,
        motion: &[Motion],
        values: &[f64],
        p: usize,
        monitor: &Monitor,
        found: &mut Linearised,
    ) -> Result<(), BadRow> {
        for k in self.parameters.iter().cloned().flatten() {
            let step = STEP * (1.0 + values[k].abs());
            let side = |step: f64| {
                let mut values = values.to_vec();
                values[k] += step;
                self.residuals(motion, &values, monitor)
            };
            let (after, before) = (side(step)?.0, side(-step)?.0);
            found.set_parameter(k, p, step, &after, &before);
        }
        Ok(())
    }

    /// Linearises the measurements. `motion_at` returns the motion of a part.
    pub fn linearised<'m, E: From<BadRow>>(
        &self,
        motion_at: &MotionAt<'_, 'm, E>,
        values: &[f64],
        spacing: f64,
        columns: &Columns,
        monitor: &Monitor,
    ) -> Result<Linearised, E> {
        let times = self.shifted(values);
        let at = |times: &[f64], frames: bool| {
            let of_part = |part: &usize| motion_at(times, (*part, self.order(), frames));
            self.parts.iter().map(of_part).collect::<Result<Vec<_>, E>>()
        };
        let mut found = self.derivatives(&at(&times, true)?, values, columns, monitor)?;
        if let Some(offset) = self.offset {
            let step = STEP * spacing;
            let side = |step: f64| {
                let times: Vec<f64> = times.iter().map(|t| t + step).collect();
                Ok::<_, E>(self.residuals(&at(&times, self.has_frames())?, values, monitor)?.0)
            };
            let (after, before) = (side(step)?, side(-step)?);
            found.set_parameter(offset, columns.parameters, step, &after, &before);
        }
        Ok(found)
    }

    /// The residuals only.
    pub fn residuals_at<'m, E: From<BadRow>>(
        &self,
        motion_at: &MotionAt<'_, 'm, E>,
        values: &[f64],
        times: &[f64],
        monitor: &Monitor,
    ) -> Result<Linearised, E> {
        let at = self.parts.iter().map(|part| motion_at(times, (*part, self.order(), self.has_frames())));
        let (residuals, size) = self.residuals(&at.collect::<Result<Vec<_>, E>>()?, values, monitor)?;
        Ok(Linearised { size, residuals, ..Linearised::default() })
    }
}

/// The motion of a part at times, with derivatives up to an order, and with frames if asked for.
pub type MotionAt<'a, 'm, E> = dyn Fn(&[f64], (usize, usize, bool)) -> Result<Motion<'m>, E> + 'a;

impl Linearised {
    /// Sets the column of parameter k of p from residuals on both sides.
    fn set_parameter(&mut self, k: usize, p: usize, step: f64, after: &[f64], before: &[f64]) {
        self.parameters.resize(self.residuals.len() * p, 0.0);
        let rows = self.parameters.chunks_exact_mut(p).zip(after.iter().zip(before));
        rows.for_each(|(row, (a, b))| row[k] = (a - b) / (2.0 * step));
    }

    /// The squared length of the residuals of each measurement.
    pub fn squares(&self) -> Vec<f64> {
        self.residuals.chunks_exact(self.size.max(1)).map(|r| dot(r, r)).collect()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A motion without its frames.
fn copied<'a>(own: &Motion<'a>) -> Motion<'a> {
    let [p, v, a] = [&own.p, &own.v, &own.a].map(Vec::clone);
    Motion { space: own.space, p, v, a, frames: Vec::new() }
}

/// What a sensor with a bias would read, minus what it reads.
fn biased(mut read: Vec<f64>, bias: Option<usize>, size: usize, values: &[f64], given: &[f64]) -> Vec<f64> {
    let bias = bias.map_or(&[][..], |at| &values[at..at + size]);
    for (row, given) in read.chunks_exact_mut(size).zip(given.chunks_exact(size)) {
        row.iter_mut().zip(bias).for_each(|(x, b)| *x += b);
        row.iter_mut().zip(given).for_each(|(x, y)| *x -= y);
    }
    read
}

/// Rᵀr for rotation matrices, and one or several vectors r per matrix.
fn turned(matrices: &[f64], vectors: &[f64]) -> Vec<f64> {
    let size = 9 * vectors.len() / matrices.len().max(1);
    let rows = matrices.chunks_exact(9).zip(vectors.chunks_exact(size.max(1)));
    rows.flat_map(|(r, vectors)| {
        vectors.chunks_exact(3).flat_map(move |x| {
            std::array::from_fn::<f64, 3, _>(|j| (0..3).map(|i| r[3 * i + j] * x[i]).sum())
        })
    })
    .collect()
}
