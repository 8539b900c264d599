/* Included once for each calibrator behind a gate and each scalar: FAMILY(begin, end) is defined. */

static void OWN(_begin)(const OF(dcal_settings) *settings)
{
    OK(C(_init)(PLACE, sizeof *PLACE, &OF(nominal), settings, 0, 0, NULL));
}

static void OWN(_take)(const OF(dcal_sample) *sample)
{
    OF(dcal_verdict) verdict;
    OK(C(_add)(PLACE, sample, &verdict, NULL));
}

/* Every eleventh sample is 5 mm off. */
static void OWN(_gated)(const OF(dcal_settings) *settings)
{
    dcal_error error;
    OF(dcal_gate_counts) counts;
    OF(dcal_verdict) verdict;
    OWN(_begin)(settings);
    for (size_t index = 0; index < SAMPLES; index++) {
        OF(dcal_sample) sample = OF(sample)(index);
        if (index % 11 == 10) {
            sample.position[0] += 5;
        }
        OK(C(_add)(PLACE, &sample, &verdict, &error));
        const REAL figures[2] = {verdict.distance, verdict.normalized};
        OF(write)(verdict.verdict == DCAL_REJECTED ? "rejected" : "taken", figures, 2);
    }
    OK(C(_state)(PLACE, &counts));
    platform_write("BITS " NAME " gate:");
    write_count(counts.taken);
    write_count(counts.rejected);
    write_count(counts.longest_run);
    write_count((uint64_t)counts.alarm);
    platform_write("\n");
    OK(C(_solve)(PLACE, &error));
    while (C(_step)(PLACE) == DCAL_WORKING) {
    }
    SCALAR(FAMILY(write_, ))(PLACE);
}

/* Adds some of the samples, so far off, to a new gate or to one that has samples; what became of the last. */
static int32_t OWN(_add)(size_t first, size_t end, REAL off)
{
    dcal_error error;
    OF(dcal_verdict) verdict = {0};
    for (size_t index = first; index < end; index++) {
        OF(dcal_sample) sample = OF(sample)(index);
        sample.position[0] += off;
        OK(C(_add)(PLACE, &sample, &verdict, &error));
    }
    return verdict.verdict;
}

static OF(dcal_gate_counts) OWN(_counts)(void)
{
    OF(dcal_gate_counts) counts;
    OK(C(_state)(PLACE, &counts));
    return counts;
}

static dcal_status OWN(_solved)(dcal_error *error)
{
    OF(dcal_robot) robot;
    const dcal_status status = C(_solve)(PLACE, error);
    if (status != DCAL_OK) {
        return status;
    }
    while (C(_step)(PLACE) == DCAL_WORKING) {
    }
    return C(_finish)(PLACE, &robot, sizeof robot, error);
}

/* An alarm, also one after a solve, is answered: the samples were wrong, or the robot has changed. Too many wrong samples are no calibration. */
static void OWN(_alarm)(const OF(dcal_settings) *settings)
{
    dcal_error error;
    OWN(_begin)(settings);
    CHECK(OWN(_add)(0, 20, 0) == DCAL_TAKEN);
    OK(OWN(_solved)(&error));
    CHECK(OWN(_add)(20, 28, 5) == DCAL_REJECTED);
    CHECK(OWN(_counts)().alarm == DCAL_ROBOT_CHANGED);
    expect(OWN(_solved)(&error), DCAL_ROBOT_HAS_CHANGED, "solve with an alarm");
    CHECK(error.count == 20);
    OK(C(_acknowledge)(PLACE));
    CHECK(OWN(_counts)().alarm == DCAL_NO_ALARM);
    CHECK(OWN(_add)(0, SAMPLES, 0) == DCAL_TAKEN);
    OK(OWN(_solved)(&error));
    OK(C(_reset)(PLACE));
    CHECK(OWN(_counts)().taken == 0);
    for (size_t index = 0; index < 20; index++) {
        OWN(_add)(index, index + 1, index % 3 == 2 ? 5 : 0);
    }
    expect(OWN(_solved)(&error), DCAL_TOO_MANY_REJECTED, "solve with a third of the samples wrong");
}

/* What the gate has seen outlasts a power cut. */
static void OWN(_power_cut)(const OF(dcal_settings) *settings)
{
    dcal_error error;
    size_t length = 7;
    size_t unchanged = 7;
    OWN(_begin)(settings);
    CHECK(OWN(_add)(0, 12, 0) == DCAL_TAKEN);
    CHECK(OWN(_add)(12, 13, 5) == DCAL_REJECTED);
    const OF(dcal_sample) sample = OF(sample)(0);
    expect(C(_add)(PLACE, &sample, NULL, &error), DCAL_NULL_POINTER, "add without a verdict");
    OK(C(_snapshot)(PLACE, bytes[0], sizeof bytes[0], &length));
    expect(C(_snapshot)(PLACE, bytes[1], length - 1, &unchanged), DCAL_SNAPSHOT_BUFFER, "snapshot with too little room");
    CHECK(unchanged == 7);
    OWN(_begin)(settings);
    OK(C(_restore)(PLACE, bytes[0], length));
    CHECK(OWN(_counts)().taken == 12 && OWN(_counts)().rejected == 1);
    expect(C(_solving)(PLACE), DCAL_OK, "solving after restore");
    OK(C(_solve)(PLACE, &error));
    expect(C(_solving)(PLACE), DCAL_WORKING, "solving after solve");
    OF(dcal_verdict) verdict;
    expect(C(_add)(PLACE, &sample, &verdict, &error), DCAL_BUSY, "add while it solves");
}
