//! The covariance of a robot's parameters, with or without its transmissions.

use nalgebra::SMatrix;

/// Number of parameters of Model 24.
pub(crate) const PARAMETERS: usize = 24;
/// With the numbers of the transmissions.
pub(crate) const WITH_TRANSMISSIONS: usize = PARAMETERS + 15;
/// The robot's parameters and the unknowns of as many instruments as a file may have: a frame and 14
/// points, for example.
pub(crate) const MOST: usize = 72;
pub(crate) const COLUMNS: usize = MOST + 1;
pub(crate) const ENTRIES: usize = COLUMNS * (COLUMNS + 1) / 2;

/// Covariance of the parameters, arm by arm, and of the numbers of the transmissions: mm, radians and their
/// products. That of what is known is 0.
pub type RobotCovariance = SMatrix<f64, WITH_TRANSMISSIONS, WITH_TRANSMISSIONS>;

/// Where the transmissions are known.
pub(crate) fn with_exact_transmissions(
    of_parameters: &SMatrix<f64, PARAMETERS, PARAMETERS>,
) -> RobotCovariance {
    let mut covariance = RobotCovariance::zeros();
    covariance
        .fixed_view_mut::<PARAMETERS, PARAMETERS>(0, 0)
        .copy_from(of_parameters);
    covariance
}

/// The part of the parameters alone.
pub(crate) fn of_parameters(covariance: &RobotCovariance) -> SMatrix<f64, PARAMETERS, PARAMETERS> {
    covariance
        .fixed_view::<PARAMETERS, PARAMETERS>(0, 0)
        .into_owned()
}
