/** delta_cal.h: kinematic calibration of Delta parallel robots, for C99 and C++11.
 *
 * Made from the library's source; do not edit it. The manual is docs/c.md.
 *
 * Angles are in radians, lengths in any one unit that you choose. Names end in _f32 or _f64, the type of all numbers.
 *
 * Objects lie in memory that you provide: a variable of the object's type, wherever you like, static or on the stack.
 * Nothing is allocated, nothing is released, and an object holds no pointer, so that you may copy one by assignment.
 * Functions that make an object take its size (sizeof object) and refuse less than they need. An object is of this
 * version of the library: after an update of the firmware, make it anew from a snapshot.
 *
 * Every function but four returns DCAL_OK (0), DCAL_WORKING (1), or why nothing was done. A call that
 * fails writes nothing but its error. An argument `error` may be NULL. What every function can return beside the
 * errors that stand with it: DCAL_NULL_POINTER, DCAL_MISALIGNED, DCAL_WRONG_SIZE,
 * DCAL_NOT_INITIALIZED, DCAL_WRONG_KIND and DCAL_OVERLAP.
 *
 * What you promise: a pointer is NULL or leads to memory of its type, and nobody else uses that memory during the
 * call. Different objects may be used at the same time, from interrupts and threads too.
 */
#ifndef DELTA_CAL_H
#define DELTA_CAL_H

#include <stddef.h>
#include <stdint.h>

