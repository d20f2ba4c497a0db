//! Errors, with the fields of the Python package.

use symspline::Error;
use wasm_bindgen::prelude::*;

/// An error before it becomes an exception of JavaScript.
#[wasm_bindgen]
pub struct Fault {
    kind: &'static str,
    message: String,
    argument: Option<&'static str>,
    index: Option<usize>,
    value: Option<f64>,
    limit: Option<f64>,
    factor: Option<usize>,
}

#[wasm_bindgen]
impl Fault {
    /// The class of the exception: `validation`, `cut-locus` or `convergence`.
    #[wasm_bindgen(getter)]
    pub fn kind(&self) -> String {
        self.kind.into()
    }

    /// The problem and its remedy.
    #[wasm_bindgen(getter)]
    pub fn message(&self) -> String {
        self.message.clone()
    }

    /// The argument that the error is about.
    #[wasm_bindgen(getter)]
    pub fn argument(&self) -> Option<String> {
        self.argument.map(Into::into)
    }

    /// The index in the argument: of the node, or of the first of two nodes.
    #[wasm_bindgen(getter)]
    pub fn index(&self) -> Option<usize> {
        self.index
    }

    /// The factor of a product that the error is about.
    #[wasm_bindgen(getter)]
    pub fn factor(&self) -> Option<usize> {
        self.factor
    }

    /// The number that was found.
    #[wasm_bindgen(getter)]
    pub fn value(&self) -> Option<f64> {
        self.value
    }

    /// The limit of that number.
    #[wasm_bindgen(getter)]
    pub fn limit(&self) -> Option<f64> {
        self.limit
    }
}

impl Fault {
    /// Invalid input.
    pub fn invalid(argument: &'static str, index: Option<usize>, message: String) -> Self {
        let argument = Some(argument);
        Fault { kind: "validation", message, argument, index, value: None, limit: None, factor: None }
    }

    /// Two points without a unique shortest geodesic.
    pub fn cut_locus(argument: &'static str, index: usize, angle: f64, limit: f64, message: String) -> Self {
        let fault = Fault::invalid(argument, Some(index), message);
        Fault { kind: "cut-locus", ..fault.with_value(angle).with_limit(limit) }
    }

    fn with_value(self, value: f64) -> Self {
        Fault { value: Some(value), ..self }
    }

    fn with_limit(self, limit: f64) -> Self {
        Fault { limit: Some(limit), ..self }
    }
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        if let Error::InFactor { factor, space, error } = error {
            let fault = Fault::from(*error);
            let message = format!("factor {factor}, {space}: {}", fault.message);
            return Fault { message, factor: Some(factor), ..fault };
        }
        // There is one curve only, which the message need not name.
        let full = error.to_string();
        let message =
            ["curve 0: ", "curve 0, "].iter().find_map(|name| full.strip_prefix(name)).unwrap_or(&full);
        let invalid = |argument, index| Fault::invalid(argument, index, message.into());
        match error {
            Error::InvalidSpace { .. } => invalid("space", None),
            Error::TooFewPoints { points, .. } => {
                invalid("points", None).with_value(points as f64).with_limit(2.0)
            }
            Error::LengthMismatch { what, expected, found, .. } => {
                let argument = match what {
                    "weights" => "weights",
                    "values of lam" => "lam",
                    "values of sigma" => "sigma",
                    _ => "t",
                };
                invalid(argument, None).with_value(found as f64).with_limit(expected as f64)
            }
            Error::PointLength { node, expected, found, .. }
            | Error::FactorCount { node, expected, found, .. } => {
                invalid("points", Some(node)).with_value(found as f64).with_limit(expected as f64)
            }
            Error::TimeNotFinite { node, time, .. } => invalid("t", Some(node)).with_value(time),
            Error::UnsortedTimes { node, before, time, .. } => {
                invalid("t", Some(node)).with_value(time).with_limit(before)
            }
            Error::TimesTooFarApart { .. } => invalid("t", None),
            Error::OffSpace { node, distance, .. } => invalid("points", Some(node)).with_value(distance),
            Error::TooFewDigits { node, .. } | Error::Disconnected { node, .. } => {
                invalid("points", Some(node))
            }
            Error::NotClosed { distance, .. } => invalid("points", None).with_value(distance),
            Error::InvalidEnd { .. } => invalid("bcType", None),
            Error::InvalidOption { name, value, .. } => {
                invalid(if name == "max_iter" { "maxIter" } else { name }, None).with_value(value)
            }
            Error::InvalidWeight { index, weight } => invalid("weights", Some(index)).with_value(weight),
            Error::CutLocus { node, angle, limit, .. } | Error::HandleTooLong { node, angle, limit, .. } => {
                Fault::cut_locus("points", node, angle, limit, message.into())
            }
            Error::Unconverged { residual, tol, .. } => {
                let fault = invalid("points", None).with_value(residual).with_limit(tol);
                Fault { kind: "convergence", argument: None, ..fault }
            }
            Error::NotSmoothed { .. } => {
                Fault { kind: "convergence", argument: None, ..invalid("points", None) }
            }
            Error::OutsideDomain { time, start, end } => {
                invalid("x", None).with_value(time).with_limit(if time < start { start } else { end })
            }
            _ => invalid("points", None),
        }
    }
}
