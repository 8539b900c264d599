/* delta_cal.h: kinematic calibration of Delta parallel robots, for C11 and C++11.
 *
 * Made from the library's source; do not edit it. The manual is docs/c.md.
 *
 * Angles are in radians, lengths in any one unit that you choose. Names end in _f32 or _f64, the type of all numbers.
 *
 * Objects lie in memory that you provide: a variable of the object's type, wherever you like, static or on the stack.
 * Nothing is allocated, nothing is released, and an object holds no pointer, so that you may copy one by assignment.
 * Functions that make an object take its size (sizeof object) and refuse less than they need.
 *
 * Every function but four returns DELTA_CAL_OK (0), DELTA_CAL_WORKING (1), or why nothing was done. A call that
 * fails writes nothing but its error. An argument `error` may be NULL. What every function can return beside the
 * errors that stand with it: DELTA_CAL_NULL_POINTER, DELTA_CAL_MISALIGNED, DELTA_CAL_WRONG_SIZE,
 * DELTA_CAL_NOT_INITIALIZED, DELTA_CAL_WRONG_KIND and DELTA_CAL_OVERLAP.
 *
 * What you promise: a pointer is NULL or leads to memory of its type, and nobody else uses that memory during the
 * call. Different objects may be used at the same time, from interrupts and threads too.
 */
#ifndef DELTA_CAL_H
#define DELTA_CAL_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
#define DELTA_CAL_ASSERT(condition, text) static_assert(condition, text)
#define DELTA_CAL_ALIGNED alignas(8)
#define DELTA_CAL_ALIGNMENT_OF(type) alignof(type)
extern "C" {
#else
#define DELTA_CAL_ASSERT(condition, text) _Static_assert(condition, text)
#define DELTA_CAL_ALIGNED _Alignas(8)
#define DELTA_CAL_ALIGNMENT_OF(type) _Alignof(type)
#endif
#define DELTA_CAL_OBJECT(type, size)                                 \
    DELTA_CAL_ASSERT(sizeof(type) == size, "the size of an object"); \
    DELTA_CAL_ASSERT(DELTA_CAL_ALIGNMENT_OF(type) == 8, "the alignment of an object")

/* The version of this header: major << 16 | minor << 8 | patch. */
#define DELTA_CAL_VERSION UINT32_C(256)

/* What a call came to. The numbers never change. */
typedef int32_t delta_cal_status;

enum {
    /* The call did what it says. */
    DELTA_CAL_OK = 0,
    /* The solver has more steps to do. */
    DELTA_CAL_WORKING = 1,
    /* A pointer is NULL. */
    DELTA_CAL_NULL_POINTER = 10,
    /* A pointer is not aligned as its type demands. */
    DELTA_CAL_MISALIGNED = 11,
    /* The stated size is smaller than the object. */
    DELTA_CAL_WRONG_SIZE = 12,
    /* The memory holds no object: it was never initialised, or overwritten. */
    DELTA_CAL_NOT_INITIALIZED = 13,
    /* The memory holds an object of another kind. */
    DELTA_CAL_WRONG_KIND = 14,
    /* Two objects overlap. */
    DELTA_CAL_OVERLAP = 15,
    /* There is no arm of this index: 0, 1 and 2 are the arms. */
    DELTA_CAL_NO_SUCH_ARM = 16,
    /* A number that chooses is none of those that the header names. */
    DELTA_CAL_NO_SUCH_CHOICE = 17,
    /* The noise of positions must be a finite number greater than 0. */
    DELTA_CAL_NOISE_OF_POSITION = 20,
    /* The noise of joint angles must be a finite number, 0 or greater. */
    DELTA_CAL_NOISE_OF_JOINT = 21,
    /* The noise of heights must be a finite number greater than 0. */
    DELTA_CAL_NOISE_OF_HEIGHT = 22,
    /* The noise of distances must be a finite number greater than 0. */
    DELTA_CAL_NOISE_OF_DISTANCE = 23,
    /* The tolerance of lengths must be a finite number greater than 0. */
    DELTA_CAL_TOLERANCE_OF_LENGTH = 24,
    /* The tolerance of angles must be a finite number greater than 0. */
    DELTA_CAL_TOLERANCE_OF_ANGLE = 25,
    /* The width of the gate must be a finite number greater than 0. */
    DELTA_CAL_WIDTH_OF_GATE = 26,
    /* The factor of forgetting must lie between 0 and 1. */
    DELTA_CAL_FORGETTING = 27,
    /* What is known of an instrument's place must be finite, and its sigma not negative. */
    DELTA_CAL_KNOWN_PLACE = 28,
    /* A parameter of the geometry is not a finite number. */
    DELTA_CAL_GEOMETRY_NOT_FINITE = 30,
    /* The upper arm or the forearm is not longer than 0. */
    DELTA_CAL_GEOMETRY_NOT_POSITIVE = 31,
    /* The tilt alpha must lie within 90 degrees. */
    DELTA_CAL_GEOMETRY_TILT = 32,
    /* The azimuth theta must lie within 360 degrees. */
    DELTA_CAL_GEOMETRY_AZIMUTH = 33,
    /* The radius of base or platform is negative. */
    DELTA_CAL_GEOMETRY_RADIUS = 34,
    /* The arms have no common upward direction. */
    DELTA_CAL_GEOMETRY_NO_COMMON_UP = 35,
    /* A transmission is not nearly exact: gain and harmonics together must be below a tenth. */
    DELTA_CAL_GEOMETRY_TRANSMISSION = 36,
    /* The forearms do not meet at these joint angles, or an arm does not reach the position. */
    DELTA_CAL_UNREACHABLE = 40,
    /* Upper arm and forearm are in line: the edge of the workspace. */
    DELTA_CAL_SINGULAR_SERIAL = 41,
    /* The three forearms lie in one plane: the joints do not hold the platform. */
    DELTA_CAL_SINGULAR_PARALLEL = 42,
    /* A joint angle or coordinate is not finite. */
    DELTA_CAL_POSE_NOT_FINITE = 43,
    /* The position of the sample is not finite. */
    DELTA_CAL_SAMPLE_POSITION_NOT_FINITE = 50,
    /* The position of the sample is thousands of forearms away from the robot. */
    DELTA_CAL_SAMPLE_POSITION_TOO_FAR = 51,
    /* A joint angle of the sample is not finite. */
    DELTA_CAL_SAMPLE_JOINT_NOT_FINITE = 52,
    /* A joint angle of the sample is beyond two turns; joint angles are in radians. */
    DELTA_CAL_SAMPLE_JOINT_TOO_LARGE = 53,
    /* The two calibrators are of different robots or noises. */
    DELTA_CAL_DIFFERENT_NOMINAL = 54,
    /* The observation holds no reading. */
    DELTA_CAL_OBSERVATION_EMPTY = 60,
    /* A reading of the observation is not finite. */
    DELTA_CAL_OBSERVATION_NOT_FINITE = 61,
    /* A distance is not greater than 0. */
    DELTA_CAL_OBSERVATION_DISTANCE = 62,
    /* There is no plane of this index. */
    DELTA_CAL_NO_SUCH_PLANE = 63,
    /* There is no point of this index. */
    DELTA_CAL_NO_SUCH_POINT = 64,
    /* The distance is between two poses that the nominal robot has in the same place. */
    DELTA_CAL_OBSERVATION_SAME_PLACE = 65,
    /* The instruments have more unknowns than there is room for. */
    DELTA_CAL_TOO_MANY_UNKNOWNS = 66,
    /* There are fewer samples than needed. */
    DELTA_CAL_TOO_FEW_SAMPLES = 70,
    /* The poses do not determine the parameters. */
    DELTA_CAL_UNDETERMINED = 71,
    /* The noise leaves a parameter unknown. */
    DELTA_CAL_UNCERTAIN = 72,
    /* The iteration did not settle within its limit. */
    DELTA_CAL_NOT_CONVERGED = 73,
    /* The residuals are larger than the stated noise allows. */
    DELTA_CAL_RESIDUAL_CONTRADICTS_NOISE = 74,
    /* A parameter is farther from nominal than the tolerance makes credible. */
    DELTA_CAL_FAR_FROM_NOMINAL = 75,
    /* The solution is not the geometry of an arm. */
    DELTA_CAL_IMPOSSIBLE_GEOMETRY = 76,
    /* The solution's three arms are not a robot. */
    DELTA_CAL_IMPOSSIBLE_ROBOT = 77,
    /* The platform was measured above its elbows: the measuring frame is upside down or left-handed. */
    DELTA_CAL_WRONG_SIDE = 78,
    /* An instrument has fewer readings than its place has unknowns. */
    DELTA_CAL_TOO_FEW_OBSERVATIONS = 79,
    /* The poses do not determine where an instrument is. */
    DELTA_CAL_UNDETERMINED_INSTRUMENT = 80,
    /* The arithmetic overflowed. */
    DELTA_CAL_OVERFLOW = 81,
    /* The solver was asked for its result before its last step. */
    DELTA_CAL_UNFINISHED = 82,
    /* There is no covariance: the noise is not stated, and too few samples are left over to estimate it. */
    DELTA_CAL_NO_COVARIANCE = 83,
    /* The sample was not tested: there is no estimate to test it with. */
    DELTA_CAL_NO_ESTIMATE = 90,
    /* The sample was not tested: the noise is neither stated nor known. */
    DELTA_CAL_NO_NOISE = 91,
    /* The memory for the snapshot is shorter than the header states. */
    DELTA_CAL_SNAPSHOT_BUFFER = 100,
    /* The bytes are not a whole snapshot: cut off, damaged, or never written. */
    DELTA_CAL_SNAPSHOT_DAMAGED = 101,
    /* The snapshot is of another version of the library. */
    DELTA_CAL_SNAPSHOT_OTHER_VERSION = 102,
    /* The snapshot is of another kind of object, or of one in the other precision. */
    DELTA_CAL_SNAPSHOT_OTHER_KIND = 103,
    /* The snapshot is of another robot, of other settings, or belongs to a calibrator in another state. */
    DELTA_CAL_SNAPSHOT_OTHER_CALIBRATION = 104,
    /* A refusal that this version of the library has no number for. */
    DELTA_CAL_OTHER = 127
};

enum {
    /* Not an arm, in places that hold an arm's index. */
    DELTA_CAL_NO_ARM = -1,
    /* Not a parameter, in places that hold a parameter's index. */
    DELTA_CAL_NO_PARAMETER = -1,
    /* Index of Dx among the eight parameters of an arm: x of the point on the motor axis. Length. */
    DELTA_CAL_DX = 0,
    /* Index of Dy: y of that point. Length. */
    DELTA_CAL_DY = 1,
    /* Index of Dz: z of that point. Length. */
    DELTA_CAL_DZ = 2,
    /* Index of theta: azimuth of the arm plane about base z. Radians. */
    DELTA_CAL_THETA = 3,
    /* Index of alpha: tilt of the motor axis out of the base plane. Radians. */
    DELTA_CAL_ALPHA = 4,
    /* Index of La_x: upper arm at joint angle 0, radial component. Length. */
    DELTA_CAL_LA_X = 5,
    /* Index of La_y: upper arm at joint angle 0, upward component. Length. */
    DELTA_CAL_LA_Y = 6,
    /* Index of Lb: forearm. Length. */
    DELTA_CAL_LB = 7,
    /* Levenberg-Marquardt: each step damped until it reduces the sum of squares. */
    DELTA_CAL_LEVENBERG_MARQUARDT = 0,
    /* Gauss-Newton: always the full step. */
    DELTA_CAL_GAUSS_NEWTON = 1,
    /* The iteration starts from the nominal robot. */
    DELTA_CAL_START_NOMINAL = 0,
    /* The iteration starts without a guess; needs 12 samples. */
    DELTA_CAL_START_FREE = 1,
    /* The iteration stopped because no step could reduce the sum of squares any further. */
    DELTA_CAL_GRADIENT_VANISHED = 0,
    /* The iteration stopped because the last step was of the size of rounding errors. */
    DELTA_CAL_ROUNDING_REACHED = 1,
    /* The result comes from the nominal robot. */
    DELTA_CAL_USED_NOMINAL = 0,
    /* The result comes from the start without a guess. */
    DELTA_CAL_USED_FREE = 1,
    /* The result comes from the search beside an earlier solution. */
    DELTA_CAL_USED_SEARCH = 2,
    /* The result comes from the solution of the joint calibration. */
    DELTA_CAL_USED_JOINT = 3,
    /* The sample agrees with the prediction and was taken in. */
    DELTA_CAL_TAKEN = 0,
    /* The sample could not be tested and was taken in. */
    DELTA_CAL_UNTESTED = 1,
    /* The sample disagrees with the prediction and was not taken in. */
    DELTA_CAL_REJECTED = 2,
    /* No alarm. */
    DELTA_CAL_NO_ALARM = 0,
    /* The robot or its measuring frame has changed. */
    DELTA_CAL_ROBOT_CHANGED = 1,
    /* The samples before the run, or the stated robot and tolerance, are wrong, or the robot has changed. */
    DELTA_CAL_EARLY_SAMPLES_WRONG = 2,
    /* No instrument. */
    DELTA_CAL_NO_INSTRUMENT = 0,
    /* The frame in which coordinates were measured. */
    DELTA_CAL_FRAME = 1,
    /* A plane that heights were measured above. */
    DELTA_CAL_PLANE = 2,
    /* A point that distances were measured from. */
    DELTA_CAL_POINT = 3,
    /* The gear and encoder of a joint. */
    DELTA_CAL_TRANSMISSION = 4,
    /* Coordinates are measured in the robot's own frame. */
    DELTA_CAL_FRAME_BASE = 0,
    /* Coordinates are measured in a frame that stands anywhere: six unknowns. */
    DELTA_CAL_FRAME_SENSOR = 1,
    /* Bit of an observation: x was measured. */
    DELTA_CAL_READ_X = 1,
    /* Bit of an observation: y was measured. */
    DELTA_CAL_READ_Y = 2,
    /* Bit of an observation: z was measured. */
    DELTA_CAL_READ_Z = 4,
    /* Bit of an observation: a height above a plane was measured. */
    DELTA_CAL_READ_HEIGHT = 8,
    /* Bit of an observation: a distance from a point was measured. */
    DELTA_CAL_READ_DISTANCE = 16,
    /* Bit of an observation: a distance from the platform's position at other joint angles was measured. */
    DELTA_CAL_READ_DISTANCE_BETWEEN = 32,
    /* Planes of a calibration from observations at most. */
    DELTA_CAL_PLANES = 4,
    /* Points of a calibration from observations at most. */
    DELTA_CAL_POINTS = 4,
    /* Unknowns of the instruments at most: six of a frame, three of a plane, three of a point, one of its
     * offset. */
    DELTA_CAL_UNKNOWNS = 12
};

/* The kinds of object, for delta_cal_size. The numbers never change. */
enum {
    DELTA_CAL_ROBOT_F32 = 1025,
    DELTA_CAL_CALIBRATOR_F32 = 1026,
    DELTA_CAL_SOLVER_F32 = 1027,
    DELTA_CAL_OUTCOME_F32 = 1028,
    DELTA_CAL_JOINT_CALIBRATOR_F32 = 1029,
    DELTA_CAL_JOINT_SOLVER_F32 = 1030,
    DELTA_CAL_JOINT_OUTCOME_F32 = 1031,
    DELTA_CAL_GATE_F32 = 1032,
    DELTA_CAL_OBSERVATION_OUTCOME_F32 = 1033,
    DELTA_CAL_ROBOT_F64 = 2049,
    DELTA_CAL_CALIBRATOR_F64 = 2050,
    DELTA_CAL_SOLVER_F64 = 2051,
    DELTA_CAL_OUTCOME_F64 = 2052,
    DELTA_CAL_JOINT_CALIBRATOR_F64 = 2053,
    DELTA_CAL_JOINT_SOLVER_F64 = 2054,
    DELTA_CAL_JOINT_OUTCOME_F64 = 2055,
    DELTA_CAL_GATE_F64 = 2056,
    DELTA_CAL_OBSERVATION_OUTCOME_F64 = 2057
};

/* Why a call failed. Every function that takes a pointer to one accepts NULL. */
typedef struct delta_cal_error {
    /* How many samples or readings there are, or the linearisations spent; 0 where that says nothing. */
    uint64_t count;
    /* How many samples or readings are needed; 0 where that says nothing. */
    uint64_t needed;
    /* The status that the call returned. */
    delta_cal_status status;
    /* The arm at fault: 0, 1, 2, or DELTA_CAL_NO_ARM. */
    int32_t arm;
    /* The parameter at fault: DELTA_CAL_DX to DELTA_CAL_LB, or DELTA_CAL_NO_PARAMETER. */
    int32_t parameter;
    /* Why a solution is impossible (DELTA_CAL_GEOMETRY_...), otherwise DELTA_CAL_OK. */
    delta_cal_status cause;
    /* The instrument at fault: DELTA_CAL_NO_INSTRUMENT, DELTA_CAL_FRAME, DELTA_CAL_PLANE, DELTA_CAL_POINT
     * or DELTA_CAL_TRANSMISSION. */
    int32_t instrument;
    /* Index of the plane or point, or of the observation at fault. */
    uint32_t index;
    /* The figure of a refusal: condition number (undetermined), sigma in length or radians (uncertain),
     * ratio of the residuals to what the noise allows (residual contradicts noise), or tolerances (far
     * from nominal); otherwise 0. */
    float figure;
    /* 0. */
    uint32_t reserved;
} delta_cal_error;

/* The version of the library that is linked. Compare it with DELTA_CAL_VERSION, that of the header:
 * before 1.0 both must agree in major and minor. */
uint32_t delta_cal_version(void);

/* How many bytes an object takes in this build of the library, its tag included; at most the size that
 * the header gives it. kind is one of DELTA_CAL_ROBOT_F32 and so on; 0 for a number that is no kind. */
size_t delta_cal_size(int32_t kind);

/* The alignment of every object, in bytes. */
size_t delta_cal_alignment(void);

/* A status in English, one sentence ended by a zero. The text lies in constant memory. Never NULL. */
const char *delta_cal_status_text(delta_cal_status status);

/* ---- Single precision ---- */

/* A robot: three arms of eight parameters. */
#define DELTA_CAL_ROBOT_F32_SIZE 384
typedef struct delta_cal_robot_f32 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_ROBOT_F32_SIZE];
} delta_cal_robot_f32;
DELTA_CAL_OBJECT(delta_cal_robot_f32, DELTA_CAL_ROBOT_F32_SIZE);

