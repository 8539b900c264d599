//! Memory as C provides it, and objects in it.
#![allow(unsafe_code)] // in the place of C
#![allow(dead_code)] // not every test needs everything

use core::ptr::null_mut;
use delta_cal_c::error::Error;
use delta_cal_c::single::calibrator::calibrator_init;
use delta_cal_c::single::robot::{Dimensions, robot_forward, robot_from_dimensions};
use delta_cal_c::single::sample::{Sample, Settings};
use delta_cal_c::{Held, In, New, Out, status};

/// Memory for an object.
#[repr(C, align(8))]
pub(crate) struct Memory<const N: usize>(Box<[u64]>);

impl<const N: usize> Memory<N> {
    pub(crate) fn zeroed() -> Self {
        Self::filled_with(0)
    }

    pub(crate) fn filled_with(byte: u8) -> Self {
        Self(vec![u64::from_ne_bytes([byte; 8]); N / 8].into_boxed_slice())
    }

    pub(crate) fn is_filled_with(&self, byte: u8) -> bool {
        self.0
            .iter()
            .all(|word| *word == u64::from_ne_bytes([byte; 8]))
    }

    pub(crate) fn place(&mut self) -> *mut u8 {
        self.0.as_mut_ptr().cast()
    }

    pub(crate) fn robot() -> Self {
        let mut memory = Self::filled_with(0xa5);
        let made = unsafe {
            robot_from_dimensions(
                New::from_c(memory.place()),
                N,
                In::from_c((&raw const *dimensions()).cast()),
                no_error(),
            )
        };
        assert_eq!(made, status::OK);
        memory
    }

    pub(crate) fn calibrator<const M: usize>(robot: &mut Memory<M>, settings: &Settings) -> Self {
        let mut memory = Self::filled_with(0xa5);
        let made = unsafe {
            calibrator_init(
                New::from_c(memory.place()),
                N,
                Held::from_c(robot.place()),
                In::from_c((&raw const *settings).cast()),
                no_error(),
            )
        };
        assert_eq!(made, status::OK);
        memory
    }
}

pub(crate) fn dimensions() -> &'static Dimensions {
    &Dimensions {
        base_radius: 194.0,
        platform_radius: 30.0,
        upper_arm: 260.0,
        forearm: 480.0,
        azimuth: 0.0,
    }
}

pub(crate) fn no_error() -> Out<Error> {
    unsafe { Out::from_c(null_mut()) }
}

/// A sample of a robot without errors.
pub(crate) fn sample<const N: usize>(robot: &mut Memory<N>, joints: [f32; 3]) -> Sample {
    let mut position = [0.0; 3];
    let found = unsafe {
        robot_forward(
            Held::from_c(robot.place()),
            In::from_c((&raw const joints).cast()),
            Out::from_c((&raw mut position).cast()),
            no_error(),
        )
    };
    assert_eq!(found, status::OK);
    Sample { joints, position }
}

/// The forearms are 0.9 mm shorter than drawn.
pub(crate) fn built() -> Memory<512> {
    let dimensions = Dimensions {
        forearm: 479.1,
        ..*dimensions()
    };
    let mut robot = Memory::zeroed();
    let made = unsafe {
        robot_from_dimensions(
            New::from_c(robot.place()),
            512,
            In::from_c((&raw const dimensions).cast()),
            no_error(),
        )
    };
    assert_eq!(made, status::OK);
    robot
}

pub(crate) fn measured() -> Vec<Sample> {
    let mut robot = built();
    (0_u8..14)
        .map(|k| {
            let t = f32::from(k);
            let joints = [0.4 * t.sin(), 0.4 * (1.7 * t).cos(), 0.4 * (2.3 * t).sin()];
            sample(&mut robot, joints)
        })
        .collect()
}

pub(crate) static SETTINGS: Settings = Settings {
    position_noise: [0.02; 3],
    joint_noise: 0.0,
    length_tolerance: 0.5,
    angle_tolerance: 0.0035,
    solver: 0,
    start: 0,
    iteration_limit: 0,
    reserved: 0,
};
