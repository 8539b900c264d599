/* Included once for each scalar: REAL, BITS, OF(name) and NAME are defined. */

static OF(dcal_robot) OF(nominal);
/* One at a time. */
static union {
    OF(dcal_ikm) ikm;
    OF(dcal_joint) joint;
    OF(dcal_gate) gate;
    OF(dcal_joint_gate) joint_gate;
    OF(dcal_fkm) fkm;
} OF(own);
static REAL OF(covariance)[576];

static void OF(write)(const char *label, const REAL *values, size_t count)
{
    platform_write("BITS " NAME " ");
    platform_write(label);
    platform_write(":");
    for (size_t index = 0; index < count; index++) {
        BITS bits;
        memcpy(&bits, &values[index], sizeof bits);
        write_bits(bits, 2 * (int)sizeof bits);
    }
    platform_write("\n");
}

static void OF(cost)(const char *what, unsigned long instructions)
{
    if (instructions > 0) {
        platform_write("COUNT " NAME " ");
        platform_write(what);
        platform_write(":");
        write_count(instructions);
        platform_write("\n");
    }
}

static OF(dcal_sample) OF(sample)(size_t index)
{
    OF(dcal_sample) sample;
    for (size_t axis = 0; axis < 3; axis++) {
        sample.joints[axis] = (REAL)samples[index][axis];
        sample.position[axis] = (REAL)samples[index][3 + axis];
    }
    return sample;
}

static OF(dcal_settings) OF(settings)(int with_tolerance)
{
    OF(dcal_settings) settings = {0};
    for (size_t axis = 0; axis < 3; axis++) {
        settings.position_noise[axis] = (REAL)noise[0];
    }
    settings.joint_noise = (REAL)noise[1];
    if (with_tolerance) {
        settings.length_tolerance = (REAL)tolerance[0];
        settings.angle_tolerance = (REAL)tolerance[1];
    }
    return settings;
}

static void OF(write_summary)(const OF(dcal_arm_summary) *summary)
{
    const REAL figures[4] = {
        summary->residual_rms,
        summary->estimated_noise,
        summary->degrees_of_freedom,
        summary->condition,
    };
    OF(write)("summary", figures, 4);
    OF(write)("prior share", summary->prior_share, 8);
    platform_write("BITS " NAME " counts:");
    write_count(summary->samples);
    write_count(summary->iterations);
    write_count((uint64_t)summary->has_covariance);
    write_count((uint64_t)summary->has_estimated_noise);
    platform_write("\n");
}

static void OF(write_robot)(const OF(dcal_robot) *robot)
{
    REAL parameters[24];
    OK(OF(dcal_robot_parameters)(robot, parameters));
    OF(write)("parameters", parameters, 24);
}

