// Calls the functions of the C++ example in docs/c.md: with too few samples, then with enough of a robot whose forearms are
// shorter. The test puts it behind them.

// One sample through a gate that has nothing to test it with.
template <typename Gate> static bool gated(const dcal_sample_f32 &sample)
{
    static Gate gate;
    dcal_verdict_f32 verdict;
    dcal_gate_counts_f32 counts;
    return gate.init(robot, {}) == DCAL_OK && gate.add(sample, verdict) == DCAL_OK && verdict.verdict == DCAL_UNTESTED
        && gate.state(counts) == DCAL_OK && counts.untested == 1 && gate.solving() == DCAL_OK
        && gate.finished() == DCAL_UNFINISHED && gate.acknowledge() == DCAL_OK;
}

int main()
{
    dcal_error error;
    delta_cal::Robot<float> built;
    float position[3];
    float found[3];
    if (robot.forward({0, 0, 0}, position) != DCAL_NOT_INITIALIZED
        || prepare(error) != DCAL_OK || calibrator.solve(&error) != DCAL_TOO_FEW_SAMPLES || error.needed != 1
        || built.from_dimensions({194, 30, 260, 479, 0}) != DCAL_OK) {
        return 1;
    }
    for (int pose = 0; pose < 20; pose++) {
        dcal_sample_f32 sample = {};
        for (int joint = 0; joint < 3; joint++) {
            sample.joints[joint] = 0.0625f * float((pose * (2 * joint + 3)) % (11 + 2 * joint) - 5);
        }
        if (built.forward(sample.joints, sample.position) != DCAL_OK || calibrator.add(sample) != DCAL_OK) {
            return 2;
        }
        if (pose == 0 && !(gated<delta_cal::IkmGate<float>>(sample) && gated<delta_cal::JointGate<float>>(sample))) {
            return 6;
        }
    }
    if (calibrator.solve(&error) != DCAL_OK) {
        return 3;
    }
    dcal_status status;
    do {
        status = idle(error);
    } while (status == DCAL_WORKING);
    if (status != DCAL_OK || robot.forward({0, 0, 0}, found) != DCAL_OK
        || built.forward({0, 0, 0}, position) != DCAL_OK) {
        return 4;
    }
    const float off = found[2] - position[2];
    return off * off < 2.5e-3f ? 0 : 5;
}
