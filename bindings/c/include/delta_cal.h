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

/** The result of a call. The numbers never change. */
typedef int32_t dcal_status;

enum dcal_status_code {
    /** The call succeeded. */
    DCAL_OK = 0,
    /** The solver has more steps to run. */
    DCAL_WORKING = 1,
    /** A pointer is NULL. */
    DCAL_NULL_POINTER = 10,
    /** A pointer is not aligned as its type requires. */
    DCAL_MISALIGNED = 11,
    /** The stated size is smaller than the object. */
    DCAL_WRONG_SIZE = 12,
    /** The memory holds no object of this version of the library: it was never initialised, or it was
     * overwritten. */
    DCAL_NOT_INITIALIZED = 13,
    /** The memory holds an object of another kind. */
    DCAL_WRONG_KIND = 14,
    /** Two objects overlap. */
    DCAL_OVERLAP = 15,
    /** There is no arm with this index: the arms are 0, 1 and 2. */
    DCAL_NO_SUCH_ARM = 16,
    /** A choice is not one of the constants in the header. */
    DCAL_NO_SUCH_CHOICE = 17,
    /** The calibrator is solving: step it to the end, or stop it, before its samples change. */
    DCAL_BUSY = 18,
    /** The noise of positions must be greater than 0, and not too large to be squared. */
    DCAL_NOISE_OF_POSITION = 20,
    /** The noise of joint angles must be 0 or greater, and not too large to be squared. */
    DCAL_NOISE_OF_JOINT = 21,
    /** The noise of heights must be greater than 0, and not too small or large to be squared. */
    DCAL_NOISE_OF_HEIGHT = 22,
    /** The noise of distances must be greater than 0, and not too small or large to be squared. */
    DCAL_NOISE_OF_DISTANCE = 23,
    /** The tolerance of lengths must be greater than 0, and not too small or large to be squared. */
    DCAL_TOLERANCE_OF_LENGTH = 24,
    /** The tolerance of angles must be greater than 0, and not too small or large to be squared. */
    DCAL_TOLERANCE_OF_ANGLE = 25,
    /** The width of the gate must be a finite number greater than 0. */
    DCAL_WIDTH_OF_GATE = 26,
    /** The forgetting factor must lie between 0 and 1; the mean age of samples must be a finite number
     * greater than 0. */
    DCAL_FORGETTING = 27,
    /** The known position of an instrument must be finite, and its sigma must not be negative. */
    DCAL_KNOWN_PLACE = 28,
    /** The tolerance of the joints' zeros must be greater than 0, and not too small or large to be
     * squared. */
    DCAL_TOLERANCE_OF_JOINT_ZERO = 29,
    /** A parameter of the geometry is not a finite number. */
    DCAL_GEOMETRY_NOT_FINITE = 30,
    /** The length of an upper arm or forearm is not greater than 0. */
    DCAL_GEOMETRY_NOT_POSITIVE = 31,
    /** The tilt alpha must lie within 90 degrees. */
    DCAL_GEOMETRY_TILT = 32,
    /** The azimuth theta must lie within 360 degrees. */
    DCAL_GEOMETRY_AZIMUTH = 33,
    /** The radius of the base or platform is negative. */
    DCAL_GEOMETRY_RADIUS = 34,
    /** The arms have no common upward direction. */
    DCAL_GEOMETRY_NO_COMMON_UP = 35,
    /** A transmission is too far from exact: gain and harmonics together must be below 0.1. */
    DCAL_GEOMETRY_TRANSMISSION = 36,
    /** The forearms do not meet at these joint angles, or an arm does not reach the position. */
    DCAL_UNREACHABLE = 40,
    /** An upper arm and its forearm are in line: the edge of the workspace. */
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
    /** The two calibrators have different robots or noises. */
    DCAL_DIFFERENT_NOMINAL = 54,
    /** The observation has no reading. */
    DCAL_OBSERVATION_EMPTY = 60,
    /** A reading of the observation is not finite, or is thousands of forearms. */
    DCAL_OBSERVATION_NOT_FINITE = 61,
    /** A distance is not greater than 0. */
    DCAL_OBSERVATION_DISTANCE = 62,
    /** There is no plane with this index. */
    DCAL_NO_SUCH_PLANE = 63,
    /** There is no point with this index. */
    DCAL_NO_SUCH_POINT = 64,
    /** The nominal robot is at the same position in both poses of a distance. */
    DCAL_OBSERVATION_SAME_PLACE = 65,
    /** The instruments have more unknowns than there is room for, or more than four planes or points. */
    DCAL_TOO_MANY_UNKNOWNS = 66,
    /** There is no room for another observation. */
    DCAL_OBSERVATIONS_FULL = 67,
    /** The nominal robot does not reach the joint angles of the observation. */
    DCAL_OBSERVATION_UNREACHED = 68,
    /** There are fewer samples than needed. */
    DCAL_TOO_FEW_SAMPLES = 70,
    /** The poses do not determine the parameters. */
    DCAL_UNDETERMINED = 71,
    /** The noise leaves a parameter undetermined. */
    DCAL_UNCERTAIN = 72,
    /** The iteration did not converge within its limit. */
    DCAL_NOT_CONVERGED = 73,
    /** The residuals are larger than the stated noise, or without one the tolerance, allows. */
    DCAL_RESIDUAL_CONTRADICTS_NOISE = 74,
    /** A parameter is farther from nominal than the tolerance allows. */
    DCAL_FAR_FROM_NOMINAL = 75,
    /** The solution is not a valid arm. */
    DCAL_IMPOSSIBLE_GEOMETRY = 76,
    /** The three arms of the solution do not form a robot. */
    DCAL_IMPOSSIBLE_ROBOT = 77,
    /** The platform was measured above its elbows: the measuring frame is upside down or left-handed. */
    DCAL_WRONG_SIDE = 78,
    /** An instrument has fewer readings than unknowns. */
    DCAL_TOO_FEW_OBSERVATIONS = 79,
    /** The poses do not determine the position of an instrument. */
    DCAL_UNDETERMINED_INSTRUMENT = 80,
    /** The arithmetic overflowed. */
    DCAL_OVERFLOW = 81,
    /** The result was requested before the last step. */
    DCAL_UNFINISHED = 82,
    /** There is no covariance: the noise is not stated, and there are too few redundant samples to
     * estimate it. */
    DCAL_NO_COVARIANCE = 83,
    /** The sample was not tested: there is no estimate yet. */
    DCAL_NO_ESTIMATE = 90,
    /** The sample was not tested: the noise is neither stated nor estimated. */
    DCAL_NO_NOISE = 91,
    /** The gate rejected a run of samples: the robot or its measuring frame has changed. */
    DCAL_ROBOT_HAS_CHANGED = 92,
    /** The gate rejected a run of samples, after too few earlier ones to decide which are right. */
    DCAL_EARLY_SAMPLES = 93,
    /** The gate rejected too many samples to tell which are wrong. */
    DCAL_TOO_MANY_REJECTED = 94,
    /** The memory for the snapshot is shorter than the header states. */
    DCAL_SNAPSHOT_BUFFER = 100,
    /** The bytes are not a complete snapshot: truncated, damaged, or never written. */
    DCAL_SNAPSHOT_DAMAGED = 101,
    /** The snapshot is of another version of the library. */
    DCAL_SNAPSHOT_OTHER_VERSION = 102,
    /** The snapshot is of another kind of object, or in the other precision. */
    DCAL_SNAPSHOT_OTHER_KIND = 103,
    /** The snapshot is of another robot or other settings, or of a calibrator in another state. */
    DCAL_SNAPSHOT_OTHER_CALIBRATION = 104,
    /** A refusal that has no number in this version of the library. */
    DCAL_OTHER = 127
};

enum dcal_arm {
    /** Not an arm, in places that hold an arm's index. */
    DCAL_NO_ARM = -1
};

enum dcal_parameter {
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
    DCAL_LB = 7
};

enum dcal_solver {
    /** Levenberg-Marquardt: each step damped until it reduces the sum of squares. */
    DCAL_LEVENBERG_MARQUARDT = 0,
    /** Gauss-Newton: always the full step. */
    DCAL_GAUSS_NEWTON = 1
};

enum dcal_start {
    /** The iteration starts from the nominal robot. */
    DCAL_START_NOMINAL = 0,
    /** The iteration starts without a guess; needs 12 samples. Calibrations from any readings start from
     * the nominal robot all the same. No number of a solver: exchanged, both are refused. */
    DCAL_START_FREE = 2
};

enum dcal_termination {
    /** The iteration stopped because no step could reduce the sum of squares any further. */
    DCAL_GRADIENT_VANISHED = 0,
    /** The iteration stopped because the last step was of the size of rounding errors. */
    DCAL_ROUNDING_REACHED = 1
};

enum dcal_start_used {
    /** The result comes from the nominal robot. */
    DCAL_USED_NOMINAL = 0,
    /** The result comes from the start without a guess. */
    DCAL_USED_FREE = 1,
    /** The result comes from the search beside an earlier solution. */
    DCAL_USED_SEARCH = 2
};

enum dcal_verdict {
    /** The sample agrees with the prediction and was taken in. */
    DCAL_TAKEN = 0,
    /** The sample could not be tested and was taken in. */
    DCAL_UNTESTED = 1,
    /** The sample disagrees with the prediction and was not taken in. */
    DCAL_REJECTED = 2
};

enum dcal_alarm {
    /** No alarm. */
    DCAL_NO_ALARM = 0,
    /** The robot or its measuring frame has changed. */
    DCAL_ROBOT_CHANGED = 1,
    /** The samples before the run, or the stated robot and tolerance, are wrong, or the robot has changed. */
    DCAL_EARLY_SAMPLES_WRONG = 2
};

enum dcal_instrument {
    /** No instrument. */
    DCAL_NO_INSTRUMENT = 0,
    /** The frame in which coordinates were measured. */
    DCAL_FRAME = 1,
    /** A plane that heights were measured above. */
    DCAL_PLANE = 2,
    /** A point that distances were measured from. */
    DCAL_POINT = 3,
    /** The gear and encoder of a joint. */
    DCAL_TRANSMISSION = 4
};

enum dcal_frame {
    /** Coordinates are measured in the robot's own frame. */
    DCAL_FRAME_BASE = 0,
    /** Coordinates are measured in a frame that stands anywhere: six unknowns. */
    DCAL_FRAME_SENSOR = 1
};

enum dcal_reading {
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
    DCAL_READ_DISTANCE_BETWEEN = 32
};

