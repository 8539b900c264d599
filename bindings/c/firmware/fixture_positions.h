/* Included once for each calibrator from complete positions and each scalar: FAMILY(begin, end) is defined. */

static void OWN(_begin)(const OF(dcal_settings) *settings)
{
    OK(C(_init)(PLACE, sizeof *PLACE, &OF(nominal), settings, NULL));
}

static void OWN(_take)(const OF(dcal_sample) *sample)
{
    OK(C(_add)(PLACE, sample, NULL));
}

/* With what is stated of noise and tolerance. */
static void OWN(_calibrated)(const OF(dcal_settings) *settings)
{
    unsigned long adding = 0;
    unsigned long solving = 0;
    unsigned long longest = 0;
    unsigned long start;
    OF(dcal_robot) robot;
    dcal_error error;
    dcal_status status;
    OWN(_begin)(settings);
    expect(C(_solve)(PLACE, &error), DCAL_TOO_FEW_SAMPLES, "solve without samples");
    write_error(NAME " without samples", &error);
    for (size_t index = 0; index < SAMPLES; index++) {
        const OF(dcal_sample) sample = OF(sample)(index);
        start = platform_count();
        OWN(_take)(&sample);
        adding += platform_count() - start;
    }
    start = platform_count();
    OK(C(_flush)(PLACE));
    OF(cost)(TEXT(FAMILY(, )) ", flush", platform_count() - start);
    OK(C(_solve)(PLACE, &error));
    expect(C(_finish)(PLACE, &robot, sizeof robot, &error), DCAL_UNFINISHED, "finish");
    expect(C(_finished)(PLACE), DCAL_UNFINISHED, "finished before the last step");
    expect(C(_solving)(PLACE), DCAL_WORKING, "solving before the last step");
    do {
        start = platform_count();
        status = C(_step)(PLACE);
        const unsigned long spent = platform_count() - start;
        solving += spent;
        longest = spent > longest ? spent : longest;
    } while (status == DCAL_WORKING);
    expect(status, DCAL_OK, "step");
    OK(C(_finished)(PLACE));
    OK(C(_solving)(PLACE));
    start = platform_count();
    OK(C(_finish)(PLACE, &robot, sizeof robot, &error));
    OF(cost)(TEXT(FAMILY(, )) ", finish", platform_count() - start);
    OF(cost)(TEXT(FAMILY(, )) ", add, mean", adding / SAMPLES);
    OF(cost)(TEXT(FAMILY(, )) ", all steps", solving);
    OF(cost)(TEXT(FAMILY(, )) ", longest step", longest);
    SCALAR(FAMILY(write_, ))(PLACE);
}
