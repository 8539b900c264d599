//! The numeric kernels, compiled with this crate for `f32` and `f64`.
//!
//! All other code of this crate is generic: it is compiled with the crate that uses it, at that crate's optimisation
//! level, which in firmware is often `s` or `z`. The functions here are not generic, so `opt-level = 3` for this package
//! alone makes them fast. They are reached through [`Real`].

#![allow(private_interfaces)] // no other crate can name the trait

use crate::Real;
use crate::calibration::{
    ArmSamples, JointNormal, JointSamples, Means, Normal, correction_of, is_below,
};
use crate::frame::RigidTransform;
use crate::kinematics::KinematicsError;
use crate::observations::{
    At, Equation, Observation, ObservationRow, Pose, READINGS, align, nearest_rotation,
};
use crate::robot::{ArmIndex, OF_ARM, Robot};
use crate::samples::{
    ArmFactor, Displacement, FEATURES, Forgetting, JointDisplacement, JointFactor, NominalArm,
    Sample, SampleError, Waiting, triangle,
};
use crate::stream::{Gate, Verdict};
use core::ops::Range;
use nalgebra::{Matrix3, Vector3};

/// Declares the functions once, and implements them for each scalar type.
macro_rules! kernels {
    ($scalars:tt $(
        $(#[$doc:meta])*
        fn $name:ident($($argument:ident: $kind:ty),* $(,)?) $(-> $result:ty)? $body:block
    )*) => {
        /// The kernels of a scalar type.
        #[allow(unreachable_pub)]
        pub trait Kernels: Sized {
            $($(#[$doc])* fn $name($($argument: $kind),*) $(-> $result)? where Self: Real;)*
        }
        kernels! { @each $scalars { $(
            // Elsewhere the caller's level is no worse.
            #[cfg_attr(target_os = "none", inline(never))]
            #[cfg_attr(not(target_os = "none"), inline)]
            fn $name($($argument: $kind),*) $(-> $result)? $body
        )* } }
    };
    (@each [$($scalar:ty),*] $functions:tt) => { $(kernels! { @one $scalar $functions })* };
    (@one $scalar:ty { $($function:item)* }) => { impl Kernels for $scalar { $($function)* } };
}

kernels! { [f32, f64]
    /// [`Robot::forward`].
    fn forward(robot: &Robot<Self>, q: &[Self; 3]) -> Result<Vector3<Self>, KinematicsError> {
        robot.point_at(q)
    }

    /// [`Robot::inverse`].
    fn inverse(robot: &Robot<Self>, x: &Vector3<Self>) -> Result<[Self; 3], KinematicsError> {
        robot.joints_at(x)
    }

    /// [`NominalArm::check_sample`].
    fn check_sample(of: [&NominalArm<Self>; 3], sample: &Sample<Self>) -> Result<(), SampleError> {
        NominalArm::check_sample(of, sample)
    }

    /// Absorbs an arm's block of waiting samples.
    fn absorb_block(factor: &mut ArmFactor<Self>, waiting: &Waiting<Self>, arm: ArmIndex) {
        factor.absorb_checked(waiting.block(arm));
    }

    /// [`ArmFactor::linearized`].
    fn linearize_arm(
        factor: &ArmFactor<Self>,
        at: &Displacement<Self>,
        normal: &mut Normal<Self>,
    ) -> Self {
        factor.linearized(at, normal)
    }

    /// Absorbs twelve rows into the triangle of a linearised arm.
    fn absorb_twelve(normal: &mut Normal<Self>, block: &mut [[Self; 12]; 9]) {
        normal.absorb(block);
    }

    /// [`Displacement::new`].
    fn displaced(nominal: &NominalArm<Self>, correction: &[Self; 8]) -> Displacement<Self> {
        Displacement::exactly(nominal, correction)
    }

    /// [`correction_of`].
    fn correction(nominal: &NominalArm<Self>, delta: &[Self; FEATURES]) -> Option<[Self; OF_ARM]> {
        correction_of(nominal, delta)
    }

    /// [`is_below`].
    fn is_below(robot: &Robot<Self>, of: [&NominalArm<Self>; 3], means: &[Means<Self>; 3]) -> bool {
        is_below(robot, of, means)
    }

    /// [`Gate::add`].
    fn gate_add(
        gate: &mut Gate<Self>,
        samples: &mut ArmSamples<Self>,
        sample: &Sample<Self>,
        forgetting: Option<&Forgetting<Self>>,
    ) -> Result<Verdict<Self>, SampleError> {
        gate.add(samples, sample, forgetting)
    }

    /// [`Gate::catch_up`].
    fn gate_catch_up(
        gate: &mut Gate<Self>,
        samples: &mut ArmSamples<Self>,
        forgetting: Option<&Forgetting<Self>>,
    ) -> bool {
        gate.catch_up(samples, forgetting)
    }

    /// [`JointSamples::take`].
    fn push_joint(samples: &mut JointSamples<Self>, sample: &Sample<Self>) {
        samples.take(sample);
    }

    /// [`JointSamples::absorb_waiting`].
    fn flush_joint(samples: &mut JointSamples<Self>) {
        samples.absorb_waiting();
    }

    /// [`JointFactor::linearized`].
    fn linearize_joint(
        factor: &JointFactor<Self>,
        at: &JointDisplacement<Self>,
        normal: &mut JointNormal<Self>,
        piece: usize,
    ) -> Self {
        factor.linearized(at, normal, piece)
    }

    /// [`Pose::new`].
    fn pose(robot: &Robot<Self>, joints: &[Self; 3]) -> Option<Pose<Self>> {
        Pose::new(robot, joints)
    }

    /// What an observation's readings should be at two positions.
    fn equations(
        observation: &Observation<Self>,
        at: &At<'_, Self>,
        own: &Vector3<Self>,
        other: Option<&Vector3<Self>>,
    ) -> [Option<Equation<Self>>; READINGS] {
        at.equations(observation, own, other)
    }

    /// [`ObservationRow::derive`].
    fn derive_row(
        row: &ObservationRow<Self>,
        at: &At<'_, Self>,
        units: &[Self],
        columns: &mut [[Self; READINGS]],
    ) -> Option<Self> {
        row.derive(at, units, columns)
    }

    /// The frame that best fits complete coordinates.
    fn align(rows: &[ObservationRow<Self>]) -> Option<RigidTransform<Self>> {
        align(rows)
    }

    /// The rotation that best fits the directions of axes.
    fn nearest_rotation(rows: &[Vector3<Self>; 3]) -> Option<Matrix3<Self>> {
        nearest_rotation(rows)
    }

    /// Absorbs rows into a packed triangle for the first `pivots` of their columns.
    fn absorb_five(entries: &mut [Self], columns: &mut [[Self; READINGS]], pivots: usize) {
        triangle::reduce(entries, columns.len(), columns, pivots);
    }

    /// Four rows.
    fn absorb_four(entries: &mut [Self], columns: &mut [[Self; 4]], pivots: usize) {
        triangle::reduce(entries, columns.len(), columns, pivots);
    }

    /// One row of nine columns.
    fn absorb_nine(entries: &mut [Self], row: &mut [[Self; 1]; 9]) {
        let whole = triangle::absorb_nine(entries, row);
        debug_assert!(whole.is_some());
    }

    /// Two rows.
    fn absorb_two(entries: &mut [Self], columns: &mut [[Self; 2]], pivots: usize) {
        triangle::reduce(entries, columns.len(), columns, pivots);
    }

    /// Lengths of a packed triangle's columns but for the last.
    fn column_norms(entries: &[Self], norms: &mut [Self]) {
        triangle::column_norms(entries, norms);
    }

    /// Adds a multiple of one vector to another.
    fn add_multiple(to: &mut [Self], factor: Self, vector: &[Self]) {
        triangle::add_multiple(to, factor, vector);
    }

    /// U x + c of a packed triangle.
    fn affine(entries: &[Self], x: &[Self], product: &mut [Self]) {
        triangle::affine(entries, x, product);
    }

    /// Solves U x = −v in place; `false` if a pivot does not exceed its smallest.
    fn back_substitute(entries: &[Self], smallest: &[Self], solution: &mut [Self]) -> bool {
        triangle::back_substitute(entries, smallest, solution)
    }

    /// Adds the products of these rows of the inverse's last columns to the covariance.
    fn invert(
        entries: &[Self],
        size: usize,
        columns: &mut [[Self; 4]],
        covariance: &mut [Self],
        rows: Range<usize>,
    ) {
        triangle::inverse_columns(entries, size, columns);
        triangle::add_square(columns, covariance, size.saturating_sub(1), rows);
    }
}