/* The per-arm calibrator: three arms' samples, each arm by itself. */
#define DELTA_CAL_CALIBRATOR_F32_SIZE 2048
typedef struct delta_cal_calibrator_f32 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_CALIBRATOR_F32_SIZE];
} delta_cal_calibrator_f32;
DELTA_CAL_OBJECT(delta_cal_calibrator_f32, DELTA_CAL_CALIBRATOR_F32_SIZE);

/* The solver of the per-arm calibrator. */
#define DELTA_CAL_SOLVER_F32_SIZE 2560
typedef struct delta_cal_solver_f32 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_SOLVER_F32_SIZE];
} delta_cal_solver_f32;
DELTA_CAL_OBJECT(delta_cal_solver_f32, DELTA_CAL_SOLVER_F32_SIZE);

/* A calibrated robot with the covariance of each arm. */
#define DELTA_CAL_OUTCOME_F32_SIZE 1728
typedef struct delta_cal_outcome_f32 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_OUTCOME_F32_SIZE];
} delta_cal_outcome_f32;
DELTA_CAL_OBJECT(delta_cal_outcome_f32, DELTA_CAL_OUTCOME_F32_SIZE);

/* The joint calibrator: all 24 parameters together. */
#define DELTA_CAL_JOINT_CALIBRATOR_F32_SIZE 4160
typedef struct delta_cal_joint_calibrator_f32 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_JOINT_CALIBRATOR_F32_SIZE];
} delta_cal_joint_calibrator_f32;
DELTA_CAL_OBJECT(delta_cal_joint_calibrator_f32, DELTA_CAL_JOINT_CALIBRATOR_F32_SIZE);

/* The solver of the joint calibrator. */
#define DELTA_CAL_JOINT_SOLVER_F32_SIZE 7168
typedef struct delta_cal_joint_solver_f32 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_JOINT_SOLVER_F32_SIZE];
} delta_cal_joint_solver_f32;
DELTA_CAL_OBJECT(delta_cal_joint_solver_f32, DELTA_CAL_JOINT_SOLVER_F32_SIZE);

