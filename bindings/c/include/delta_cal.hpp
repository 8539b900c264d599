// delta_cal.hpp: robot and joint calibration for C++11 and later, over delta_cal.h; Real is float or double.
//
// Nothing is allocated and nothing is thrown: every function returns the status of the C function that it calls.
// For whatever is not here, c() leads to the object of C.
#ifndef DELTA_CAL_HPP
#define DELTA_CAL_HPP

#include "delta_cal.h"

namespace delta_cal {

using Status = dcal_status;
using Error = dcal_error;

// The types and functions of a scalar.
template <typename Real> struct Api;

template <> struct Api<float> {
    using Robot = dcal_robot_f32;
    using Dimensions = dcal_dimensions_f32;
    using Sample = dcal_sample_f32;
    using Settings = dcal_settings_f32;
    using Calibrator = dcal_joint_f32;
    static constexpr auto from_dimensions = dcal_robot_from_dimensions_f32;
    static constexpr auto from_parameters = dcal_robot_from_parameters_f32;
    static constexpr auto parameters = dcal_robot_parameters_f32;
    static constexpr auto set_transmissions = dcal_robot_set_transmissions_f32;
    static constexpr auto transmissions = dcal_robot_transmissions_f32;
    static constexpr auto forward = dcal_robot_forward_f32;
    static constexpr auto inverse = dcal_robot_inverse_f32;
    static constexpr auto init = dcal_joint_init_f32;
    static constexpr auto add = dcal_joint_add_f32;
    static constexpr auto flush = dcal_joint_flush_f32;
    static constexpr auto solve = dcal_joint_solve_f32;
    static constexpr auto step = dcal_joint_step_f32;
    static constexpr auto stop = dcal_joint_stop_f32;
    static constexpr auto reset = dcal_joint_reset_f32;
    static constexpr auto finish = dcal_joint_finish_f32;
    static constexpr auto deviations = dcal_joint_deviations_f32;
    static constexpr auto covariance = dcal_joint_covariance_f32;
};

template <> struct Api<double> {
    using Robot = dcal_robot_f64;
    using Dimensions = dcal_dimensions_f64;
    using Sample = dcal_sample_f64;
    using Settings = dcal_settings_f64;
    using Calibrator = dcal_joint_f64;
    static constexpr auto from_dimensions = dcal_robot_from_dimensions_f64;
    static constexpr auto from_parameters = dcal_robot_from_parameters_f64;
    static constexpr auto parameters = dcal_robot_parameters_f64;
    static constexpr auto set_transmissions = dcal_robot_set_transmissions_f64;
    static constexpr auto transmissions = dcal_robot_transmissions_f64;
    static constexpr auto forward = dcal_robot_forward_f64;
    static constexpr auto inverse = dcal_robot_inverse_f64;
    static constexpr auto init = dcal_joint_init_f64;
    static constexpr auto add = dcal_joint_add_f64;
    static constexpr auto flush = dcal_joint_flush_f64;
    static constexpr auto solve = dcal_joint_solve_f64;
    static constexpr auto step = dcal_joint_step_f64;
    static constexpr auto stop = dcal_joint_stop_f64;
    static constexpr auto reset = dcal_joint_reset_f64;
    static constexpr auto finish = dcal_joint_finish_f64;
    static constexpr auto deviations = dcal_joint_deviations_f64;
    static constexpr auto covariance = dcal_joint_covariance_f64;
};

// A robot; before it is made, every function refuses it with DCAL_NOT_INITIALIZED.
template <typename Real> class Robot {
public:
    using C = Api<Real>;
    Status from_dimensions(const typename C::Dimensions &dimensions, Error *error = nullptr) {
        return C::from_dimensions(&robot, sizeof robot, &dimensions, error);
    }
    Status from_parameters(const Real (&parameters)[24], Error *error = nullptr) {
        return C::from_parameters(&robot, sizeof robot, parameters, error);
    }
    Status parameters(Real (&parameters)[24]) const { return C::parameters(&robot, parameters); }
    Status set_transmissions(const Real (&transmissions)[15], Error *error = nullptr) {
        return C::set_transmissions(&robot, transmissions, error);
    }
    Status transmissions(Real (&transmissions)[15]) const {
        return C::transmissions(&robot, transmissions);
    }
    Status forward(const Real (&joints)[3], Real (&position)[3], Error *error = nullptr) const {
        return C::forward(&robot, joints, position, error);
    }
    Status inverse(const Real (&position)[3], Real (&joints)[3], Error *error = nullptr) const {
        return C::inverse(&robot, position, joints, error);
    }
    typename C::Robot *c() { return &robot; }
    const typename C::Robot *c() const { return &robot; }

private:
    typename C::Robot robot = {};
};

// The joint calibrator.
template <typename Real> class Calibrator {
public:
    using C = Api<Real>;
    Status init(const Robot<Real> &robot, const typename C::Settings &settings, Error *error = nullptr) {
        return C::init(&calibrator, sizeof calibrator, robot.c(), &settings, error);
    }
    Status add(const typename C::Sample &sample, Error *error = nullptr) {
        return C::add(&calibrator, &sample, error);
    }
    // Works in the samples that wait, which `solve` does otherwise: that call is then shorter.
    Status flush() { return C::flush(&calibrator); }
    Status solve(Error *error = nullptr) { return C::solve(&calibrator, error); }
    Status step() { return C::step(&calibrator); }
    Status reset() { return C::reset(&calibrator); }
    Status stop() { return C::stop(&calibrator); }
    Status finish(Robot<Real> &robot, Error *error = nullptr) const {
        return C::finish(&calibrator, robot.c(), sizeof *robot.c(), error);
    }
    Status deviations(Real (&sigma)[24]) const { return C::deviations(&calibrator, sigma); }
    Status covariance(Real (&covariance)[576]) const { return C::covariance(&calibrator, covariance); }
    typename C::Calibrator *c() { return &calibrator; }
    const typename C::Calibrator *c() const { return &calibrator; }

private:
    typename C::Calibrator calibrator = {};
};

} // namespace delta_cal

#endif
