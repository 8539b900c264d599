component deltacalkins "Kinematics of a Delta robot with all 24 parameters of a calibration";

description
"""
Kinematics of a Delta robot whose motors turn its upper arms: three arms of eight parameters each, as
`delta-cal calibrate` finds them. `delta-cal export calibrated.toml --for linuxcnc-component` writes the setp lines.

Specify it in the INI file:

    [KINS]
    KINEMATICS = deltacalkins
    JOINTS = 3

Joints 0, 1 and 2 drive arms 1, 2 and 3, in degrees, positive with the elbow down. At 0 the upper arm is as the pins
la-x and la-y state it.
X, Y and Z are those of the platform point in the robot's frame. Further joints are A, B, C, U, V and W.

The component takes over the parameters of all arms together, when the number on the pin revision changes, and once hold
is FALSE: the joint angles jump, so that the machine must be off. If they are not those of a robot, or if one is not set,
the component keeps the robot before, and says why. Without any robot, and for a position or joint angles that the robot
cannot have, the kinematics fails, and LinuxCNC refuses the
move.
""";

pin in float arm1.dx "x of the point on the motor axis, mm";
pin in float arm1.dy "y of that point, mm";
pin in float arm1.dz "z of that point, mm";
pin in float arm1.theta "azimuth of the arm plane, degrees";
pin in float arm1.alpha "tilt of the motor axis, degrees";
pin in float arm1.la_x "upper arm at joint angle 0, outwards, mm";
pin in float arm1.la_y "upper arm at joint angle 0, upwards, mm";
pin in float arm1.lb "forearm, mm";
pin in float arm2.dx "x of the point on the motor axis, mm";
pin in float arm2.dy "y of that point, mm";
pin in float arm2.dz "z of that point, mm";
pin in float arm2.theta "azimuth of the arm plane, degrees";
pin in float arm2.alpha "tilt of the motor axis, degrees";
pin in float arm2.la_x "upper arm at joint angle 0, outwards, mm";
pin in float arm2.la_y "upper arm at joint angle 0, upwards, mm";
pin in float arm2.lb "forearm, mm";
pin in float arm3.dx "x of the point on the motor axis, mm";
pin in float arm3.dy "y of that point, mm";
pin in float arm3.dz "z of that point, mm";
pin in float arm3.theta "azimuth of the arm plane, degrees";
pin in float arm3.alpha "tilt of the motor axis, degrees";
pin in float arm3.la_x "upper arm at joint angle 0, outwards, mm";
pin in float arm3.la_y "upper arm at joint angle 0, upwards, mm";
pin in float arm3.lb "forearm, mm";
pin in float units_per_mm = 1 "machine units in a millimetre: 1, or 0.03937007874015748 with LINEAR_UNITS = inch";
pin in u32 revision "a new number takes all parameters over; set it last";
pin in bit hold "a new revision waits while TRUE: net it to motion.motion-enabled";
pin out u32 revision_in_use "the revision that moves the robot; 0 while there is none";
pin out bit valid "TRUE if the last revision is in use";
pin out s32 status "why the last revision was refused: the status numbers of delta_cal.h, 0 if it was not";

see_also "kins(9)";
option singleton yes;
option rtapi_app no;
option no_convenience_defines yes;
license "Dual MIT/GPL";
author "the delta-cal authors";
;;

#include "kinematics.h"
#include "rtapi_math.h"
#include "rtapi_string.h"

#include "../include/delta_cal.h"

#define DEGREE (M_PI / 180)

/* The parameter pins, in the library's order. */
static hal_float_t *parameter_pins[24];
/* The rest of the pins. */
static struct __comp_state *pins;
/* The robot in use. No robot while it is all zeros: the library then refuses every call. */
static dcal_robot_f64 robot;
static double units_per_mm;
/* The revision that was looked at last. */
static rtapi_u32 seen;

static const char *const names[8] = {"dx", "dy", "dz", "theta", "alpha", "la-x", "la-y", "lb"};

int rtapi_app_main(void)
{
    int result;
    comp_id = hal_init("deltacalkins");
    if (comp_id < 0) {
        return comp_id;
    }
    result = export("deltacalkins", 0);
    if (result != 0) {
        hal_exit(comp_id);
        return result;
    }
    pins = __comp_first_inst;
#define ARM(n)                                                                                              \
    pins->arm##n##_dx, pins->arm##n##_dy, pins->arm##n##_dz, pins->arm##n##_theta, pins->arm##n##_alpha,    \
        pins->arm##n##_la_x, pins->arm##n##_la_y, pins->arm##n##_lb
    hal_float_t *const all[24] = {ARM(1), ARM(2), ARM(3)};
    for (int index = 0; index < 24; index++) {
        parameter_pins[index] = all[index];
        /* A line that is missing must not pass for a parameter of 0. */
        *parameter_pins[index] = NAN;
    }
    hal_ready(comp_id);
    return 0;
}

