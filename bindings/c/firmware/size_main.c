/* What a part of the library adds to a firmware, in single precision: the part is named by SIZE_ROBOT, SIZE_IKM, SIZE_GATE,
 * SIZE_JOINT, SIZE_JOINT_GATE or SIZE_FKM; SIZE_NOTHING is the firmware without any. Built to be looked at. */
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

#ifndef SIZE_NOTHING
#ifdef SIZE_IKM
#define OF(name) dcal_ikm##name##_f32
#elif defined(SIZE_GATE)
#define OF(name) dcal_gate##name##_f32
#elif defined(SIZE_JOINT)
#define OF(name) dcal_joint##name##_f32
#elif defined(SIZE_JOINT_GATE)
#define OF(name) dcal_joint_gate##name##_f32
#elif defined(SIZE_FKM)
#define OF(name) dcal_fkm##name##_f32
#endif
#endif

#ifdef OF
static OF() calibrator;

static void part(void)
{
    const dcal_settings_f32 settings = {.position_noise = {number, number, number}};
#ifdef SIZE_FKM
    const dcal_instruments_f32 instruments = {.height_noise = number};
    OF(_init)(&calibrator, sizeof calibrator, &robot, &instruments, &settings, &error);
#elif defined(SIZE_GATE) || defined(SIZE_JOINT_GATE)
    OF(_init)(&calibrator, sizeof calibrator, &robot, &settings, 0, 0, &error);
#else
    OF(_init)(&calibrator, sizeof calibrator, &robot, &settings, &error);
#endif
    while (more) {
#ifdef SIZE_FKM
        const dcal_observation_f32 observation = {.height = number, .readings = DCAL_READ_HEIGHT};
        OF(_add)(&calibrator, &observation, &error);
#else
        const dcal_sample_f32 sample = {{number, number, number}, {number, number, number}};
#if defined(SIZE_GATE) || defined(SIZE_JOINT_GATE)
        dcal_verdict_f32 verdict;
        OF(_add)(&calibrator, &sample, &verdict, &error);
#else
        OF(_add)(&calibrator, &sample, &error);
#endif
#endif
    }
    OF(_solve)(&calibrator, &error);
    while (OF(_step)(&calibrator) == DCAL_WORKING) {
    }
    OF(_finish)(&calibrator, &robot, sizeof robot, &error);
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
