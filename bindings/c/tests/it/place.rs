//! Memory as C provides it, and objects in it.

use delta_cal::calibration::{Estimator, Ikm, Joint, JointOutcome};
use delta_cal::nalgebra::SMatrix;
use delta_cal::{ArmIndex, Parameter, Real, Robot, RobotOutcome};
use delta_cal_c::double::robot::{robot_from_parameters, robot_parameters};
use delta_cal_c::double::sample::{Sample, Settings};
use delta_cal_c::error::Error;
use delta_cal_c::kind::Kind;
use delta_cal_c::{Held, HeldMut, In, New, Out, Pointer, status};
use delta_cal_target_tests::{noise, nominal, tolerance};
use std::marker::PhantomData;
use std::ptr::null_mut;

/// The tests are in the place of C: what they promise is that the memory is there.
pub(crate) fn at<P: Pointer>(place: *mut u8) -> P {
    unsafe { P::from_c(place) }
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

pub(crate) fn null() -> Out<Error> {
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
    ok(robot_from_parameters(new, size, input(&parameters), null()));
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

/// What the core finds.
pub(crate) trait Found: Estimator {
    fn covariance<T: Real>(outcome: &Self::Outcome<T>) -> SMatrix<T, 24, 24>;
}

impl Found for Ikm {
    fn covariance<T: Real>(outcome: &RobotOutcome<T>) -> SMatrix<T, 24, 24> {
        let mut all = SMatrix::<T, 24, 24>::zeros();
        for (arm, first) in outcome.arms.iter().zip([0, 8, 16]) {
            let block = arm.covariance.as_ref().unwrap();
            all.fixed_view_mut::<8, 8>(first, first).copy_from(block);
        }
        all
    }
}

impl Found for Joint {
    fn covariance<T: Real>(outcome: &JointOutcome<T>) -> SMatrix<T, 24, 24> {
        outcome.estimate.covariance.unwrap()
    }
}

/// Parameters, standard uncertainties, and the covariance row by row.
pub(crate) fn found<T: Real, E: Found>(outcome: &E::Outcome<T>) -> [Vec<T>; 3] {
    let sigma = |arm| {
        let arm = E::arm(outcome, arm);
        Parameter::ROTARY.map(|of| arm.standard_deviation(of).unwrap())
    };
    let covariance = E::covariance(outcome).transpose();
    [
        E::robot(outcome).parameters().as_flattened().to_vec(),
        ArmIndex::ALL.map(sigma).as_flattened().to_vec(),
        covariance.as_slice().to_vec(),
    ]
}
