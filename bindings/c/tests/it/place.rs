//! Memory as C provides it, and objects in it.

use delta_cal::calibration::ArmOutcome;
use delta_cal::nalgebra::SMatrix;
use delta_cal::{Parameter, Real, Robot};
use delta_cal_c::double::robot::{robot_from_parameters, robot_parameters};
use delta_cal_c::double::sample::{Sample, Settings};
use delta_cal_c::error::Error;
use delta_cal_c::kind::Kind;
use delta_cal_c::{Held, HeldMut, In, New, Out, status};
use delta_cal_target_tests::{noise, nominal, tolerance};
use std::marker::PhantomData;
use std::ptr::null_mut;

/// A pointer of the interface.
pub(crate) trait Pointer {
    /// As C would hand it over.
    unsafe fn at(place: *mut u8) -> Self;
}

macro_rules! pointers {
    ($($name:ident)+) => {
        $(impl<T> Pointer for $name<T> {
            unsafe fn at(place: *mut u8) -> Self {
                unsafe { Self::from_c(place) }
            }
        })+
    };
}

pointers! { Held HeldMut In New Out }

/// The tests are in the place of C: what they promise is that the memory is there.
pub(crate) fn at<P: Pointer>(place: *mut u8) -> P {
    unsafe { P::at(place) }
}

/// Memory for an object of a kind, as large as in C.
pub(crate) struct Place<K>(Box<[u64]>, PhantomData<K>);

impl<K: Kind> Place<K> {
    pub(crate) fn new() -> Self {
        Self::filled_with(0)
    }

    pub(crate) fn filled_with(byte: u8) -> Self {
        let words = vec![u64::from_ne_bytes([byte; 8]); K::SIZE / 8];
        Self(words.into_boxed_slice(), PhantomData)
    }

    pub(crate) fn is_filled_with(&self, byte: u8) -> bool {
        let expected = u64::from_ne_bytes([byte; 8]);
        self.0.iter().all(|word| *word == expected)
    }

    /// Its words: a version, a number and so on.
    pub(crate) fn words(&mut self) -> &mut [u64] {
        &mut self.0
    }

    pub(crate) fn size(&self) -> usize {
        size_of_val(&*self.0)
    }

    pub(crate) fn start(&mut self) -> *mut u8 {
        self.0.as_mut_ptr().cast()
    }

    pub(crate) fn new_object(&mut self) -> New<K> {
        at(self.start())
    }

    pub(crate) fn held(&mut self) -> Held<K> {
        at(self.start())
    }

    pub(crate) fn held_mut(&mut self) -> HeldMut<K> {
        at(self.start())
    }
}

pub(crate) fn input<T>(value: &T) -> In<T> {
    at((&raw const *value).cast_mut().cast())
}

pub(crate) fn output<T>(value: &mut T) -> Out<T> {
    at((&raw mut *value).cast())
}

pub(crate) fn row<T>(values: &[T]) -> In<T> {
    at(values.as_ptr().cast_mut().cast())
}

pub(crate) fn no_error() -> Out<Error> {
    at(null_mut())
}

pub(crate) fn ok(status: i32) {
    assert_eq!(status, status::OK);
}

pub(crate) fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|number| number.to_bits()).collect()
}

pub(crate) fn in_c(sample: &delta_cal::Sample<f64>) -> Sample {
    Sample {
        joints: sample.joints,
        position: sample.position.into(),
    }
}

/// The nominal robot, from its 24 parameters.
pub(crate) fn robot() -> Place<Robot<f64>> {
    let mut robot = Place::new();
    let (new, size) = (robot.new_object(), robot.size());
    let parameters = nominal::<f64>().parameters();
    ok(robot_from_parameters(
        new,
        size,
        input(&parameters),
        no_error(),
    ));
    robot
}

pub(crate) fn noise_alone() -> Settings {
    let noise = noise::<f64>();
    Settings {
        position_noise: noise.position_by_axis(),
        joint_noise: noise.joint(),
        ..Settings::default()
    }
}

pub(crate) fn noise_and_tolerance() -> Settings {
    let tolerance = tolerance::<f64>();
    Settings {
        length_tolerance: tolerance.of(Parameter::Lb),
        angle_tolerance: tolerance.of(Parameter::Theta),
        ..noise_alone()
    }
}

pub(crate) fn parameters(robot: &mut Place<Robot<f64>>) -> Vec<u64> {
    let mut found = [[0.0; 8]; 3];
    ok(robot_parameters(robot.held(), output(&mut found)));
    bits(found.as_flattened())
}

/// As `solved` of a calibrator, from the core's outcome: parameters, standard uncertainties, and the covariance row by row.
pub(crate) fn found<T: Real>(
    robot: &Robot<T>,
    arms: &[ArmOutcome<T>; 3],
    together: Option<&SMatrix<T, 24, 24>>,
) -> [Vec<T>; 3] {
    let sigma =
        |arm: &ArmOutcome<T>| Parameter::ROTARY.map(|of| arm.standard_deviation(of).unwrap());
    let mut apart = SMatrix::<T, 24, 24>::zeros();
    for (arm, first) in arms.iter().zip([0, 8, 16]) {
        let block = arm.covariance.as_ref().unwrap();
        apart.fixed_view_mut::<8, 8>(first, first).copy_from(block);
    }
    [
        robot.parameters().as_flattened().to_vec(),
        arms.each_ref().map(sigma).as_flattened().to_vec(),
        together.unwrap_or(&apart).transpose().as_slice().to_vec(),
    ]
}

pub(crate) fn of_core(
    robot: &Robot<f64>,
    arms: &[ArmOutcome<f64>; 3],
    together: Option<&SMatrix<f64, 24, 24>>,
) -> Vec<u64> {
    bits(&found(robot, arms, together).concat())
}