/* A calibrated robot with the covariance of all 24 parameters. */
#define DELTA_CAL_JOINT_OUTCOME_F32_SIZE 2944
typedef struct delta_cal_joint_outcome_f32 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_JOINT_OUTCOME_F32_SIZE];
} delta_cal_joint_outcome_f32;
DELTA_CAL_OBJECT(delta_cal_joint_outcome_f32, DELTA_CAL_JOINT_OUTCOME_F32_SIZE);

/* The gate: tests each sample before the per-arm calibrator takes it in. */
#define DELTA_CAL_GATE_F32_SIZE 1280
typedef struct delta_cal_gate_f32 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_GATE_F32_SIZE];
} delta_cal_gate_f32;
DELTA_CAL_OBJECT(delta_cal_gate_f32, DELTA_CAL_GATE_F32_SIZE);

/* A robot calibrated from observations, and where the instruments are. */
#define DELTA_CAL_OBSERVATION_OUTCOME_F32_SIZE 6400
typedef struct delta_cal_observation_outcome_f32 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_OBSERVATION_OUTCOME_F32_SIZE];
} delta_cal_observation_outcome_f32;
DELTA_CAL_OBJECT(delta_cal_observation_outcome_f32, DELTA_CAL_OBSERVATION_OUTCOME_F32_SIZE);

/* Workspace for one observation. */
#define DELTA_CAL_OBSERVATION_ROW_F32_SIZE 192
typedef struct delta_cal_observation_row_f32 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_OBSERVATION_ROW_F32_SIZE];
} delta_cal_observation_row_f32;
DELTA_CAL_OBJECT(delta_cal_observation_row_f32, DELTA_CAL_OBSERVATION_ROW_F32_SIZE);

/* The bytes of a snapshot. */
#define DELTA_CAL_CALIBRATOR_SNAPSHOT_F32_SIZE 1316
#define DELTA_CAL_JOINT_CALIBRATOR_SNAPSHOT_F32_SIZE 3462
#define DELTA_CAL_GATE_SNAPSHOT_F32_SIZE 798

/* The robot as a data sheet gives it: three equal arms 120 degrees apart, no tilt. Lengths in any one
 * unit. */
typedef struct delta_cal_dimensions_f32 {
    /* From the base centre to the motor axes. Length. */
    float base_radius;
    /* From the platform point to the forearms' ends. Length. */
    float platform_radius;
    /* Upper arm. Length. */
    float upper_arm;
    /* Forearm. Length. */
    float forearm;
    /* Direction of the first arm; the others are 120 and 240 degrees further. Radians. */
    float azimuth;
} delta_cal_dimensions_f32;

/* One measurement: where the platform was at known joint angles. */
typedef struct delta_cal_sample_f32 {
    /* q1, q2, q3. Radians. */
    float joints[3];
    /* x, y, z. Length. */
    float position[3];
} delta_cal_sample_f32;

/* What a calibration assumes and how it is solved. All zeros are the defaults: noise and tolerance not
 * stated, Levenberg-Marquardt from the nominal robot. */
typedef struct delta_cal_settings_f32 {
    /* One sigma of the measured x, y and z; all four noises 0: not stated. Length. */
    float position_noise[3];
    /* One sigma of a joint angle. Radians. */
    float joint_noise;
    /* Manufacturing tolerance, one sigma of every length; both tolerances 0: not stated. Length. */
    float length_tolerance;
    /* Manufacturing tolerance, one sigma of theta and alpha. Radians. */
    float angle_tolerance;
    /* DELTA_CAL_LEVENBERG_MARQUARDT or DELTA_CAL_GAUSS_NEWTON. */
    int32_t solver;
    /* DELTA_CAL_START_NOMINAL or DELTA_CAL_START_FREE. */
    int32_t start;
    /* Linearisations allowed for each start; 0: 50. */
    uint32_t iteration_limit;
    /* 0. */
    uint32_t reserved;
} delta_cal_settings_f32;

/* How well one arm is known. */
typedef struct delta_cal_arm_summary_f32 {
    /* Samples taken in. */
    uint64_t samples;
    /* Linearisations of all starts together. */
    uint32_t iterations;
    /* DELTA_CAL_GRADIENT_VANISHED or DELTA_CAL_ROUNDING_REACHED. */
    int32_t termination;
    /* Where the result comes from: DELTA_CAL_USED_NOMINAL and so on. */
    int32_t start;
    /* 1 if there is a covariance, 0 if the noise is not stated and too few samples are left over to
     * estimate it. */
    int32_t has_covariance;
    /* 1 if estimated_noise was estimated, 0 with a stated noise, or if no sample is left over. */
    int32_t has_estimated_noise;
    /* 0. */
    int32_t reserved;
    /* Root mean square of the residuals: in sigma with a stated noise, otherwise length. */
    float residual_rms;
    /* One sigma of a residual, 0 if not estimated. Length. */
    float estimated_noise;
    /* Samples less parameters, as far as the samples and not the tolerance determine them. */
    float degrees_of_freedom;
    /* Condition number of the weighted Jacobian, its columns scaled to unit length; 1 is best. */
    float condition;
    /* For each parameter the share of the result that the tolerance decided and not the samples, 0 to 1. */
    float prior_share[8];
} delta_cal_arm_summary_f32;

/* What became of a sample. */
typedef struct delta_cal_verdict_f32 {
    /* DELTA_CAL_TAKEN, DELTA_CAL_UNTESTED or DELTA_CAL_REJECTED. */
    int32_t verdict;
    /* Why it was not tested: DELTA_CAL_NO_ESTIMATE or DELTA_CAL_NO_NOISE; otherwise DELTA_CAL_OK. */
    delta_cal_status reason;
    /* The arm whose part of the sample is furthest off, 0, 1 or 2; DELTA_CAL_NO_ARM if not tested. */
    int32_t arm;
    /* 0. */
    int32_t reserved;
    /* By how much the sample is off along that arm's forearm. Length. */
    float distance;
    /* The same over its sigma, which contains that of the prediction. */
    float normalized;
} delta_cal_verdict_f32;

/* How many samples came to what, and what that means. */
typedef struct delta_cal_gate_counts_f32 {
    /* Samples taken in, untested ones included. */
    uint64_t taken;
    /* Of them, those that could not be tested. */
    uint64_t untested;
    /* Samples rejected. */
    uint64_t rejected;
    /* By each arm; a sample that several reject counts for each. */
    uint64_t rejected_by_arm[3];
    /* Rejected samples since the last that was taken. */
    uint64_t run;
    /* The longest such run. */
    uint64_t longest_run;
    /* What the first long run of rejections means: DELTA_CAL_NO_ALARM, DELTA_CAL_ROBOT_CHANGED or
     * DELTA_CAL_EARLY_SAMPLES_WRONG. */
    int32_t alarm;
    /* 1 if the gate cannot test for want of an estimate, and there are samples enough to try and solve
     * one. */
    int32_t wants_estimate;
    /* The first sample of that run, counted from 0 over all that came; 0 without an alarm. */
    uint64_t alarm_sample;
} delta_cal_gate_counts_f32;

/* What was measured at one set of joint angles: any of the coordinates, a height, a distance. */
typedef struct delta_cal_observation_f32 {
    /* q1, q2, q3. Radians. */
    float joints[3];
    /* x, y, z, as far as they were measured. Length. */
    float position[3];
    /* Height of the platform point above a plane, along the plane's upward normal. Length. */
    float height;
    /* Distance of the platform point from a point, or from where it is at other_joints. Length. */
    float distance;
    /* The joint angles at the other end of a distance. Radians. */
    float other_joints[3];
    /* Which plane the height is above, from 0 on. */
    uint32_t plane;
    /* Which point the distance is from, from 0 on. */
    uint32_t point;
    /* What was measured: bits DELTA_CAL_READ_..., at most one of the two kinds of distance. */
    uint32_t readings;
    /* 0. */
    uint32_t reserved;
} delta_cal_observation_f32;

/* A plane z = c + a x + b y, whose c, a and b are unknown. */
typedef struct delta_cal_plane_f32 {
    /* What is known of c. Length. */
    float known;
    /* One sigma of that; 0: nothing is known. Length. */
    float sigma;
} delta_cal_plane_f32;

/* A fixed point, whose place is unknown. */
typedef struct delta_cal_point_f32 {
    /* What is known of the place: x, y, z. Length. */
    float known[3];
    /* One sigma of each coordinate; 0: nothing is known. Length. */
    float sigma;
    /* 1 if the sensor there reads a constant too much that is unknown, too; otherwise 0. */
    uint32_t has_offset;
    /* 0. */
    uint32_t reserved;
} delta_cal_point_f32;

/* What the readings refer to. All zeros: coordinates in the robot's own frame, no plane, no point. */
typedef struct delta_cal_instruments_f32 {
    /* DELTA_CAL_FRAME_BASE or DELTA_CAL_FRAME_SENSOR. */
    int32_t frame;
    /* How many planes there are. */
    uint32_t plane_count;
    /* How many points there are. */
    uint32_t point_count;
    /* 0. */
    uint32_t reserved;
    /* One sigma of a height; 0 where none is measured. Length. */
    float height_noise;
    /* One sigma of a distance; 0 where none is measured. Length. */
    float distance_noise;
    /* The planes that heights are measured above. */
    delta_cal_plane_f32 planes[DELTA_CAL_PLANES];
    /* The points that distances are measured from. */
    delta_cal_point_f32 points[DELTA_CAL_POINTS];
} delta_cal_instruments_f32;

/* Makes a robot from its dimensions, in size bytes of memory: write sizeof *robot.
 *
 * Errors: DELTA_CAL_GEOMETRY_.... */
delta_cal_status delta_cal_robot_from_dimensions_f32(
    delta_cal_robot_f32 *robot,
    size_t size,
    const delta_cal_dimensions_f32 *dimensions,
    delta_cal_error *error);

/* Makes a robot from its 24 parameters, in size bytes of memory: write sizeof *robot. Eight parameters an
 * arm, in the order DELTA_CAL_DX to DELTA_CAL_LB: lengths, and theta and alpha in radians.
 *
 * Errors: DELTA_CAL_GEOMETRY_.... */
delta_cal_status delta_cal_robot_from_parameters_f32(
    delta_cal_robot_f32 *robot,
    size_t size,
    const float parameters[24],
    delta_cal_error *error);

/* Writes a robot's 24 parameters, as delta_cal_robot_from_parameters_f32 takes them: lengths and radians. */
delta_cal_status delta_cal_robot_parameters_f32(const delta_cal_robot_f32 *robot, float parameters[24]);

