/* Included once for each calibrator and each scalar: FAMILY(begin, end) is defined. */

/* Solves; how it ends, and the parameters. */
static dcal_status OWN(_outcome)(REAL parameters[24])
{
    OF(dcal_robot) robot;
    (void)C(_solve)(PLACE, NULL);
    while (C(_step)(PLACE) == DCAL_WORKING) {
    }
    const dcal_status status = C(_finish)(PLACE, &robot, sizeof robot, NULL);
    if (status == DCAL_OK) {
        OK(OF(dcal_robot_parameters)(&robot, parameters));
    }
    return status;
}

/* Adds samples before that, mirrored or not. */
static dcal_status OWN(_outcome_of)(REAL sign, REAL parameters[24])
{
    for (size_t index = 0; index < 20; index++) {
        OF(dcal_sample) sample = OF(sample)(index);
        sample.position[2] *= sign;
        OWN(_take)(&sample);
        while (C(_step)(PLACE) == DCAL_WORKING) {
        }
    }
    return OWN(_outcome)(parameters);
}

/* A calibrator that was reset is as a new one: its snapshot, and what it makes of mirrored samples, which it refuses, and
 * then of good ones. So is one that was restored. */
static void OWN(_reset)(const OF(dcal_settings) *settings)
{
    REAL found[2][24] = {{0}};
    size_t length[2] = {0};
    for (size_t anew = 0; anew < 2; anew++) {
        OWN(_begin)(settings);
        if (anew == 0) {
            OK(OWN(_outcome_of)(1, found[0]));
            OK(C(_reset)(PLACE));
        }
        OK(C(_snapshot)(PLACE, bytes[anew], sizeof bytes[anew], &length[anew]));
        check(OWN(_outcome_of)(-1, found[anew]) != DCAL_OK, TEXT(FAMILY(, )) ": mirrored samples are refused");
        OK(C(_reset)(PLACE));
        if (anew == 1) {
            OWN(_begin)(settings);
        }
        OK(OWN(_outcome_of)(1, found[anew]));
    }
    check(length[0] == length[1] && memcmp(bytes[0], bytes[1], length[0]) == 0, TEXT(FAMILY(, )) ": reset, its snapshot");
    check(memcmp(found[0], found[1], sizeof found[0]) == 0, TEXT(FAMILY(, )) ": reset, its result");
    OK(C(_snapshot)(PLACE, bytes[0], sizeof bytes[0], &length[0]));
    OWN(_begin)(settings);
    OK(C(_restore)(PLACE, bytes[0], length[0]));
    OK(OWN(_outcome)(found[0]));
    check(memcmp(found[0], found[1], sizeof found[0]) == 0, TEXT(FAMILY(, )) ": restored, its result");
}