enum dcal_limit {
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

/** For dcal_size. The numbers never change. */
enum dcal_kind {
    DCAL_ROBOT_F32 = 1025,
    DCAL_IKM_F32 = 1026,
    DCAL_JOINT_F32 = 1029,
    DCAL_GATE_F32 = 1032,
    DCAL_JOINT_GATE_F32 = 1034,
    DCAL_FKM_F32 = 1033,
    DCAL_ROBOT_F64 = 2049,
    DCAL_IKM_F64 = 2050,
    DCAL_JOINT_F64 = 2053,
    DCAL_GATE_F64 = 2056,
    DCAL_JOINT_GATE_F64 = 2058,
    DCAL_FKM_F64 = 2057
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
DCAL_ASSERT(sizeof(dcal_error) == sizeof(uint64_t)
    + sizeof(uint64_t)
    + sizeof(dcal_status)
    + sizeof(int32_t)
    + sizeof(int32_t)
    + sizeof(dcal_status)
    + sizeof(int32_t)
    + sizeof(uint32_t)
    + sizeof(float)
    + sizeof(uint32_t), "no padding");

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
#define DCAL_IKM_F32_SIZE 5296
typedef struct dcal_ikm_f32 {
    DCAL_ALIGNED unsigned char memory[DCAL_IKM_F32_SIZE];
} dcal_ikm_f32;
DCAL_OBJECT(dcal_ikm_f32, DCAL_IKM_F32_SIZE);

/** The joint calibrator: samples and solver, all 24 parameters together. */
#define DCAL_JOINT_F32_SIZE 11968
typedef struct dcal_joint_f32 {
    DCAL_ALIGNED unsigned char memory[DCAL_JOINT_F32_SIZE];
} dcal_joint_f32;
DCAL_OBJECT(dcal_joint_f32, DCAL_JOINT_F32_SIZE);

/** The per-arm calibrator behind a gate, which tests each sample before it is taken in. */
#define DCAL_GATE_F32_SIZE 6664
typedef struct dcal_gate_f32 {
    DCAL_ALIGNED unsigned char memory[DCAL_GATE_F32_SIZE];
} dcal_gate_f32;
DCAL_OBJECT(dcal_gate_f32, DCAL_GATE_F32_SIZE);

/** The joint calibrator behind a gate, which tests each sample before it is taken in. */
#define DCAL_JOINT_GATE_F32_SIZE 15432
typedef struct dcal_joint_gate_f32 {
    DCAL_ALIGNED unsigned char memory[DCAL_JOINT_GATE_F32_SIZE];
} dcal_joint_gate_f32;
DCAL_OBJECT(dcal_joint_gate_f32, DCAL_JOINT_GATE_F32_SIZE);

/** The calibrator from any readings: up to DCAL_FKM_ROWS observations and solver. */
#define DCAL_FKM_F32_SIZE 26304
typedef struct dcal_fkm_f32 {
    DCAL_ALIGNED unsigned char memory[DCAL_FKM_F32_SIZE];
} dcal_fkm_f32;
DCAL_OBJECT(dcal_fkm_f32, DCAL_FKM_F32_SIZE);

/** The bytes of a snapshot. */
#define DCAL_IKM_SNAPSHOT_F32_SIZE 1319
#define DCAL_JOINT_SNAPSHOT_F32_SIZE 3462
#define DCAL_GATE_SNAPSHOT_F32_SIZE 2133
#define DCAL_JOINT_GATE_SNAPSHOT_F32_SIZE 5579
#define DCAL_FKM_SNAPSHOT_F32_SIZE 3032

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
DCAL_ASSERT(sizeof(dcal_dimensions_f32) == sizeof(float)
    + sizeof(float)
    + sizeof(float)
    + sizeof(float)
    + sizeof(float), "no padding");

/** One measurement: where the platform was at known joint angles. */
typedef struct dcal_sample_f32 {
    /** q1, q2, q3. Radians. */
    float joints[3];
    /** x, y, z. Length. */
    float position[3];
} dcal_sample_f32;
DCAL_ASSERT(sizeof(dcal_sample_f32) == 3 * sizeof(float)
    + 3 * sizeof(float), "no padding");

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
DCAL_ASSERT(sizeof(dcal_settings_f32) == 3 * sizeof(float)
    + sizeof(float)
    + sizeof(float)
    + sizeof(float)
    + sizeof(float)
    + sizeof(int32_t)
    + sizeof(int32_t)
    + sizeof(uint32_t)
    + sizeof(uint32_t), "no padding");

/** How well one arm is known. */
typedef struct dcal_arm_summary_f32 {
    /** Number of samples. */
    uint64_t samples;
    /** Linearisations of all starts together. */
    uint32_t iterations;
    /** DCAL_GRADIENT_VANISHED or DCAL_ROUNDING_REACHED. */
    int32_t termination;
    /** The start that led to the result: DCAL_USED_NOMINAL and so on. */
    int32_t start;
    /** 1 if there is a covariance, 0 if the noise is not stated and there are too few redundant samples to
     * estimate it. */
    int32_t has_covariance;
    /** 1 if estimated_noise was estimated, 0 if the noise is stated or no sample is redundant. */
    int32_t has_estimated_noise;
    /** 0. */
    int32_t reserved;
    /** Root mean square of the residuals: in sigma with a stated noise, otherwise length. */
    float residual_rms;
    /** One sigma of a residual, 0 if not estimated. Length. */
    float estimated_noise;
    /** Number of samples minus number of parameters, as far as the samples and not the tolerance determine
     * them. */
    float degrees_of_freedom;
    /** Condition number of the weighted Jacobian with columns scaled to unit length; 1 is best. */
    float condition;
    /** The share of each parameter that comes from the tolerance rather than the samples, 0 to 1. */
    float prior_share[8];
} dcal_arm_summary_f32;
DCAL_ASSERT(sizeof(dcal_arm_summary_f32) == sizeof(uint64_t)
    + sizeof(uint32_t)
    + sizeof(int32_t)
    + sizeof(int32_t)
    + sizeof(int32_t)
    + sizeof(int32_t)
    + sizeof(int32_t)
    + sizeof(float)
    + sizeof(float)
    + sizeof(float)
    + sizeof(float)
    + 8 * sizeof(float), "no padding");

/** What happened to a sample. */
typedef struct dcal_verdict_f32 {
    /** DCAL_TAKEN, DCAL_UNTESTED or DCAL_REJECTED. */
    int32_t verdict;
    /** Why the sample was not tested: DCAL_NO_ESTIMATE or DCAL_NO_NOISE; otherwise DCAL_OK. */
    dcal_status reason;
    /** The arm with the largest deviation, 0, 1 or 2; DCAL_NO_ARM if not tested. */
    int32_t arm;
    /** 0. */
    int32_t reserved;
    /** The deviation along that arm's forearm. Length. */
    float distance;
    /** The deviation divided by its sigma, which includes that of the prediction. */
    float normalized;
} dcal_verdict_f32;
DCAL_ASSERT(sizeof(dcal_verdict_f32) == sizeof(int32_t)
    + sizeof(dcal_status)
    + sizeof(int32_t)
    + sizeof(int32_t)
    + sizeof(float)
    + sizeof(float), "no padding");

/** Sample counts and the alarm. */
typedef struct dcal_gate_counts_f32 {
    /** Samples accepted, including untested ones. */
    uint64_t taken;
    /** Accepted samples that could not be tested. */
    uint64_t untested;
    /** Samples rejected. */
    uint64_t rejected;
    /** Rejected by each arm; a sample rejected by several counts for each. */
    uint64_t rejected_by_arm[3];
    /** Rejected samples since the last accepted one. */
    uint64_t run;
    /** The longest such run. */
    uint64_t longest_run;
    /** The cause of the first long run of rejections: DCAL_NO_ALARM, DCAL_ROBOT_CHANGED or
     * DCAL_EARLY_SAMPLES_WRONG. */
    int32_t alarm;
    /** 0. */
    int32_t reserved;
    /** The first sample of that run, counted from 0 over all samples received; 0 without an alarm. */
    uint64_t alarm_sample;
} dcal_gate_counts_f32;
DCAL_ASSERT(sizeof(dcal_gate_counts_f32) == sizeof(uint64_t)
    + sizeof(uint64_t)
    + sizeof(uint64_t)
    + 3 * sizeof(uint64_t)
    + sizeof(uint64_t)
    + sizeof(uint64_t)
    + sizeof(int32_t)
    + sizeof(int32_t)
    + sizeof(uint64_t), "no padding");

/** What was measured at one set of joint angles: any of the coordinates, a height, a distance. */
typedef struct dcal_observation_f32 {
    /** q1, q2, q3. Radians. */
    float joints[3];
    /** x, y, z, where measured. Length. */
    float position[3];
    /** Height of the platform point above a plane, along the plane's upward normal. Length. */
    float height;
    /** Distance of the platform point from a point, or from where it is at other_joints. Length. */
    float distance;
    /** The joint angles at the other end of a distance. Radians. */
    float other_joints[3];
    /** Index of the plane below the height, from 0. */
    uint32_t plane;
    /** Index of the point that the distance is from, from 0. */
    uint32_t point;
    /** What was measured: bits DCAL_READ_..., at most one of the two kinds of distance. */
    uint32_t readings;
    /** 0. */
    uint32_t reserved;
} dcal_observation_f32;
DCAL_ASSERT(sizeof(dcal_observation_f32) == 3 * sizeof(float)
    + 3 * sizeof(float)
    + sizeof(float)
    + sizeof(float)
    + 3 * sizeof(float)
    + sizeof(uint32_t)
    + sizeof(uint32_t)
    + sizeof(uint32_t)
    + sizeof(uint32_t), "no padding");

/** A plane z = c + a x + b y with unknown c, a and b. */
typedef struct dcal_plane_f32 {
    /** The approximate c, if known. Length. */
    float known;
    /** One sigma of it; 0: unknown. Length. */
    float sigma;
    /** One sigma of the slopes a and b of a nearly level plane; 0: unknown. No unit. */
    float level;
} dcal_plane_f32;
DCAL_ASSERT(sizeof(dcal_plane_f32) == sizeof(float)
    + sizeof(float)
    + sizeof(float), "no padding");

/** A fixed point at an unknown position. */
typedef struct dcal_point_f32 {
    /** The approximate x, y, z, if known. Length. */
    float known[3];
    /** One sigma of each coordinate; 0: unknown. Length. */
    float sigma;
    /** 1 if the sensor there has an unknown constant offset, otherwise 0. */
    uint32_t has_offset;
    /** 0. */
    uint32_t reserved;
} dcal_point_f32;
DCAL_ASSERT(sizeof(dcal_point_f32) == 3 * sizeof(float)
    + sizeof(float)
    + sizeof(uint32_t)
    + sizeof(uint32_t), "no padding");

/** What the readings refer to. All zeros: coordinates in the robot's own frame, no planes, no points. */
typedef struct dcal_instruments_f32 {
    /** DCAL_FRAME_BASE or DCAL_FRAME_SENSOR. */
    int32_t frame;
    /** Number of planes. */
    uint32_t plane_count;
    /** Number of points. */
    uint32_t point_count;
    /** 0. */
    uint32_t reserved;
    /** One sigma of a height; 0 if none is measured. Length. */
    float height_noise;
    /** One sigma of a distance; 0 if none is measured. Length. */
    float distance_noise;
    /** The planes that heights are measured above. */
    dcal_plane_f32 planes[DCAL_PLANES];
    /** The points that distances are measured from. */
    dcal_point_f32 points[DCAL_POINTS];
} dcal_instruments_f32;
DCAL_ASSERT(sizeof(dcal_instruments_f32) == sizeof(int32_t)
    + sizeof(uint32_t)
    + sizeof(uint32_t)
    + sizeof(uint32_t)
    + sizeof(float)
    + sizeof(float)
    + DCAL_PLANES * sizeof(dcal_plane_f32)
    + DCAL_POINTS * sizeof(dcal_point_f32), "no padding");

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

/** Makes a calibrator without samples, in size bytes of memory: write sizeof *calibrator. robot is the
 * uncalibrated robot, the nominal of the tolerance and the start of the iteration; it is copied.
 *
 * Errors: DCAL_NOISE_..., DCAL_TOLERANCE_..., DCAL_NO_SUCH_CHOICE. */
dcal_status dcal_ikm_init_f32(
    dcal_ikm_f32 *calibrator,
    size_t size,
    const dcal_robot_f32 *robot,
    const dcal_settings_f32 *settings,
    dcal_error *error);

/** Adds one sample; memory and time are the same for any number of samples. The result of the last
 * dcal_ikm_solve_f32 is discarded.
 *
 * Errors: DCAL_BUSY, and DCAL_SAMPLE_... with the arm; nothing is added. */
dcal_status dcal_ikm_add_f32(dcal_ikm_f32 *calibrator, const dcal_sample_f32 *sample, dcal_error *error);

/** Processes waiting samples: the calibrator takes in several at once. dcal_ikm_solve_f32 does the same;
 * call this one turn of the control loop earlier if dcal_ikm_solve_f32 takes too long. The result has the
 * same bits. */
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

/** Starts solving. Until the last dcal_ikm_step_f32, or until dcal_ikm_stop_f32, every call that would
 * change the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_ikm_finish_f32 that are already known, such as DCAL_TOO_FEW_SAMPLES with the arm,
 * the number of samples and the number needed. Behind a gate also DCAL_ROBOT_HAS_CHANGED,
 * DCAL_EARLY_SAMPLES and DCAL_TOO_MANY_REJECTED; an earlier result is then gone. */
dcal_status dcal_ikm_solve_f32(dcal_ikm_f32 *calibrator, dcal_error *error);

/** Runs one short step, to be called between the turns of a control loop. Returns DCAL_WORKING while there
 * is more to do, then DCAL_OK: dcal_ikm_finish_f32 has the result, or says why there is none. */
dcal_status dcal_ikm_step_f32(dcal_ikm_f32 *calibrator);

/** DCAL_WORKING while dcal_ikm_step_f32 has work to do, of a gate possibly its own estimate; DCAL_OK
 * otherwise. */
dcal_status dcal_ikm_solving_f32(const dcal_ikm_f32 *calibrator);

/** DCAL_OK if a solve has finished and no sample was added since: dcal_ikm_finish_f32 then has the result
 * or the refusal. DCAL_UNFINISHED otherwise. */
dcal_status dcal_ikm_finished_f32(const dcal_ikm_f32 *calibrator);

/** Abandons what dcal_ikm_solve_f32 started. The samples stay. */
dcal_status dcal_ikm_stop_f32(dcal_ikm_f32 *calibrator);

/** Discards all samples and what was solved from them: as after dcal_ikm_init_f32. */
dcal_status dcal_ikm_reset_f32(dcal_ikm_f32 *calibrator);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. The result stays in the calibrator until its samples change.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to DCAL_OVERFLOW)
 * with its arm and cause; the robot keeps its parameters. */
dcal_status dcal_ikm_finish_f32(
    const dcal_ikm_f32 *calibrator,
    dcal_robot_f32 *robot,
    size_t size,
    dcal_error *error);

/** Writes how well an arm is known; arm is 0, 1 or 2. If the arms were solved together, residual and noise
 * are those of the whole robot.
 *
 * Errors: DCAL_NO_SUCH_ARM, and those of dcal_ikm_finish_f32. */
dcal_status dcal_ikm_arm_f32(const dcal_ikm_f32 *calibrator, int32_t arm, dcal_arm_summary_f32 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight per arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_ikm_finish_f32. */
dcal_status dcal_ikm_deviations_f32(const dcal_ikm_f32 *calibrator, float sigma[24]);

/** Writes the covariance of all 24 parameters, eight per arm, row by row: length^2, length radian,
 * radian^2. Arms that were solved separately have none between them: 0.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_ikm_finish_f32. */
dcal_status dcal_ikm_covariance_f32(const dcal_ikm_f32 *calibrator, float covariance[576]);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length receives the number written. They are the same on every target.
 * Store them where they survive a power cut, and give them to dcal_ikm_restore_f32.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. Of a gate also DCAL_BUSY. */
dcal_status dcal_ikm_snapshot_f32(
    const dcal_ikm_f32 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must have the same robot, noise and
 * instruments. It then computes the same bits as the calibrator that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_ikm_restore_f32(dcal_ikm_f32 *calibrator, const uint8_t *bytes, size_t length);

/** Makes a calibrator without samples, in size bytes of memory: write sizeof *calibrator. robot is the
 * uncalibrated robot, the nominal of the tolerance and the start of the iteration; it is copied.
 *
 * Errors: DCAL_NOISE_..., DCAL_TOLERANCE_..., DCAL_NO_SUCH_CHOICE. */
dcal_status dcal_joint_init_f32(
    dcal_joint_f32 *calibrator,
    size_t size,
    const dcal_robot_f32 *robot,
    const dcal_settings_f32 *settings,
    dcal_error *error);

/** Adds one sample; memory and time are the same for any number of samples. The result of the last
 * dcal_joint_solve_f32 is discarded.
 *
 * Errors: DCAL_BUSY, and DCAL_SAMPLE_... with the arm; nothing is added. */
dcal_status dcal_joint_add_f32(dcal_joint_f32 *calibrator, const dcal_sample_f32 *sample, dcal_error *error);

/** Processes waiting samples: the calibrator takes in several at once. dcal_joint_solve_f32 does the same;
 * call this one turn of the control loop earlier if dcal_joint_solve_f32 takes too long. The result has
 * the same bits. */
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

/** Starts solving. Until the last dcal_joint_step_f32, or until dcal_joint_stop_f32, every call that would
 * change the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_joint_finish_f32 that are already known, such as DCAL_TOO_FEW_SAMPLES with the
 * arm, the number of samples and the number needed. Behind a gate also DCAL_ROBOT_HAS_CHANGED,
 * DCAL_EARLY_SAMPLES and DCAL_TOO_MANY_REJECTED; an earlier result is then gone. */
dcal_status dcal_joint_solve_f32(dcal_joint_f32 *calibrator, dcal_error *error);

/** Runs one short step, to be called between the turns of a control loop. Returns DCAL_WORKING while there
 * is more to do, then DCAL_OK: dcal_joint_finish_f32 has the result, or says why there is none. */
dcal_status dcal_joint_step_f32(dcal_joint_f32 *calibrator);

/** DCAL_WORKING while dcal_joint_step_f32 has work to do, of a gate possibly its own estimate; DCAL_OK
 * otherwise. */
dcal_status dcal_joint_solving_f32(const dcal_joint_f32 *calibrator);

/** DCAL_OK if a solve has finished and no sample was added since: dcal_joint_finish_f32 then has the
 * result or the refusal. DCAL_UNFINISHED otherwise. */
dcal_status dcal_joint_finished_f32(const dcal_joint_f32 *calibrator);

/** Abandons what dcal_joint_solve_f32 started. The samples stay. */
dcal_status dcal_joint_stop_f32(dcal_joint_f32 *calibrator);

/** Discards all samples and what was solved from them: as after dcal_joint_init_f32. */
dcal_status dcal_joint_reset_f32(dcal_joint_f32 *calibrator);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. The result stays in the calibrator until its samples change.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to DCAL_OVERFLOW)
 * with its arm and cause; the robot keeps its parameters. */
dcal_status dcal_joint_finish_f32(
    const dcal_joint_f32 *calibrator,
    dcal_robot_f32 *robot,
    size_t size,
    dcal_error *error);

/** Writes how well an arm is known; arm is 0, 1 or 2. If the arms were solved together, residual and noise
 * are those of the whole robot.
 *
 * Errors: DCAL_NO_SUCH_ARM, and those of dcal_joint_finish_f32. */
dcal_status dcal_joint_arm_f32(const dcal_joint_f32 *calibrator, int32_t arm, dcal_arm_summary_f32 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight per arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_joint_finish_f32. */
dcal_status dcal_joint_deviations_f32(const dcal_joint_f32 *calibrator, float sigma[24]);

/** Writes the covariance of all 24 parameters, eight per arm, row by row: length^2, length radian,
 * radian^2. Arms that were solved separately have none between them: 0.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_joint_finish_f32. */
dcal_status dcal_joint_covariance_f32(const dcal_joint_f32 *calibrator, float covariance[576]);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length receives the number written. They are the same on every target.
 * Store them where they survive a power cut, and give them to dcal_joint_restore_f32.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. Of a gate also DCAL_BUSY. */
dcal_status dcal_joint_snapshot_f32(
    const dcal_joint_f32 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must have the same robot, noise and
 * instruments. It then computes the same bits as the calibrator that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_joint_restore_f32(dcal_joint_f32 *calibrator, const uint8_t *bytes, size_t length);

/** Makes a calibrator with a gate and without samples, in size bytes of memory: write sizeof *calibrator.
 * sigmas is the width of the gate; 0 selects the width that rejects three good samples in a million for
 * each arm. age is the mean age of the samples that count, for a robot that changes slowly; 0 if all
 * count equally. If noise and tolerance are stated, the gate tests from the first sample, otherwise from
 * its first estimate.
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

/** Tests one sample, and adds it unless it is rejected. A rejected sample is not an error: verdict reports
 * it. If the gate then needs an estimate of its own, call dcal_gate_step_f32 until it returns DCAL_OK,
 * before the next sample.
 *
 * Errors: DCAL_BUSY, and DCAL_SAMPLE_... with the arm; nothing has changed. */
dcal_status dcal_gate_add_f32(
    dcal_gate_f32 *calibrator,
    const dcal_sample_f32 *sample,
    dcal_verdict_f32 *verdict,
    dcal_error *error);

/** Writes the sample counts and the alarm, if any. */
dcal_status dcal_gate_state_f32(const dcal_gate_f32 *calibrator, dcal_gate_counts_f32 *state);

/** Answers the alarm and excuses all rejections so far: solving is possible again. Without forgetting the
 * rejected samples were wrong, and the samples before them stay; if the robot itself has changed, call
 * dcal_gate_reset_f32. With forgetting an alarm's answer discards the earlier samples, and the gate
 * begins again, as when new; its counts go on. */
dcal_status dcal_gate_acknowledge_f32(dcal_gate_f32 *calibrator);

/** Writes the number of samples. */
dcal_status dcal_gate_samples_f32(const dcal_gate_f32 *calibrator, uint64_t *samples);

/** Starts solving. Until the last dcal_gate_step_f32, or until dcal_gate_stop_f32, every call that would
 * change the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_gate_finish_f32 that are already known, such as DCAL_TOO_FEW_SAMPLES with the
 * arm, the number of samples and the number needed. Behind a gate also DCAL_ROBOT_HAS_CHANGED,
 * DCAL_EARLY_SAMPLES and DCAL_TOO_MANY_REJECTED; an earlier result is then gone. */
dcal_status dcal_gate_solve_f32(dcal_gate_f32 *calibrator, dcal_error *error);

/** Runs one short step, to be called between the turns of a control loop. Returns DCAL_WORKING while there
 * is more to do, then DCAL_OK: dcal_gate_finish_f32 has the result, or says why there is none. */
dcal_status dcal_gate_step_f32(dcal_gate_f32 *calibrator);

/** DCAL_WORKING while dcal_gate_step_f32 has work to do, of a gate possibly its own estimate; DCAL_OK
 * otherwise. */
dcal_status dcal_gate_solving_f32(const dcal_gate_f32 *calibrator);

/** DCAL_OK if a solve has finished and no sample was added since: dcal_gate_finish_f32 then has the result
 * or the refusal. DCAL_UNFINISHED otherwise. */
dcal_status dcal_gate_finished_f32(const dcal_gate_f32 *calibrator);

/** Abandons what dcal_gate_solve_f32 started. The samples stay. */
dcal_status dcal_gate_stop_f32(dcal_gate_f32 *calibrator);

/** Discards all samples and what was solved from them: as after dcal_gate_init_f32. */
dcal_status dcal_gate_reset_f32(dcal_gate_f32 *calibrator);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. The result stays in the calibrator until its samples change.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to DCAL_OVERFLOW)
 * with its arm and cause; the robot keeps its parameters. */
dcal_status dcal_gate_finish_f32(
    const dcal_gate_f32 *calibrator,
    dcal_robot_f32 *robot,
    size_t size,
    dcal_error *error);

/** Writes how well an arm is known; arm is 0, 1 or 2. If the arms were solved together, residual and noise
 * are those of the whole robot.
 *
 * Errors: DCAL_NO_SUCH_ARM, and those of dcal_gate_finish_f32. */
dcal_status dcal_gate_arm_f32(const dcal_gate_f32 *calibrator, int32_t arm, dcal_arm_summary_f32 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight per arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_gate_finish_f32. */
dcal_status dcal_gate_deviations_f32(const dcal_gate_f32 *calibrator, float sigma[24]);

/** Writes the covariance of all 24 parameters, eight per arm, row by row: length^2, length radian,
 * radian^2. Arms that were solved separately have none between them: 0.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_gate_finish_f32. */
dcal_status dcal_gate_covariance_f32(const dcal_gate_f32 *calibrator, float covariance[576]);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length receives the number written. They are the same on every target.
 * Store them where they survive a power cut, and give them to dcal_gate_restore_f32.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. Of a gate also DCAL_BUSY. */
dcal_status dcal_gate_snapshot_f32(
    const dcal_gate_f32 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must have the same robot, noise and
 * instruments. It then computes the same bits as the calibrator that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_gate_restore_f32(dcal_gate_f32 *calibrator, const uint8_t *bytes, size_t length);

/** Makes a calibrator with a gate and without samples, in size bytes of memory: write sizeof *calibrator.
 * sigmas is the width of the gate; 0 selects the width that rejects three good samples in a million for
 * each arm. age is the mean age of the samples that count, for a robot that changes slowly; 0 if all
 * count equally. If noise and tolerance are stated, the gate tests from the first sample, otherwise from
 * its first estimate.
 *
 * Errors: DCAL_NOISE_..., DCAL_TOLERANCE_..., DCAL_NO_SUCH_CHOICE, DCAL_WIDTH_OF_GATE, DCAL_FORGETTING. */
dcal_status dcal_joint_gate_init_f32(
    dcal_joint_gate_f32 *calibrator,
    size_t size,
    const dcal_robot_f32 *robot,
    const dcal_settings_f32 *settings,
    float sigmas,
    float age,
    dcal_error *error);

/** Tests one sample, and adds it unless it is rejected. A rejected sample is not an error: verdict reports
 * it. If the gate then needs an estimate of its own, call dcal_joint_gate_step_f32 until it returns
 * DCAL_OK, before the next sample.
 *
 * Errors: DCAL_BUSY, and DCAL_SAMPLE_... with the arm; nothing has changed. */
dcal_status dcal_joint_gate_add_f32(
    dcal_joint_gate_f32 *calibrator,
    const dcal_sample_f32 *sample,
    dcal_verdict_f32 *verdict,
    dcal_error *error);

/** Writes the sample counts and the alarm, if any. */
dcal_status dcal_joint_gate_state_f32(const dcal_joint_gate_f32 *calibrator, dcal_gate_counts_f32 *state);

/** Answers the alarm and excuses all rejections so far: solving is possible again. Without forgetting the
 * rejected samples were wrong, and the samples before them stay; if the robot itself has changed, call
 * dcal_joint_gate_reset_f32. With forgetting an alarm's answer discards the earlier samples, and the gate
 * begins again, as when new; its counts go on. */
dcal_status dcal_joint_gate_acknowledge_f32(dcal_joint_gate_f32 *calibrator);

/** Writes the number of samples. */
dcal_status dcal_joint_gate_samples_f32(const dcal_joint_gate_f32 *calibrator, uint64_t *samples);

/** Starts solving. Until the last dcal_joint_gate_step_f32, or until dcal_joint_gate_stop_f32, every call
 * that would change the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_joint_gate_finish_f32 that are already known, such as DCAL_TOO_FEW_SAMPLES with
 * the arm, the number of samples and the number needed. Behind a gate also DCAL_ROBOT_HAS_CHANGED,
 * DCAL_EARLY_SAMPLES and DCAL_TOO_MANY_REJECTED; an earlier result is then gone. */
dcal_status dcal_joint_gate_solve_f32(dcal_joint_gate_f32 *calibrator, dcal_error *error);

/** Runs one short step, to be called between the turns of a control loop. Returns DCAL_WORKING while there
 * is more to do, then DCAL_OK: dcal_joint_gate_finish_f32 has the result, or says why there is none. */
dcal_status dcal_joint_gate_step_f32(dcal_joint_gate_f32 *calibrator);

/** DCAL_WORKING while dcal_joint_gate_step_f32 has work to do, of a gate possibly its own estimate;
 * DCAL_OK otherwise. */
dcal_status dcal_joint_gate_solving_f32(const dcal_joint_gate_f32 *calibrator);

/** DCAL_OK if a solve has finished and no sample was added since: dcal_joint_gate_finish_f32 then has the
 * result or the refusal. DCAL_UNFINISHED otherwise. */
dcal_status dcal_joint_gate_finished_f32(const dcal_joint_gate_f32 *calibrator);

/** Abandons what dcal_joint_gate_solve_f32 started. The samples stay. */
dcal_status dcal_joint_gate_stop_f32(dcal_joint_gate_f32 *calibrator);

/** Discards all samples and what was solved from them: as after dcal_joint_gate_init_f32. */
dcal_status dcal_joint_gate_reset_f32(dcal_joint_gate_f32 *calibrator);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. The result stays in the calibrator until its samples change.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to DCAL_OVERFLOW)
 * with its arm and cause; the robot keeps its parameters. */
dcal_status dcal_joint_gate_finish_f32(
    const dcal_joint_gate_f32 *calibrator,
    dcal_robot_f32 *robot,
    size_t size,
    dcal_error *error);

/** Writes how well an arm is known; arm is 0, 1 or 2. If the arms were solved together, residual and noise
 * are those of the whole robot.
 *
 * Errors: DCAL_NO_SUCH_ARM, and those of dcal_joint_gate_finish_f32. */
dcal_status dcal_joint_gate_arm_f32(
    const dcal_joint_gate_f32 *calibrator,
    int32_t arm,
    dcal_arm_summary_f32 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight per arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_joint_gate_finish_f32. */
dcal_status dcal_joint_gate_deviations_f32(const dcal_joint_gate_f32 *calibrator, float sigma[24]);

/** Writes the covariance of all 24 parameters, eight per arm, row by row: length^2, length radian,
 * radian^2. Arms that were solved separately have none between them: 0.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_joint_gate_finish_f32. */
dcal_status dcal_joint_gate_covariance_f32(const dcal_joint_gate_f32 *calibrator, float covariance[576]);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length receives the number written. They are the same on every target.
 * Store them where they survive a power cut, and give them to dcal_joint_gate_restore_f32.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. Of a gate also DCAL_BUSY. */
dcal_status dcal_joint_gate_snapshot_f32(
    const dcal_joint_gate_f32 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must have the same robot, noise and
 * instruments. It then computes the same bits as the calibrator that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_joint_gate_restore_f32(dcal_joint_gate_f32 *calibrator, const uint8_t *bytes, size_t length);

/** Makes a calibrator without observations, in size bytes of memory: write sizeof *calibrator. robot is
 * the uncalibrated robot. settings must state the noise of positions and joint angles, and a tolerance
 * unless x, y and z are measured often enough; instruments states the noise of heights and distances.
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

/** Adds one observation, at most DCAL_FKM_ROWS in all. Every one that was added takes part in the
 * calibration.
 *
 * Errors: DCAL_OBSERVATION_..., also where the uncalibrated robot does not reach the joint angles;
 * DCAL_SAMPLE_JOINT_..., DCAL_NO_SUCH_PLANE and ..._POINT, DCAL_NOISE_... of a height or distance if it
 * is not stated, DCAL_NO_SUCH_CHOICE, DCAL_BUSY; nothing is added. */
dcal_status dcal_fkm_add_f32(
    dcal_fkm_f32 *calibrator,
    const dcal_observation_f32 *observation,
    dcal_error *error);

/** Writes c (length), a and b of a plane z = c + a x + b y.
 *
 * Errors: DCAL_NO_SUCH_PLANE, and those of dcal_fkm_finish_f32. */
dcal_status dcal_fkm_plane_f32(const dcal_fkm_f32 *calibrator, uint32_t plane, float coefficients[3]);

/** Writes the position of a point and the offset of its sensor: x, y, z, offset. Length.
 *
 * Errors: DCAL_NO_SUCH_POINT, and those of dcal_fkm_finish_f32. */
dcal_status dcal_fkm_point_f32(const dcal_fkm_f32 *calibrator, uint32_t point, float place[4]);

/** Writes the transform from the robot's frame to that of the measured coordinates: the rotation row by
 * row, and the translation (length). The identity for DCAL_FRAME_BASE.
 *
 * Errors: those of dcal_fkm_finish_f32. */
dcal_status dcal_fkm_frame_f32(const dcal_fkm_f32 *calibrator, float rotation[9], float translation[3]);

/** Writes the number of samples. */
dcal_status dcal_fkm_samples_f32(const dcal_fkm_f32 *calibrator, uint64_t *samples);

/** Starts solving. Until the last dcal_fkm_step_f32, or until dcal_fkm_stop_f32, every call that would
 * change the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_fkm_finish_f32 that are already known, such as DCAL_TOO_FEW_SAMPLES with the arm,
 * the number of samples and the number needed. Behind a gate also DCAL_ROBOT_HAS_CHANGED,
 * DCAL_EARLY_SAMPLES and DCAL_TOO_MANY_REJECTED; an earlier result is then gone. */
dcal_status dcal_fkm_solve_f32(dcal_fkm_f32 *calibrator, dcal_error *error);

/** Runs one short step, to be called between the turns of a control loop. Returns DCAL_WORKING while there
 * is more to do, then DCAL_OK: dcal_fkm_finish_f32 has the result, or says why there is none. */
dcal_status dcal_fkm_step_f32(dcal_fkm_f32 *calibrator);

/** DCAL_WORKING while dcal_fkm_step_f32 has work to do, of a gate possibly its own estimate; DCAL_OK
 * otherwise. */
dcal_status dcal_fkm_solving_f32(const dcal_fkm_f32 *calibrator);

/** DCAL_OK if a solve has finished and no sample was added since: dcal_fkm_finish_f32 then has the result
 * or the refusal. DCAL_UNFINISHED otherwise. */
dcal_status dcal_fkm_finished_f32(const dcal_fkm_f32 *calibrator);

/** Abandons what dcal_fkm_solve_f32 started. The samples stay. */
dcal_status dcal_fkm_stop_f32(dcal_fkm_f32 *calibrator);

/** Discards all samples and what was solved from them: as after dcal_fkm_init_f32. */
dcal_status dcal_fkm_reset_f32(dcal_fkm_f32 *calibrator);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. The result stays in the calibrator until its samples change.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to DCAL_OVERFLOW)
 * with its arm and cause; the robot keeps its parameters. */
dcal_status dcal_fkm_finish_f32(
    const dcal_fkm_f32 *calibrator,
    dcal_robot_f32 *robot,
    size_t size,
    dcal_error *error);

/** Writes how well an arm is known; arm is 0, 1 or 2. If the arms were solved together, residual and noise
 * are those of the whole robot.
 *
 * Errors: DCAL_NO_SUCH_ARM, and those of dcal_fkm_finish_f32. */
dcal_status dcal_fkm_arm_f32(const dcal_fkm_f32 *calibrator, int32_t arm, dcal_arm_summary_f32 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight per arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_fkm_finish_f32. */
dcal_status dcal_fkm_deviations_f32(const dcal_fkm_f32 *calibrator, float sigma[24]);

/** Writes the covariance of all 24 parameters, eight per arm, row by row: length^2, length radian,
 * radian^2. Arms that were solved separately have none between them: 0.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_fkm_finish_f32. */
dcal_status dcal_fkm_covariance_f32(const dcal_fkm_f32 *calibrator, float covariance[576]);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length receives the number written. They are the same on every target.
 * Store them where they survive a power cut, and give them to dcal_fkm_restore_f32.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. Of a gate also DCAL_BUSY. */
dcal_status dcal_fkm_snapshot_f32(
    const dcal_fkm_f32 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must have the same robot, noise and
 * instruments. It then computes the same bits as the calibrator that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_fkm_restore_f32(dcal_fkm_f32 *calibrator, const uint8_t *bytes, size_t length);

/* ---- Double precision ---- */

/** A robot: three arms of eight parameters. */
#define DCAL_ROBOT_F64_SIZE 752
typedef struct dcal_robot_f64 {
    DCAL_ALIGNED unsigned char memory[DCAL_ROBOT_F64_SIZE];
} dcal_robot_f64;
DCAL_OBJECT(dcal_robot_f64, DCAL_ROBOT_F64_SIZE);

/** The per-arm calibrator: samples and solver, each arm by itself. */
#define DCAL_IKM_F64_SIZE 10272
typedef struct dcal_ikm_f64 {
    DCAL_ALIGNED unsigned char memory[DCAL_IKM_F64_SIZE];
} dcal_ikm_f64;
DCAL_OBJECT(dcal_ikm_f64, DCAL_IKM_F64_SIZE);

/** The joint calibrator: samples and solver, all 24 parameters together. */
#define DCAL_JOINT_F64_SIZE 23776
typedef struct dcal_joint_f64 {
    DCAL_ALIGNED unsigned char memory[DCAL_JOINT_F64_SIZE];
} dcal_joint_f64;
DCAL_OBJECT(dcal_joint_f64, DCAL_JOINT_F64_SIZE);

/** The per-arm calibrator behind a gate, which tests each sample before it is taken in. */
#define DCAL_GATE_F64_SIZE 12816
typedef struct dcal_gate_f64 {
    DCAL_ALIGNED unsigned char memory[DCAL_GATE_F64_SIZE];
} dcal_gate_f64;
DCAL_OBJECT(dcal_gate_f64, DCAL_GATE_F64_SIZE);

/** The joint calibrator behind a gate, which tests each sample before it is taken in. */
#define DCAL_JOINT_GATE_F64_SIZE 30352
typedef struct dcal_joint_gate_f64 {
    DCAL_ALIGNED unsigned char memory[DCAL_JOINT_GATE_F64_SIZE];
} dcal_joint_gate_f64;
DCAL_OBJECT(dcal_joint_gate_f64, DCAL_JOINT_GATE_F64_SIZE);

/** The calibrator from any readings: up to DCAL_FKM_ROWS observations and solver. */
#define DCAL_FKM_F64_SIZE 52448
typedef struct dcal_fkm_f64 {
    DCAL_ALIGNED unsigned char memory[DCAL_FKM_F64_SIZE];
} dcal_fkm_f64;
DCAL_OBJECT(dcal_fkm_f64, DCAL_FKM_F64_SIZE);

/** The bytes of a snapshot. */
#define DCAL_IKM_SNAPSHOT_F64_SIZE 2567
#define DCAL_JOINT_SNAPSHOT_F64_SIZE 6890
#define DCAL_GATE_SNAPSHOT_F64_SIZE 4041
#define DCAL_JOINT_GATE_SNAPSHOT_F64_SIZE 10915
#define DCAL_FKM_SNAPSHOT_F64_SIZE 5848

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
DCAL_ASSERT(sizeof(dcal_dimensions_f64) == sizeof(double)
    + sizeof(double)
    + sizeof(double)
    + sizeof(double)
    + sizeof(double), "no padding");

/** One measurement: where the platform was at known joint angles. */
typedef struct dcal_sample_f64 {
    /** q1, q2, q3. Radians. */
    double joints[3];
    /** x, y, z. Length. */
    double position[3];
} dcal_sample_f64;
DCAL_ASSERT(sizeof(dcal_sample_f64) == 3 * sizeof(double)
    + 3 * sizeof(double), "no padding");

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
DCAL_ASSERT(sizeof(dcal_settings_f64) == 3 * sizeof(double)
    + sizeof(double)
    + sizeof(double)
    + sizeof(double)
    + sizeof(double)
    + sizeof(int32_t)
    + sizeof(int32_t)
    + sizeof(uint32_t)
    + sizeof(uint32_t), "no padding");

/** How well one arm is known. */
typedef struct dcal_arm_summary_f64 {
    /** Number of samples. */
    uint64_t samples;
    /** Linearisations of all starts together. */
    uint32_t iterations;
    /** DCAL_GRADIENT_VANISHED or DCAL_ROUNDING_REACHED. */
    int32_t termination;
    /** The start that led to the result: DCAL_USED_NOMINAL and so on. */
    int32_t start;
    /** 1 if there is a covariance, 0 if the noise is not stated and there are too few redundant samples to
     * estimate it. */
    int32_t has_covariance;
    /** 1 if estimated_noise was estimated, 0 if the noise is stated or no sample is redundant. */
    int32_t has_estimated_noise;
    /** 0. */
    int32_t reserved;
    /** Root mean square of the residuals: in sigma with a stated noise, otherwise length. */
    double residual_rms;
    /** One sigma of a residual, 0 if not estimated. Length. */
    double estimated_noise;
    /** Number of samples minus number of parameters, as far as the samples and not the tolerance determine
     * them. */
    double degrees_of_freedom;
    /** Condition number of the weighted Jacobian with columns scaled to unit length; 1 is best. */
    double condition;
    /** The share of each parameter that comes from the tolerance rather than the samples, 0 to 1. */
    double prior_share[8];
} dcal_arm_summary_f64;
DCAL_ASSERT(sizeof(dcal_arm_summary_f64) == sizeof(uint64_t)
    + sizeof(uint32_t)
    + sizeof(int32_t)
    + sizeof(int32_t)
    + sizeof(int32_t)
    + sizeof(int32_t)
    + sizeof(int32_t)
    + sizeof(double)
    + sizeof(double)
    + sizeof(double)
    + sizeof(double)
    + 8 * sizeof(double), "no padding");

/** What happened to a sample. */
typedef struct dcal_verdict_f64 {
    /** DCAL_TAKEN, DCAL_UNTESTED or DCAL_REJECTED. */
    int32_t verdict;
    /** Why the sample was not tested: DCAL_NO_ESTIMATE or DCAL_NO_NOISE; otherwise DCAL_OK. */
    dcal_status reason;
    /** The arm with the largest deviation, 0, 1 or 2; DCAL_NO_ARM if not tested. */
    int32_t arm;
    /** 0. */
    int32_t reserved;
    /** The deviation along that arm's forearm. Length. */
    double distance;
    /** The deviation divided by its sigma, which includes that of the prediction. */
    double normalized;
} dcal_verdict_f64;
DCAL_ASSERT(sizeof(dcal_verdict_f64) == sizeof(int32_t)
    + sizeof(dcal_status)
    + sizeof(int32_t)
    + sizeof(int32_t)
    + sizeof(double)
    + sizeof(double), "no padding");

/** Sample counts and the alarm. */
typedef struct dcal_gate_counts_f64 {
    /** Samples accepted, including untested ones. */
    uint64_t taken;
    /** Accepted samples that could not be tested. */
    uint64_t untested;
    /** Samples rejected. */
    uint64_t rejected;
    /** Rejected by each arm; a sample rejected by several counts for each. */
    uint64_t rejected_by_arm[3];
    /** Rejected samples since the last accepted one. */
    uint64_t run;
    /** The longest such run. */
    uint64_t longest_run;
    /** The cause of the first long run of rejections: DCAL_NO_ALARM, DCAL_ROBOT_CHANGED or
     * DCAL_EARLY_SAMPLES_WRONG. */
    int32_t alarm;
    /** 0. */
    int32_t reserved;
    /** The first sample of that run, counted from 0 over all samples received; 0 without an alarm. */
    uint64_t alarm_sample;
} dcal_gate_counts_f64;
DCAL_ASSERT(sizeof(dcal_gate_counts_f64) == sizeof(uint64_t)
    + sizeof(uint64_t)
    + sizeof(uint64_t)
    + 3 * sizeof(uint64_t)
    + sizeof(uint64_t)
    + sizeof(uint64_t)
    + sizeof(int32_t)
    + sizeof(int32_t)
    + sizeof(uint64_t), "no padding");

/** What was measured at one set of joint angles: any of the coordinates, a height, a distance. */
typedef struct dcal_observation_f64 {
    /** q1, q2, q3. Radians. */
    double joints[3];
    /** x, y, z, where measured. Length. */
    double position[3];
    /** Height of the platform point above a plane, along the plane's upward normal. Length. */
    double height;
    /** Distance of the platform point from a point, or from where it is at other_joints. Length. */
    double distance;
    /** The joint angles at the other end of a distance. Radians. */
    double other_joints[3];
    /** Index of the plane below the height, from 0. */
    uint32_t plane;
    /** Index of the point that the distance is from, from 0. */
    uint32_t point;
    /** What was measured: bits DCAL_READ_..., at most one of the two kinds of distance. */
    uint32_t readings;
    /** 0. */
    uint32_t reserved;
} dcal_observation_f64;
DCAL_ASSERT(sizeof(dcal_observation_f64) == 3 * sizeof(double)
    + 3 * sizeof(double)
    + sizeof(double)
    + sizeof(double)
    + 3 * sizeof(double)
    + sizeof(uint32_t)
    + sizeof(uint32_t)
    + sizeof(uint32_t)
    + sizeof(uint32_t), "no padding");

/** A plane z = c + a x + b y with unknown c, a and b. */
typedef struct dcal_plane_f64 {
    /** The approximate c, if known. Length. */
    double known;
    /** One sigma of it; 0: unknown. Length. */
    double sigma;
    /** One sigma of the slopes a and b of a nearly level plane; 0: unknown. No unit. */
    double level;
} dcal_plane_f64;
DCAL_ASSERT(sizeof(dcal_plane_f64) == sizeof(double)
    + sizeof(double)
    + sizeof(double), "no padding");

/** A fixed point at an unknown position. */
typedef struct dcal_point_f64 {
    /** The approximate x, y, z, if known. Length. */
    double known[3];
    /** One sigma of each coordinate; 0: unknown. Length. */
    double sigma;
    /** 1 if the sensor there has an unknown constant offset, otherwise 0. */
    uint32_t has_offset;
    /** 0. */
    uint32_t reserved;
} dcal_point_f64;
DCAL_ASSERT(sizeof(dcal_point_f64) == 3 * sizeof(double)
    + sizeof(double)
    + sizeof(uint32_t)
    + sizeof(uint32_t), "no padding");

/** What the readings refer to. All zeros: coordinates in the robot's own frame, no planes, no points. */
typedef struct dcal_instruments_f64 {
    /** DCAL_FRAME_BASE or DCAL_FRAME_SENSOR. */
    int32_t frame;
    /** Number of planes. */
    uint32_t plane_count;
    /** Number of points. */
    uint32_t point_count;
    /** 0. */
    uint32_t reserved;
    /** One sigma of a height; 0 if none is measured. Length. */
    double height_noise;
    /** One sigma of a distance; 0 if none is measured. Length. */
    double distance_noise;
    /** The planes that heights are measured above. */
    dcal_plane_f64 planes[DCAL_PLANES];
    /** The points that distances are measured from. */
    dcal_point_f64 points[DCAL_POINTS];
} dcal_instruments_f64;
DCAL_ASSERT(sizeof(dcal_instruments_f64) == sizeof(int32_t)
    + sizeof(uint32_t)
    + sizeof(uint32_t)
    + sizeof(uint32_t)
    + sizeof(double)
    + sizeof(double)
    + DCAL_PLANES * sizeof(dcal_plane_f64)
    + DCAL_POINTS * sizeof(dcal_point_f64), "no padding");

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

/** Makes a calibrator without samples, in size bytes of memory: write sizeof *calibrator. robot is the
 * uncalibrated robot, the nominal of the tolerance and the start of the iteration; it is copied.
 *
 * Errors: DCAL_NOISE_..., DCAL_TOLERANCE_..., DCAL_NO_SUCH_CHOICE. */
dcal_status dcal_ikm_init_f64(
    dcal_ikm_f64 *calibrator,
    size_t size,
    const dcal_robot_f64 *robot,
    const dcal_settings_f64 *settings,
    dcal_error *error);

/** Adds one sample; memory and time are the same for any number of samples. The result of the last
 * dcal_ikm_solve_f64 is discarded.
 *
 * Errors: DCAL_BUSY, and DCAL_SAMPLE_... with the arm; nothing is added. */
dcal_status dcal_ikm_add_f64(dcal_ikm_f64 *calibrator, const dcal_sample_f64 *sample, dcal_error *error);

/** Processes waiting samples: the calibrator takes in several at once. dcal_ikm_solve_f64 does the same;
 * call this one turn of the control loop earlier if dcal_ikm_solve_f64 takes too long. The result has the
 * same bits. */
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

/** Starts solving. Until the last dcal_ikm_step_f64, or until dcal_ikm_stop_f64, every call that would
 * change the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_ikm_finish_f64 that are already known, such as DCAL_TOO_FEW_SAMPLES with the arm,
 * the number of samples and the number needed. Behind a gate also DCAL_ROBOT_HAS_CHANGED,
 * DCAL_EARLY_SAMPLES and DCAL_TOO_MANY_REJECTED; an earlier result is then gone. */
dcal_status dcal_ikm_solve_f64(dcal_ikm_f64 *calibrator, dcal_error *error);

/** Runs one short step, to be called between the turns of a control loop. Returns DCAL_WORKING while there
 * is more to do, then DCAL_OK: dcal_ikm_finish_f64 has the result, or says why there is none. */
dcal_status dcal_ikm_step_f64(dcal_ikm_f64 *calibrator);

/** DCAL_WORKING while dcal_ikm_step_f64 has work to do, of a gate possibly its own estimate; DCAL_OK
 * otherwise. */
dcal_status dcal_ikm_solving_f64(const dcal_ikm_f64 *calibrator);

/** DCAL_OK if a solve has finished and no sample was added since: dcal_ikm_finish_f64 then has the result
 * or the refusal. DCAL_UNFINISHED otherwise. */
dcal_status dcal_ikm_finished_f64(const dcal_ikm_f64 *calibrator);

/** Abandons what dcal_ikm_solve_f64 started. The samples stay. */
dcal_status dcal_ikm_stop_f64(dcal_ikm_f64 *calibrator);

/** Discards all samples and what was solved from them: as after dcal_ikm_init_f64. */
dcal_status dcal_ikm_reset_f64(dcal_ikm_f64 *calibrator);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. The result stays in the calibrator until its samples change.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to DCAL_OVERFLOW)
 * with its arm and cause; the robot keeps its parameters. */
dcal_status dcal_ikm_finish_f64(
    const dcal_ikm_f64 *calibrator,
    dcal_robot_f64 *robot,
    size_t size,
    dcal_error *error);

/** Writes how well an arm is known; arm is 0, 1 or 2. If the arms were solved together, residual and noise
 * are those of the whole robot.
 *
 * Errors: DCAL_NO_SUCH_ARM, and those of dcal_ikm_finish_f64. */
dcal_status dcal_ikm_arm_f64(const dcal_ikm_f64 *calibrator, int32_t arm, dcal_arm_summary_f64 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight per arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_ikm_finish_f64. */
dcal_status dcal_ikm_deviations_f64(const dcal_ikm_f64 *calibrator, double sigma[24]);

/** Writes the covariance of all 24 parameters, eight per arm, row by row: length^2, length radian,
 * radian^2. Arms that were solved separately have none between them: 0.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_ikm_finish_f64. */
dcal_status dcal_ikm_covariance_f64(const dcal_ikm_f64 *calibrator, double covariance[576]);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length receives the number written. They are the same on every target.
 * Store them where they survive a power cut, and give them to dcal_ikm_restore_f64.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. Of a gate also DCAL_BUSY. */
dcal_status dcal_ikm_snapshot_f64(
    const dcal_ikm_f64 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must have the same robot, noise and
 * instruments. It then computes the same bits as the calibrator that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_ikm_restore_f64(dcal_ikm_f64 *calibrator, const uint8_t *bytes, size_t length);

/** Makes a calibrator without samples, in size bytes of memory: write sizeof *calibrator. robot is the
 * uncalibrated robot, the nominal of the tolerance and the start of the iteration; it is copied.
 *
 * Errors: DCAL_NOISE_..., DCAL_TOLERANCE_..., DCAL_NO_SUCH_CHOICE. */
dcal_status dcal_joint_init_f64(
    dcal_joint_f64 *calibrator,
    size_t size,
    const dcal_robot_f64 *robot,
    const dcal_settings_f64 *settings,
    dcal_error *error);

/** Adds one sample; memory and time are the same for any number of samples. The result of the last
 * dcal_joint_solve_f64 is discarded.
 *
 * Errors: DCAL_BUSY, and DCAL_SAMPLE_... with the arm; nothing is added. */
dcal_status dcal_joint_add_f64(dcal_joint_f64 *calibrator, const dcal_sample_f64 *sample, dcal_error *error);

/** Processes waiting samples: the calibrator takes in several at once. dcal_joint_solve_f64 does the same;
 * call this one turn of the control loop earlier if dcal_joint_solve_f64 takes too long. The result has
 * the same bits. */
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

/** Starts solving. Until the last dcal_joint_step_f64, or until dcal_joint_stop_f64, every call that would
 * change the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_joint_finish_f64 that are already known, such as DCAL_TOO_FEW_SAMPLES with the
 * arm, the number of samples and the number needed. Behind a gate also DCAL_ROBOT_HAS_CHANGED,
 * DCAL_EARLY_SAMPLES and DCAL_TOO_MANY_REJECTED; an earlier result is then gone. */
dcal_status dcal_joint_solve_f64(dcal_joint_f64 *calibrator, dcal_error *error);

/** Runs one short step, to be called between the turns of a control loop. Returns DCAL_WORKING while there
 * is more to do, then DCAL_OK: dcal_joint_finish_f64 has the result, or says why there is none. */
dcal_status dcal_joint_step_f64(dcal_joint_f64 *calibrator);

/** DCAL_WORKING while dcal_joint_step_f64 has work to do, of a gate possibly its own estimate; DCAL_OK
 * otherwise. */
dcal_status dcal_joint_solving_f64(const dcal_joint_f64 *calibrator);

/** DCAL_OK if a solve has finished and no sample was added since: dcal_joint_finish_f64 then has the
 * result or the refusal. DCAL_UNFINISHED otherwise. */
dcal_status dcal_joint_finished_f64(const dcal_joint_f64 *calibrator);

/** Abandons what dcal_joint_solve_f64 started. The samples stay. */
dcal_status dcal_joint_stop_f64(dcal_joint_f64 *calibrator);

/** Discards all samples and what was solved from them: as after dcal_joint_init_f64. */
dcal_status dcal_joint_reset_f64(dcal_joint_f64 *calibrator);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. The result stays in the calibrator until its samples change.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to DCAL_OVERFLOW)
 * with its arm and cause; the robot keeps its parameters. */
dcal_status dcal_joint_finish_f64(
    const dcal_joint_f64 *calibrator,
    dcal_robot_f64 *robot,
    size_t size,
    dcal_error *error);

/** Writes how well an arm is known; arm is 0, 1 or 2. If the arms were solved together, residual and noise
 * are those of the whole robot.
 *
 * Errors: DCAL_NO_SUCH_ARM, and those of dcal_joint_finish_f64. */
dcal_status dcal_joint_arm_f64(const dcal_joint_f64 *calibrator, int32_t arm, dcal_arm_summary_f64 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight per arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_joint_finish_f64. */
dcal_status dcal_joint_deviations_f64(const dcal_joint_f64 *calibrator, double sigma[24]);

/** Writes the covariance of all 24 parameters, eight per arm, row by row: length^2, length radian,
 * radian^2. Arms that were solved separately have none between them: 0.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_joint_finish_f64. */
dcal_status dcal_joint_covariance_f64(const dcal_joint_f64 *calibrator, double covariance[576]);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length receives the number written. They are the same on every target.
 * Store them where they survive a power cut, and give them to dcal_joint_restore_f64.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. Of a gate also DCAL_BUSY. */
dcal_status dcal_joint_snapshot_f64(
    const dcal_joint_f64 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must have the same robot, noise and
 * instruments. It then computes the same bits as the calibrator that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_joint_restore_f64(dcal_joint_f64 *calibrator, const uint8_t *bytes, size_t length);

/** Makes a calibrator with a gate and without samples, in size bytes of memory: write sizeof *calibrator.
 * sigmas is the width of the gate; 0 selects the width that rejects three good samples in a million for
 * each arm. age is the mean age of the samples that count, for a robot that changes slowly; 0 if all
 * count equally. If noise and tolerance are stated, the gate tests from the first sample, otherwise from
 * its first estimate.
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

/** Tests one sample, and adds it unless it is rejected. A rejected sample is not an error: verdict reports
 * it. If the gate then needs an estimate of its own, call dcal_gate_step_f64 until it returns DCAL_OK,
 * before the next sample.
 *
 * Errors: DCAL_BUSY, and DCAL_SAMPLE_... with the arm; nothing has changed. */
dcal_status dcal_gate_add_f64(
    dcal_gate_f64 *calibrator,
    const dcal_sample_f64 *sample,
    dcal_verdict_f64 *verdict,
    dcal_error *error);

/** Writes the sample counts and the alarm, if any. */
dcal_status dcal_gate_state_f64(const dcal_gate_f64 *calibrator, dcal_gate_counts_f64 *state);

/** Answers the alarm and excuses all rejections so far: solving is possible again. Without forgetting the
 * rejected samples were wrong, and the samples before them stay; if the robot itself has changed, call
 * dcal_gate_reset_f64. With forgetting an alarm's answer discards the earlier samples, and the gate
 * begins again, as when new; its counts go on. */
dcal_status dcal_gate_acknowledge_f64(dcal_gate_f64 *calibrator);

/** Writes the number of samples. */
dcal_status dcal_gate_samples_f64(const dcal_gate_f64 *calibrator, uint64_t *samples);

/** Starts solving. Until the last dcal_gate_step_f64, or until dcal_gate_stop_f64, every call that would
 * change the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_gate_finish_f64 that are already known, such as DCAL_TOO_FEW_SAMPLES with the
 * arm, the number of samples and the number needed. Behind a gate also DCAL_ROBOT_HAS_CHANGED,
 * DCAL_EARLY_SAMPLES and DCAL_TOO_MANY_REJECTED; an earlier result is then gone. */
dcal_status dcal_gate_solve_f64(dcal_gate_f64 *calibrator, dcal_error *error);

/** Runs one short step, to be called between the turns of a control loop. Returns DCAL_WORKING while there
 * is more to do, then DCAL_OK: dcal_gate_finish_f64 has the result, or says why there is none. */
dcal_status dcal_gate_step_f64(dcal_gate_f64 *calibrator);

/** DCAL_WORKING while dcal_gate_step_f64 has work to do, of a gate possibly its own estimate; DCAL_OK
 * otherwise. */
dcal_status dcal_gate_solving_f64(const dcal_gate_f64 *calibrator);

/** DCAL_OK if a solve has finished and no sample was added since: dcal_gate_finish_f64 then has the result
 * or the refusal. DCAL_UNFINISHED otherwise. */
dcal_status dcal_gate_finished_f64(const dcal_gate_f64 *calibrator);

/** Abandons what dcal_gate_solve_f64 started. The samples stay. */
dcal_status dcal_gate_stop_f64(dcal_gate_f64 *calibrator);

/** Discards all samples and what was solved from them: as after dcal_gate_init_f64. */
dcal_status dcal_gate_reset_f64(dcal_gate_f64 *calibrator);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. The result stays in the calibrator until its samples change.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to DCAL_OVERFLOW)
 * with its arm and cause; the robot keeps its parameters. */
dcal_status dcal_gate_finish_f64(
    const dcal_gate_f64 *calibrator,
    dcal_robot_f64 *robot,
    size_t size,
    dcal_error *error);

/** Writes how well an arm is known; arm is 0, 1 or 2. If the arms were solved together, residual and noise
 * are those of the whole robot.
 *
 * Errors: DCAL_NO_SUCH_ARM, and those of dcal_gate_finish_f64. */
dcal_status dcal_gate_arm_f64(const dcal_gate_f64 *calibrator, int32_t arm, dcal_arm_summary_f64 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight per arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_gate_finish_f64. */
dcal_status dcal_gate_deviations_f64(const dcal_gate_f64 *calibrator, double sigma[24]);

/** Writes the covariance of all 24 parameters, eight per arm, row by row: length^2, length radian,
 * radian^2. Arms that were solved separately have none between them: 0.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_gate_finish_f64. */
dcal_status dcal_gate_covariance_f64(const dcal_gate_f64 *calibrator, double covariance[576]);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length receives the number written. They are the same on every target.
 * Store them where they survive a power cut, and give them to dcal_gate_restore_f64.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. Of a gate also DCAL_BUSY. */
dcal_status dcal_gate_snapshot_f64(
    const dcal_gate_f64 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must have the same robot, noise and
 * instruments. It then computes the same bits as the calibrator that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_gate_restore_f64(dcal_gate_f64 *calibrator, const uint8_t *bytes, size_t length);

/** Makes a calibrator with a gate and without samples, in size bytes of memory: write sizeof *calibrator.
 * sigmas is the width of the gate; 0 selects the width that rejects three good samples in a million for
 * each arm. age is the mean age of the samples that count, for a robot that changes slowly; 0 if all
 * count equally. If noise and tolerance are stated, the gate tests from the first sample, otherwise from
 * its first estimate.
 *
 * Errors: DCAL_NOISE_..., DCAL_TOLERANCE_..., DCAL_NO_SUCH_CHOICE, DCAL_WIDTH_OF_GATE, DCAL_FORGETTING. */
dcal_status dcal_joint_gate_init_f64(
    dcal_joint_gate_f64 *calibrator,
    size_t size,
    const dcal_robot_f64 *robot,
    const dcal_settings_f64 *settings,
    double sigmas,
    double age,
    dcal_error *error);

/** Tests one sample, and adds it unless it is rejected. A rejected sample is not an error: verdict reports
 * it. If the gate then needs an estimate of its own, call dcal_joint_gate_step_f64 until it returns
 * DCAL_OK, before the next sample.
 *
 * Errors: DCAL_BUSY, and DCAL_SAMPLE_... with the arm; nothing has changed. */
dcal_status dcal_joint_gate_add_f64(
    dcal_joint_gate_f64 *calibrator,
    const dcal_sample_f64 *sample,
    dcal_verdict_f64 *verdict,
    dcal_error *error);

/** Writes the sample counts and the alarm, if any. */
dcal_status dcal_joint_gate_state_f64(const dcal_joint_gate_f64 *calibrator, dcal_gate_counts_f64 *state);

/** Answers the alarm and excuses all rejections so far: solving is possible again. Without forgetting the
 * rejected samples were wrong, and the samples before them stay; if the robot itself has changed, call
 * dcal_joint_gate_reset_f64. With forgetting an alarm's answer discards the earlier samples, and the gate
 * begins again, as when new; its counts go on. */
dcal_status dcal_joint_gate_acknowledge_f64(dcal_joint_gate_f64 *calibrator);

/** Writes the number of samples. */
dcal_status dcal_joint_gate_samples_f64(const dcal_joint_gate_f64 *calibrator, uint64_t *samples);

/** Starts solving. Until the last dcal_joint_gate_step_f64, or until dcal_joint_gate_stop_f64, every call
 * that would change the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_joint_gate_finish_f64 that are already known, such as DCAL_TOO_FEW_SAMPLES with
 * the arm, the number of samples and the number needed. Behind a gate also DCAL_ROBOT_HAS_CHANGED,
 * DCAL_EARLY_SAMPLES and DCAL_TOO_MANY_REJECTED; an earlier result is then gone. */
dcal_status dcal_joint_gate_solve_f64(dcal_joint_gate_f64 *calibrator, dcal_error *error);

/** Runs one short step, to be called between the turns of a control loop. Returns DCAL_WORKING while there
 * is more to do, then DCAL_OK: dcal_joint_gate_finish_f64 has the result, or says why there is none. */
dcal_status dcal_joint_gate_step_f64(dcal_joint_gate_f64 *calibrator);

/** DCAL_WORKING while dcal_joint_gate_step_f64 has work to do, of a gate possibly its own estimate;
 * DCAL_OK otherwise. */
dcal_status dcal_joint_gate_solving_f64(const dcal_joint_gate_f64 *calibrator);

/** DCAL_OK if a solve has finished and no sample was added since: dcal_joint_gate_finish_f64 then has the
 * result or the refusal. DCAL_UNFINISHED otherwise. */
dcal_status dcal_joint_gate_finished_f64(const dcal_joint_gate_f64 *calibrator);

/** Abandons what dcal_joint_gate_solve_f64 started. The samples stay. */
dcal_status dcal_joint_gate_stop_f64(dcal_joint_gate_f64 *calibrator);

/** Discards all samples and what was solved from them: as after dcal_joint_gate_init_f64. */
dcal_status dcal_joint_gate_reset_f64(dcal_joint_gate_f64 *calibrator);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. The result stays in the calibrator until its samples change.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to DCAL_OVERFLOW)
 * with its arm and cause; the robot keeps its parameters. */
dcal_status dcal_joint_gate_finish_f64(
    const dcal_joint_gate_f64 *calibrator,
    dcal_robot_f64 *robot,
    size_t size,
    dcal_error *error);

/** Writes how well an arm is known; arm is 0, 1 or 2. If the arms were solved together, residual and noise
 * are those of the whole robot.
 *
 * Errors: DCAL_NO_SUCH_ARM, and those of dcal_joint_gate_finish_f64. */
dcal_status dcal_joint_gate_arm_f64(
    const dcal_joint_gate_f64 *calibrator,
    int32_t arm,
    dcal_arm_summary_f64 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight per arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_joint_gate_finish_f64. */
dcal_status dcal_joint_gate_deviations_f64(const dcal_joint_gate_f64 *calibrator, double sigma[24]);

/** Writes the covariance of all 24 parameters, eight per arm, row by row: length^2, length radian,
 * radian^2. Arms that were solved separately have none between them: 0.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_joint_gate_finish_f64. */
dcal_status dcal_joint_gate_covariance_f64(const dcal_joint_gate_f64 *calibrator, double covariance[576]);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length receives the number written. They are the same on every target.
 * Store them where they survive a power cut, and give them to dcal_joint_gate_restore_f64.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. Of a gate also DCAL_BUSY. */
dcal_status dcal_joint_gate_snapshot_f64(
    const dcal_joint_gate_f64 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must have the same robot, noise and
 * instruments. It then computes the same bits as the calibrator that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_joint_gate_restore_f64(dcal_joint_gate_f64 *calibrator, const uint8_t *bytes, size_t length);

/** Makes a calibrator without observations, in size bytes of memory: write sizeof *calibrator. robot is
 * the uncalibrated robot. settings must state the noise of positions and joint angles, and a tolerance
 * unless x, y and z are measured often enough; instruments states the noise of heights and distances.
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

/** Adds one observation, at most DCAL_FKM_ROWS in all. Every one that was added takes part in the
 * calibration.
 *
 * Errors: DCAL_OBSERVATION_..., also where the uncalibrated robot does not reach the joint angles;
 * DCAL_SAMPLE_JOINT_..., DCAL_NO_SUCH_PLANE and ..._POINT, DCAL_NOISE_... of a height or distance if it
 * is not stated, DCAL_NO_SUCH_CHOICE, DCAL_BUSY; nothing is added. */
dcal_status dcal_fkm_add_f64(
    dcal_fkm_f64 *calibrator,
    const dcal_observation_f64 *observation,
    dcal_error *error);

/** Writes c (length), a and b of a plane z = c + a x + b y.
 *
 * Errors: DCAL_NO_SUCH_PLANE, and those of dcal_fkm_finish_f64. */
dcal_status dcal_fkm_plane_f64(const dcal_fkm_f64 *calibrator, uint32_t plane, double coefficients[3]);

/** Writes the position of a point and the offset of its sensor: x, y, z, offset. Length.
 *
 * Errors: DCAL_NO_SUCH_POINT, and those of dcal_fkm_finish_f64. */
dcal_status dcal_fkm_point_f64(const dcal_fkm_f64 *calibrator, uint32_t point, double place[4]);

/** Writes the transform from the robot's frame to that of the measured coordinates: the rotation row by
 * row, and the translation (length). The identity for DCAL_FRAME_BASE.
 *
 * Errors: those of dcal_fkm_finish_f64. */
dcal_status dcal_fkm_frame_f64(const dcal_fkm_f64 *calibrator, double rotation[9], double translation[3]);

/** Writes the number of samples. */
dcal_status dcal_fkm_samples_f64(const dcal_fkm_f64 *calibrator, uint64_t *samples);

/** Starts solving. Until the last dcal_fkm_step_f64, or until dcal_fkm_stop_f64, every call that would
 * change the samples returns DCAL_BUSY.
 *
 * Errors: those of dcal_fkm_finish_f64 that are already known, such as DCAL_TOO_FEW_SAMPLES with the arm,
 * the number of samples and the number needed. Behind a gate also DCAL_ROBOT_HAS_CHANGED,
 * DCAL_EARLY_SAMPLES and DCAL_TOO_MANY_REJECTED; an earlier result is then gone. */
dcal_status dcal_fkm_solve_f64(dcal_fkm_f64 *calibrator, dcal_error *error);

/** Runs one short step, to be called between the turns of a control loop. Returns DCAL_WORKING while there
 * is more to do, then DCAL_OK: dcal_fkm_finish_f64 has the result, or says why there is none. */
dcal_status dcal_fkm_step_f64(dcal_fkm_f64 *calibrator);

/** DCAL_WORKING while dcal_fkm_step_f64 has work to do, of a gate possibly its own estimate; DCAL_OK
 * otherwise. */
dcal_status dcal_fkm_solving_f64(const dcal_fkm_f64 *calibrator);

/** DCAL_OK if a solve has finished and no sample was added since: dcal_fkm_finish_f64 then has the result
 * or the refusal. DCAL_UNFINISHED otherwise. */
dcal_status dcal_fkm_finished_f64(const dcal_fkm_f64 *calibrator);

/** Abandons what dcal_fkm_solve_f64 started. The samples stay. */
dcal_status dcal_fkm_stop_f64(dcal_fkm_f64 *calibrator);

/** Discards all samples and what was solved from them: as after dcal_fkm_init_f64. */
dcal_status dcal_fkm_reset_f64(dcal_fkm_f64 *calibrator);

/** Makes the calibrated robot, in size bytes of memory: write sizeof *robot. robot may be the robot in
 * use, which is then replaced. The result stays in the calibrator until its samples change.
 *
 * Errors: DCAL_UNFINISHED before the last step, and every refusal (DCAL_TOO_FEW_SAMPLES to DCAL_OVERFLOW)
 * with its arm and cause; the robot keeps its parameters. */
dcal_status dcal_fkm_finish_f64(
    const dcal_fkm_f64 *calibrator,
    dcal_robot_f64 *robot,
    size_t size,
    dcal_error *error);

/** Writes how well an arm is known; arm is 0, 1 or 2. If the arms were solved together, residual and noise
 * are those of the whole robot.
 *
 * Errors: DCAL_NO_SUCH_ARM, and those of dcal_fkm_finish_f64. */
dcal_status dcal_fkm_arm_f64(const dcal_fkm_f64 *calibrator, int32_t arm, dcal_arm_summary_f64 *summary);

/** Writes the standard uncertainty of each of the 24 parameters, eight per arm: length or radians.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_fkm_finish_f64. */
dcal_status dcal_fkm_deviations_f64(const dcal_fkm_f64 *calibrator, double sigma[24]);

/** Writes the covariance of all 24 parameters, eight per arm, row by row: length^2, length radian,
 * radian^2. Arms that were solved separately have none between them: 0.
 *
 * Errors: DCAL_NO_COVARIANCE, and those of dcal_fkm_finish_f64. */
dcal_status dcal_fkm_covariance_f64(const dcal_fkm_f64 *calibrator, double covariance[576]);

/** Writes the samples into bytes, of which there are capacity: write the constant
 * DCAL_..._SNAPSHOT_..._SIZE. length receives the number written. They are the same on every target.
 * Store them where they survive a power cut, and give them to dcal_fkm_restore_f64.
 *
 * Errors: DCAL_SNAPSHOT_BUFFER; nothing is written. Of a gate also DCAL_BUSY. */
dcal_status dcal_fkm_snapshot_f64(
    const dcal_fkm_f64 *calibrator,
    uint8_t *bytes,
    size_t capacity,
    size_t *length);

/** Replaces the samples by those of a snapshot. The calibrator must have the same robot, noise and
 * instruments. It then computes the same bits as the calibrator that the snapshot is of.
 *
 * Errors: DCAL_BUSY, DCAL_SNAPSHOT_...; the calibrator is unchanged. */
dcal_status dcal_fkm_restore_f64(dcal_fkm_f64 *calibrator, const uint8_t *bytes, size_t length);

#ifdef __cplusplus
}
#endif

#endif