/* Gives a robot the transmissions of its joints, which its kinematics and every calibration with it as
 * the nominal robot then use. Five numbers a joint: gain (no unit), c1, s1, c2 and s2 (radians). The
 * angle of the arm is q + gain q + c1 cos q + s1 sin q + c2 cos 2q + s2 sin 2q at the joint angle q.
 * Zeros take them away.
 *
 * Errors: DELTA_CAL_GEOMETRY_TRANSMISSION; the robot then keeps those that it had. */
delta_cal_status delta_cal_robot_set_transmissions_f32(
    delta_cal_robot_f32 *robot,
    const float transmissions[15],
    delta_cal_error *error);

/* Writes a robot's transmissions, as delta_cal_robot_set_transmissions_f32 takes them. */
delta_cal_status delta_cal_robot_transmissions_f32(const delta_cal_robot_f32 *robot, float transmissions[15]);

/* Forward kinematics: where the platform is at these joint angles. joints: q1, q2, q3, radians. position:
 * x, y, z, in the robot's unit of length.
 *
 * Errors: DELTA_CAL_UNREACHABLE, DELTA_CAL_SINGULAR_PARALLEL, DELTA_CAL_POSE_NOT_FINITE, each with the
 * arm. */
delta_cal_status delta_cal_robot_forward_f32(
    const delta_cal_robot_f32 *robot,
    const float joints[3],
    float position[3],
    delta_cal_error *error);

/* Inverse kinematics, elbows out: the joint angles at which the platform is at a position. position: x,
 * y, z, in the robot's unit of length. joints: q1, q2, q3, radians.
 *
 * Errors: DELTA_CAL_UNREACHABLE, DELTA_CAL_SINGULAR_SERIAL, DELTA_CAL_POSE_NOT_FINITE, each with the arm. */
delta_cal_status delta_cal_robot_inverse_f32(
    const delta_cal_robot_f32 *robot,
    const float position[3],
    float joints[3],
    delta_cal_error *error);

/* Makes a per-arm calibrator without samples, in size bytes of memory: write sizeof *calibrator. robot is
 * the robot before calibration, the nominal of the tolerance and the start of the iteration; it is
 * copied.
 *
 * Errors: DELTA_CAL_NOISE_..., DELTA_CAL_TOLERANCE_..., DELTA_CAL_NO_SUCH_CHOICE. */
delta_cal_status delta_cal_calibrator_init_f32(
    delta_cal_calibrator_f32 *calibrator,
    size_t size,
    const delta_cal_robot_f32 *robot,
    const delta_cal_settings_f32 *settings,
    delta_cal_error *error);

/* Takes in one sample; memory and time are the same for any number of samples.
 *
 * Errors: DELTA_CAL_SAMPLE_..., with the arm; nothing is taken in. */
delta_cal_status delta_cal_calibrator_add_f32(
    delta_cal_calibrator_f32 *calibrator,
    const delta_cal_sample_f32 *sample,
    delta_cal_error *error);

/* Writes how many samples were taken in. */
delta_cal_status delta_cal_calibrator_samples_f32(
    const delta_cal_calibrator_f32 *calibrator,
    uint64_t *samples);

/* Adds everything that another calibrator of the same robot and noise has seen.
 *
 * Errors: DELTA_CAL_DIFFERENT_NOMINAL; nothing is added. */
delta_cal_status delta_cal_calibrator_merge_f32(
    delta_cal_calibrator_f32 *calibrator,
    const delta_cal_calibrator_f32 *other);

/* Lets everything seen so far count lambda times as much, 0 to 1.
 *
 * Errors: DELTA_CAL_FORGETTING. */
delta_cal_status delta_cal_calibrator_forget_f32(delta_cal_calibrator_f32 *calibrator, float lambda);

/* Begins a calibration, in size bytes of memory: write sizeof *solver. Takes the samples in that wait.
 *
 * Errors: DELTA_CAL_TOO_FEW_SAMPLES, with the arm, how many there are and how many are needed. */
delta_cal_status delta_cal_solver_init_f32(
    delta_cal_solver_f32 *solver,
    size_t size,
    delta_cal_calibrator_f32 *calibrator,
    delta_cal_error *error);

/* One short step, to be called between the turns of a control loop. Returns DELTA_CAL_WORKING as long as
 * there is more to do, and DELTA_CAL_OK when the outcome is ready. calibrator is the one of
 * delta_cal_solver_init_f32.
 *
 * Errors: every refusal (DELTA_CAL_TOO_FEW_SAMPLES to DELTA_CAL_OVERFLOW), with arm and cause; the robot
 * keeps its parameters. */
delta_cal_status delta_cal_solver_step_f32(
    delta_cal_solver_f32 *solver,
    const delta_cal_calibrator_f32 *calibrator,
    delta_cal_error *error);

/* The calibrated robot, in size bytes of memory: write sizeof *outcome.
 *
 * Errors: DELTA_CAL_UNFINISHED before the last step, DELTA_CAL_IMPOSSIBLE_ROBOT. */
delta_cal_status delta_cal_solver_outcome_f32(
    const delta_cal_solver_f32 *solver,
    delta_cal_outcome_f32 *outcome,
    size_t size,
    delta_cal_error *error);

/* Makes a joint calibrator without samples, in size bytes of memory: write sizeof *calibrator. robot is
 * the robot before calibration, the nominal of the tolerance and the start of the iteration; it is
 * copied.
 *
 * Errors: DELTA_CAL_NOISE_..., DELTA_CAL_TOLERANCE_..., DELTA_CAL_NO_SUCH_CHOICE. */
delta_cal_status delta_cal_joint_calibrator_init_f32(
    delta_cal_joint_calibrator_f32 *calibrator,
    size_t size,
    const delta_cal_robot_f32 *robot,
    const delta_cal_settings_f32 *settings,
    delta_cal_error *error);

/* Takes in one sample; memory and time are the same for any number of samples.
 *
 * Errors: DELTA_CAL_SAMPLE_..., with the arm; nothing is taken in. */
delta_cal_status delta_cal_joint_calibrator_add_f32(
    delta_cal_joint_calibrator_f32 *calibrator,
    const delta_cal_sample_f32 *sample,
    delta_cal_error *error);

/* Works the samples in that still wait: the calibrator works several in at once.
 * delta_cal_joint_solver_init_f32 does it as well; do it a turn earlier where that call would take too
 * long. The result has the same bits. */
delta_cal_status delta_cal_joint_calibrator_flush_f32(delta_cal_joint_calibrator_f32 *calibrator);

/* Writes how many samples were taken in. */
delta_cal_status delta_cal_joint_calibrator_samples_f32(
    const delta_cal_joint_calibrator_f32 *calibrator,
    uint64_t *samples);

/* Adds everything that another calibrator of the same robot and noise has seen.
 *
 * Errors: DELTA_CAL_DIFFERENT_NOMINAL; nothing is added. */
delta_cal_status delta_cal_joint_calibrator_merge_f32(
    delta_cal_joint_calibrator_f32 *calibrator,
    const delta_cal_joint_calibrator_f32 *other);

/* Lets everything seen so far count lambda times as much, 0 to 1.
 *
 * Errors: DELTA_CAL_FORGETTING. */
delta_cal_status delta_cal_joint_calibrator_forget_f32(
    delta_cal_joint_calibrator_f32 *calibrator,
    float lambda);

/* Begins a calibration, in size bytes of memory: write sizeof *solver. Takes the samples in that wait.
 *
 * Errors: DELTA_CAL_TOO_FEW_SAMPLES, with the arm, how many there are and how many are needed. */
delta_cal_status delta_cal_joint_solver_init_f32(
    delta_cal_joint_solver_f32 *solver,
    size_t size,
    delta_cal_joint_calibrator_f32 *calibrator,
    delta_cal_error *error);

/* One short step, to be called between the turns of a control loop. Returns DELTA_CAL_WORKING as long as
 * there is more to do, and DELTA_CAL_OK when the outcome is ready. calibrator is the one of
 * delta_cal_joint_solver_init_f32.
 *
 * A refusal shows when the outcome is asked for. */
delta_cal_status delta_cal_joint_solver_step_f32(
    delta_cal_joint_solver_f32 *solver,
    const delta_cal_joint_calibrator_f32 *calibrator,
    delta_cal_error *error);

/* The calibrated robot, in size bytes of memory: write sizeof *outcome.
 *
 * calibrator is the one of delta_cal_joint_solver_init_f32.
 *
 * Errors: DELTA_CAL_UNFINISHED before the last step, and every refusal (DELTA_CAL_TOO_FEW_SAMPLES to
 * DELTA_CAL_OVERFLOW), with arm and cause; the robot keeps its parameters. */
delta_cal_status delta_cal_joint_solver_outcome_f32(
    const delta_cal_joint_solver_f32 *solver,
    const delta_cal_joint_calibrator_f32 *calibrator,
    delta_cal_joint_outcome_f32 *outcome,
    size_t size,
    delta_cal_error *error);

/* Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. */
delta_cal_status delta_cal_outcome_robot_f32(
    const delta_cal_outcome_f32 *outcome,
    delta_cal_robot_f32 *robot,
    size_t size);

/* Writes how well an arm is known; arm is 0, 1 or 2.
 *
 * Errors: DELTA_CAL_NO_SUCH_ARM. */
delta_cal_status delta_cal_outcome_arm_f32(
    const delta_cal_outcome_f32 *outcome,
    int32_t arm,
    delta_cal_arm_summary_f32 *summary);

/* Writes one sigma of each of the 24 parameters, eight an arm: length or radians.
 *
 * Errors: DELTA_CAL_NO_COVARIANCE. */
delta_cal_status delta_cal_outcome_deviations_f32(const delta_cal_outcome_f32 *outcome, float sigma[24]);

/* Writes the covariance of an arm's eight parameters, row by row: length^2, length radian, radian^2. arm
 * is 0, 1 or 2.
 *
 * Errors: DELTA_CAL_NO_SUCH_ARM, DELTA_CAL_NO_COVARIANCE. */
delta_cal_status delta_cal_outcome_covariance_f32(
    const delta_cal_outcome_f32 *outcome,
    int32_t arm,
    float covariance[64]);

/* Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. */
delta_cal_status delta_cal_joint_outcome_robot_f32(
    const delta_cal_joint_outcome_f32 *outcome,
    delta_cal_robot_f32 *robot,
    size_t size);

/* Writes how well an arm is known; arm is 0, 1 or 2. Residual and noise are the whole robot's.
 *
 * Errors: DELTA_CAL_NO_SUCH_ARM. */
