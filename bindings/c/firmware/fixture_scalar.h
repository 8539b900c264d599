/* Included once for each scalar: REAL, BITS, OF(name) and NAME are defined. */

static OF(dcal_robot) OF(nominal);
static OF(dcal_ikm) OF(calibrator);
static OF(dcal_ikm_outcome) OF(outcome);
static OF(dcal_joint) OF(joint_calibrator);
static OF(dcal_joint_outcome) OF(joint_outcome);
static OF(dcal_gate) OF(gate);
static OF(dcal_fkm) OF(fkm);
static OF(dcal_fkm_outcome) OF(fkm_outcome);

static REAL OF(number)(uint64_t bits)
{
    double value;
    memcpy(&value, &bits, sizeof value);
    return (REAL)value;
}

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
        sample.joints[axis] = OF(number)(samples[index][axis]);
        sample.position[axis] = OF(number)(samples[index][3 + axis]);
    }
    return sample;
}

static OF(dcal_settings) OF(settings)(int with_tolerance)
{
    OF(dcal_settings) settings = {0};
    for (size_t axis = 0; axis < 3; axis++) {
        settings.position_noise[axis] = OF(number)(noise[0]);
    }
    settings.joint_noise = OF(number)(noise[1]);
    if (with_tolerance) {
        settings.length_tolerance = OF(number)(tolerance[0]);
        settings.angle_tolerance = OF(number)(tolerance[1]);
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

/* With the noise stated, or with nothing stated. */
static void OF(ikm)(const OF(dcal_settings) *settings)
{
    dcal_error error;
    unsigned long adding = 0;
    unsigned long solving = 0;
    unsigned long longest = 0;
    dcal_status status;
    OK(OF(dcal_ikm_init)(&OF(calibrator), sizeof OF(calibrator), &OF(nominal), settings, &error));
    expect(OF(dcal_ikm_solve)(&OF(calibrator), &error),
        DCAL_TOO_FEW_SAMPLES, "solve without samples");
    write_error(NAME " without samples", &error);
    for (size_t index = 0; index < SAMPLES; index++) {
        const OF(dcal_sample) sample = OF(sample)(index);
        const unsigned long start = platform_count();
        OK(OF(dcal_ikm_add)(&OF(calibrator), &sample, &error));
        adding += platform_count() - start;
    }
    OK(OF(dcal_ikm_solve)(&OF(calibrator), &error));
    expect(OF(dcal_ikm_finish)(&OF(calibrator), &OF(outcome), sizeof OF(outcome), &error),
        DCAL_UNFINISHED, "outcome before the last step");
    do {
        const unsigned long start = platform_count();
        status = OF(dcal_ikm_step)(&OF(calibrator));
        const unsigned long spent = platform_count() - start;
        solving += spent;
        longest = spent > longest ? spent : longest;
    } while (status == DCAL_WORKING);
    expect(status, DCAL_OK, "step");
    OK(OF(dcal_ikm_finish)(&OF(calibrator), &OF(outcome), sizeof OF(outcome), &error));
    OF(cost)("add, mean", adding / SAMPLES);
    OF(cost)("all steps", solving);
    OF(cost)("longest step", longest);

    OF(dcal_robot) robot;
    REAL deviations[24];
    OK(OF(dcal_ikm_outcome_robot)(&OF(outcome), &robot, sizeof robot));
    OF(write_robot)(&robot);
    OK(OF(dcal_ikm_outcome_deviations)(&OF(outcome), deviations));
    OF(write)("deviations", deviations, 24);
    for (int32_t arm = 0; arm < 3; arm++) {
        OF(dcal_arm_summary) summary;
        REAL covariance[64];
        OK(OF(dcal_ikm_outcome_arm)(&OF(outcome), arm, &summary));
        OF(write_summary)(&summary);
        OK(OF(dcal_ikm_outcome_arm_covariance)(&OF(outcome), arm, covariance));
        OF(write)("covariance", covariance, 64);
    }
}

static void OF(write_joint)(const OF(dcal_joint_outcome) *outcome)
{
    static REAL covariance[576];
    OF(dcal_robot) robot;
    REAL deviations[24];
    OK(OF(dcal_joint_outcome_robot)(outcome, &robot, sizeof robot));
    OF(write_robot)(&robot);
    OK(OF(dcal_joint_outcome_deviations)(outcome, deviations));
    OF(write)("deviations", deviations, 24);
    OK(OF(dcal_joint_outcome_covariance)(outcome, covariance));
    OF(write)("covariance", covariance, 576);
    for (int32_t arm = 0; arm < 3; arm++) {
        OF(dcal_arm_summary) summary;
        OK(OF(dcal_joint_outcome_arm)(outcome, arm, &summary));
        OF(write_summary)(&summary);
    }
}

static void OF(joint)(const OF(dcal_settings) *settings)
{
    dcal_error error;
    unsigned long adding = 0;
    unsigned long solving = 0;
    unsigned long longest = 0;
    unsigned long begin;
    dcal_status status;
    OK(OF(dcal_joint_init)(
        &OF(joint_calibrator), sizeof OF(joint_calibrator), &OF(nominal), settings, &error));
    for (size_t index = 0; index < SAMPLES; index++) {
        const OF(dcal_sample) sample = OF(sample)(index);
        const unsigned long start = platform_count();
        OK(OF(dcal_joint_add)(&OF(joint_calibrator), &sample, &error));
        adding += platform_count() - start;
    }
    begin = platform_count();
    OK(OF(dcal_joint_flush)(&OF(joint_calibrator)));
    OF(cost)("joint, flush", platform_count() - begin);
    OK(OF(dcal_joint_solve)(&OF(joint_calibrator), &error));
    do {
        const unsigned long start = platform_count();
        status = OF(dcal_joint_step)(&OF(joint_calibrator));
        const unsigned long spent = platform_count() - start;
        solving += spent;
        longest = spent > longest ? spent : longest;
    } while (status == DCAL_WORKING);
    expect(status, DCAL_OK, "joint step");
    begin = platform_count();
    OK(OF(dcal_joint_finish)(
        &OF(joint_calibrator), &OF(joint_outcome), sizeof OF(joint_outcome), &error));
    OF(cost)("joint, end", platform_count() - begin);
    OF(cost)("joint, add, mean", adding / SAMPLES);
    OF(cost)("joint, all steps", solving);
    OF(cost)("joint, longest step", longest);
    OF(write_joint)(&OF(joint_outcome));
}

/* Every eleventh sample is 5 mm off. */
static void OF(gated)(const OF(dcal_settings) *settings)
{
    dcal_error error;
    OF(dcal_gate_counts) counts;
    OF(dcal_verdict) verdict;
    OF(dcal_robot) robot;
    OK(OF(dcal_gate_init)(&OF(gate), sizeof OF(gate), &OF(nominal), settings, 0, 0, &error));
    for (size_t index = 0; index < SAMPLES; index++) {
        OF(dcal_sample) sample = OF(sample)(index);
        if (index % 11 == 10) {
            sample.position[0] += 5;
        }
        OK(OF(dcal_gate_add)(&OF(gate), &sample, &verdict, &error));
        const REAL figures[2] = {verdict.distance, verdict.normalized};
        OF(write)(verdict.verdict == DCAL_REJECTED ? "rejected" : "taken", figures, 2);
    }
    OK(OF(dcal_gate_state)(&OF(gate), &counts));
    platform_write("BITS " NAME " gate:");
    write_count(counts.taken);
    write_count(counts.rejected);
    write_count(counts.longest_run);
    write_count((uint64_t)counts.alarm);
    platform_write("\n");
    OK(OF(dcal_gate_solve)(&OF(gate), &error));
    while (OF(dcal_gate_step)(&OF(gate)) == DCAL_WORKING) {
    }
    OK(OF(dcal_gate_finish)(&OF(gate), &OF(outcome), sizeof OF(outcome), &error));
    OK(OF(dcal_ikm_outcome_robot)(&OF(outcome), &robot, sizeof robot));
    OF(write_robot)(&robot);
}

/* Heights above a plane, x and z alone, distances from a point, in turn. */
static OF(dcal_observation) OF(observation)(size_t index)
{
    const OF(dcal_sample) sample = OF(sample)(index);
    OF(dcal_observation) observation = {0};
    memcpy(observation.joints, sample.joints, sizeof sample.joints);
    memcpy(observation.position, sample.position, sizeof sample.position);
    observation.height = sample.position[2] + 560;
    observation.distance = OF(number)(distances[index]);
    observation.readings = index % 3 == 0 ? (uint32_t)DCAL_READ_HEIGHT
        : index % 3 == 1                  ? (uint32_t)(DCAL_READ_X | DCAL_READ_Z)
                                          : (uint32_t)DCAL_READ_DISTANCE;
    return observation;
}

static void OF(observe)(const OF(dcal_settings) *settings)
{
    dcal_error error;
    OF(dcal_instruments) instruments = {0};
    REAL place[4];
    REAL rotation[9];
    unsigned long solving = 0;
    unsigned long longest = 0;
    unsigned long begin;
    dcal_status status;
    instruments.plane_count = 1;
    instruments.point_count = 1;
    instruments.height_noise = settings->position_noise[0];
    instruments.distance_noise = settings->position_noise[0];
    OK(OF(dcal_fkm_init)(&OF(fkm), sizeof OF(fkm), &OF(nominal), &instruments, settings, &error));
    for (size_t index = 0; index < SAMPLES; index++) {
        const OF(dcal_observation) observation = OF(observation)(index);
        OK(OF(dcal_fkm_add)(&OF(fkm), &observation, &error));
    }
    OK(OF(dcal_fkm_solve)(&OF(fkm), &error));
    do {
        const unsigned long start = platform_count();
        status = OF(dcal_fkm_step)(&OF(fkm));
        const unsigned long spent = platform_count() - start;
        solving += spent;
        longest = spent > longest ? spent : longest;
    } while (status == DCAL_WORKING);
    expect(status, DCAL_OK, "fkm step");
    begin = platform_count();
    OK(OF(dcal_fkm_finish)(&OF(fkm), &OF(fkm_outcome), sizeof OF(fkm_outcome), &error));
    OF(cost)("fkm, end", platform_count() - begin);
    OF(cost)("fkm, all steps", solving);
    OF(cost)("fkm, longest step", longest);
    OK(OF(dcal_fkm_outcome_joint)(&OF(fkm_outcome), &OF(joint_outcome), sizeof OF(joint_outcome)));
    OF(write_joint)(&OF(joint_outcome));
    OK(OF(dcal_fkm_outcome_plane)(&OF(fkm_outcome), 0, place));
    OF(write)("plane", place, 3);
    OK(OF(dcal_fkm_outcome_point)(&OF(fkm_outcome), 0, place));
    OF(write)("point", place, 4);
    OK(OF(dcal_fkm_outcome_frame)(&OF(fkm_outcome), rotation, place));
    OF(write)("frame", rotation, 9);
}

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
    OF(ikm)(&nothing);
    OF(joint)(&nothing);
    OF(joint)(&both);
    OF(stack_of)("joint", OF(joint), &noise_alone);
    OF(stack_of)("ikm", OF(ikm), &noise_alone);
    OF(stack_of)("gate", OF(gated), &both);
    OF(stack_of)("fkm", OF(observe), &both);
}
