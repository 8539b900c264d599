/* What a part of the library adds to a firmware, in single precision: the part is named by SIZE_ROBOT, SIZE_ARMS, SIZE_GATE,
 * SIZE_JOINT or SIZE_OBSERVATIONS; SIZE_NOTHING is the firmware without any. Built to be looked at. */
#include "delta_cal.h"

#ifndef SIZE_NOTHING
/* As if they came from elsewhere. */
static volatile float number;
static volatile int more;

static dcal_robot_f32 robot;
static dcal_error error;

static void make_robot(void)
{
    const dcal_dimensions_f32 dimensions = {number, number, number, number, number};
    dcal_robot_from_dimensions_f32(&robot, sizeof robot, &dimensions, &error);
}
#endif

#ifdef SIZE_ROBOT
static void part(void)
{
    const float joints[3] = {number, number, number};
    float position[3];
    float back[3];
    dcal_robot_forward_f32(&robot, joints, position, &error);
    dcal_robot_inverse_f32(&robot, position, back, &error);
    number = back[0];
}
#endif

#if defined(SIZE_ARMS) || defined(SIZE_GATE) || defined(SIZE_JOINT)
#ifdef SIZE_JOINT
#define CALIBRATION(name) dcal_joint_##name##_f32
static dcal_joint_f32 calibrator;
static dcal_joint_outcome_f32 outcome;
#else
static dcal_arms_outcome_f32 outcome;
#ifdef SIZE_GATE
#define CALIBRATION(name) dcal_gated_##name##_f32
static dcal_gated_f32 calibrator;
#else
#define CALIBRATION(name) dcal_arms_##name##_f32
static dcal_arms_f32 calibrator;
#endif
#endif

static void part(void)
{
    const dcal_settings_f32 settings = {.position_noise = {number, number, number}};
#ifdef SIZE_GATE
    CALIBRATION(init)(&calibrator, sizeof calibrator, &robot, &settings, 0, &error);
#else
    CALIBRATION(init)(&calibrator, sizeof calibrator, &robot, &settings, &error);
#endif
    while (more) {
        const dcal_sample_f32 sample = {{number, number, number}, {number, number, number}};
#ifdef SIZE_GATE
        dcal_verdict_f32 verdict;
        CALIBRATION(add)(&calibrator, &sample, &verdict, &error);
#else
        CALIBRATION(add)(&calibrator, &sample, &error);
#endif
    }
    CALIBRATION(solve)(&calibrator, &error);
    while (CALIBRATION(step)(&calibrator, &error) == DCAL_WORKING) {
    }
    CALIBRATION(finish)(&calibrator, &outcome, sizeof outcome, &error);
#ifdef SIZE_JOINT
    dcal_joint_outcome_robot_f32(&outcome, &robot, sizeof robot);
#else
    dcal_arms_outcome_robot_f32(&outcome, &robot, sizeof robot);
#endif
}
#endif

#ifdef SIZE_OBSERVATIONS
static dcal_observation_f32 observations[30];
static dcal_observation_row_f32 rows[30];
static dcal_observation_outcome_f32 observed;
static dcal_joint_outcome_f32 outcome;

static void part(void)
{
    const dcal_settings_f32 settings = {.position_noise = {number, number, number}};
    const dcal_instruments_f32 instruments = {.height_noise = number};
    dcal_observations_solve_f32(&robot, observations, (size_t)more, &instruments, &settings, rows, sizeof rows,
        &observed, sizeof observed, &error);
    dcal_observation_outcome_joint_f32(&observed, &outcome, sizeof outcome);
    dcal_joint_outcome_robot_f32(&outcome, &robot, sizeof robot);
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