delta_cal_status delta_cal_joint_outcome_arm_f32(
    const delta_cal_joint_outcome_f32 *outcome,
    int32_t arm,
    delta_cal_arm_summary_f32 *summary);

/* Writes one sigma of each of the 24 parameters, eight an arm: length or radians.
 *
 * Errors: DELTA_CAL_NO_COVARIANCE. */
delta_cal_status delta_cal_joint_outcome_deviations_f32(
    const delta_cal_joint_outcome_f32 *outcome,
    float sigma[24]);

/* Writes the covariance of all 24 parameters, eight an arm, row by row: length^2, length radian,
 * radian^2.
 *
 * Errors: DELTA_CAL_NO_COVARIANCE. */
delta_cal_status delta_cal_joint_outcome_covariance_f32(
    const delta_cal_joint_outcome_f32 *outcome,
    float covariance[576]);

/* Makes the outcome of each arm by itself, in size bytes of memory: write sizeof *arms. What the joint
 * outcome says of two arms together is left out. */
delta_cal_status delta_cal_joint_outcome_arms_f32(
    const delta_cal_joint_outcome_f32 *outcome,
    delta_cal_outcome_f32 *arms,
    size_t size);

/* Makes a gate in front of a per-arm calibrator, before its first sample or after the first few, in size
 * bytes of memory: write sizeof *gate. sigmas is its width; 0 for the width that rejects three good
 * samples in a million for each arm. With a stated noise and tolerance it tests from the first sample on;
 * otherwise it needs an estimate first, see delta_cal_gate_adopt_f32.
 *
 * Errors: DELTA_CAL_WIDTH_OF_GATE. */
delta_cal_status delta_cal_gate_init_f32(
    delta_cal_gate_f32 *gate,
    size_t size,
    delta_cal_calibrator_f32 *calibrator,
    float sigmas);

/* Tests one sample, and takes it into the calibrator unless it disagrees. calibrator is the one of
 * delta_cal_gate_init_f32. A sample that is rejected is no error: verdict says so.
 *
 * Errors: DELTA_CAL_SAMPLE_..., with the arm; nothing has changed. */
delta_cal_status delta_cal_gate_add_f32(
    delta_cal_gate_f32 *gate,
    delta_cal_calibrator_f32 *calibrator,
    const delta_cal_sample_f32 *sample,
    delta_cal_verdict_f32 *verdict,
    delta_cal_error *error);

/* Writes how many samples came to what, and whether there is an alarm. */
delta_cal_status delta_cal_gate_state_f32(const delta_cal_gate_f32 *gate, delta_cal_gate_counts_f32 *counts);

/* The gate predicts from this outcome from now on, which must be one of the samples of this calibrator. */
delta_cal_status delta_cal_gate_adopt_f32(
    delta_cal_gate_f32 *gate,
    delta_cal_calibrator_f32 *calibrator,
    const delta_cal_outcome_f32 *outcome);

/* Writes what the per-arm calibrator has seen into bytes, of which there are capacity: write
 * DELTA_CAL_CALIBRATOR_SNAPSHOT_..._SIZE. length is how many were written. They are the same on every
 * target. Store them where they outlast a power cut, and give them to delta_cal_calibrator_restore_f32.
 *
 * Errors: DELTA_CAL_SNAPSHOT_BUFFER. */
delta_cal_status delta_cal_calibrator_snapshot_f32(
    const delta_cal_calibrator_f32 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    uint64_t *length);

/* Puts what a snapshot holds in place of what the per-arm calibrator has seen. The calibrator must be of
 * the same robot and settings. It goes on to the same bits as the one that the snapshot is of.
 *
 * Errors: DELTA_CAL_SNAPSHOT_...; the calibrator is unchanged. */
delta_cal_status delta_cal_calibrator_restore_f32(
    delta_cal_calibrator_f32 *calibrator,
    const uint8_t *bytes,
    size_t length);

/* Writes what the joint calibrator has seen into bytes, of which there are capacity: write
 * DELTA_CAL_JOINT_CALIBRATOR_SNAPSHOT_..._SIZE. length is how many were written.
 *
 * Errors: DELTA_CAL_SNAPSHOT_BUFFER. */
delta_cal_status delta_cal_joint_calibrator_snapshot_f32(
    const delta_cal_joint_calibrator_f32 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    uint64_t *length);

/* Puts what a snapshot holds in place of what the joint calibrator has seen. The calibrator must be of
 * the same robot and settings. It goes on to the same bits as the one that the snapshot is of.
 *
 * Errors: DELTA_CAL_SNAPSHOT_...; the calibrator is unchanged. */
delta_cal_status delta_cal_joint_calibrator_restore_f32(
    delta_cal_joint_calibrator_f32 *calibrator,
    const uint8_t *bytes,
    size_t length);

/* Writes what the gate has seen into bytes, of which there are capacity: write
 * DELTA_CAL_GATE_SNAPSHOT_..._SIZE. length is how many were written. They belong to the snapshot of the
 * calibrator as it is now: store both together.
 *
 * Errors: DELTA_CAL_SNAPSHOT_BUFFER. */
delta_cal_status delta_cal_gate_snapshot_f32(
    const delta_cal_gate_f32 *gate,
    const delta_cal_calibrator_f32 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    uint64_t *length);

/* Puts what a snapshot holds in place of what the gate has seen. The gate must be of the same width. Make
 * the gate first, then restore the calibrator, then the gate: delta_cal_gate_init_f32 takes in the
 * samples that wait in the calibrator.
 *
 * Errors: DELTA_CAL_SNAPSHOT_...; the gate is unchanged. */
delta_cal_status delta_cal_gate_restore_f32(
    delta_cal_gate_f32 *gate,
    const delta_cal_calibrator_f32 *calibrator,
    const uint8_t *bytes,
    size_t length);

/* Calibrates a robot from count observations: touches on planes, distances, single coordinates, in any
 * mixture. robot is the robot before calibration. settings must state the noise of positions and joint
 * angles, and a tolerance unless x, y and z were measured often enough; instruments states the noise of
 * heights and distances. workspace is memory for count observations, workspace_size its size in bytes;
 * its content has no meaning before or after the call. size is sizeof *outcome.
 *
 * This is one long call, unlike the solvers: its time grows with count, and its temporaries lie on the
 * stack (docs/c.md states how much).
 *
 * Errors: DELTA_CAL_OBSERVATION_..., DELTA_CAL_SAMPLE_JOINT_..., DELTA_CAL_NO_SUCH_PLANE and ..._POINT
 * with the index of the observation; DELTA_CAL_TOO_MANY_UNKNOWNS, DELTA_CAL_NOISE_...,
 * DELTA_CAL_KNOWN_PLACE, and every refusal (DELTA_CAL_TOO_FEW_SAMPLES to DELTA_CAL_OVERFLOW). */
delta_cal_status delta_cal_observations_solve_f32(
    const delta_cal_robot_f32 *robot,
    const delta_cal_observation_f32 *observations,
    size_t count,
    const delta_cal_instruments_f32 *instruments,
    const delta_cal_settings_f32 *settings,
    delta_cal_observation_row_f32 *workspace,
    size_t workspace_size,
    delta_cal_observation_outcome_f32 *outcome,
    size_t size,
    delta_cal_error *error);

/* Makes the outcome of the robot's 24 parameters alone, in size bytes of memory: write sizeof *joint. Its
 * covariance takes the unknowns of the instruments into account. */
delta_cal_status delta_cal_observation_outcome_joint_f32(
    const delta_cal_observation_outcome_f32 *outcome,
    delta_cal_joint_outcome_f32 *joint,
    size_t size);

/* Writes where a plane z = c + a x + b y lies: c (length), a, b.
 *
 * Errors: DELTA_CAL_NO_SUCH_PLANE. */
delta_cal_status delta_cal_observation_outcome_plane_f32(
    const delta_cal_observation_outcome_f32 *outcome,
    uint32_t plane,
    float coefficients[3]);

/* Writes where a point is, and what the sensor there reads too much: x, y, z, offset. Length.
 *
 * Errors: DELTA_CAL_NO_SUCH_POINT. */
delta_cal_status delta_cal_observation_outcome_point_f32(
    const delta_cal_observation_outcome_f32 *outcome,
    uint32_t point,
    float place[4]);

/* Writes the frame in which coordinates were measured, from the robot's frame to it: the rotation row by
 * row, and the translation (length). The identity for DELTA_CAL_FRAME_BASE. */
delta_cal_status delta_cal_observation_outcome_frame_f32(
    const delta_cal_observation_outcome_f32 *outcome,
    float rotation[9],
    float translation[3]);

/* ---- Double precision ---- */

/* A robot: three arms of eight parameters. */
#define DELTA_CAL_ROBOT_F64_SIZE 752
typedef struct delta_cal_robot_f64 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_ROBOT_F64_SIZE];
} delta_cal_robot_f64;
DELTA_CAL_OBJECT(delta_cal_robot_f64, DELTA_CAL_ROBOT_F64_SIZE);

/* The per-arm calibrator: three arms' samples, each arm by itself. */
#define DELTA_CAL_CALIBRATOR_F64_SIZE 3968
typedef struct delta_cal_calibrator_f64 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_CALIBRATOR_F64_SIZE];
} delta_cal_calibrator_f64;
DELTA_CAL_OBJECT(delta_cal_calibrator_f64, DELTA_CAL_CALIBRATOR_F64_SIZE);

/* The solver of the per-arm calibrator. */
#define DELTA_CAL_SOLVER_F64_SIZE 4992
typedef struct delta_cal_solver_f64 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_SOLVER_F64_SIZE];
} delta_cal_solver_f64;
DELTA_CAL_OBJECT(delta_cal_solver_f64, DELTA_CAL_SOLVER_F64_SIZE);

/* A calibrated robot with the covariance of each arm. */
#define DELTA_CAL_OUTCOME_F64_SIZE 3392
typedef struct delta_cal_outcome_f64 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_OUTCOME_F64_SIZE];
} delta_cal_outcome_f64;
DELTA_CAL_OBJECT(delta_cal_outcome_f64, DELTA_CAL_OUTCOME_F64_SIZE);

/* The joint calibrator: all 24 parameters together. */
#define DELTA_CAL_JOINT_CALIBRATOR_F64_SIZE 8256
typedef struct delta_cal_joint_calibrator_f64 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_JOINT_CALIBRATOR_F64_SIZE];
} delta_cal_joint_calibrator_f64;
DELTA_CAL_OBJECT(delta_cal_joint_calibrator_f64, DELTA_CAL_JOINT_CALIBRATOR_F64_SIZE);

