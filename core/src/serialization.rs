//! `Serialize` and `Deserialize` for types that are valid by construction: deserialisation goes through their
//! constructors and refuses what these refuse. Other types derive both.

use crate::Real;
use crate::calibration::Tolerance;
use crate::kinematics::JointLimits;
use crate::robot::{Arm, Drive, Parameter, Robot};
use crate::samples::Noise;
use crate::stream::Forgetting;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Eight numbers, in the order of [`Parameter::ROTARY`]. An arm with a linear drive is refused, because eight numbers
/// do not identify the drive; so is an arm with a transmission, which would be lost.
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

/// Three times eight numbers, as in [`Robot::parameters`].
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

/// Refuses an arm that eight numbers do not fully describe.
fn plain<T: Real, E: serde::ser::Error>(arm: &Arm<T>) -> Result<(), E> {
    match (arm.drive(), arm.transmission()) {
        (Drive::Rotary, None) => Ok(()),
        (Drive::Rotary, Some(_)) => Err(E::custom("arms with transmissions are not serialized")),
        (Drive::Linear, _) => Err(E::custom("only robots with rotary drives are serialized")),
    }
}

#[derive(Serialize, Deserialize)]
#[serde(rename = "JointLimits", deny_unknown_fields)]
struct LimitsFields<T> {
    minimum: T,
    maximum: T,
    /// Whether the drives are linear.
    #[serde(default)]
    linear: bool,
}

impl<T: Real + Serialize> Serialize for JointLimits<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        LimitsFields {
            minimum: self.minimum(),
            maximum: self.maximum(),
            linear: self.drive() == Drive::Linear,
        }
        .serialize(serializer)
    }
}

impl<'de, T: Real + Deserialize<'de>> Deserialize<'de> for JointLimits<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let fields = LimitsFields::deserialize(deserializer)?;
        if !fields.linear {
            return Self::new(fields.minimum, fields.maximum).map_err(Error::custom);
        }
        #[cfg(feature = "linear")]
        return Self::travel(fields.minimum, fields.maximum).map_err(Error::custom);
        #[cfg(not(feature = "linear"))]
        Err(Error::custom(
            "limits of linear drives need the feature `linear`",
        ))
    }
}

/// All σ; an omitted one is as after [`Tolerance::new`].
#[derive(Serialize, Deserialize)]
#[serde(rename = "Tolerance", deny_unknown_fields)]
struct ToleranceFields<T> {
    length: T,
    angle: T,
    #[serde(default = "none")]
    joint_zero: Option<T>,
    #[cfg(feature = "linear")]
    #[serde(default = "none")]
    carriage_zero: Option<T>,
    #[cfg(feature = "linear")]
    #[serde(default = "none")]
    carriage_scale: Option<T>,
    #[cfg(feature = "linear")]
    #[serde(default = "none")]
    common_radius: Option<T>,
    #[cfg(feature = "linear")]
    #[serde(default = "none")]
    common_forearm: Option<T>,
}

const fn none<T>() -> Option<T> {
    None
}

impl<T: Real + Serialize> Serialize for Tolerance<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        ToleranceFields {
            length: self.of(Parameter::Lb),
            angle: self.of(Parameter::Alpha),
            joint_zero: self.joint_zero(),
            #[cfg(feature = "linear")]
            carriage_zero: Some(self.of(Parameter::Zero)),
            #[cfg(feature = "linear")]
            carriage_scale: Some(self.of(Parameter::Scale)),
            #[cfg(feature = "linear")]
            common_radius: Some(self.radius()),
            #[cfg(feature = "linear")]
            common_forearm: Some(self.forearm()),
        }
        .serialize(serializer)
    }
}

impl<'de, T: Real + Deserialize<'de>> Deserialize<'de> for Tolerance<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let fields = ToleranceFields::deserialize(deserializer)?;
        let mut tolerance = Self::new(fields.length, fields.angle).map_err(Error::custom)?;
        if let Some(zero) = fields.joint_zero {
            tolerance = tolerance.with_joint_zero(zero).map_err(Error::custom)?;
        }
        #[cfg(feature = "linear")]
        {
            let zero = fields.carriage_zero.unwrap_or(fields.length);
            let scale = fields.carriage_scale.unwrap_or(fields.angle);
            tolerance = tolerance
                .with_linear(zero, scale)
                .and_then(|own| own.with_radius(fields.common_radius.unwrap_or(T::ZERO)))
                .and_then(|own| own.with_forearm(fields.common_forearm.unwrap_or(T::ZERO)))
                .map_err(Error::custom)?;
        }
        Ok(tolerance)
    }
}

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

/// The mean age, as one number.
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
