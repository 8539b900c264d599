/* What a part of the library adds to a firmware, in single precision: the part is named by SIZE_ROBOT, SIZE_ARMS, SIZE_GATE,
 * SIZE_JOINT or SIZE_OBSERVATIONS; SIZE_NOTHING is the firmware without any. Built to be looked at. */
#include "delta_cal.h"

#ifndef SIZE_NOTHING
/* As if they came from elsewhere. */
static volatile float number;
static volatile int more;

static delta_cal_robot_f32 robot;
static delta_cal_error error;

static void make_robot(void)
{
    const delta_cal_dimensions_f32 dimensions = {number, number, number, number, number};
    delta_cal_robot_from_dimensions_f32(&robot, sizeof robot, &dimensions, &error);
}
#endif

#ifdef SIZE_ROBOT
static void part(void)
{
    const float joints[3] = {number, number, number};
    float position[3];
    float back[3];
    delta_cal_robot_forward_f32(&robot, joints, position, &error);
    delta_cal_robot_inverse_f32(&robot, position, back, &error);
    number = back[0];
}
#endif

#if defined(SIZE_ARMS) || defined(SIZE_GATE) || defined(SIZE_JOINT)
#ifdef SIZE_JOINT
#define CALIBRATION(name) delta_cal_joint_##name##_f32
#else
#define CALIBRATION(name) delta_cal_##name##_f32
#endif

static CALIBRATION(calibrator) calibrator;
static CALIBRATION(solver) solver;
static CALIBRATION(outcome) outcome;

static void part(void)
{
    const delta_cal_settings_f32 settings = {.position_noise = {number, number, number}};
    CALIBRATION(calibrator_init)(&calibrator, sizeof calibrator, &robot, &settings, &error);
#ifdef SIZE_GATE
    static delta_cal_gate_f32 gate;
    delta_cal_gate_init_f32(&gate, sizeof gate, &calibrator, 0);
#endif
    while (more) {
        const delta_cal_sample_f32 sample = {{number, number, number}, {number, number, number}};
#ifdef SIZE_GATE
        delta_cal_verdict_f32 verdict;
        delta_cal_gate_add_f32(&gate, &calibrator, &sample, &verdict, &error);
#else
        CALIBRATION(calibrator_add)(&calibrator, &sample, &error);
#endif
    }
    CALIBRATION(solver_init)(&solver, sizeof solver, &calibrator, &error);
    while (CALIBRATION(solver_step)(&solver, &calibrator, &error) == DELTA_CAL_WORKING) {
    }
#ifdef SIZE_JOINT
    CALIBRATION(solver_outcome)(&solver, &calibrator, &outcome, sizeof outcome, &error);
#else
    CALIBRATION(solver_outcome)(&solver, &outcome, sizeof outcome, &error);
#endif
    CALIBRATION(outcome_robot)(&outcome, &robot, sizeof robot);
}
#endif

#ifdef SIZE_OBSERVATIONS
static delta_cal_observation_f32 observations[30];
static delta_cal_observation_row_f32 rows[30];
static delta_cal_observation_outcome_f32 observed;
static delta_cal_joint_outcome_f32 outcome;

static void part(void)
{
    const delta_cal_settings_f32 settings = {.position_noise = {number, number, number}};
    const delta_cal_instruments_f32 instruments = {.height_noise = number};
    delta_cal_observations_solve_f32(&robot, observations, (size_t)more, &instruments, &settings, rows, sizeof rows,
        &observed, sizeof observed, &error);
    delta_cal_observation_outcome_joint_f32(&observed, &outcome, sizeof outcome);
    delta_cal_joint_outcome_robot_f32(&outcome, &robot, sizeof robot);
}
#endif

int main(void)
{
#ifndef SIZE_NOTHING
    make_robot();
    part();
#endif
    return 0;
}
