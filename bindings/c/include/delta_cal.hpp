// delta_cal.hpp: robot, joint calibrator and gates for C++11 and later, over delta_cal.h; Real is float or double.
//
// Nothing is allocated and nothing is thrown: every function returns the status of the C function that it calls.
// For whatever is not here, c() leads to the object of C.
#ifndef DELTA_CAL_HPP
#define DELTA_CAL_HPP

#include "delta_cal.h"

namespace delta_cal {

using Status = dcal_status;
using Error = dcal_error;

// The types and functions of a scalar, and of each calibrator with it.
template <typename Real> struct Api;
template <typename Real> struct JointApi;
template <typename Real> struct IkmGateApi;
template <typename Real> struct JointGateApi;

#define DELTA_CAL_CALIBRATOR(family, suffix) \
    using C = dcal_##family##suffix; \
    static constexpr auto init = dcal_##family##_init##suffix; \
    static constexpr auto add = dcal_##family##_add##suffix; \
    static constexpr auto samples = dcal_##family##_samples##suffix; \
    static constexpr auto solve = dcal_##family##_solve##suffix; \
    static constexpr auto step = dcal_##family##_step##suffix; \
    static constexpr auto solving = dcal_##family##_solving##suffix; \
    static constexpr auto finished = dcal_##family##_finished##suffix; \
    static constexpr auto stop = dcal_##family##_stop##suffix; \
    static constexpr auto reset = dcal_##family##_reset##suffix; \
    static constexpr auto finish = dcal_##family##_finish##suffix; \
    static constexpr auto deviations = dcal_##family##_deviations##suffix; \
    static constexpr auto covariance = dcal_##family##_covariance##suffix;

#define DELTA_CAL_GATED(family, suffix) \
    DELTA_CAL_CALIBRATOR(family, suffix) \
    static constexpr auto state = dcal_##family##_state##suffix; \
    static constexpr auto acknowledge = dcal_##family##_acknowledge##suffix;

#define DELTA_CAL_SCALAR(Real, suffix) \
    template <> struct Api<Real> { \
        using C = dcal_robot##suffix; \
        using Dimensions = dcal_dimensions##suffix; \
        using Sample = dcal_sample##suffix; \
        using Settings = dcal_settings##suffix; \
        using Verdict = dcal_verdict##suffix; \
        using GateCounts = dcal_gate_counts##suffix; \
        static constexpr auto from_dimensions = dcal_robot_from_dimensions##suffix; \
        static constexpr auto from_parameters = dcal_robot_from_parameters##suffix; \
        static constexpr auto parameters = dcal_robot_parameters##suffix; \
        static constexpr auto set_transmissions = dcal_robot_set_transmissions##suffix; \
        static constexpr auto transmissions = dcal_robot_transmissions##suffix; \
        static constexpr auto forward = dcal_robot_forward##suffix; \
        static constexpr auto inverse = dcal_robot_inverse##suffix; \
    }; \
    template <> struct JointApi<Real> { \
        DELTA_CAL_CALIBRATOR(joint, suffix) \
        static constexpr auto flush = dcal_joint_flush##suffix; \
    }; \
    template <> struct IkmGateApi<Real> { DELTA_CAL_GATED(gate, suffix) }; \
    template <> struct JointGateApi<Real> { DELTA_CAL_GATED(joint_gate, suffix) };

DELTA_CAL_SCALAR(float, _f32)
DELTA_CAL_SCALAR(double, _f64)

#undef DELTA_CAL_SCALAR
#undef DELTA_CAL_GATED
#undef DELTA_CAL_CALIBRATOR

// A robot; before it is made, every function refuses it with DCAL_NOT_INITIALIZED.
template <typename Real> class Robot {
public:
    using Of = Api<Real>;
    Status from_dimensions(const typename Of::Dimensions &dimensions, Error *error = nullptr) {
        return Of::from_dimensions(&robot, sizeof robot, &dimensions, error);
    }
    Status from_parameters(const Real (&parameters)[24], Error *error = nullptr) {
        return Of::from_parameters(&robot, sizeof robot, parameters, error);
    }
    Status parameters(Real (&parameters)[24]) const { return Of::parameters(&robot, parameters); }
    Status set_transmissions(const Real (&transmissions)[15], Error *error = nullptr) {
        return Of::set_transmissions(&robot, transmissions, error);
    }
    Status transmissions(Real (&transmissions)[15]) const {
        return Of::transmissions(&robot, transmissions);
    }
    Status forward(const Real (&joints)[3], Real (&position)[3], Error *error = nullptr) const {
        return Of::forward(&robot, joints, position, error);
    }
    Status inverse(const Real (&position)[3], Real (&joints)[3], Error *error = nullptr) const {
        return Of::inverse(&robot, position, joints, error);
    }
    typename Of::C *c() { return &robot; }
    const typename Of::C *c() const { return &robot; }

private:
    typename Of::C robot = {};
};

// What every calibrator has; Of: its functions in C.
template <typename Real, typename Of> class Solving {
public:
    Status samples(uint64_t &count) const { return Of::samples(&calibrator, &count); }
    Status solve(Error *error = nullptr) { return Of::solve(&calibrator, error); }
    Status step() { return Of::step(&calibrator); }
    Status solving() const { return Of::solving(&calibrator); }
    Status finished() const { return Of::finished(&calibrator); }
    Status stop() { return Of::stop(&calibrator); }
    Status reset() { return Of::reset(&calibrator); }
    Status finish(Robot<Real> &robot, Error *error = nullptr) const {
        return Of::finish(&calibrator, robot.c(), sizeof *robot.c(), error);
    }
    Status deviations(Real (&sigma)[24]) const { return Of::deviations(&calibrator, sigma); }
    Status covariance(Real (&covariance)[576]) const { return Of::covariance(&calibrator, covariance); }
    typename Of::C *c() { return &calibrator; }
    const typename Of::C *c() const { return &calibrator; }

protected:
    typename Of::C calibrator = {};
};

// The joint calibrator.
template <typename Real> class Calibrator : public Solving<Real, JointApi<Real>> {
public:
    using Of = JointApi<Real>;
    Status init(
        const Robot<Real> &robot, const typename Api<Real>::Settings &settings, Error *error = nullptr) {
        return Of::init(&this->calibrator, sizeof this->calibrator, robot.c(), &settings, error);
    }
    Status add(const typename Api<Real>::Sample &sample, Error *error = nullptr) {
        return Of::add(&this->calibrator, &sample, error);
    }
    // Works in the samples that wait, which `solve` does otherwise: that call is then shorter.
    Status flush() { return Of::flush(&this->calibrator); }
};

// A calibrator behind a gate.
template <typename Real, typename Of> class Gated : public Solving<Real, Of> {
public:
    // sigmas: the width of the gate, age: the mean age of the samples; 0: as dcal_joint_gate_init_f32 has it.
    Status init(const Robot<Real> &robot, const typename Api<Real>::Settings &settings, Real sigmas = 0,
        Real age = 0, Error *error = nullptr) {
        return Of::init(
            &this->calibrator, sizeof this->calibrator, robot.c(), &settings, sigmas, age, error);
    }
    Status add(const typename Api<Real>::Sample &sample, typename Api<Real>::Verdict &verdict,
        Error *error = nullptr) {
        return Of::add(&this->calibrator, &sample, &verdict, error);
    }
    Status state(typename Api<Real>::GateCounts &counts) const { return Of::state(&this->calibrator, &counts); }
    Status acknowledge() { return Of::acknowledge(&this->calibrator); }
};

template <typename Real> using IkmGate = Gated<Real, IkmGateApi<Real>>;
template <typename Real> using JointGate = Gated<Real, JointGateApi<Real>>;

} // namespace delta_cal

#endif