/* The solver of the joint calibrator. */
#define DELTA_CAL_JOINT_SOLVER_F64_SIZE 14208
typedef struct delta_cal_joint_solver_f64 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_JOINT_SOLVER_F64_SIZE];
} delta_cal_joint_solver_f64;
DELTA_CAL_OBJECT(delta_cal_joint_solver_f64, DELTA_CAL_JOINT_SOLVER_F64_SIZE);

/* A calibrated robot with the covariance of all 24 parameters. */
#define DELTA_CAL_JOINT_OUTCOME_F64_SIZE 5824
typedef struct delta_cal_joint_outcome_f64 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_JOINT_OUTCOME_F64_SIZE];
} delta_cal_joint_outcome_f64;
DELTA_CAL_OBJECT(delta_cal_joint_outcome_f64, DELTA_CAL_JOINT_OUTCOME_F64_SIZE);

/* The gate: tests each sample before the per-arm calibrator takes it in. */
#define DELTA_CAL_GATE_F64_SIZE 2368
typedef struct delta_cal_gate_f64 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_GATE_F64_SIZE];
} delta_cal_gate_f64;
DELTA_CAL_OBJECT(delta_cal_gate_f64, DELTA_CAL_GATE_F64_SIZE);

/* A robot calibrated from observations, and where the instruments are. */
#define DELTA_CAL_OBSERVATION_OUTCOME_F64_SIZE 12672
typedef struct delta_cal_observation_outcome_f64 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_OBSERVATION_OUTCOME_F64_SIZE];
} delta_cal_observation_outcome_f64;
DELTA_CAL_OBJECT(delta_cal_observation_outcome_f64, DELTA_CAL_OBSERVATION_OUTCOME_F64_SIZE);

/* Workspace for one observation. */
#define DELTA_CAL_OBSERVATION_ROW_F64_SIZE 368
typedef struct delta_cal_observation_row_f64 {
    DELTA_CAL_ALIGNED unsigned char memory[DELTA_CAL_OBSERVATION_ROW_F64_SIZE];
} delta_cal_observation_row_f64;
DELTA_CAL_OBJECT(delta_cal_observation_row_f64, DELTA_CAL_OBSERVATION_ROW_F64_SIZE);

/* The bytes of a snapshot. */
#define DELTA_CAL_CALIBRATOR_SNAPSHOT_F64_SIZE 2564
#define DELTA_CAL_JOINT_CALIBRATOR_SNAPSHOT_F64_SIZE 6890
#define DELTA_CAL_GATE_SNAPSHOT_F64_SIZE 1458

/* The robot as a data sheet gives it: three equal arms 120 degrees apart, no tilt. Lengths in any one
 * unit. */
typedef struct delta_cal_dimensions_f64 {
    /* From the base centre to the motor axes. Length. */
    double base_radius;
    /* From the platform point to the forearms' ends. Length. */
    double platform_radius;
    /* Upper arm. Length. */
    double upper_arm;
    /* Forearm. Length. */
    double forearm;
    /* Direction of the first arm; the others are 120 and 240 degrees further. Radians. */
    double azimuth;
} delta_cal_dimensions_f64;

/* One measurement: where the platform was at known joint angles. */
typedef struct delta_cal_sample_f64 {
    /* q1, q2, q3. Radians. */
    double joints[3];
    /* x, y, z. Length. */
    double position[3];
} delta_cal_sample_f64;

/* What a calibration assumes and how it is solved. All zeros are the defaults: noise and tolerance not
 * stated, Levenberg-Marquardt from the nominal robot. */
typedef struct delta_cal_settings_f64 {
    /* One sigma of the measured x, y and z; all four noises 0: not stated. Length. */
    double position_noise[3];
    /* One sigma of a joint angle. Radians. */
    double joint_noise;
    /* Manufacturing tolerance, one sigma of every length; both tolerances 0: not stated. Length. */
    double length_tolerance;
    /* Manufacturing tolerance, one sigma of theta and alpha. Radians. */
    double angle_tolerance;
    /* DELTA_CAL_LEVENBERG_MARQUARDT or DELTA_CAL_GAUSS_NEWTON. */
    int32_t solver;
    /* DELTA_CAL_START_NOMINAL or DELTA_CAL_START_FREE. */
    int32_t start;
    /* Linearisations allowed for each start; 0: 50. */
    uint32_t iteration_limit;
    /* 0. */
    uint32_t reserved;
} delta_cal_settings_f64;

/* How well one arm is known. */
typedef struct delta_cal_arm_summary_f64 {
    /* Samples taken in. */
    uint64_t samples;
    /* Linearisations of all starts together. */
    uint32_t iterations;
    /* DELTA_CAL_GRADIENT_VANISHED or DELTA_CAL_ROUNDING_REACHED. */
    int32_t termination;
    /* Where the result comes from: DELTA_CAL_USED_NOMINAL and so on. */
    int32_t start;
    /* 1 if there is a covariance, 0 if the noise is not stated and too few samples are left over to
     * estimate it. */
    int32_t has_covariance;
    /* 1 if estimated_noise was estimated, 0 with a stated noise, or if no sample is left over. */
    int32_t has_estimated_noise;
    /* 0. */
    int32_t reserved;
    /* Root mean square of the residuals: in sigma with a stated noise, otherwise length. */
    double residual_rms;
    /* One sigma of a residual, 0 if not estimated. Length. */
    double estimated_noise;
    /* Samples less parameters, as far as the samples and not the tolerance determine them. */
    double degrees_of_freedom;
    /* Condition number of the weighted Jacobian, its columns scaled to unit length; 1 is best. */
    double condition;
    /* For each parameter the share of the result that the tolerance decided and not the samples, 0 to 1. */
    double prior_share[8];
} delta_cal_arm_summary_f64;

/* What became of a sample. */
typedef struct delta_cal_verdict_f64 {
    /* DELTA_CAL_TAKEN, DELTA_CAL_UNTESTED or DELTA_CAL_REJECTED. */
    int32_t verdict;
    /* Why it was not tested: DELTA_CAL_NO_ESTIMATE or DELTA_CAL_NO_NOISE; otherwise DELTA_CAL_OK. */
    delta_cal_status reason;
    /* The arm whose part of the sample is furthest off, 0, 1 or 2; DELTA_CAL_NO_ARM if not tested. */
    int32_t arm;
    /* 0. */
    int32_t reserved;
    /* By how much the sample is off along that arm's forearm. Length. */
    double distance;
    /* The same over its sigma, which contains that of the prediction. */
    double normalized;
} delta_cal_verdict_f64;

/* How many samples came to what, and what that means. */
typedef struct delta_cal_gate_counts_f64 {
    /* Samples taken in, untested ones included. */
    uint64_t taken;
    /* Of them, those that could not be tested. */
    uint64_t untested;
    /* Samples rejected. */
    uint64_t rejected;
    /* By each arm; a sample that several reject counts for each. */
    uint64_t rejected_by_arm[3];
    /* Rejected samples since the last that was taken. */
    uint64_t run;
    /* The longest such run. */
    uint64_t longest_run;
    /* What the first long run of rejections means: DELTA_CAL_NO_ALARM, DELTA_CAL_ROBOT_CHANGED or
     * DELTA_CAL_EARLY_SAMPLES_WRONG. */
    int32_t alarm;
    /* 1 if the gate cannot test for want of an estimate, and there are samples enough to try and solve
     * one. */
    int32_t wants_estimate;
    /* The first sample of that run, counted from 0 over all that came; 0 without an alarm. */
    uint64_t alarm_sample;
} delta_cal_gate_counts_f64;

/* What was measured at one set of joint angles: any of the coordinates, a height, a distance. */
typedef struct delta_cal_observation_f64 {
    /* q1, q2, q3. Radians. */
    double joints[3];
    /* x, y, z, as far as they were measured. Length. */
    double position[3];
    /* Height of the platform point above a plane, along the plane's upward normal. Length. */
    double height;
    /* Distance of the platform point from a point, or from where it is at other_joints. Length. */
    double distance;
    /* The joint angles at the other end of a distance. Radians. */
    double other_joints[3];
    /* Which plane the height is above, from 0 on. */
    uint32_t plane;
    /* Which point the distance is from, from 0 on. */
    uint32_t point;
    /* What was measured: bits DELTA_CAL_READ_..., at most one of the two kinds of distance. */
    uint32_t readings;
    /* 0. */
    uint32_t reserved;
} delta_cal_observation_f64;

/* A plane z = c + a x + b y, whose c, a and b are unknown. */
typedef struct delta_cal_plane_f64 {
    /* What is known of c. Length. */
    double known;
    /* One sigma of that; 0: nothing is known. Length. */
    double sigma;
} delta_cal_plane_f64;

/* A fixed point, whose place is unknown. */
typedef struct delta_cal_point_f64 {
    /* What is known of the place: x, y, z. Length. */
    double known[3];
    /* One sigma of each coordinate; 0: nothing is known. Length. */
    double sigma;
    /* 1 if the sensor there reads a constant too much that is unknown, too; otherwise 0. */
    uint32_t has_offset;
    /* 0. */
    uint32_t reserved;
} delta_cal_point_f64;

/* What the readings refer to. All zeros: coordinates in the robot's own frame, no plane, no point. */
typedef struct delta_cal_instruments_f64 {
    /* DELTA_CAL_FRAME_BASE or DELTA_CAL_FRAME_SENSOR. */
    int32_t frame;
    /* How many planes there are. */
    uint32_t plane_count;
    /* How many points there are. */
    uint32_t point_count;
    /* 0. */
    uint32_t reserved;
    /* One sigma of a height; 0 where none is measured. Length. */
    double height_noise;
    /* One sigma of a distance; 0 where none is measured. Length. */
    double distance_noise;
    /* The planes that heights are measured above. */
    delta_cal_plane_f64 planes[DELTA_CAL_PLANES];
    /* The points that distances are measured from. */
    delta_cal_point_f64 points[DELTA_CAL_POINTS];
} delta_cal_instruments_f64;

/* Makes a robot from its dimensions, in size bytes of memory: write sizeof *robot.
 *
 * Errors: DELTA_CAL_GEOMETRY_.... */