/* What a calibrator has found. */
#define WRITE_FOUND(family) \
    static void OF(write_##family)(const OF(dcal_##family) *calibrator) \
    { \
        OF(dcal_robot) robot; \
        REAL deviations[24]; \
        dcal_error error; \
        OK(OF(dcal_##family##_finish)(calibrator, &robot, sizeof robot, &error)); \
        OF(write_robot)(&robot); \
        OK(OF(dcal_##family##_deviations)(calibrator, deviations)); \
        OF(write)("deviations", deviations, 24); \
        OK(OF(dcal_##family##_covariance)(calibrator, OF(covariance))); \
        OF(write)("covariance", OF(covariance), 576); \
        for (int32_t arm = 0; arm < 3; arm++) { \
            OF(dcal_arm_summary) summary; \
            OK(OF(dcal_##family##_arm)(calibrator, arm, &summary)); \
            OF(write_summary)(&summary); \
        } \
    }

WRITE_FOUND(ikm)
WRITE_FOUND(joint)
WRITE_FOUND(gate)
WRITE_FOUND(joint_gate)
WRITE_FOUND(fkm)

static void OF(kinematics)(void)
{
    const REAL joints[3] = {(REAL)0.25, (REAL)-0.125, (REAL)0.5};
    REAL position[3];
    REAL back[3];
    dcal_error error;
    unsigned long start = platform_count();
    OK(OF(dcal_robot_forward)(&OF(nominal), joints, position, &error));
    OF(cost)("forward", platform_count() - start);
    start = platform_count();
    OK(OF(dcal_robot_inverse)(&OF(nominal), position, back, &error));
    OF(cost)("inverse", platform_count() - start);
    OF(write)("forward", position, 3);
    OF(write)("inverse", back, 3);

    position[2] = -2000;
    expect(OF(dcal_robot_inverse)(&OF(nominal), position, back, &error), DCAL_UNREACHABLE, "inverse");
    write_error(NAME " unreachable", &error);
}

/* The functions of a calibrator in C, its own here, and its place. */
#define SCALAR(name) OF(name)
#define C(name) SCALAR(FAMILY(dcal_, name))
#define OWN(name) SCALAR(FAMILY(own_, name))
#define PLACE (&OF(own).FAMILY(, ))

#define FAMILY(begin, end) begin##ikm##end
#include "fixture_positions.h"
#include "fixture_reset.h"
#undef FAMILY
#define FAMILY(begin, end) begin##joint##end
#include "fixture_positions.h"
#include "fixture_reset.h"
#undef FAMILY
#define FAMILY(begin, end) begin##gate##end
#include "fixture_gate.h"
#include "fixture_reset.h"
#undef FAMILY
#define FAMILY(begin, end) begin##joint_gate##end
#include "fixture_gate.h"
#include "fixture_reset.h"
#undef FAMILY

/* What of a sample is read. */
static OF(dcal_observation) OF(observation)(size_t index, uint32_t readings)
{
    const OF(dcal_sample) sample = OF(sample)(index);
    const OF(dcal_sample) other = OF(sample)((index + 1) % SAMPLES);
    OF(dcal_observation) observation = {0};
    memcpy(observation.joints, sample.joints, sizeof sample.joints);
    memcpy(observation.position, sample.position, sizeof sample.position);
    memcpy(observation.other_joints, other.joints, sizeof other.joints);
    observation.height = sample.position[2] + 560;
    observation.distance = (REAL)((readings & DCAL_READ_DISTANCE) != 0 ? distances[index] : apart[index]);
    observation.readings = readings;
    return observation;
}

static void OF(observe_with)(const OF(dcal_instruments) *instruments, const OF(dcal_settings) *settings,
    const uint32_t *readings, size_t count)
{
    dcal_error error;
    REAL place[4];
    REAL rotation[9];
    unsigned long solving = 0;
    unsigned long longest = 0;
    unsigned long begin;
    OF(dcal_robot) robot;
    dcal_status status;
    OK(OF(dcal_fkm_init)(&OF(own).fkm, sizeof OF(own).fkm, &OF(nominal), instruments, settings, &error));
    for (size_t index = 0; index < SAMPLES; index++) {
        const OF(dcal_observation) observation = OF(observation)(index, readings[index % count]);
        OK(OF(dcal_fkm_add)(&OF(own).fkm, &observation, &error));
    }
    OK(OF(dcal_fkm_solve)(&OF(own).fkm, &error));
    do {
        const unsigned long start = platform_count();
        status = OF(dcal_fkm_step)(&OF(own).fkm);
        const unsigned long spent = platform_count() - start;
        solving += spent;
        longest = spent > longest ? spent : longest;
    } while (status == DCAL_WORKING);
    expect(status, DCAL_OK, "fkm step");
    begin = platform_count();
    OK(OF(dcal_fkm_finish)(&OF(own).fkm, &robot, sizeof robot, &error));
    OF(cost)("fkm, finish", platform_count() - begin);
    OF(cost)("fkm, all steps", solving);
    OF(cost)("fkm, longest step", longest);
    OF(write_fkm)(&OF(own).fkm);
    if (instruments->plane_count > 0) {
        OK(OF(dcal_fkm_plane)(&OF(own).fkm, 0, place));
        OF(write)("plane", place, 3);
    }
    if (instruments->point_count > 0) {
        OK(OF(dcal_fkm_point)(&OF(own).fkm, 0, place));
        OF(write)("point", place, 4);
    }
    OK(OF(dcal_fkm_frame)(&OF(own).fkm, rotation, place));
    OF(write)("frame", rotation, 9);
    OF(write)("moved", place, 3);
}

/* Heights above a plane, x and z alone, distances from a point, in turn. */
static void OF(observe)(const OF(dcal_settings) *settings)
{
    const uint32_t readings[3] = {DCAL_READ_HEIGHT, DCAL_READ_X | DCAL_READ_Z, DCAL_READ_DISTANCE};
    OF(dcal_instruments) instruments = {0};
    instruments.plane_count = 1;
    instruments.point_count = 1;
    instruments.height_noise = settings->position_noise[0];
    instruments.distance_noise = settings->position_noise[0];
    OF(observe_with)(&instruments, settings, readings, 3);
}

/* In a sensor's frame: with a point that has an offset, and with a plane that is known. */
static void OF(observe_in_sensor)(const OF(dcal_settings) *settings)
{
    const uint32_t positions = DCAL_READ_X | DCAL_READ_Y | DCAL_READ_Z;
    const uint32_t of_point[3] = {positions, DCAL_READ_DISTANCE, DCAL_READ_DISTANCE_BETWEEN | DCAL_READ_Z};
    const uint32_t of_plane[2] = {positions, DCAL_READ_HEIGHT | DCAL_READ_Y};
    OF(dcal_instruments) instruments = {0};
    instruments.frame = DCAL_FRAME_SENSOR;
    instruments.height_noise = settings->position_noise[0];
    instruments.distance_noise = settings->position_noise[0];
    instruments.point_count = 1;
    instruments.points[0].has_offset = 1;
    OF(observe_with)(&instruments, settings, of_point, 3);
    instruments.point_count = 0;
    instruments.plane_count = 1;
    instruments.planes[0].known = -560;
    instruments.planes[0].sigma = 1;
    instruments.planes[0].level = (REAL)0.0078125;
    OF(observe_with)(&instruments, settings, of_plane, 2);
}

/* Positions in the robot's frame. */
static void OF(own_fkm_begin)(const OF(dcal_settings) *settings)
{
    const OF(dcal_instruments) instruments = {0};
    OK(OF(dcal_fkm_init)(&OF(own).fkm, sizeof OF(own).fkm, &OF(nominal), &instruments, settings, NULL));
}

static void OF(own_fkm_take)(const OF(dcal_sample) *sample)
{
    OF(dcal_observation) observation = {.readings = DCAL_READ_X | DCAL_READ_Y | DCAL_READ_Z};
    memcpy(observation.joints, sample->joints, sizeof sample->joints);
    memcpy(observation.position, sample->position, sizeof sample->position);
    OK(OF(dcal_fkm_add)(&OF(own).fkm, &observation, NULL));
}

#define FAMILY(begin, end) begin##fkm##end
#include "fixture_reset.h"
#undef FAMILY

/* What a part of the run takes of the stack, beside what it is called with. */
static void OF(stack_of)(const char *what, void (*part)(const OF(dcal_settings) *), const OF(dcal_settings) *settings)
{
    platform_paint_stack();
    part(settings);
    const unsigned long bytes = platform_stack();
    if (bytes > 0) {
        platform_write("STACK " NAME " ");
        platform_write(what);
        platform_write(":");
        write_count(bytes);
        platform_write("\n");
    }
}

static void OF(run)(void)
{
    OF(dcal_dimensions) dimensions = {194, 30, 260, 480, 0};
    const OF(dcal_settings) nothing = {0};
    const OF(dcal_settings) noise_alone = OF(settings)(0);
    const OF(dcal_settings) both = OF(settings)(1);
    dcal_error error;
    OK(OF(dcal_robot_from_dimensions)(&OF(nominal), sizeof OF(nominal), &dimensions, &error));
    OF(write_robot)(&OF(nominal));
    OF(kinematics)();
    OF(own_ikm_calibrated)(&nothing);
    OF(own_joint_calibrated)(&nothing);
    OF(own_joint_calibrated)(&both);
    OF(stack_of)("joint", OF(own_joint_calibrated), &noise_alone);
    OF(stack_of)("ikm", OF(own_ikm_calibrated), &noise_alone);
    OF(stack_of)("gate", OF(own_gate_gated), &both);
    OF(stack_of)("joint gate", OF(own_joint_gate_gated), &both);
    OF(stack_of)("fkm", OF(observe), &both);
    OF(observe_in_sensor)(&both);
    OF(own_gate_alarm)(&both);
    OF(own_gate_power_cut)(&both);
    OF(own_joint_gate_alarm)(&both);
    OF(own_joint_gate_power_cut)(&both);
    OF(own_ikm_reset)(&noise_alone);
    OF(own_joint_reset)(&noise_alone);
    OF(own_gate_reset)(&noise_alone);
    OF(own_joint_gate_reset)(&noise_alone);
    OF(own_fkm_reset)(&noise_alone);
}
