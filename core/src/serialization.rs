//! `Serialize` and `Deserialize` of the types that are valid by construction: what is read goes through
//! their constructors, and is refused as there. The others derive both.

use crate::Real;
use crate::calibration::Tolerance;
use crate::kinematics::JointLimits;
use crate::robot::{Arm, Drive, Parameter, Robot};
use crate::samples::Noise;
use crate::stream::Forgetting;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Eight numbers, in the order of [`Parameter::ROTARY`]. An arm with a linear drive is refused, for eight numbers do
/// not tell the two apart; so is one with a transmission, which would be lost.
impl<T: Real + Serialize> Serialize for Arm<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        plain(self)?;
        self.parameters().serialize(serializer)
    }
}

impl<'de, T: Real + Deserialize<'de>> Deserialize<'de> for Arm<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::new(Deserialize::deserialize(deserializer)?).map_err(Error::custom)
    }
}

/// Three times eight numbers, as of [`Robot::parameters`].
impl<T: Real + Serialize> Serialize for Robot<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.arms().iter().try_for_each(plain)?;
        self.parameters().serialize(serializer)
    }
}

impl<'de, T: Real + Deserialize<'de>> Deserialize<'de> for Robot<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::from_parameters(Deserialize::deserialize(deserializer)?).map_err(Error::custom)
    }
}

/// That eight numbers are all there is of an arm.
fn plain<T: Real, E: serde::ser::Error>(arm: &Arm<T>) -> Result<(), E> {
    match (arm.drive(), arm.transmission()) {
        (Drive::Rotary, None) => Ok(()),
        (Drive::Rotary, Some(_)) => Err(E::custom("arms with transmissions are not serialized")),
        (Drive::Linear, _) => Err(E::custom("only robots with rotary drives are serialized")),
    }
}

/// Implements both for a type of two numbers by its constructor and two functions that give them back.
macro_rules! two_numbers {
    ($type:ident, $name:literal, $first:ident: $get_first:expr, $second:ident: $get_second:expr) => {
        const _: () = {
            #[derive(Serialize, Deserialize)]
            #[serde(rename = $name, deny_unknown_fields)]
            struct Fields<T> {
                $first: T,
                $second: T,
            }

            impl<T: Real + Serialize> Serialize for $type<T> {
                fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                    let fields = Fields {
                        $first: $get_first(self),
                        $second: $get_second(self),
                    };
                    fields.serialize(serializer)
                }
            }

            impl<'de, T: Real + Deserialize<'de>> Deserialize<'de> for $type<T> {
                fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                    let fields = Fields::deserialize(deserializer)?;
                    Self::new(fields.$first, fields.$second).map_err(Error::custom)
                }
            }
        };
    };
}

two_numbers!(
    Tolerance, "Tolerance",
    length: |tolerance: &Tolerance<T>| tolerance.of(Parameter::Lb),
    angle: |tolerance: &Tolerance<T>| tolerance.of(Parameter::Alpha)
);
two_numbers!(JointLimits, "JointLimits", minimum: JointLimits::minimum, maximum: JointLimits::maximum);

#[derive(Serialize, Deserialize)]
#[serde(rename = "Noise", deny_unknown_fields)]
struct NoiseFields<T> {
    position: [T; 3],
    joint: T,
}

/// σx, σy, σz and σq.
impl<T: Real + Serialize> Serialize for Noise<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        NoiseFields {
            position: self.position_by_axis(),
            joint: self.joint(),
        }
        .serialize(serializer)
    }
}

impl<'de, T: Real + Deserialize<'de>> Deserialize<'de> for Noise<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let fields = NoiseFields::deserialize(deserializer)?;
        Self::by_axis(fields.position, fields.joint).map_err(Error::custom)
    }
}

/// The mean age, one number.
impl<T: Real + Serialize> Serialize for Forgetting<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.mean_age().serialize(serializer)
    }
}

impl<'de, T: Real + Deserialize<'de>> Deserialize<'de> for Forgetting<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::new(Deserialize::deserialize(deserializer)?).map_err(Error::custom)
    }
}