delta_cal_status delta_cal_robot_from_dimensions_f64(
    delta_cal_robot_f64 *robot,
    size_t size,
    const delta_cal_dimensions_f64 *dimensions,
    delta_cal_error *error);

/* Makes a robot from its 24 parameters, in size bytes of memory: write sizeof *robot. Eight parameters an
 * arm, in the order DELTA_CAL_DX to DELTA_CAL_LB: lengths, and theta and alpha in radians.
 *
 * Errors: DELTA_CAL_GEOMETRY_.... */
delta_cal_status delta_cal_robot_from_parameters_f64(
    delta_cal_robot_f64 *robot,
    size_t size,
    const double parameters[24],
    delta_cal_error *error);

/* Writes a robot's 24 parameters, as delta_cal_robot_from_parameters_f64 takes them: lengths and radians. */
delta_cal_status delta_cal_robot_parameters_f64(const delta_cal_robot_f64 *robot, double parameters[24]);

/* Gives a robot the transmissions of its joints, which its kinematics and every calibration with it as
 * the nominal robot then use. Five numbers a joint: gain (no unit), c1, s1, c2 and s2 (radians). The
 * angle of the arm is q + gain q + c1 cos q + s1 sin q + c2 cos 2q + s2 sin 2q at the joint angle q.
 * Zeros take them away.
 *
 * Errors: DELTA_CAL_GEOMETRY_TRANSMISSION; the robot then keeps those that it had. */
delta_cal_status delta_cal_robot_set_transmissions_f64(
    delta_cal_robot_f64 *robot,
    const double transmissions[15],
    delta_cal_error *error);

/* Writes a robot's transmissions, as delta_cal_robot_set_transmissions_f64 takes them. */
delta_cal_status delta_cal_robot_transmissions_f64(
    const delta_cal_robot_f64 *robot,
    double transmissions[15]);

/* Forward kinematics: where the platform is at these joint angles. joints: q1, q2, q3, radians. position:
 * x, y, z, in the robot's unit of length.
 *
 * Errors: DELTA_CAL_UNREACHABLE, DELTA_CAL_SINGULAR_PARALLEL, DELTA_CAL_POSE_NOT_FINITE, each with the
 * arm. */
delta_cal_status delta_cal_robot_forward_f64(
    const delta_cal_robot_f64 *robot,
    const double joints[3],
    double position[3],
    delta_cal_error *error);

/* Inverse kinematics, elbows out: the joint angles at which the platform is at a position. position: x,
 * y, z, in the robot's unit of length. joints: q1, q2, q3, radians.
 *
 * Errors: DELTA_CAL_UNREACHABLE, DELTA_CAL_SINGULAR_SERIAL, DELTA_CAL_POSE_NOT_FINITE, each with the arm. */
delta_cal_status delta_cal_robot_inverse_f64(
    const delta_cal_robot_f64 *robot,
    const double position[3],
    double joints[3],
    delta_cal_error *error);

/* Makes a per-arm calibrator without samples, in size bytes of memory: write sizeof *calibrator. robot is
 * the robot before calibration, the nominal of the tolerance and the start of the iteration; it is
 * copied.
 *
 * Errors: DELTA_CAL_NOISE_..., DELTA_CAL_TOLERANCE_..., DELTA_CAL_NO_SUCH_CHOICE. */
delta_cal_status delta_cal_calibrator_init_f64(
    delta_cal_calibrator_f64 *calibrator,
    size_t size,
    const delta_cal_robot_f64 *robot,
    const delta_cal_settings_f64 *settings,
    delta_cal_error *error);

/* Takes in one sample; memory and time are the same for any number of samples.
 *
 * Errors: DELTA_CAL_SAMPLE_..., with the arm; nothing is taken in. */
delta_cal_status delta_cal_calibrator_add_f64(
    delta_cal_calibrator_f64 *calibrator,
    const delta_cal_sample_f64 *sample,
    delta_cal_error *error);

/* Writes how many samples were taken in. */
delta_cal_status delta_cal_calibrator_samples_f64(
    const delta_cal_calibrator_f64 *calibrator,
    uint64_t *samples);

/* Adds everything that another calibrator of the same robot and noise has seen.
 *
 * Errors: DELTA_CAL_DIFFERENT_NOMINAL; nothing is added. */
delta_cal_status delta_cal_calibrator_merge_f64(
    delta_cal_calibrator_f64 *calibrator,
    const delta_cal_calibrator_f64 *other);

/* Lets everything seen so far count lambda times as much, 0 to 1.
 *
 * Errors: DELTA_CAL_FORGETTING. */
delta_cal_status delta_cal_calibrator_forget_f64(delta_cal_calibrator_f64 *calibrator, double lambda);

/* Begins a calibration, in size bytes of memory: write sizeof *solver. Takes the samples in that wait.
 *
 * Errors: DELTA_CAL_TOO_FEW_SAMPLES, with the arm, how many there are and how many are needed. */
delta_cal_status delta_cal_solver_init_f64(
    delta_cal_solver_f64 *solver,
    size_t size,
    delta_cal_calibrator_f64 *calibrator,
    delta_cal_error *error);

/* One short step, to be called between the turns of a control loop. Returns DELTA_CAL_WORKING as long as
 * there is more to do, and DELTA_CAL_OK when the outcome is ready. calibrator is the one of
 * delta_cal_solver_init_f64.
 *
 * Errors: every refusal (DELTA_CAL_TOO_FEW_SAMPLES to DELTA_CAL_OVERFLOW), with arm and cause; the robot
 * keeps its parameters. */
delta_cal_status delta_cal_solver_step_f64(
    delta_cal_solver_f64 *solver,
    const delta_cal_calibrator_f64 *calibrator,
    delta_cal_error *error);

/* The calibrated robot, in size bytes of memory: write sizeof *outcome.
 *
 * Errors: DELTA_CAL_UNFINISHED before the last step, DELTA_CAL_IMPOSSIBLE_ROBOT. */
delta_cal_status delta_cal_solver_outcome_f64(
    const delta_cal_solver_f64 *solver,
    delta_cal_outcome_f64 *outcome,
    size_t size,
    delta_cal_error *error);

/* Makes a joint calibrator without samples, in size bytes of memory: write sizeof *calibrator. robot is
 * the robot before calibration, the nominal of the tolerance and the start of the iteration; it is
 * copied.
 *
 * Errors: DELTA_CAL_NOISE_..., DELTA_CAL_TOLERANCE_..., DELTA_CAL_NO_SUCH_CHOICE. */
delta_cal_status delta_cal_joint_calibrator_init_f64(
    delta_cal_joint_calibrator_f64 *calibrator,
    size_t size,
    const delta_cal_robot_f64 *robot,
    const delta_cal_settings_f64 *settings,
    delta_cal_error *error);

/* Takes in one sample; memory and time are the same for any number of samples.
 *
 * Errors: DELTA_CAL_SAMPLE_..., with the arm; nothing is taken in. */
delta_cal_status delta_cal_joint_calibrator_add_f64(
    delta_cal_joint_calibrator_f64 *calibrator,
    const delta_cal_sample_f64 *sample,
    delta_cal_error *error);

/* Works the samples in that still wait: the calibrator works several in at once.
 * delta_cal_joint_solver_init_f64 does it as well; do it a turn earlier where that call would take too
 * long. The result has the same bits. */
delta_cal_status delta_cal_joint_calibrator_flush_f64(delta_cal_joint_calibrator_f64 *calibrator);

/* Writes how many samples were taken in. */
delta_cal_status delta_cal_joint_calibrator_samples_f64(
    const delta_cal_joint_calibrator_f64 *calibrator,
    uint64_t *samples);

/* Adds everything that another calibrator of the same robot and noise has seen.
 *
 * Errors: DELTA_CAL_DIFFERENT_NOMINAL; nothing is added. */
delta_cal_status delta_cal_joint_calibrator_merge_f64(
    delta_cal_joint_calibrator_f64 *calibrator,
    const delta_cal_joint_calibrator_f64 *other);

/* Lets everything seen so far count lambda times as much, 0 to 1.
 *
 * Errors: DELTA_CAL_FORGETTING. */
delta_cal_status delta_cal_joint_calibrator_forget_f64(
    delta_cal_joint_calibrator_f64 *calibrator,
    double lambda);

/* Begins a calibration, in size bytes of memory: write sizeof *solver. Takes the samples in that wait.
 *
 * Errors: DELTA_CAL_TOO_FEW_SAMPLES, with the arm, how many there are and how many are needed. */
delta_cal_status delta_cal_joint_solver_init_f64(
    delta_cal_joint_solver_f64 *solver,
    size_t size,
    delta_cal_joint_calibrator_f64 *calibrator,
    delta_cal_error *error);

/* One short step, to be called between the turns of a control loop. Returns DELTA_CAL_WORKING as long as
 * there is more to do, and DELTA_CAL_OK when the outcome is ready. calibrator is the one of
 * delta_cal_joint_solver_init_f64.
 *
 * A refusal shows when the outcome is asked for. */
delta_cal_status delta_cal_joint_solver_step_f64(
    delta_cal_joint_solver_f64 *solver,
    const delta_cal_joint_calibrator_f64 *calibrator,
    delta_cal_error *error);

/* The calibrated robot, in size bytes of memory: write sizeof *outcome.
 *
 * calibrator is the one of delta_cal_joint_solver_init_f64.
 *
 * Errors: DELTA_CAL_UNFINISHED before the last step, and every refusal (DELTA_CAL_TOO_FEW_SAMPLES to
 * DELTA_CAL_OVERFLOW), with arm and cause; the robot keeps its parameters. */
delta_cal_status delta_cal_joint_solver_outcome_f64(
    const delta_cal_joint_solver_f64 *solver,
    const delta_cal_joint_calibrator_f64 *calibrator,
    delta_cal_joint_outcome_f64 *outcome,
    size_t size,
    delta_cal_error *error);

/* Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. */
delta_cal_status delta_cal_outcome_robot_f64(
    const delta_cal_outcome_f64 *outcome,
    delta_cal_robot_f64 *robot,
    size_t size);

/* Writes how well an arm is known; arm is 0, 1 or 2.
 *
 * Errors: DELTA_CAL_NO_SUCH_ARM. */
delta_cal_status delta_cal_outcome_arm_f64(
    const delta_cal_outcome_f64 *outcome,
    int32_t arm,
    delta_cal_arm_summary_f64 *summary);

/* Writes one sigma of each of the 24 parameters, eight an arm: length or radians.
 *
 * Errors: DELTA_CAL_NO_COVARIANCE. */