#if defined(__cplusplus)
#define DCAL_ASSERT(condition, text) static_assert(condition, text)
#define DCAL_ALIGNED alignas(8)
extern "C" {
#elif defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L
#define DCAL_ASSERT(condition, text) _Static_assert(condition, text)
#define DCAL_ALIGNED _Alignas(8)
#else
#define DCAL_ASSERT(condition, text) extern int dcal_asserted[(condition) ? 1 : -1]
#ifdef __GNUC__
#define DCAL_ALIGNED __attribute__((aligned(8)))
#else
#define DCAL_ALIGNED /* Align objects to 8 bytes yourself: DCAL_MISALIGNED says where they are not. */
#endif
#endif
#define DCAL_OBJECT(type, size) DCAL_ASSERT(sizeof(type) == size, "the size of an object")

/** The version of this header: major << 16 | minor << 8 | patch. */
#define DCAL_VERSION UINT32_C(256)

/** What a call came to. The numbers never change. */
typedef int32_t dcal_status;

enum {
    /** The call did what it says. */
    DCAL_OK = 0,
    /** The solver has more steps to do. */
    DCAL_WORKING = 1,
    /** A pointer is NULL. */
    DCAL_NULL_POINTER = 10,
    /** A pointer is not aligned as its type demands. */
    DCAL_MISALIGNED = 11,
    /** The stated size is smaller than the object. */
    DCAL_WRONG_SIZE = 12,
    /** The memory holds no object of this version of the library: it was never initialised, or overwritten. */
    DCAL_NOT_INITIALIZED = 13,
    /** The memory holds an object of another kind. */
    DCAL_WRONG_KIND = 14,
    /** Two objects overlap. */
    DCAL_OVERLAP = 15,
    /** There is no arm of this index: 0, 1 and 2 are the arms. */
    DCAL_NO_SUCH_ARM = 16,
    /** A number that chooses is none of those that the header names. */
    DCAL_NO_SUCH_CHOICE = 17,
    /** The calibrator is solving: step it to the end, or stop it, before its samples change. */
    DCAL_BUSY = 18,
    /** The noise of positions must be a finite number greater than 0. */
    DCAL_NOISE_OF_POSITION = 20,
    /** The noise of joint angles must be a finite number, 0 or greater. */
    DCAL_NOISE_OF_JOINT = 21,
    /** The noise of heights must be a finite number greater than 0. */
    DCAL_NOISE_OF_HEIGHT = 22,
    /** The noise of distances must be a finite number greater than 0. */
    DCAL_NOISE_OF_DISTANCE = 23,
    /** The tolerance of lengths must be a finite number greater than 0. */
    DCAL_TOLERANCE_OF_LENGTH = 24,
    /** The tolerance of angles must be a finite number greater than 0. */
    DCAL_TOLERANCE_OF_ANGLE = 25,
    /** The width of the gate must be a finite number greater than 0. */
    DCAL_WIDTH_OF_GATE = 26,
    /** The factor of forgetting must lie between 0 and 1, the mean age of samples be a finite number greater than 0. */
    DCAL_FORGETTING = 27,
    /** What is known of an instrument's place must be finite, and its sigma not negative. */
    DCAL_KNOWN_PLACE = 28,
    /** The tolerance of the joints' zeros must be a finite number greater than 0. */
    DCAL_TOLERANCE_OF_JOINT_ZERO = 29,
    /** A parameter of the geometry is not a finite number. */
    DCAL_GEOMETRY_NOT_FINITE = 30,
    /** The upper arm or the forearm is not longer than 0. */
    DCAL_GEOMETRY_NOT_POSITIVE = 31,
    /** The tilt alpha must lie within 90 degrees. */
    DCAL_GEOMETRY_TILT = 32,
    /** The azimuth theta must lie within 360 degrees. */
    DCAL_GEOMETRY_AZIMUTH = 33,
    /** The radius of base or platform is negative. */
    DCAL_GEOMETRY_RADIUS = 34,
    /** The arms have no common upward direction. */
    DCAL_GEOMETRY_NO_COMMON_UP = 35,
    /** A transmission is not nearly exact: gain and harmonics together must be below a tenth. */
    DCAL_GEOMETRY_TRANSMISSION = 36,
    /** The forearms do not meet at these joint angles, or an arm does not reach the position. */
    DCAL_UNREACHABLE = 40,
    /** Upper arm and forearm are in line: the edge of the workspace. */
    DCAL_SINGULAR_SERIAL = 41,
    /** The three forearms lie in one plane: the joints do not hold the platform. */
    DCAL_SINGULAR_PARALLEL = 42,
    /** A joint angle or coordinate is not finite. */
    DCAL_POSE_NOT_FINITE = 43,
    /** The position of the sample is not finite. */
    DCAL_SAMPLE_POSITION_NOT_FINITE = 50,
    /** The position of the sample is thousands of forearms away from the robot. */
    DCAL_SAMPLE_POSITION_TOO_FAR = 51,
    /** A joint angle of the sample is not finite. */
    DCAL_SAMPLE_JOINT_NOT_FINITE = 52,
    /** A joint angle of the sample is beyond two turns; joint angles are in radians. */
    DCAL_SAMPLE_JOINT_TOO_LARGE = 53,
    /** The two calibrators are of different robots or noises. */
    DCAL_DIFFERENT_NOMINAL = 54,
    /** The observation holds no reading. */
    DCAL_OBSERVATION_EMPTY = 60,
    /** A reading of the observation is not finite. */
    DCAL_OBSERVATION_NOT_FINITE = 61,
    /** A distance is not greater than 0. */
    DCAL_OBSERVATION_DISTANCE = 62,
    /** There is no plane of this index. */
    DCAL_NO_SUCH_PLANE = 63,
    /** There is no point of this index. */
    DCAL_NO_SUCH_POINT = 64,
    /** The distance is between two poses that the nominal robot has in the same place. */
    DCAL_OBSERVATION_SAME_PLACE = 65,
    /** The instruments have more unknowns than there is room for. */
    DCAL_TOO_MANY_UNKNOWNS = 66,
    /** There is no room for another observation. */
    DCAL_OBSERVATIONS_FULL = 67,
    /** There are fewer samples than needed. */
    DCAL_TOO_FEW_SAMPLES = 70,
    /** The poses do not determine the parameters. */
    DCAL_UNDETERMINED = 71,
    /** The noise leaves a parameter unknown. */
    DCAL_UNCERTAIN = 72,
    /** The iteration did not settle within its limit. */
    DCAL_NOT_CONVERGED = 73,
    /** The residuals are larger than the stated noise allows. */
    DCAL_RESIDUAL_CONTRADICTS_NOISE = 74,
    /** A parameter is farther from nominal than the tolerance makes credible. */
    DCAL_FAR_FROM_NOMINAL = 75,
    /** The solution is not the geometry of an arm. */
    DCAL_IMPOSSIBLE_GEOMETRY = 76,
    /** The solution's three arms are not a robot. */
    DCAL_IMPOSSIBLE_ROBOT = 77,
    /** The platform was measured above its elbows: the measuring frame is upside down or left-handed. */
    DCAL_WRONG_SIDE = 78,
    /** An instrument has fewer readings than its place has unknowns. */
    DCAL_TOO_FEW_OBSERVATIONS = 79,
    /** The poses do not determine where an instrument is. */
    DCAL_UNDETERMINED_INSTRUMENT = 80,
    /** The arithmetic overflowed. */
    DCAL_OVERFLOW = 81,
    /** The solver was asked for its result before its last step. */
    DCAL_UNFINISHED = 82,
    /** There is no covariance: the noise is not stated, and too few samples are left over to estimate it. */
    DCAL_NO_COVARIANCE = 83,
    /** The sample was not tested: there is no estimate to test it with. */
    DCAL_NO_ESTIMATE = 90,
    /** The sample was not tested: the noise is neither stated nor known. */
    DCAL_NO_NOISE = 91,
    /** The gate rejected a run of samples: the robot has changed, or its measuring frame. */
    DCAL_ROBOT_HAS_CHANGED = 92,
    /** The gate rejected a run of samples, and too few came before it to decide which are right. */
    DCAL_EARLY_SAMPLES = 93,
    /** The gate rejected so many of all samples that it is not known which are wrong. */
    DCAL_TOO_MANY_REJECTED = 94,
    /** The memory for the snapshot is shorter than the header states. */
    DCAL_SNAPSHOT_BUFFER = 100,
    /** The bytes are not a whole snapshot: cut off, damaged, or never written. */
    DCAL_SNAPSHOT_DAMAGED = 101,
    /** The snapshot is of another version of the library. */
    DCAL_SNAPSHOT_OTHER_VERSION = 102,
    /** The snapshot is of another kind of object, or of one in the other precision. */
    DCAL_SNAPSHOT_OTHER_KIND = 103,
    /** The snapshot is of another robot, of other settings, or belongs to a calibrator in another state. */
    DCAL_SNAPSHOT_OTHER_CALIBRATION = 104,
    /** A refusal that this version of the library has no number for. */
    DCAL_OTHER = 127
};

enum {
    /** Not an arm, in places that hold an arm's index. */
    DCAL_NO_ARM = -1,
    /** Not a parameter, in places that hold a parameter's index. */
    DCAL_NO_PARAMETER = -1,
    /** Index of Dx among the eight parameters of an arm: x of the point on the motor axis. Length. */
    DCAL_DX = 0,
    /** Index of Dy: y of that point. Length. */
    DCAL_DY = 1,
    /** Index of Dz: z of that point. Length. */
    DCAL_DZ = 2,
    /** Index of theta: azimuth of the arm plane about base z. Radians. */
    DCAL_THETA = 3,
    /** Index of alpha: tilt of the motor axis out of the base plane. Radians. */
    DCAL_ALPHA = 4,
    /** Index of La_x: upper arm at joint angle 0, radial component. Length. */
    DCAL_LA_X = 5,
    /** Index of La_y: upper arm at joint angle 0, upward component. Length. */
    DCAL_LA_Y = 6,
    /** Index of Lb: forearm. Length. */
    DCAL_LB = 7,
    /** Levenberg-Marquardt: each step damped until it reduces the sum of squares. */
    DCAL_LEVENBERG_MARQUARDT = 0,
    /** Gauss-Newton: always the full step. */
    DCAL_GAUSS_NEWTON = 1,
    /** The iteration starts from the nominal robot. */
    DCAL_START_NOMINAL = 0,
    /** The iteration starts without a guess; needs 12 samples. No number of a solver: exchanged, both are
     * refused. */
    DCAL_START_FREE = 2,
    /** The iteration stopped because no step could reduce the sum of squares any further. */
    DCAL_GRADIENT_VANISHED = 0,
    /** The iteration stopped because the last step was of the size of rounding errors. */
    DCAL_ROUNDING_REACHED = 1,
    /** The result comes from the nominal robot. */
    DCAL_USED_NOMINAL = 0,
    /** The result comes from the start without a guess. */
    DCAL_USED_FREE = 1,
    /** The result comes from the search beside an earlier solution. */
    DCAL_USED_SEARCH = 2,
    /** The sample agrees with the prediction and was taken in. */
    DCAL_TAKEN = 0,
    /** The sample could not be tested and was taken in. */
    DCAL_UNTESTED = 1,
    /** The sample disagrees with the prediction and was not taken in. */
    DCAL_REJECTED = 2,
    /** No alarm. */
    DCAL_NO_ALARM = 0,
    /** The robot or its measuring frame has changed. */
    DCAL_ROBOT_CHANGED = 1,
    /** The samples before the run, or the stated robot and tolerance, are wrong, or the robot has changed. */
    DCAL_EARLY_SAMPLES_WRONG = 2,
    /** No instrument. */
    DCAL_NO_INSTRUMENT = 0,
    /** The frame in which coordinates were measured. */
    DCAL_FRAME = 1,
    /** A plane that heights were measured above. */
    DCAL_PLANE = 2,
    /** A point that distances were measured from. */
    DCAL_POINT = 3,
    /** The gear and encoder of a joint. */
    DCAL_TRANSMISSION = 4,
    /** Coordinates are measured in the robot's own frame. */
    DCAL_FRAME_BASE = 0,
    /** Coordinates are measured in a frame that stands anywhere: six unknowns. */
    DCAL_FRAME_SENSOR = 1,
    /** Bit of an observation: x was measured. */
    DCAL_READ_X = 1,
    /** Bit of an observation: y was measured. */
    DCAL_READ_Y = 2,
    /** Bit of an observation: z was measured. */
    DCAL_READ_Z = 4,
    /** Bit of an observation: a height above a plane was measured. */
    DCAL_READ_HEIGHT = 8,
    /** Bit of an observation: a distance from a point was measured. */
    DCAL_READ_DISTANCE = 16,
    /** Bit of an observation: a distance from the platform's position at other joint angles was measured. */
    DCAL_READ_DISTANCE_BETWEEN = 32,
    /** Observations of a calibration from any readings at most. */
    DCAL_FKM_ROWS = 64,
    /** Planes of a calibration from any readings at most. */
    DCAL_PLANES = 4,
    /** Points of a calibration from any readings at most. */
    DCAL_POINTS = 4,
    /** Unknowns of the instruments at most: six of a frame, three of a plane, three of a point, one of its
     * offset. */
    DCAL_UNKNOWNS = 12
};

/** The kinds of object, for dcal_size. The numbers never change. */
enum {
    DCAL_ROBOT_F32 = 1025,
    DCAL_IKM_F32 = 1026,
    DCAL_IKM_OUTCOME_F32 = 1028,
    DCAL_JOINT_F32 = 1029,
    DCAL_JOINT_OUTCOME_F32 = 1031,
    DCAL_GATE_F32 = 1032,
    DCAL_FKM_F32 = 1033,
    DCAL_FKM_OUTCOME_F32 = 1034,
    DCAL_ROBOT_F64 = 2049,
    DCAL_IKM_F64 = 2050,
    DCAL_IKM_OUTCOME_F64 = 2052,
    DCAL_JOINT_F64 = 2053,
    DCAL_JOINT_OUTCOME_F64 = 2055,
    DCAL_GATE_F64 = 2056,
    DCAL_FKM_F64 = 2057,
    DCAL_FKM_OUTCOME_F64 = 2058
};

/** Why a call failed. Every function that takes a pointer to one accepts NULL. */
typedef struct dcal_error {
    /** How many samples or readings there are, or the linearisations spent; 0 where that says nothing. */
    uint64_t count;
    /** How many samples or readings are needed; 0 where that says nothing. */
    uint64_t needed;
    /** The status that the call returned. */
    dcal_status status;
    /** The arm at fault: 0, 1, 2, or DCAL_NO_ARM. */
    int32_t arm;
    /** The parameter at fault: DCAL_DX to DCAL_LB, or DCAL_NO_PARAMETER. */
    int32_t parameter;
    /** Why a solution is impossible (DCAL_GEOMETRY_...), otherwise DCAL_OK. */
    dcal_status cause;
    /** The instrument at fault: DCAL_NO_INSTRUMENT, DCAL_FRAME, DCAL_PLANE, DCAL_POINT or
     * DCAL_TRANSMISSION. */
    int32_t instrument;
    /** Index of the plane or point at fault. */
    uint32_t index;
    /** The figure of a refusal: condition number (undetermined), sigma in length or radians (uncertain),
     * ratio of the residuals to what the noise allows (residual contradicts noise), or tolerances (far
     * from nominal); otherwise 0. */
    float figure;
    /** 0. */
    uint32_t reserved;
} dcal_error;

/** The version of the library that is linked. Compare it with DCAL_VERSION, that of the header: before 1.0
 * both must agree in major and minor. */
uint32_t dcal_version(void);

/** How many bytes an object takes in this build of the library, its tag included; at most the size that
 * the header gives it. kind is one of DCAL_ROBOT_F32 and so on; 0 for a number that is no kind. */
size_t dcal_size(int32_t kind);

/** The alignment of every object, in bytes. */
size_t dcal_alignment(void);

/** A status in English, one sentence ended by a zero. The text lies in constant memory. Never NULL. */
const char *dcal_status_text(dcal_status status);

/* ---- Single precision ---- */

/** A robot: three arms of eight parameters. */
#define DCAL_ROBOT_F32_SIZE 384
typedef struct dcal_robot_f32 {
    DCAL_ALIGNED unsigned char memory[DCAL_ROBOT_F32_SIZE];
} dcal_robot_f32;
DCAL_OBJECT(dcal_robot_f32, DCAL_ROBOT_F32_SIZE);

/** The per-arm calibrator: samples and solver, each arm by itself. */
#define DCAL_IKM_F32_SIZE 5248
typedef struct dcal_ikm_f32 {
    DCAL_ALIGNED unsigned char memory[DCAL_IKM_F32_SIZE];
} dcal_ikm_f32;
DCAL_OBJECT(dcal_ikm_f32, DCAL_IKM_F32_SIZE);

/** A calibrated robot with the covariance of each arm. */
#define DCAL_IKM_OUTCOME_F32_SIZE 1728
typedef struct dcal_ikm_outcome_f32 {
    DCAL_ALIGNED unsigned char memory[DCAL_IKM_OUTCOME_F32_SIZE];
} dcal_ikm_outcome_f32;
DCAL_OBJECT(dcal_ikm_outcome_f32, DCAL_IKM_OUTCOME_F32_SIZE);

/** The joint calibrator: samples and solver, all 24 parameters together. */
#define DCAL_JOINT_F32_SIZE 11904
typedef struct dcal_joint_f32 {
    DCAL_ALIGNED unsigned char memory[DCAL_JOINT_F32_SIZE];
} dcal_joint_f32;
DCAL_OBJECT(dcal_joint_f32, DCAL_JOINT_F32_SIZE);

/** A calibrated robot with the covariance of all 24 parameters. */
#define DCAL_JOINT_OUTCOME_F32_SIZE 2944
typedef struct dcal_joint_outcome_f32 {
    DCAL_ALIGNED unsigned char memory[DCAL_JOINT_OUTCOME_F32_SIZE];
} dcal_joint_outcome_f32;
DCAL_OBJECT(dcal_joint_outcome_f32, DCAL_JOINT_OUTCOME_F32_SIZE);

/** The per-arm calibrator behind a gate, which tests each sample before it is taken in. */
#define DCAL_GATE_F32_SIZE 6528
typedef struct dcal_gate_f32 {
    DCAL_ALIGNED unsigned char memory[DCAL_GATE_F32_SIZE];
} dcal_gate_f32;
DCAL_OBJECT(dcal_gate_f32, DCAL_GATE_F32_SIZE);

/** The calibrator from any readings: up to DCAL_FKM_ROWS observations and solver. */
#define DCAL_FKM_F32_SIZE 26240
typedef struct dcal_fkm_f32 {
    DCAL_ALIGNED unsigned char memory[DCAL_FKM_F32_SIZE];
} dcal_fkm_f32;
DCAL_OBJECT(dcal_fkm_f32, DCAL_FKM_F32_SIZE);

/** A robot calibrated from any readings, and where the instruments are. */
#define DCAL_FKM_OUTCOME_F32_SIZE 3200
typedef struct dcal_fkm_outcome_f32 {
    DCAL_ALIGNED unsigned char memory[DCAL_FKM_OUTCOME_F32_SIZE];
} dcal_fkm_outcome_f32;
DCAL_OBJECT(dcal_fkm_outcome_f32, DCAL_FKM_OUTCOME_F32_SIZE);

/** The bytes of a snapshot. */
#define DCAL_IKM_SNAPSHOT_F32_SIZE 1316
#define DCAL_JOINT_SNAPSHOT_F32_SIZE 3462
#define DCAL_GATE_SNAPSHOT_F32_SIZE 2106

/** The robot as a data sheet gives it: three equal arms 120 degrees apart, no tilt. Lengths in any one
 * unit. */
typedef struct dcal_dimensions_f32 {
    /** From the base centre to the motor axes. Length. */
    float base_radius;
    /** From the platform point to the forearms' ends. Length. */
    float platform_radius;
    /** Upper arm. Length. */
    float upper_arm;
    /** Forearm. Length. */
    float forearm;
    /** Direction of the first arm; the others are 120 and 240 degrees further. Radians. */
    float azimuth;
} dcal_dimensions_f32;

/** One measurement: where the platform was at known joint angles. */
typedef struct dcal_sample_f32 {
    /** q1, q2, q3. Radians. */
    float joints[3];
    /** x, y, z. Length. */
    float position[3];
} dcal_sample_f32;

/** What a calibration assumes and how it is solved. All zeros are the defaults: noise and tolerance not
 * stated, Levenberg-Marquardt from the nominal robot. */
typedef struct dcal_settings_f32 {
    /** One sigma of the measured x, y and z; all four noises 0: not stated. Length. */
    float position_noise[3];
    /** One sigma of a joint angle. Radians. */
    float joint_noise;
    /** Manufacturing tolerance, one sigma of every length; both tolerances 0: not stated. Length. */
    float length_tolerance;
    /** Manufacturing tolerance, one sigma of theta and alpha. Radians. */
    float angle_tolerance;
    /** One sigma of each rotary joint's zero, where it is uncertain by more than the tolerance of lengths
     * says; 0: not stated. Radians. */
    float joint_zero_tolerance;
    /** DCAL_LEVENBERG_MARQUARDT or DCAL_GAUSS_NEWTON. */
    int32_t solver;
    /** DCAL_START_NOMINAL or DCAL_START_FREE. */
    int32_t start;
    /** Linearisations allowed for each start; 0: 50. */
    uint32_t iteration_limit;
    /** 0. */
    uint32_t reserved;
} dcal_settings_f32;

/** How well one arm is known. */
typedef struct dcal_arm_summary_f32 {
    /** Samples taken in. */
    uint64_t samples;
    /** Linearisations of all starts together. */
    uint32_t iterations;
    /** DCAL_GRADIENT_VANISHED or DCAL_ROUNDING_REACHED. */
    int32_t termination;
    /** Where the result comes from: DCAL_USED_NOMINAL and so on. */
    int32_t start;
    /** 1 if there is a covariance, 0 if the noise is not stated and too few samples are left over to
     * estimate it. */
    int32_t has_covariance;
    /** 1 if estimated_noise was estimated, 0 with a stated noise, or if no sample is left over. */
    int32_t has_estimated_noise;
    /** 0. */
    int32_t reserved;
    /** Root mean square of the residuals: in sigma with a stated noise, otherwise length. */
    float residual_rms;
    /** One sigma of a residual, 0 if not estimated. Length. */
    float estimated_noise;
    /** Samples less parameters, as far as the samples and not the tolerance determine them. */
    float degrees_of_freedom;
    /** Condition number of the weighted Jacobian, its columns scaled to unit length; 1 is best. */
    float condition;
    /** For each parameter the share of the result that the tolerance decided and not the samples, 0 to 1. */
    float prior_share[8];
} dcal_arm_summary_f32;

/** What became of a sample. */
typedef struct dcal_verdict_f32 {
    /** DCAL_TAKEN, DCAL_UNTESTED or DCAL_REJECTED. */
    int32_t verdict;
    /** Why it was not tested: DCAL_NO_ESTIMATE or DCAL_NO_NOISE; otherwise DCAL_OK. */
    dcal_status reason;
    /** The arm whose part of the sample is furthest off, 0, 1 or 2; DCAL_NO_ARM if not tested. */
    int32_t arm;
    /** 0. */
    int32_t reserved;
    /** By how much the sample is off along that arm's forearm. Length. */
    float distance;
    /** The same over its sigma, which contains that of the prediction. */
    float normalized;
} dcal_verdict_f32;

/** How many samples came to what, and what that means. */
typedef struct dcal_gate_counts_f32 {
    /** Samples taken in, untested ones included. */
    uint64_t taken;
    /** Of them, those that could not be tested. */
    uint64_t untested;
    /** Samples rejected. */
    uint64_t rejected;
    /** By each arm; a sample that several reject counts for each. */
    uint64_t rejected_by_arm[3];
    /** Rejected samples since the last that was taken. */
    uint64_t run;
    /** The longest such run. */
    uint64_t longest_run;
    /** What the first long run of rejections means: DCAL_NO_ALARM, DCAL_ROBOT_CHANGED or
     * DCAL_EARLY_SAMPLES_WRONG. */
    int32_t alarm;
    /** 1 while there is something to solve, which may be the gate's own estimate: call dcal_gate_step_f32
     * until it returns DCAL_OK. */
    int32_t solving;
    /** The first sample of that run, counted from 0 over all that came; 0 without an alarm. */
    uint64_t alarm_sample;
} dcal_gate_counts_f32;

/** What was measured at one set of joint angles: any of the coordinates, a height, a distance. */
typedef struct dcal_observation_f32 {
    /** q1, q2, q3. Radians. */
    float joints[3];
    /** x, y, z, as far as they were measured. Length. */
    float position[3];
    /** Height of the platform point above a plane, along the plane's upward normal. Length. */
    float height;
    /** Distance of the platform point from a point, or from where it is at other_joints. Length. */
    float distance;
    /** The joint angles at the other end of a distance. Radians. */
    float other_joints[3];
    /** Which plane the height is above, from 0 on. */
    uint32_t plane;
    /** Which point the distance is from, from 0 on. */
    uint32_t point;
    /** What was measured: bits DCAL_READ_..., at most one of the two kinds of distance. */
    uint32_t readings;
    /** 0. */
    uint32_t reserved;
} dcal_observation_f32;

/** A plane z = c + a x + b y, whose c, a and b are unknown. */
typedef struct dcal_plane_f32 {
    /** What is known of c. Length. */
    float known;
    /** One sigma of that; 0: nothing is known. Length. */
    float sigma;
    /** One sigma of the slopes a and b of a plane that is nearly level; 0: nothing is known. No unit. */
    float level;
} dcal_plane_f32;

/** A fixed point, whose place is unknown. */
typedef struct dcal_point_f32 {
    /** What is known of the place: x, y, z. Length. */
    float known[3];
    /** One sigma of each coordinate; 0: nothing is known. Length. */
    float sigma;
    /** 1 if the sensor there reads a constant too much that is unknown, too; otherwise 0. */
    uint32_t has_offset;
    /** 0. */
    uint32_t reserved;
} dcal_point_f32;

/** What the readings refer to. All zeros: coordinates in the robot's own frame, no plane, no point. */
typedef struct dcal_instruments_f32 {
    /** DCAL_FRAME_BASE or DCAL_FRAME_SENSOR. */
    int32_t frame;
    /** How many planes there are. */
    uint32_t plane_count;
    /** How many points there are. */
    uint32_t point_count;
    /** 0. */
    uint32_t reserved;
    /** One sigma of a height; 0 where none is measured. Length. */
    float height_noise;
    /** One sigma of a distance; 0 where none is measured. Length. */
    float distance_noise;
    /** The planes that heights are measured above. */
    dcal_plane_f32 planes[DCAL_PLANES];
    /** The points that distances are measured from. */
    dcal_point_f32 points[DCAL_POINTS];
} dcal_instruments_f32;

/** Makes a robot from its dimensions, in size bytes of memory: write sizeof *robot.
 *
 * Errors: DCAL_GEOMETRY_.... */
dcal_status dcal_robot_from_dimensions_f32(
    dcal_robot_f32 *robot,
    size_t size,
    const dcal_dimensions_f32 *dimensions,
    dcal_error *error);

/** Makes a robot from its 24 parameters, in size bytes of memory: write sizeof *robot. Eight parameters an
 * arm, in the order DCAL_DX to DCAL_LB: lengths, and theta and alpha in radians.
 *
 * Errors: DCAL_GEOMETRY_.... */
dcal_status dcal_robot_from_parameters_f32(
    dcal_robot_f32 *robot,
    size_t size,
    const float parameters[24],
    dcal_error *error);

/** Writes a robot's 24 parameters, as dcal_robot_from_parameters_f32 takes them: lengths and radians. */
dcal_status dcal_robot_parameters_f32(const dcal_robot_f32 *robot, float parameters[24]);

/** Gives a robot the transmissions of its joints, which its kinematics and every calibration with it as
 * the nominal robot then use. Five numbers a joint: gain (no unit), c1, s1, c2 and s2 (radians). The
 * angle of the arm is q + gain q + c1 cos q + s1 sin q + c2 cos 2q + s2 sin 2q at the joint angle q.
 * Zeros take them away.
 *
 * Errors: DCAL_GEOMETRY_TRANSMISSION; the robot then keeps those that it had. */
dcal_status dcal_robot_set_transmissions_f32(
    dcal_robot_f32 *robot,
    const float transmissions[15],
    dcal_error *error);

/** Writes a robot's transmissions, as dcal_robot_set_transmissions_f32 takes them. */
dcal_status dcal_robot_transmissions_f32(const dcal_robot_f32 *robot, float transmissions[15]);

/** Forward kinematics: where the platform is at these joint angles. joints: q1, q2, q3, radians. position:
 * x, y, z, in the robot's unit of length.
 *
 * Errors: DCAL_UNREACHABLE, DCAL_SINGULAR_PARALLEL, DCAL_POSE_NOT_FINITE, each with the arm. */
dcal_status dcal_robot_forward_f32(
    const dcal_robot_f32 *robot,
    const float joints[3],
    float position[3],
    dcal_error *error);

/** Inverse kinematics, elbows out: the joint angles at which the platform is at a position. position: x,
 * y, z, in the robot's unit of length. joints: q1, q2, q3, radians.
 *
 * Errors: DCAL_UNREACHABLE, DCAL_SINGULAR_SERIAL, DCAL_POSE_NOT_FINITE, each with the arm. */
dcal_status dcal_robot_inverse_f32(
    const dcal_robot_f32 *robot,
    const float position[3],
    float joints[3],
    dcal_error *error);

/** Writes the covariance of all 24 parameters, eight an arm, row by row: length^2, length radian,
 * radian^2.
 *
 * Errors: DCAL_NO_COVARIANCE. */
dcal_status dcal_joint_outcome_covariance_f32(const dcal_joint_outcome_f32 *outcome, float covariance[576]);

/** Makes a calibrator without samples, in size bytes of memory: write sizeof *calibrator. robot is the
 * robot before calibration, the nominal of the tolerance and the start of the iteration; it is copied.
 *
 * Errors: DCAL_NOISE_..., DCAL_TOLERANCE_..., DCAL_NO_SUCH_CHOICE. */
dcal_status dcal_ikm_init_f32(
    dcal_ikm_f32 *calibrator,
    size_t size,
    const dcal_robot_f32 *robot,
    const dcal_settings_f32 *settings,
    dcal_error *error);

/** Adds one sample; memory and time are the same for any number of samples. The result of the last
 * dcal_ikm_solve_f32 is dropped.
 *
 * Errors: DCAL_BUSY, and DCAL_SAMPLE_... with the arm; nothing is added. */
dcal_status dcal_ikm_add_f32(dcal_ikm_f32 *calibrator, const dcal_sample_f32 *sample, dcal_error *error);

/** Works in the samples that still wait: the calibrator works in several at once. dcal_ikm_solve_f32 does
 * it as well; call this one turn of the control loop earlier if that call takes too long. The result has
 * the same bits. */
dcal_status dcal_ikm_flush_f32(dcal_ikm_f32 *calibrator);

/** Adds all samples of another calibrator of the same robot and noise.
 *
 * Errors: DCAL_BUSY, DCAL_DIFFERENT_NOMINAL; nothing is added. */
dcal_status dcal_ikm_merge_f32(dcal_ikm_f32 *calibrator, const dcal_ikm_f32 *other);

/** Multiplies the weight of all samples so far by lambda, 0 to 1.
 *
 * Errors: DCAL_BUSY, DCAL_FORGETTING. */
dcal_status dcal_ikm_forget_f32(dcal_ikm_f32 *calibrator, float lambda);

/** Writes the number of samples. */
dcal_status dcal_ikm_samples_f32(const dcal_ikm_f32 *calibrator, uint64_t *samples);

/** Begins to solve. Until the last dcal_ikm_step_f32, or dcal_ikm_stop_f32, every call that would change
 * the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_ikm_finish_f32 that are known already, as DCAL_TOO_FEW_SAMPLES, with the arm, how
 * many there are and how many are needed. */
dcal_status dcal_ikm_solve_f32(dcal_ikm_f32 *calibrator, dcal_error *error);

/** One short step, to be called between the turns of a control loop. Returns DCAL_WORKING as long as there
 * is more to do, and then DCAL_OK: dcal_ikm_finish_f32 has the outcome, or why there is none. */
dcal_status dcal_ikm_step_f32(dcal_ikm_f32 *calibrator);

/** Gives up what dcal_ikm_solve_f32 has begun. The samples stay. */
dcal_status dcal_ikm_stop_f32(dcal_ikm_f32 *calibrator);

/** Drops all samples and what was solved from them: as after dcal_ikm_init_f32. */
dcal_status dcal_ikm_reset_f32(dcal_ikm_f32 *calibrator);

/** The calibrated robot, in size bytes of memory: write sizeof *outcome.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to
 * DCAL_OVERFLOW), with arm and cause; the robot keeps its parameters. */
dcal_status dcal_ikm_finish_f32(
    const dcal_ikm_f32 *calibrator,
    dcal_ikm_outcome_f32 *outcome,
    size_t size,
    dcal_error *error);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length is how many were written. They are the same on every target. Store
 * them where they outlast a power cut, and give them to dcal_ikm_restore_f32.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. The gate: DCAL_BUSY. */
dcal_status dcal_ikm_snapshot_f32(
    const dcal_ikm_f32 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must be of the same robot and noise. It
 * goes on to the same bits as the one that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_ikm_restore_f32(dcal_ikm_f32 *calibrator, const uint8_t *bytes, size_t length);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. */
dcal_status dcal_ikm_outcome_robot_f32(
    const dcal_ikm_outcome_f32 *outcome,
    dcal_robot_f32 *robot,
    size_t size);

/** Writes how well an arm is known; arm is 0, 1 or 2. Solved together, residual and noise are the whole
 * robot's.
 *
 * Errors: DCAL_NO_SUCH_ARM. */
dcal_status dcal_ikm_outcome_arm_f32(
    const dcal_ikm_outcome_f32 *outcome,
    int32_t arm,
    dcal_arm_summary_f32 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight an arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE. */
dcal_status dcal_ikm_outcome_deviations_f32(const dcal_ikm_outcome_f32 *outcome, float sigma[24]);

/** Writes the covariance of an arm's eight parameters, row by row: length^2, length radian, radian^2. arm
 * is 0, 1 or 2.
 *
 * Errors: DCAL_NO_SUCH_ARM, DCAL_NO_COVARIANCE. */
dcal_status dcal_ikm_outcome_arm_covariance_f32(
    const dcal_ikm_outcome_f32 *outcome,
    int32_t arm,
    float covariance[64]);

/** Makes a calibrator without samples, in size bytes of memory: write sizeof *calibrator. robot is the
 * robot before calibration, the nominal of the tolerance and the start of the iteration; it is copied.
 *
 * Errors: DCAL_NOISE_..., DCAL_TOLERANCE_..., DCAL_NO_SUCH_CHOICE. */
dcal_status dcal_joint_init_f32(
    dcal_joint_f32 *calibrator,
    size_t size,
    const dcal_robot_f32 *robot,
    const dcal_settings_f32 *settings,
    dcal_error *error);

/** Adds one sample; memory and time are the same for any number of samples. The result of the last
 * dcal_joint_solve_f32 is dropped.
 *
 * Errors: DCAL_BUSY, and DCAL_SAMPLE_... with the arm; nothing is added. */
dcal_status dcal_joint_add_f32(dcal_joint_f32 *calibrator, const dcal_sample_f32 *sample, dcal_error *error);

/** Works in the samples that still wait: the calibrator works in several at once. dcal_joint_solve_f32
 * does it as well; call this one turn of the control loop earlier if that call takes too long. The result
 * has the same bits. */
dcal_status dcal_joint_flush_f32(dcal_joint_f32 *calibrator);

/** Adds all samples of another calibrator of the same robot and noise.
 *
 * Errors: DCAL_BUSY, DCAL_DIFFERENT_NOMINAL; nothing is added. */
dcal_status dcal_joint_merge_f32(dcal_joint_f32 *calibrator, const dcal_joint_f32 *other);

/** Multiplies the weight of all samples so far by lambda, 0 to 1.
 *
 * Errors: DCAL_BUSY, DCAL_FORGETTING. */
dcal_status dcal_joint_forget_f32(dcal_joint_f32 *calibrator, float lambda);

/** Writes the number of samples. */
dcal_status dcal_joint_samples_f32(const dcal_joint_f32 *calibrator, uint64_t *samples);

/** Begins to solve. Until the last dcal_joint_step_f32, or dcal_joint_stop_f32, every call that would
 * change the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_joint_finish_f32 that are known already, as DCAL_TOO_FEW_SAMPLES, with the arm,
 * how many there are and how many are needed. */
dcal_status dcal_joint_solve_f32(dcal_joint_f32 *calibrator, dcal_error *error);

/** One short step, to be called between the turns of a control loop. Returns DCAL_WORKING as long as there
 * is more to do, and then DCAL_OK: dcal_joint_finish_f32 has the outcome, or why there is none. */
dcal_status dcal_joint_step_f32(dcal_joint_f32 *calibrator);

/** Gives up what dcal_joint_solve_f32 has begun. The samples stay. */
dcal_status dcal_joint_stop_f32(dcal_joint_f32 *calibrator);

/** Drops all samples and what was solved from them: as after dcal_joint_init_f32. */
dcal_status dcal_joint_reset_f32(dcal_joint_f32 *calibrator);

/** The calibrated robot, in size bytes of memory: write sizeof *outcome.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to
 * DCAL_OVERFLOW), with arm and cause; the robot keeps its parameters. */
dcal_status dcal_joint_finish_f32(
    const dcal_joint_f32 *calibrator,
    dcal_joint_outcome_f32 *outcome,
    size_t size,
    dcal_error *error);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length is how many were written. They are the same on every target. Store
 * them where they outlast a power cut, and give them to dcal_joint_restore_f32.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. The gate: DCAL_BUSY. */
dcal_status dcal_joint_snapshot_f32(
    const dcal_joint_f32 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must be of the same robot and noise. It
 * goes on to the same bits as the one that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_joint_restore_f32(dcal_joint_f32 *calibrator, const uint8_t *bytes, size_t length);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. */
dcal_status dcal_joint_outcome_robot_f32(
    const dcal_joint_outcome_f32 *outcome,
    dcal_robot_f32 *robot,
    size_t size);

/** Writes how well an arm is known; arm is 0, 1 or 2. Solved together, residual and noise are the whole
 * robot's.
 *
 * Errors: DCAL_NO_SUCH_ARM. */
dcal_status dcal_joint_outcome_arm_f32(
    const dcal_joint_outcome_f32 *outcome,
    int32_t arm,
    dcal_arm_summary_f32 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight an arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE. */
dcal_status dcal_joint_outcome_deviations_f32(const dcal_joint_outcome_f32 *outcome, float sigma[24]);

/** Writes the covariance of an arm's eight parameters, row by row: length^2, length radian, radian^2. arm
 * is 0, 1 or 2.
 *
 * Errors: DCAL_NO_SUCH_ARM, DCAL_NO_COVARIANCE. */
dcal_status dcal_joint_outcome_arm_covariance_f32(
    const dcal_joint_outcome_f32 *outcome,
    int32_t arm,
    float covariance[64]);

/** Makes a calibrator with a gate, without samples, in size bytes of memory: write sizeof *calibrator.
 * sigmas is the gate's width; 0 for the width that rejects three good samples in a million for each arm.
 * age is the mean age of the samples that count, for a robot that changes slowly; 0 if all count alike.
 * With a stated noise and tolerance the gate tests from the first sample on, otherwise from its first
 * estimate on.
 *
 * Errors: DCAL_NOISE_..., DCAL_TOLERANCE_..., DCAL_NO_SUCH_CHOICE, DCAL_WIDTH_OF_GATE, DCAL_FORGETTING. */
dcal_status dcal_gate_init_f32(
    dcal_gate_f32 *calibrator,
    size_t size,
    const dcal_robot_f32 *robot,
    const dcal_settings_f32 *settings,
    float sigmas,
    float age,
    dcal_error *error);

/** Tests one sample, and takes it in unless it disagrees. A sample that is rejected is no error: verdict
 * says so. Where the gate then wants an estimate of its own, call dcal_gate_step_f32 until it returns
 * DCAL_OK, before the next sample.
 *
 * Errors: DCAL_BUSY, and DCAL_SAMPLE_... with the arm; nothing has changed. */
dcal_status dcal_gate_add_f32(
    dcal_gate_f32 *calibrator,
    const dcal_sample_f32 *sample,
    dcal_verdict_f32 *verdict,
    dcal_error *error);

/** Writes how many samples came to what, and whether there is an alarm. */
dcal_status dcal_gate_state_f32(const dcal_gate_f32 *calibrator, dcal_gate_counts_f32 *counts);

/** Answers the alarm: the run of rejected samples was wrong, and what was taken in before stays. If the
 * robot has changed, call dcal_gate_reset_f32. */
dcal_status dcal_gate_acknowledge_f32(dcal_gate_f32 *calibrator);

/** Writes the number of samples. */
dcal_status dcal_gate_samples_f32(const dcal_gate_f32 *calibrator, uint64_t *samples);

/** Begins to solve. Until the last dcal_gate_step_f32, or dcal_gate_stop_f32, every call that would change
 * the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_gate_finish_f32 that are known already, as DCAL_TOO_FEW_SAMPLES, with the arm,
 * how many there are and how many are needed. */
dcal_status dcal_gate_solve_f32(dcal_gate_f32 *calibrator, dcal_error *error);

/** One short step, to be called between the turns of a control loop. Returns DCAL_WORKING as long as there
 * is more to do, and then DCAL_OK: dcal_gate_finish_f32 has the outcome, or why there is none. */
dcal_status dcal_gate_step_f32(dcal_gate_f32 *calibrator);

/** Gives up what dcal_gate_solve_f32 has begun. The samples stay. */
dcal_status dcal_gate_stop_f32(dcal_gate_f32 *calibrator);

/** Drops all samples and what was solved from them: as after dcal_gate_init_f32. */
dcal_status dcal_gate_reset_f32(dcal_gate_f32 *calibrator);

/** The calibrated robot, in size bytes of memory: write sizeof *outcome.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to
 * DCAL_OVERFLOW), with arm and cause; the robot keeps its parameters. */
dcal_status dcal_gate_finish_f32(
    const dcal_gate_f32 *calibrator,
    dcal_ikm_outcome_f32 *outcome,
    size_t size,
    dcal_error *error);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length is how many were written. They are the same on every target. Store
 * them where they outlast a power cut, and give them to dcal_gate_restore_f32.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. The gate: DCAL_BUSY. */
dcal_status dcal_gate_snapshot_f32(
    const dcal_gate_f32 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must be of the same robot and noise. It
 * goes on to the same bits as the one that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_gate_restore_f32(dcal_gate_f32 *calibrator, const uint8_t *bytes, size_t length);

/** Makes a calibrator without observations, in size bytes of memory: write sizeof *calibrator. robot is
 * the robot before calibration. settings must state the noise of positions and joint angles, and a
 * tolerance unless x, y and z are measured often enough; instruments states the noise of heights and
 * distances.
 *
 * Errors: DCAL_NOISE_..., DCAL_TOLERANCE_..., DCAL_NO_SUCH_CHOICE, DCAL_KNOWN_PLACE,
 * DCAL_TOO_MANY_UNKNOWNS. */
dcal_status dcal_fkm_init_f32(
    dcal_fkm_f32 *calibrator,
    size_t size,
    const dcal_robot_f32 *robot,
    const dcal_instruments_f32 *instruments,
    const dcal_settings_f32 *settings,
    dcal_error *error);

/** Takes in one observation, of DCAL_FKM_ROWS at most.
 *
 * Errors: DCAL_OBSERVATION_..., DCAL_SAMPLE_JOINT_..., DCAL_NO_SUCH_PLANE and ..._POINT, DCAL_NOISE_...
 * of a height or distance where it is not stated, DCAL_NO_SUCH_CHOICE, DCAL_BUSY; nothing is taken in. */
dcal_status dcal_fkm_add_f32(
    dcal_fkm_f32 *calibrator,
    const dcal_observation_f32 *observation,
    dcal_error *error);

/** Makes the outcome of the robot's 24 parameters alone, in size bytes of memory: write sizeof *joint. Its
 * covariance takes the unknowns of the instruments into account. */
dcal_status dcal_fkm_outcome_joint_f32(
    const dcal_fkm_outcome_f32 *outcome,
    dcal_joint_outcome_f32 *joint,
    size_t size);

/** Writes where a plane z = c + a x + b y lies: c (length), a, b.
 *
 * Errors: DCAL_NO_SUCH_PLANE. */
dcal_status dcal_fkm_outcome_plane_f32(
    const dcal_fkm_outcome_f32 *outcome,
    uint32_t plane,
    float coefficients[3]);

/** Writes where a point is, and what the sensor there reads too much: x, y, z, offset. Length.
 *
 * Errors: DCAL_NO_SUCH_POINT. */
dcal_status dcal_fkm_outcome_point_f32(const dcal_fkm_outcome_f32 *outcome, uint32_t point, float place[4]);

/** Writes the frame in which coordinates were measured, from the robot's frame to it: the rotation row by
 * row, and the translation (length). The identity for DCAL_FRAME_BASE. */
dcal_status dcal_fkm_outcome_frame_f32(
    const dcal_fkm_outcome_f32 *outcome,
    float rotation[9],
    float translation[3]);

/** Writes the number of samples. */
dcal_status dcal_fkm_samples_f32(const dcal_fkm_f32 *calibrator, uint64_t *samples);

/** Begins to solve. Until the last dcal_fkm_step_f32, or dcal_fkm_stop_f32, every call that would change
 * the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_fkm_finish_f32 that are known already, as DCAL_TOO_FEW_SAMPLES, with the arm, how
 * many there are and how many are needed. */
dcal_status dcal_fkm_solve_f32(dcal_fkm_f32 *calibrator, dcal_error *error);

/** One short step, to be called between the turns of a control loop. Returns DCAL_WORKING as long as there
 * is more to do, and then DCAL_OK: dcal_fkm_finish_f32 has the outcome, or why there is none. */
dcal_status dcal_fkm_step_f32(dcal_fkm_f32 *calibrator);

/** Gives up what dcal_fkm_solve_f32 has begun. The samples stay. */
dcal_status dcal_fkm_stop_f32(dcal_fkm_f32 *calibrator);

/** Drops all samples and what was solved from them: as after dcal_fkm_init_f32. */
dcal_status dcal_fkm_reset_f32(dcal_fkm_f32 *calibrator);

/** The calibrated robot, in size bytes of memory: write sizeof *outcome.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to
 * DCAL_OVERFLOW), with arm and cause; the robot keeps its parameters. */
dcal_status dcal_fkm_finish_f32(
    const dcal_fkm_f32 *calibrator,
    dcal_fkm_outcome_f32 *outcome,
    size_t size,
    dcal_error *error);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. */
dcal_status dcal_fkm_outcome_robot_f32(
    const dcal_fkm_outcome_f32 *outcome,
    dcal_robot_f32 *robot,
    size_t size);

/** Writes how well an arm is known; arm is 0, 1 or 2. Solved together, residual and noise are the whole
 * robot's.
 *
 * Errors: DCAL_NO_SUCH_ARM. */
dcal_status dcal_fkm_outcome_arm_f32(
    const dcal_fkm_outcome_f32 *outcome,
    int32_t arm,
    dcal_arm_summary_f32 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight an arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE. */
dcal_status dcal_fkm_outcome_deviations_f32(const dcal_fkm_outcome_f32 *outcome, float sigma[24]);

/** Writes the covariance of an arm's eight parameters, row by row: length^2, length radian, radian^2. arm
 * is 0, 1 or 2.
 *
 * Errors: DCAL_NO_SUCH_ARM, DCAL_NO_COVARIANCE. */
dcal_status dcal_fkm_outcome_arm_covariance_f32(
    const dcal_fkm_outcome_f32 *outcome,
    int32_t arm,
    float covariance[64]);

/* ---- Double precision ---- */

/** A robot: three arms of eight parameters. */
#define DCAL_ROBOT_F64_SIZE 752
typedef struct dcal_robot_f64 {
    DCAL_ALIGNED unsigned char memory[DCAL_ROBOT_F64_SIZE];
} dcal_robot_f64;
DCAL_OBJECT(dcal_robot_f64, DCAL_ROBOT_F64_SIZE);

/** The per-arm calibrator: samples and solver, each arm by itself. */
#define DCAL_IKM_F64_SIZE 10176
typedef struct dcal_ikm_f64 {
    DCAL_ALIGNED unsigned char memory[DCAL_IKM_F64_SIZE];
} dcal_ikm_f64;
DCAL_OBJECT(dcal_ikm_f64, DCAL_IKM_F64_SIZE);

/** A calibrated robot with the covariance of each arm. */
#define DCAL_IKM_OUTCOME_F64_SIZE 3392
typedef struct dcal_ikm_outcome_f64 {
    DCAL_ALIGNED unsigned char memory[DCAL_IKM_OUTCOME_F64_SIZE];
} dcal_ikm_outcome_f64;
DCAL_OBJECT(dcal_ikm_outcome_f64, DCAL_IKM_OUTCOME_F64_SIZE);

/** The joint calibrator: samples and solver, all 24 parameters together. */
#define DCAL_JOINT_F64_SIZE 23680
typedef struct dcal_joint_f64 {
    DCAL_ALIGNED unsigned char memory[DCAL_JOINT_F64_SIZE];
} dcal_joint_f64;
DCAL_OBJECT(dcal_joint_f64, DCAL_JOINT_F64_SIZE);

/** A calibrated robot with the covariance of all 24 parameters. */
#define DCAL_JOINT_OUTCOME_F64_SIZE 5824
typedef struct dcal_joint_outcome_f64 {
    DCAL_ALIGNED unsigned char memory[DCAL_JOINT_OUTCOME_F64_SIZE];
} dcal_joint_outcome_f64;
DCAL_OBJECT(dcal_joint_outcome_f64, DCAL_JOINT_OUTCOME_F64_SIZE);

/** The per-arm calibrator behind a gate, which tests each sample before it is taken in. */
#define DCAL_GATE_F64_SIZE 12544
typedef struct dcal_gate_f64 {
    DCAL_ALIGNED unsigned char memory[DCAL_GATE_F64_SIZE];
} dcal_gate_f64;
DCAL_OBJECT(dcal_gate_f64, DCAL_GATE_F64_SIZE);

/** The calibrator from any readings: up to DCAL_FKM_ROWS observations and solver. */
#define DCAL_FKM_F64_SIZE 52352
typedef struct dcal_fkm_f64 {
    DCAL_ALIGNED unsigned char memory[DCAL_FKM_F64_SIZE];
} dcal_fkm_f64;
DCAL_OBJECT(dcal_fkm_f64, DCAL_FKM_F64_SIZE);

/** A robot calibrated from any readings, and where the instruments are. */
#define DCAL_FKM_OUTCOME_F64_SIZE 6272
typedef struct dcal_fkm_outcome_f64 {
    DCAL_ALIGNED unsigned char memory[DCAL_FKM_OUTCOME_F64_SIZE];
} dcal_fkm_outcome_f64;
DCAL_OBJECT(dcal_fkm_outcome_f64, DCAL_FKM_OUTCOME_F64_SIZE);

/** The bytes of a snapshot. */
#define DCAL_IKM_SNAPSHOT_F64_SIZE 2564
#define DCAL_JOINT_SNAPSHOT_F64_SIZE 6890
#define DCAL_GATE_SNAPSHOT_F64_SIZE 4014

/** The robot as a data sheet gives it: three equal arms 120 degrees apart, no tilt. Lengths in any one
 * unit. */
typedef struct dcal_dimensions_f64 {
    /** From the base centre to the motor axes. Length. */
    double base_radius;
    /** From the platform point to the forearms' ends. Length. */
    double platform_radius;
    /** Upper arm. Length. */
    double upper_arm;
    /** Forearm. Length. */
    double forearm;
    /** Direction of the first arm; the others are 120 and 240 degrees further. Radians. */
    double azimuth;
} dcal_dimensions_f64;

/** One measurement: where the platform was at known joint angles. */
typedef struct dcal_sample_f64 {
    /** q1, q2, q3. Radians. */
    double joints[3];
    /** x, y, z. Length. */
    double position[3];
} dcal_sample_f64;

/** What a calibration assumes and how it is solved. All zeros are the defaults: noise and tolerance not
 * stated, Levenberg-Marquardt from the nominal robot. */
typedef struct dcal_settings_f64 {
    /** One sigma of the measured x, y and z; all four noises 0: not stated. Length. */
    double position_noise[3];
    /** One sigma of a joint angle. Radians. */
    double joint_noise;
    /** Manufacturing tolerance, one sigma of every length; both tolerances 0: not stated. Length. */
    double length_tolerance;
    /** Manufacturing tolerance, one sigma of theta and alpha. Radians. */
    double angle_tolerance;
    /** One sigma of each rotary joint's zero, where it is uncertain by more than the tolerance of lengths
     * says; 0: not stated. Radians. */
    double joint_zero_tolerance;
    /** DCAL_LEVENBERG_MARQUARDT or DCAL_GAUSS_NEWTON. */
    int32_t solver;
    /** DCAL_START_NOMINAL or DCAL_START_FREE. */
    int32_t start;
    /** Linearisations allowed for each start; 0: 50. */
    uint32_t iteration_limit;
    /** 0. */
    uint32_t reserved;
} dcal_settings_f64;

/** How well one arm is known. */
typedef struct dcal_arm_summary_f64 {
    /** Samples taken in. */
    uint64_t samples;
    /** Linearisations of all starts together. */
    uint32_t iterations;
    /** DCAL_GRADIENT_VANISHED or DCAL_ROUNDING_REACHED. */
    int32_t termination;
    /** Where the result comes from: DCAL_USED_NOMINAL and so on. */
    int32_t start;
    /** 1 if there is a covariance, 0 if the noise is not stated and too few samples are left over to
     * estimate it. */
    int32_t has_covariance;
    /** 1 if estimated_noise was estimated, 0 with a stated noise, or if no sample is left over. */
    int32_t has_estimated_noise;
    /** 0. */
    int32_t reserved;
    /** Root mean square of the residuals: in sigma with a stated noise, otherwise length. */
    double residual_rms;
    /** One sigma of a residual, 0 if not estimated. Length. */
    double estimated_noise;
    /** Samples less parameters, as far as the samples and not the tolerance determine them. */
    double degrees_of_freedom;
    /** Condition number of the weighted Jacobian, its columns scaled to unit length; 1 is best. */
    double condition;
    /** For each parameter the share of the result that the tolerance decided and not the samples, 0 to 1. */
    double prior_share[8];
} dcal_arm_summary_f64;

/** What became of a sample. */
typedef struct dcal_verdict_f64 {
    /** DCAL_TAKEN, DCAL_UNTESTED or DCAL_REJECTED. */
    int32_t verdict;
    /** Why it was not tested: DCAL_NO_ESTIMATE or DCAL_NO_NOISE; otherwise DCAL_OK. */
    dcal_status reason;
    /** The arm whose part of the sample is furthest off, 0, 1 or 2; DCAL_NO_ARM if not tested. */
    int32_t arm;
    /** 0. */
    int32_t reserved;
    /** By how much the sample is off along that arm's forearm. Length. */
    double distance;
    /** The same over its sigma, which contains that of the prediction. */
    double normalized;
} dcal_verdict_f64;

/** How many samples came to what, and what that means. */
typedef struct dcal_gate_counts_f64 {
    /** Samples taken in, untested ones included. */
    uint64_t taken;
    /** Of them, those that could not be tested. */
    uint64_t untested;
    /** Samples rejected. */
    uint64_t rejected;
    /** By each arm; a sample that several reject counts for each. */
    uint64_t rejected_by_arm[3];
    /** Rejected samples since the last that was taken. */
    uint64_t run;
    /** The longest such run. */
    uint64_t longest_run;
    /** What the first long run of rejections means: DCAL_NO_ALARM, DCAL_ROBOT_CHANGED or
     * DCAL_EARLY_SAMPLES_WRONG. */
    int32_t alarm;
    /** 1 while there is something to solve, which may be the gate's own estimate: call dcal_gate_step_f64
     * until it returns DCAL_OK. */
    int32_t solving;
    /** The first sample of that run, counted from 0 over all that came; 0 without an alarm. */
    uint64_t alarm_sample;
} dcal_gate_counts_f64;

/** What was measured at one set of joint angles: any of the coordinates, a height, a distance. */
typedef struct dcal_observation_f64 {
    /** q1, q2, q3. Radians. */
    double joints[3];
    /** x, y, z, as far as they were measured. Length. */
    double position[3];
    /** Height of the platform point above a plane, along the plane's upward normal. Length. */
    double height;
    /** Distance of the platform point from a point, or from where it is at other_joints. Length. */
    double distance;
    /** The joint angles at the other end of a distance. Radians. */
    double other_joints[3];
    /** Which plane the height is above, from 0 on. */
    uint32_t plane;
    /** Which point the distance is from, from 0 on. */
    uint32_t point;
    /** What was measured: bits DCAL_READ_..., at most one of the two kinds of distance. */
    uint32_t readings;
    /** 0. */
    uint32_t reserved;
} dcal_observation_f64;

/** A plane z = c + a x + b y, whose c, a and b are unknown. */
typedef struct dcal_plane_f64 {
    /** What is known of c. Length. */
    double known;
    /** One sigma of that; 0: nothing is known. Length. */
    double sigma;
    /** One sigma of the slopes a and b of a plane that is nearly level; 0: nothing is known. No unit. */
    double level;
} dcal_plane_f64;

/** A fixed point, whose place is unknown. */
typedef struct dcal_point_f64 {
    /** What is known of the place: x, y, z. Length. */
    double known[3];
    /** One sigma of each coordinate; 0: nothing is known. Length. */
    double sigma;
    /** 1 if the sensor there reads a constant too much that is unknown, too; otherwise 0. */
    uint32_t has_offset;
    /** 0. */
    uint32_t reserved;
} dcal_point_f64;

/** What the readings refer to. All zeros: coordinates in the robot's own frame, no plane, no point. */
typedef struct dcal_instruments_f64 {
    /** DCAL_FRAME_BASE or DCAL_FRAME_SENSOR. */
    int32_t frame;
    /** How many planes there are. */
    uint32_t plane_count;
    /** How many points there are. */
    uint32_t point_count;
    /** 0. */
    uint32_t reserved;
    /** One sigma of a height; 0 where none is measured. Length. */
    double height_noise;
    /** One sigma of a distance; 0 where none is measured. Length. */
    double distance_noise;
    /** The planes that heights are measured above. */
    dcal_plane_f64 planes[DCAL_PLANES];
    /** The points that distances are measured from. */
    dcal_point_f64 points[DCAL_POINTS];
} dcal_instruments_f64;

/** Makes a robot from its dimensions, in size bytes of memory: write sizeof *robot.
 *
 * Errors: DCAL_GEOMETRY_.... */
dcal_status dcal_robot_from_dimensions_f64(
    dcal_robot_f64 *robot,
    size_t size,
    const dcal_dimensions_f64 *dimensions,
    dcal_error *error);

/** Makes a robot from its 24 parameters, in size bytes of memory: write sizeof *robot. Eight parameters an
 * arm, in the order DCAL_DX to DCAL_LB: lengths, and theta and alpha in radians.
 *
 * Errors: DCAL_GEOMETRY_.... */
dcal_status dcal_robot_from_parameters_f64(
    dcal_robot_f64 *robot,
    size_t size,
    const double parameters[24],
    dcal_error *error);

/** Writes a robot's 24 parameters, as dcal_robot_from_parameters_f64 takes them: lengths and radians. */
dcal_status dcal_robot_parameters_f64(const dcal_robot_f64 *robot, double parameters[24]);

/** Gives a robot the transmissions of its joints, which its kinematics and every calibration with it as
 * the nominal robot then use. Five numbers a joint: gain (no unit), c1, s1, c2 and s2 (radians). The
 * angle of the arm is q + gain q + c1 cos q + s1 sin q + c2 cos 2q + s2 sin 2q at the joint angle q.
 * Zeros take them away.
 *
 * Errors: DCAL_GEOMETRY_TRANSMISSION; the robot then keeps those that it had. */
dcal_status dcal_robot_set_transmissions_f64(
    dcal_robot_f64 *robot,
    const double transmissions[15],
    dcal_error *error);

/** Writes a robot's transmissions, as dcal_robot_set_transmissions_f64 takes them. */
dcal_status dcal_robot_transmissions_f64(const dcal_robot_f64 *robot, double transmissions[15]);

/** Forward kinematics: where the platform is at these joint angles. joints: q1, q2, q3, radians. position:
 * x, y, z, in the robot's unit of length.
 *
 * Errors: DCAL_UNREACHABLE, DCAL_SINGULAR_PARALLEL, DCAL_POSE_NOT_FINITE, each with the arm. */
dcal_status dcal_robot_forward_f64(
    const dcal_robot_f64 *robot,
    const double joints[3],
    double position[3],
    dcal_error *error);

/** Inverse kinematics, elbows out: the joint angles at which the platform is at a position. position: x,
 * y, z, in the robot's unit of length. joints: q1, q2, q3, radians.
 *
 * Errors: DCAL_UNREACHABLE, DCAL_SINGULAR_SERIAL, DCAL_POSE_NOT_FINITE, each with the arm. */
dcal_status dcal_robot_inverse_f64(
    const dcal_robot_f64 *robot,
    const double position[3],
    double joints[3],
    dcal_error *error);

/** Writes the covariance of all 24 parameters, eight an arm, row by row: length^2, length radian,
 * radian^2.
 *
 * Errors: DCAL_NO_COVARIANCE. */
dcal_status dcal_joint_outcome_covariance_f64(const dcal_joint_outcome_f64 *outcome, double covariance[576]);

/** Makes a calibrator without samples, in size bytes of memory: write sizeof *calibrator. robot is the
 * robot before calibration, the nominal of the tolerance and the start of the iteration; it is copied.
 *
 * Errors: DCAL_NOISE_..., DCAL_TOLERANCE_..., DCAL_NO_SUCH_CHOICE. */
dcal_status dcal_ikm_init_f64(
    dcal_ikm_f64 *calibrator,
    size_t size,
    const dcal_robot_f64 *robot,
    const dcal_settings_f64 *settings,
    dcal_error *error);

/** Adds one sample; memory and time are the same for any number of samples. The result of the last
 * dcal_ikm_solve_f64 is dropped.
 *
 * Errors: DCAL_BUSY, and DCAL_SAMPLE_... with the arm; nothing is added. */
dcal_status dcal_ikm_add_f64(dcal_ikm_f64 *calibrator, const dcal_sample_f64 *sample, dcal_error *error);

/** Works in the samples that still wait: the calibrator works in several at once. dcal_ikm_solve_f64 does
 * it as well; call this one turn of the control loop earlier if that call takes too long. The result has
 * the same bits. */
dcal_status dcal_ikm_flush_f64(dcal_ikm_f64 *calibrator);

/** Adds all samples of another calibrator of the same robot and noise.
 *
 * Errors: DCAL_BUSY, DCAL_DIFFERENT_NOMINAL; nothing is added. */
dcal_status dcal_ikm_merge_f64(dcal_ikm_f64 *calibrator, const dcal_ikm_f64 *other);

/** Multiplies the weight of all samples so far by lambda, 0 to 1.
 *
 * Errors: DCAL_BUSY, DCAL_FORGETTING. */
dcal_status dcal_ikm_forget_f64(dcal_ikm_f64 *calibrator, double lambda);

/** Writes the number of samples. */
dcal_status dcal_ikm_samples_f64(const dcal_ikm_f64 *calibrator, uint64_t *samples);

/** Begins to solve. Until the last dcal_ikm_step_f64, or dcal_ikm_stop_f64, every call that would change
 * the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_ikm_finish_f64 that are known already, as DCAL_TOO_FEW_SAMPLES, with the arm, how
 * many there are and how many are needed. */
dcal_status dcal_ikm_solve_f64(dcal_ikm_f64 *calibrator, dcal_error *error);

/** One short step, to be called between the turns of a control loop. Returns DCAL_WORKING as long as there
 * is more to do, and then DCAL_OK: dcal_ikm_finish_f64 has the outcome, or why there is none. */
dcal_status dcal_ikm_step_f64(dcal_ikm_f64 *calibrator);

/** Gives up what dcal_ikm_solve_f64 has begun. The samples stay. */
dcal_status dcal_ikm_stop_f64(dcal_ikm_f64 *calibrator);

/** Drops all samples and what was solved from them: as after dcal_ikm_init_f64. */
dcal_status dcal_ikm_reset_f64(dcal_ikm_f64 *calibrator);

/** The calibrated robot, in size bytes of memory: write sizeof *outcome.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to
 * DCAL_OVERFLOW), with arm and cause; the robot keeps its parameters. */
dcal_status dcal_ikm_finish_f64(
    const dcal_ikm_f64 *calibrator,
    dcal_ikm_outcome_f64 *outcome,
    size_t size,
    dcal_error *error);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length is how many were written. They are the same on every target. Store
 * them where they outlast a power cut, and give them to dcal_ikm_restore_f64.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. The gate: DCAL_BUSY. */
dcal_status dcal_ikm_snapshot_f64(
    const dcal_ikm_f64 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must be of the same robot and noise. It
 * goes on to the same bits as the one that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_ikm_restore_f64(dcal_ikm_f64 *calibrator, const uint8_t *bytes, size_t length);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. */
dcal_status dcal_ikm_outcome_robot_f64(
    const dcal_ikm_outcome_f64 *outcome,
    dcal_robot_f64 *robot,
    size_t size);

/** Writes how well an arm is known; arm is 0, 1 or 2. Solved together, residual and noise are the whole
 * robot's.
 *
 * Errors: DCAL_NO_SUCH_ARM. */
dcal_status dcal_ikm_outcome_arm_f64(
    const dcal_ikm_outcome_f64 *outcome,
    int32_t arm,
    dcal_arm_summary_f64 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight an arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE. */
dcal_status dcal_ikm_outcome_deviations_f64(const dcal_ikm_outcome_f64 *outcome, double sigma[24]);

/** Writes the covariance of an arm's eight parameters, row by row: length^2, length radian, radian^2. arm
 * is 0, 1 or 2.
 *
 * Errors: DCAL_NO_SUCH_ARM, DCAL_NO_COVARIANCE. */
dcal_status dcal_ikm_outcome_arm_covariance_f64(
    const dcal_ikm_outcome_f64 *outcome,
    int32_t arm,
    double covariance[64]);

/** Makes a calibrator without samples, in size bytes of memory: write sizeof *calibrator. robot is the
 * robot before calibration, the nominal of the tolerance and the start of the iteration; it is copied.
 *
 * Errors: DCAL_NOISE_..., DCAL_TOLERANCE_..., DCAL_NO_SUCH_CHOICE. */
dcal_status dcal_joint_init_f64(
    dcal_joint_f64 *calibrator,
    size_t size,
    const dcal_robot_f64 *robot,
    const dcal_settings_f64 *settings,
    dcal_error *error);

/** Adds one sample; memory and time are the same for any number of samples. The result of the last
 * dcal_joint_solve_f64 is dropped.
 *
 * Errors: DCAL_BUSY, and DCAL_SAMPLE_... with the arm; nothing is added. */
dcal_status dcal_joint_add_f64(dcal_joint_f64 *calibrator, const dcal_sample_f64 *sample, dcal_error *error);

/** Works in the samples that still wait: the calibrator works in several at once. dcal_joint_solve_f64
 * does it as well; call this one turn of the control loop earlier if that call takes too long. The result
 * has the same bits. */
dcal_status dcal_joint_flush_f64(dcal_joint_f64 *calibrator);

/** Adds all samples of another calibrator of the same robot and noise.
 *
 * Errors: DCAL_BUSY, DCAL_DIFFERENT_NOMINAL; nothing is added. */
dcal_status dcal_joint_merge_f64(dcal_joint_f64 *calibrator, const dcal_joint_f64 *other);

/** Multiplies the weight of all samples so far by lambda, 0 to 1.
 *
 * Errors: DCAL_BUSY, DCAL_FORGETTING. */
dcal_status dcal_joint_forget_f64(dcal_joint_f64 *calibrator, double lambda);

/** Writes the number of samples. */
dcal_status dcal_joint_samples_f64(const dcal_joint_f64 *calibrator, uint64_t *samples);

/** Begins to solve. Until the last dcal_joint_step_f64, or dcal_joint_stop_f64, every call that would
 * change the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_joint_finish_f64 that are known already, as DCAL_TOO_FEW_SAMPLES, with the arm,
 * how many there are and how many are needed. */
dcal_status dcal_joint_solve_f64(dcal_joint_f64 *calibrator, dcal_error *error);

/** One short step, to be called between the turns of a control loop. Returns DCAL_WORKING as long as there
 * is more to do, and then DCAL_OK: dcal_joint_finish_f64 has the outcome, or why there is none. */
dcal_status dcal_joint_step_f64(dcal_joint_f64 *calibrator);

/** Gives up what dcal_joint_solve_f64 has begun. The samples stay. */
dcal_status dcal_joint_stop_f64(dcal_joint_f64 *calibrator);

/** Drops all samples and what was solved from them: as after dcal_joint_init_f64. */
dcal_status dcal_joint_reset_f64(dcal_joint_f64 *calibrator);

/** The calibrated robot, in size bytes of memory: write sizeof *outcome.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to
 * DCAL_OVERFLOW), with arm and cause; the robot keeps its parameters. */
dcal_status dcal_joint_finish_f64(
    const dcal_joint_f64 *calibrator,
    dcal_joint_outcome_f64 *outcome,
    size_t size,
    dcal_error *error);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length is how many were written. They are the same on every target. Store
 * them where they outlast a power cut, and give them to dcal_joint_restore_f64.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. The gate: DCAL_BUSY. */
dcal_status dcal_joint_snapshot_f64(
    const dcal_joint_f64 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must be of the same robot and noise. It
 * goes on to the same bits as the one that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_joint_restore_f64(dcal_joint_f64 *calibrator, const uint8_t *bytes, size_t length);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. */
dcal_status dcal_joint_outcome_robot_f64(
    const dcal_joint_outcome_f64 *outcome,
    dcal_robot_f64 *robot,
    size_t size);

/** Writes how well an arm is known; arm is 0, 1 or 2. Solved together, residual and noise are the whole
 * robot's.
 *
 * Errors: DCAL_NO_SUCH_ARM. */
dcal_status dcal_joint_outcome_arm_f64(
    const dcal_joint_outcome_f64 *outcome,
    int32_t arm,
    dcal_arm_summary_f64 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight an arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE. */
dcal_status dcal_joint_outcome_deviations_f64(const dcal_joint_outcome_f64 *outcome, double sigma[24]);

/** Writes the covariance of an arm's eight parameters, row by row: length^2, length radian, radian^2. arm
 * is 0, 1 or 2.
 *
 * Errors: DCAL_NO_SUCH_ARM, DCAL_NO_COVARIANCE. */
dcal_status dcal_joint_outcome_arm_covariance_f64(
    const dcal_joint_outcome_f64 *outcome,
    int32_t arm,
    double covariance[64]);

/** Makes a calibrator with a gate, without samples, in size bytes of memory: write sizeof *calibrator.
 * sigmas is the gate's width; 0 for the width that rejects three good samples in a million for each arm.
 * age is the mean age of the samples that count, for a robot that changes slowly; 0 if all count alike.
 * With a stated noise and tolerance the gate tests from the first sample on, otherwise from its first
 * estimate on.
 *
 * Errors: DCAL_NOISE_..., DCAL_TOLERANCE_..., DCAL_NO_SUCH_CHOICE, DCAL_WIDTH_OF_GATE, DCAL_FORGETTING. */
dcal_status dcal_gate_init_f64(
    dcal_gate_f64 *calibrator,
    size_t size,
    const dcal_robot_f64 *robot,
    const dcal_settings_f64 *settings,
    double sigmas,
    double age,
    dcal_error *error);

/** Tests one sample, and takes it in unless it disagrees. A sample that is rejected is no error: verdict
 * says so. Where the gate then wants an estimate of its own, call dcal_gate_step_f64 until it returns
 * DCAL_OK, before the next sample.
 *
 * Errors: DCAL_BUSY, and DCAL_SAMPLE_... with the arm; nothing has changed. */
dcal_status dcal_gate_add_f64(
    dcal_gate_f64 *calibrator,
    const dcal_sample_f64 *sample,
    dcal_verdict_f64 *verdict,
    dcal_error *error);

/** Writes how many samples came to what, and whether there is an alarm. */
dcal_status dcal_gate_state_f64(const dcal_gate_f64 *calibrator, dcal_gate_counts_f64 *counts);

/** Answers the alarm: the run of rejected samples was wrong, and what was taken in before stays. If the
 * robot has changed, call dcal_gate_reset_f64. */
dcal_status dcal_gate_acknowledge_f64(dcal_gate_f64 *calibrator);

/** Writes the number of samples. */
dcal_status dcal_gate_samples_f64(const dcal_gate_f64 *calibrator, uint64_t *samples);

/** Begins to solve. Until the last dcal_gate_step_f64, or dcal_gate_stop_f64, every call that would change
 * the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_gate_finish_f64 that are known already, as DCAL_TOO_FEW_SAMPLES, with the arm,
 * how many there are and how many are needed. */
dcal_status dcal_gate_solve_f64(dcal_gate_f64 *calibrator, dcal_error *error);

/** One short step, to be called between the turns of a control loop. Returns DCAL_WORKING as long as there
 * is more to do, and then DCAL_OK: dcal_gate_finish_f64 has the outcome, or why there is none. */
dcal_status dcal_gate_step_f64(dcal_gate_f64 *calibrator);

/** Gives up what dcal_gate_solve_f64 has begun. The samples stay. */
dcal_status dcal_gate_stop_f64(dcal_gate_f64 *calibrator);

/** Drops all samples and what was solved from them: as after dcal_gate_init_f64. */
dcal_status dcal_gate_reset_f64(dcal_gate_f64 *calibrator);

/** The calibrated robot, in size bytes of memory: write sizeof *outcome.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to
 * DCAL_OVERFLOW), with arm and cause; the robot keeps its parameters. */
dcal_status dcal_gate_finish_f64(
    const dcal_gate_f64 *calibrator,
    dcal_ikm_outcome_f64 *outcome,
    size_t size,
    dcal_error *error);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length is how many were written. They are the same on every target. Store
 * them where they outlast a power cut, and give them to dcal_gate_restore_f64.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. The gate: DCAL_BUSY. */
dcal_status dcal_gate_snapshot_f64(
    const dcal_gate_f64 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must be of the same robot and noise. It
 * goes on to the same bits as the one that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_gate_restore_f64(dcal_gate_f64 *calibrator, const uint8_t *bytes, size_t length);

/** Makes a calibrator without observations, in size bytes of memory: write sizeof *calibrator. robot is
 * the robot before calibration. settings must state the noise of positions and joint angles, and a
 * tolerance unless x, y and z are measured often enough; instruments states the noise of heights and
 * distances.
 *
 * Errors: DCAL_NOISE_..., DCAL_TOLERANCE_..., DCAL_NO_SUCH_CHOICE, DCAL_KNOWN_PLACE,
 * DCAL_TOO_MANY_UNKNOWNS. */
dcal_status dcal_fkm_init_f64(
    dcal_fkm_f64 *calibrator,
    size_t size,
    const dcal_robot_f64 *robot,
    const dcal_instruments_f64 *instruments,
    const dcal_settings_f64 *settings,
    dcal_error *error);

/** Takes in one observation, of DCAL_FKM_ROWS at most.
 *
 * Errors: DCAL_OBSERVATION_..., DCAL_SAMPLE_JOINT_..., DCAL_NO_SUCH_PLANE and ..._POINT, DCAL_NOISE_...
 * of a height or distance where it is not stated, DCAL_NO_SUCH_CHOICE, DCAL_BUSY; nothing is taken in. */
dcal_status dcal_fkm_add_f64(
    dcal_fkm_f64 *calibrator,
    const dcal_observation_f64 *observation,
    dcal_error *error);

/** Makes the outcome of the robot's 24 parameters alone, in size bytes of memory: write sizeof *joint. Its
 * covariance takes the unknowns of the instruments into account. */
dcal_status dcal_fkm_outcome_joint_f64(
    const dcal_fkm_outcome_f64 *outcome,
    dcal_joint_outcome_f64 *joint,
    size_t size);

/** Writes where a plane z = c + a x + b y lies: c (length), a, b.
 *
 * Errors: DCAL_NO_SUCH_PLANE. */
dcal_status dcal_fkm_outcome_plane_f64(
    const dcal_fkm_outcome_f64 *outcome,
    uint32_t plane,
    double coefficients[3]);

/** Writes where a point is, and what the sensor there reads too much: x, y, z, offset. Length.
 *
 * Errors: DCAL_NO_SUCH_POINT. */
dcal_status dcal_fkm_outcome_point_f64(const dcal_fkm_outcome_f64 *outcome, uint32_t point, double place[4]);

/** Writes the frame in which coordinates were measured, from the robot's frame to it: the rotation row by
 * row, and the translation (length). The identity for DCAL_FRAME_BASE. */
dcal_status dcal_fkm_outcome_frame_f64(
    const dcal_fkm_outcome_f64 *outcome,
    double rotation[9],
    double translation[3]);

/** Writes the number of samples. */
dcal_status dcal_fkm_samples_f64(const dcal_fkm_f64 *calibrator, uint64_t *samples);

/** Begins to solve. Until the last dcal_fkm_step_f64, or dcal_fkm_stop_f64, every call that would change
 * the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_fkm_finish_f64 that are known already, as DCAL_TOO_FEW_SAMPLES, with the arm, how
 * many there are and how many are needed. */
dcal_status dcal_fkm_solve_f64(dcal_fkm_f64 *calibrator, dcal_error *error);

/** One short step, to be called between the turns of a control loop. Returns DCAL_WORKING as long as there
 * is more to do, and then DCAL_OK: dcal_fkm_finish_f64 has the outcome, or why there is none. */
dcal_status dcal_fkm_step_f64(dcal_fkm_f64 *calibrator);

/** Gives up what dcal_fkm_solve_f64 has begun. The samples stay. */
dcal_status dcal_fkm_stop_f64(dcal_fkm_f64 *calibrator);

/** Drops all samples and what was solved from them: as after dcal_fkm_init_f64. */
dcal_status dcal_fkm_reset_f64(dcal_fkm_f64 *calibrator);

/** The calibrated robot, in size bytes of memory: write sizeof *outcome.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to
 * DCAL_OVERFLOW), with arm and cause; the robot keeps its parameters. */
dcal_status dcal_fkm_finish_f64(
    const dcal_fkm_f64 *calibrator,
    dcal_fkm_outcome_f64 *outcome,
    size_t size,
    dcal_error *error);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. */
dcal_status dcal_fkm_outcome_robot_f64(
    const dcal_fkm_outcome_f64 *outcome,
    dcal_robot_f64 *robot,
    size_t size);

/** Writes how well an arm is known; arm is 0, 1 or 2. Solved together, residual and noise are the whole
 * robot's.
 *
 * Errors: DCAL_NO_SUCH_ARM. */
dcal_status dcal_fkm_outcome_arm_f64(
    const dcal_fkm_outcome_f64 *outcome,
    int32_t arm,
    dcal_arm_summary_f64 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight an arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE. */
dcal_status dcal_fkm_outcome_deviations_f64(const dcal_fkm_outcome_f64 *outcome, double sigma[24]);

/** Writes the covariance of an arm's eight parameters, row by row: length^2, length radian, radian^2. arm
 * is 0, 1 or 2.
 *
 * Errors: DCAL_NO_SUCH_ARM, DCAL_NO_COVARIANCE. */
dcal_status dcal_fkm_outcome_arm_covariance_f64(
    const dcal_fkm_outcome_f64 *outcome,
    int32_t arm,
    double covariance[64]);

/* ---- What this compiler makes of it ---- */

DCAL_ASSERT(sizeof(dcal_arm_summary_f32) == 80, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_arm_summary_f64) == 128, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_dimensions_f32) == 20, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_dimensions_f64) == 40, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_error) == 48, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_gate_counts_f32) == 80, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_gate_counts_f64) == 80, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_instruments_f32) == 168, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_instruments_f64) == 288, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_observation_f32) == 60, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_observation_f64) == 104, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_plane_f32) == 12, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_plane_f64) == 24, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_point_f32) == 24, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_point_f64) == 40, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_sample_f32) == 24, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_sample_f64) == 48, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_settings_f32) == 44, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_settings_f64) == 72, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_verdict_f32) == 24, "the size of a structure");
DCAL_ASSERT(sizeof(dcal_verdict_f64) == 32, "the size of a structure");

#ifdef __cplusplus
}
#endif

#endif
