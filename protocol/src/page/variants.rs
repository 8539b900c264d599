//! The names of an enum's variants, in the order of their numbers, as `serde` knows them: also of
//! those of the core, which may become more.

use crate::{Fault, Origin, ParameterSet, Phase, Request, Response, RevertTo, Scalar};
use delta_cal::calibration::{Instrument, StartUsed, Termination};
use delta_cal::observations::{DistanceFrom, ObservationError};
use delta_cal::robot::GeometryError;
use delta_cal::samples::SampleError;
use delta_cal::stream::{
    Added, Alarm, Estimator, HeldOutRefusal, StreamRefusal, Untested, Verdict,
};
use delta_cal::{ArmIndex, Parameter, Refusal};
use serde::de::{Deserialize, Deserializer, Error, Visitor};
use serde::forward_to_deserialize_any;
use std::fmt;
use std::vec::Vec;

type Variants = &'static [&'static str];

/// Of every enum that a message holds.
pub(super) fn variants() -> Vec<(&'static str, Variants)> {
    std::vec![
        of::<Request<f32>>(),
        of::<ParameterSet>(),
        of::<RevertTo>(),
        of::<Response<f32>>(),
        of::<Fault>(),
        of::<SampleError>(),
        of::<ObservationError>(),
        of::<DistanceFrom<f32>>(),
        of::<Scalar>(),
        of::<Origin>(),
        of::<Phase>(),
        of::<StreamRefusal>(),
        of::<HeldOutRefusal>(),
        of::<Alarm>(),
        of::<Estimator>(),
        of::<Added<f32>>(),
        of::<Verdict<f32>>(),
        of::<Untested>(),
        of::<Refusal>(),
        of::<GeometryError>(),
        of::<Instrument>(),
        of::<ArmIndex>(),
        of::<Parameter>(),
        of::<Termination>(),
        of::<StartUsed>(),
    ]
}

fn of<T: for<'a> Deserialize<'a>>() -> (&'static str, Variants) {
    let Err(Asked(asked)) = T::deserialize(Asks) else {
        panic!("deserialized from nothing")
    };
    asked.expect("an enum")
}

/// Gives nothing but what it was asked for.
struct Asks;

#[derive(Debug)]
struct Asked(Option<(&'static str, Variants)>);

impl fmt::Display for Asked {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, formatter)
    }
}

impl std::error::Error for Asked {}

impl Error for Asked {
    fn custom<M: fmt::Display>(_: M) -> Self {
        Self(None)
    }
}

impl<'de> Deserializer<'de> for Asks {
    type Error = Asked;

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: Variants,
        _: V,
    ) -> Result<V::Value, Asked> {
        Err(Asked(Some((name, variants))))
    }

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Asked> {
        Err(Asked(None))
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf option unit
        unit_struct newtype_struct seq tuple tuple_struct map struct identifier ignored_any
    }
}
