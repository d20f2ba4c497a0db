//! Curves in files and messages. What is read is validated.

use crate::curves::{Curves, Report};
use crate::error::Error;
use crate::point::Point;
use crate::space::{AnySpace, Space};
use crate::spline::CubicSpline;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de, ser::SerializeStruct};

/// The contents of a curve: points and velocities as lists of numbers, matrices row by row. For a product, these are all
/// numbers of the first factor, then those of the second one, and so on.
#[derive(Deserialize)]
#[serde(rename = "CubicSpline")]
struct Stored<S> {
    space: S,
    times: Vec<f64>,
    points: Vec<f64>,
    velocities: Vec<f64>,
}

impl<S: Space + Serialize, P: Point<S>> Serialize for CubicSpline<S, P> {
    fn serialize<T: Serializer>(&self, serializer: T) -> Result<T::Ok, T::Error> {
        let mut fields = serializer.serialize_struct("CubicSpline", 4)?;
        fields.serialize_field("space", self.space())?;
        fields.serialize_field("times", self.times())?;
        let [points, velocities] = self.curves.to_store();
        fields.serialize_field("points", &points)?;
        fields.serialize_field("velocities", &velocities)?;
        fields.end()
    }
}

impl<'de, S: Space + Deserialize<'de>, P: Point<S>> Deserialize<'de> for CubicSpline<S, P> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let stored = Stored::deserialize(deserializer)?;
        let builder = CubicSpline::builder(stored.space);
        Curves::stored(&builder, stored.times, &stored.points, &stored.velocities)
            .map(|curves| CubicSpline { curves, report: Report::unknown() })
            .map_err(de::Error::custom)
    }
}

#[derive(Deserialize, Serialize)]
#[serde(rename = "AnySpace")]
struct Named {
    name: String,
    sizes: Vec<usize>,
}

impl Serialize for AnySpace {
    fn serialize<T: Serializer>(&self, serializer: T) -> Result<T::Ok, T::Error> {
        Named { name: self.name().into(), sizes: self.sizes() }.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for AnySpace {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Named { name, sizes } = Named::deserialize(deserializer)?;
        AnySpace::new(&name, &sizes).map_err(|error: Error| de::Error::custom(error))
    }
}
