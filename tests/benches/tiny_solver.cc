// One arm's problem for Ceres' TinySolver: the residuals and derivatives of tests/src/peer.rs, sines computed
// beforehand, no covariance. benches/solvers.rs compiles and runs it, and takes the times.
//
// Input: the number of samples, the eight start parameters, for each sample X, sin q and cos q, then numbers of
// solves. Output for each of these: Lb of the solution and the nanoseconds they took together.

#include <ceres/tiny_solver.h>

#include <chrono>
#include <cstdio>
#include <vector>

namespace {

using Vector = Eigen::Vector3d;

struct Row {
    Vector x;
    double sine, cosine;
};

// The number of samples is known when it is compiled: then TinySolver allocates nothing.
template <int SAMPLES>
struct Arm {
    using Scalar = double;
    enum { NUM_RESIDUALS = SAMPLES, NUM_PARAMETERS = 8 };

    std::vector<Row> rows;

    bool operator()(const double* p, double* residuals, double* jacobian) const {
        const double sin_theta = std::sin(p[3]), cos_theta = std::cos(p[3]);
        const double sin_alpha = std::sin(p[4]), cos_alpha = std::cos(p[4]);
        const double la_x = p[5], la_y = p[6], lb = p[7];
        const Vector ex(cos_theta, sin_theta, 0), d(p[0], p[1], p[2]);
        const Vector ez(sin_theta * sin_alpha, -cos_theta * sin_alpha, cos_alpha);
        const Vector ex_by_theta(-sin_theta, cos_theta, 0), ez_by_theta = ex * sin_alpha;
        const Vector ez_by_alpha(sin_theta * cos_alpha, -cos_theta * cos_alpha, -sin_alpha);
        const Vector u = ex * la_x + ez * la_y, v = ex * la_y - ez * la_x;
        for (int i = 0; i < SAMPLES; ++i) {
            const double c = rows[i].cosine, s = rows[i].sine;
            const Vector to_platform = rows[i].x - (d + u * c + v * s);
            residuals[i] = to_platform.squaredNorm() - lb * lb;
            if (jacobian == nullptr) continue;
            const Vector w = -2 * to_platform;
            const double along = la_x * c + la_y * s, across = la_y * c - la_x * s;
            const double w_ex = w.dot(ex), w_ez = w.dot(ez);
            const double entries[] = {
                w.x(), w.y(), w.z(),
                w.dot(ex_by_theta) * along + w.dot(ez_by_theta) * across,
                w.dot(ez_by_alpha) * across,
                w_ex * c - w_ez * s, w_ez * c + w_ex * s, -2 * lb,
            };
            for (int column = 0; column < 8; ++column) jacobian[column * SAMPLES + i] = entries[column];
        }
        return true;
    }
};

template <int SAMPLES>
int run() {
    using Solver = ceres::TinySolver<Arm<SAMPLES>>;
    typename Solver::Parameters start;
    Arm<SAMPLES> arm;
    arm.rows.resize(SAMPLES);
    for (int i = 0; i < 8; ++i)
        if (std::scanf("%lf", &start[i]) != 1) return 1;
    for (Row& row : arm.rows) {
        double* x = row.x.data();
        if (std::scanf("%lf %lf %lf %lf %lf", x, x + 1, x + 2, &row.sine, &row.cosine) != 5) return 1;
    }
    static Solver solver;
    long solves;
    while (std::scanf("%ld", &solves) == 1) {
        auto solution = start;
        const auto begin = std::chrono::steady_clock::now();
        for (long i = 0; i < solves; ++i) {
            solution = start;
            solver.Solve(arm, &solution);
            asm volatile("" : : "r"(solution.data()) : "memory");
        }
        const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - begin;
        std::printf("%.17g %.0f\n", solution[7], taken.count());
        std::fflush(stdout);
    }
    return 0;
}

}  // namespace

int main() {
    int samples;
    if (std::scanf("%d", &samples) != 1) return 1;
    switch (samples) {
        case 20: return run<20>();
        case 60: return run<60>();
        case 1000: return run<1000>();
        default: return 1;
    }
}