void rtapi_app_exit(void)
{
    hal_exit(comp_id);
}

/* The revision stays unused, and the robot in use stays. */
static void refuse(rtapi_u32 revision, dcal_status status, const char *why)
{
    *pins->status = status;
    rtapi_print_msg(RTAPI_MSG_ERR, "deltacalkins: revision %u is not taken over: %s\n", revision, why);
}

/* Goes over to the parameters on the pins if there is a new revision. Between two calls of the kinematics, so that
 * each of these computes with one robot; constant time, no allocation. */
static void take_over(void)
{
    static dcal_robot_f64 next;
    double parameters[24];
    double units;
    dcal_status status;
    const rtapi_u32 revision = *pins->revision;
    if (revision == seen || *pins->hold) {
        return;
    }
    seen = revision;
    *pins->valid = 0;
    /* The parameters were set before the revision. */
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    for (int index = 0; index < 24; index++) {
        const int which = index % 8;
        const double unit = which == DCAL_THETA || which == DCAL_ALPHA ? DEGREE : 1;
        parameters[index] = *parameter_pins[index] * unit;
        if (isnan(parameters[index])) {
            char why[] = "arm1.theta is not set";
            rtapi_snprintf(why, sizeof why, "arm%d.%s is not set", index / 8 + 1, names[which]);
            refuse(revision, DCAL_GEOMETRY_NOT_FINITE, why);
            return;
        }
    }
    units = *pins->units_per_mm;
    if (!(units > 0) || !isfinite(units)) {
        refuse(revision, DCAL_OTHER, "units-per-mm must be above 0");
        return;
    }
    status = dcal_robot_from_parameters_f64(&next, sizeof next, parameters, NULL);
    if (status != DCAL_OK) {
        refuse(revision, status, dcal_status_text(status));
        return;
    }
    robot = next;
    units_per_mm = units;
    *pins->status = DCAL_OK;
    *pins->revision_in_use = revision;
    *pins->valid = 1;
}

KINEMATICS_TYPE kinematicsType(void)
{
    /* Motion asks while it is loaded: a robot that is set before then is refused here already. */
    take_over();
    return KINEMATICS_BOTH;
}

int kinematicsForward(const double *joint, EmcPose *world, const KINEMATICS_FORWARD_FLAGS *fflags,
                      KINEMATICS_INVERSE_FLAGS *iflags)
{
    const double joints[3] = {joint[0] * DEGREE, joint[1] * DEGREE, joint[2] * DEGREE};
    double position[3];
    (void)fflags;
    (void)iflags;
    take_over();
    if (dcal_robot_forward_f64(&robot, joints, position, NULL) != DCAL_OK) {
        return -1;
    }
    world->tran.x = position[0] * units_per_mm;
    world->tran.y = position[1] * units_per_mm;
    world->tran.z = position[2] * units_per_mm;
    world->a = joint[3];
    world->b = joint[4];
    world->c = joint[5];
    world->u = joint[6];
    world->v = joint[7];
    world->w = joint[8];
    return 0;
}

int kinematicsInverse(const EmcPose *world, double *joint, const KINEMATICS_INVERSE_FLAGS *iflags,
                      KINEMATICS_FORWARD_FLAGS *fflags)
{
    double position[3];
    double joints[3];
    (void)iflags;
    (void)fflags;
    take_over();
    position[0] = world->tran.x / units_per_mm;
    position[1] = world->tran.y / units_per_mm;
    position[2] = world->tran.z / units_per_mm;
    if (dcal_robot_inverse_f64(&robot, position, joints, NULL) != DCAL_OK) {
        return -1;
    }
    joint[0] = joints[0] / DEGREE;
    joint[1] = joints[1] / DEGREE;
    joint[2] = joints[2] / DEGREE;
    joint[3] = world->a;
    joint[4] = world->b;
    joint[5] = world->c;
    joint[6] = world->u;
    joint[7] = world->v;
    joint[8] = world->w;
    return 0;
}

KINS_NOT_SWITCHABLE
EXPORT_SYMBOL(kinematicsType);
EXPORT_SYMBOL(kinematicsForward);
EXPORT_SYMBOL(kinematicsInverse);
