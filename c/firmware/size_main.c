/* Nothing but a calibration in single precision: what is linked is what one needs. Built to be looked at; with SIZE_ARMS
 * by the per-arm calibrator, otherwise by the joint one, and with SIZE_NOTHING without any. */
#include "delta_cal.h"

#ifndef SIZE_NOTHING
#ifdef SIZE_ARMS
#define CALIBRATION(name) delta_cal_##name##_f32
#else
#define CALIBRATION(name) delta_cal_joint_##name##_f32
#endif

static delta_cal_robot_f32 robot;
static CALIBRATION(calibrator) calibrator;
static CALIBRATION(solver) solver;
static CALIBRATION(outcome) outcome;
/* As if they came from elsewhere. */
static volatile float number;
static volatile int more;

static void calibrate(void)
{
    const delta_cal_dimensions_f32 dimensions = {number, number, number, number, number};
    const delta_cal_settings_f32 settings = {.position_noise = {number, number, number}};
    delta_cal_error error;
    delta_cal_robot_from_dimensions_f32(&robot, sizeof robot, &dimensions, &error);
    CALIBRATION(calibrator_init)(&calibrator, sizeof calibrator, &robot, &settings, &error);
    while (more) {
        const delta_cal_sample_f32 sample = {{number, number, number}, {number, number, number}};
        CALIBRATION(calibrator_add)(&calibrator, &sample, &error);
    }
    CALIBRATION(solver_init)(&solver, sizeof solver, &calibrator, &error);
    while (CALIBRATION(solver_step)(&solver, &calibrator, &error) == DELTA_CAL_WORKING) {
    }
#ifdef SIZE_ARMS
    CALIBRATION(solver_outcome)(&solver, &outcome, sizeof outcome, &error);
#else
    CALIBRATION(solver_outcome)(&solver, &calibrator, &outcome, sizeof outcome, &error);
#endif
    CALIBRATION(outcome_robot)(&outcome, &robot, sizeof robot);
}
#endif

int main(void)
{
#ifndef SIZE_NOTHING
    calibrate();
#endif
    return 0;
}