delta_cal_status delta_cal_outcome_deviations_f64(const delta_cal_outcome_f64 *outcome, double sigma[24]);

/* Writes the covariance of an arm's eight parameters, row by row: length^2, length radian, radian^2. arm
 * is 0, 1 or 2.
 *
 * Errors: DELTA_CAL_NO_SUCH_ARM, DELTA_CAL_NO_COVARIANCE. */
delta_cal_status delta_cal_outcome_covariance_f64(
    const delta_cal_outcome_f64 *outcome,
    int32_t arm,
    double covariance[64]);

/* Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. */
delta_cal_status delta_cal_joint_outcome_robot_f64(
    const delta_cal_joint_outcome_f64 *outcome,
    delta_cal_robot_f64 *robot,
    size_t size);

/* Writes how well an arm is known; arm is 0, 1 or 2. Residual and noise are the whole robot's.
 *
 * Errors: DELTA_CAL_NO_SUCH_ARM. */
delta_cal_status delta_cal_joint_outcome_arm_f64(
    const delta_cal_joint_outcome_f64 *outcome,
    int32_t arm,
    delta_cal_arm_summary_f64 *summary);

/* Writes one sigma of each of the 24 parameters, eight an arm: length or radians.
 *
 * Errors: DELTA_CAL_NO_COVARIANCE. */
delta_cal_status delta_cal_joint_outcome_deviations_f64(
    const delta_cal_joint_outcome_f64 *outcome,
    double sigma[24]);

/* Writes the covariance of all 24 parameters, eight an arm, row by row: length^2, length radian,
 * radian^2.
 *
 * Errors: DELTA_CAL_NO_COVARIANCE. */
delta_cal_status delta_cal_joint_outcome_covariance_f64(
    const delta_cal_joint_outcome_f64 *outcome,
    double covariance[576]);

/* Makes the outcome of each arm by itself, in size bytes of memory: write sizeof *arms. What the joint
 * outcome says of two arms together is left out. */
delta_cal_status delta_cal_joint_outcome_arms_f64(
    const delta_cal_joint_outcome_f64 *outcome,
    delta_cal_outcome_f64 *arms,
    size_t size);

/* Makes a gate in front of a per-arm calibrator, before its first sample or after the first few, in size
 * bytes of memory: write sizeof *gate. sigmas is its width; 0 for the width that rejects three good
 * samples in a million for each arm. With a stated noise and tolerance it tests from the first sample on;
 * otherwise it needs an estimate first, see delta_cal_gate_adopt_f64.
 *
 * Errors: DELTA_CAL_WIDTH_OF_GATE. */
delta_cal_status delta_cal_gate_init_f64(
    delta_cal_gate_f64 *gate,
    size_t size,
    delta_cal_calibrator_f64 *calibrator,
    double sigmas);

/* Tests one sample, and takes it into the calibrator unless it disagrees. calibrator is the one of
 * delta_cal_gate_init_f64. A sample that is rejected is no error: verdict says so.
 *
 * Errors: DELTA_CAL_SAMPLE_..., with the arm; nothing has changed. */
delta_cal_status delta_cal_gate_add_f64(
    delta_cal_gate_f64 *gate,
    delta_cal_calibrator_f64 *calibrator,
    const delta_cal_sample_f64 *sample,
    delta_cal_verdict_f64 *verdict,
    delta_cal_error *error);

/* Writes how many samples came to what, and whether there is an alarm. */
delta_cal_status delta_cal_gate_state_f64(const delta_cal_gate_f64 *gate, delta_cal_gate_counts_f64 *counts);

/* The gate predicts from this outcome from now on, which must be one of the samples of this calibrator. */
delta_cal_status delta_cal_gate_adopt_f64(
    delta_cal_gate_f64 *gate,
    delta_cal_calibrator_f64 *calibrator,
    const delta_cal_outcome_f64 *outcome);

/* Writes what the per-arm calibrator has seen into bytes, of which there are capacity: write
 * DELTA_CAL_CALIBRATOR_SNAPSHOT_..._SIZE. length is how many were written. They are the same on every
 * target. Store them where they outlast a power cut, and give them to delta_cal_calibrator_restore_f64.
 *
 * Errors: DELTA_CAL_SNAPSHOT_BUFFER. */
delta_cal_status delta_cal_calibrator_snapshot_f64(
    const delta_cal_calibrator_f64 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    uint64_t *length);

/* Puts what a snapshot holds in place of what the per-arm calibrator has seen. The calibrator must be of
 * the same robot and settings. It goes on to the same bits as the one that the snapshot is of.
 *
 * Errors: DELTA_CAL_SNAPSHOT_...; the calibrator is unchanged. */
delta_cal_status delta_cal_calibrator_restore_f64(
    delta_cal_calibrator_f64 *calibrator,
    const uint8_t *bytes,
    size_t length);

/* Writes what the joint calibrator has seen into bytes, of which there are capacity: write
 * DELTA_CAL_JOINT_CALIBRATOR_SNAPSHOT_..._SIZE. length is how many were written.
 *
 * Errors: DELTA_CAL_SNAPSHOT_BUFFER. */
delta_cal_status delta_cal_joint_calibrator_snapshot_f64(
    const delta_cal_joint_calibrator_f64 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    uint64_t *length);

/* Puts what a snapshot holds in place of what the joint calibrator has seen. The calibrator must be of
 * the same robot and settings. It goes on to the same bits as the one that the snapshot is of.
 *
 * Errors: DELTA_CAL_SNAPSHOT_...; the calibrator is unchanged. */
delta_cal_status delta_cal_joint_calibrator_restore_f64(
    delta_cal_joint_calibrator_f64 *calibrator,
    const uint8_t *bytes,
    size_t length);

/* Writes what the gate has seen into bytes, of which there are capacity: write
 * DELTA_CAL_GATE_SNAPSHOT_..._SIZE. length is how many were written. They belong to the snapshot of the
 * calibrator as it is now: store both together.
 *
 * Errors: DELTA_CAL_SNAPSHOT_BUFFER. */
delta_cal_status delta_cal_gate_snapshot_f64(
    const delta_cal_gate_f64 *gate,
    const delta_cal_calibrator_f64 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    uint64_t *length);

/* Puts what a snapshot holds in place of what the gate has seen. The gate must be of the same width. Make
 * the gate first, then restore the calibrator, then the gate: delta_cal_gate_init_f64 takes in the
 * samples that wait in the calibrator.
 *
 * Errors: DELTA_CAL_SNAPSHOT_...; the gate is unchanged. */
delta_cal_status delta_cal_gate_restore_f64(
    delta_cal_gate_f64 *gate,
    const delta_cal_calibrator_f64 *calibrator,
    const uint8_t *bytes,
    size_t length);

/* Calibrates a robot from count observations: touches on planes, distances, single coordinates, in any
 * mixture. robot is the robot before calibration. settings must state the noise of positions and joint
 * angles, and a tolerance unless x, y and z were measured often enough; instruments states the noise of
 * heights and distances. workspace is memory for count observations, workspace_size its size in bytes;
 * its content has no meaning before or after the call. size is sizeof *outcome.
 *
 * This is one long call, unlike the solvers: its time grows with count, and its temporaries lie on the
 * stack (docs/c.md states how much).
 *
 * Errors: DELTA_CAL_OBSERVATION_..., DELTA_CAL_SAMPLE_JOINT_..., DELTA_CAL_NO_SUCH_PLANE and ..._POINT
 * with the index of the observation; DELTA_CAL_TOO_MANY_UNKNOWNS, DELTA_CAL_NOISE_...,
 * DELTA_CAL_KNOWN_PLACE, and every refusal (DELTA_CAL_TOO_FEW_SAMPLES to DELTA_CAL_OVERFLOW). */
delta_cal_status delta_cal_observations_solve_f64(
    const delta_cal_robot_f64 *robot,
    const delta_cal_observation_f64 *observations,
    size_t count,
    const delta_cal_instruments_f64 *instruments,
    const delta_cal_settings_f64 *settings,
    delta_cal_observation_row_f64 *workspace,
    size_t workspace_size,
    delta_cal_observation_outcome_f64 *outcome,
    size_t size,
    delta_cal_error *error);

/* Makes the outcome of the robot's 24 parameters alone, in size bytes of memory: write sizeof *joint. Its
 * covariance takes the unknowns of the instruments into account. */
delta_cal_status delta_cal_observation_outcome_joint_f64(
    const delta_cal_observation_outcome_f64 *outcome,
    delta_cal_joint_outcome_f64 *joint,
    size_t size);

/* Writes where a plane z = c + a x + b y lies: c (length), a, b.
 *
 * Errors: DELTA_CAL_NO_SUCH_PLANE. */
delta_cal_status delta_cal_observation_outcome_plane_f64(
    const delta_cal_observation_outcome_f64 *outcome,
    uint32_t plane,
    double coefficients[3]);

/* Writes where a point is, and what the sensor there reads too much: x, y, z, offset. Length.
 *
 * Errors: DELTA_CAL_NO_SUCH_POINT. */
delta_cal_status delta_cal_observation_outcome_point_f64(
    const delta_cal_observation_outcome_f64 *outcome,
    uint32_t point,
    double place[4]);

/* Writes the frame in which coordinates were measured, from the robot's frame to it: the rotation row by
 * row, and the translation (length). The identity for DELTA_CAL_FRAME_BASE. */
delta_cal_status delta_cal_observation_outcome_frame_f64(
    const delta_cal_observation_outcome_f64 *outcome,
    double rotation[9],
    double translation[3]);

/* ---- What this compiler makes of it ---- */

DELTA_CAL_ASSERT(sizeof(delta_cal_arm_summary_f32) == 80, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_arm_summary_f64) == 128, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_dimensions_f32) == 20, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_dimensions_f64) == 40, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_error) == 48, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_gate_counts_f32) == 80, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_gate_counts_f64) == 80, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_instruments_f32) == 152, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_instruments_f64) == 256, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_observation_f32) == 60, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_observation_f64) == 104, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_plane_f32) == 8, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_plane_f64) == 16, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_point_f32) == 24, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_point_f64) == 40, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_sample_f32) == 24, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_sample_f64) == 48, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_settings_f32) == 40, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_settings_f64) == 64, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_verdict_f32) == 24, "the size of a structure");
DELTA_CAL_ASSERT(sizeof(delta_cal_verdict_f64) == 32, "the size of a structure");

#ifdef __cplusplus
}
#endif

#endif
