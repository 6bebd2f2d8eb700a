// What users of the headers write; it returns the number of checks that fail. Two robots are in one file.
#include "puma560.hpp"
#include "calibrated_2r.hpp"
#include "hand.hpp"

#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

namespace {

int failures = 0;

void check(const bool holds, const char* what)
{
    if (!holds) {
        ++failures;
        std::printf("%s\n", what);
    }
}

// Constant expressions: numbers are computed by the compiler.
constexpr auto pose = puma560::fk({0.1, -0.3, 0.6, 0.0, 0.4, 0.0});
static_assert(pose(3, 3) == 1.0 && pose(3, 0) == 0.0);
static_assert(pose(0, 3) > 0.2878 && pose(0, 3) < 0.2879);
constexpr auto in_float = puma560::fk<float>({});
static_assert(in_float(3, 3) == 1.0F);
constexpr auto all = puma560::inverse(pose);
static_assert(all.count() == 4 || all.count() > 0);
static_assert(puma560::branch_names[0] == "shoulder left, elbow up, wrist no-flip");
static_assert(static_cast<int>(puma560::Branch::shoulder_left_elbow_up_wrist_flip) == 1);
constexpr auto nearest = puma560::inverse_nearest(pose, {0.1, -0.3, 0.6, 0.0, 0.4, 0.0});
static_assert(nearest.has_value() && (*nearest)[0] > 0.0999999 && (*nearest)[0] < 0.1000001);
constexpr auto angles = puma560::rpy_zyx({0.1, -0.3, 0.6, 0.0, 0.4, 0.0});
static_assert(angles[2] < 4.0);
static_assert(puma560::within_limits({}) && !puma560::within_limits({9.0, 0.0, 0.0, 0.0, 0.0, 0.0}));
static_assert(puma560::clamp({9.0, 0.0, 0.0, 0.0, 0.0, 0.0})[0] == puma560::limits_high<double>[0]);
static_assert(calibrated_2r::fk({0.1, 0.2})(3, 3) == 1.0);
static_assert(puma560::dof == 6 && hand::tip_names.size() == hand::fk<double>({}).size() / 16);
static_assert(noexcept(puma560::fk({})));

void views()
{
    const std::array<double, 6> q{0.1, -0.3, 0.6, 0.0, 0.4, 0.0};
    double raw[16] = {};
    puma560::fk(puma560::View(q), puma560::View(raw));
    const auto found = puma560::fk(q);
    const auto [T, J] = puma560::fk_jacobian(q);
    std::array<double, 16> kept{};
    const double joints[6] = {0.1, -0.3, 0.6, 0.0, 0.4, 0.0};
    puma560::fk(puma560::View(joints), puma560::View(kept));
    puma560::Pose<double> same{};
    puma560::fk(puma560::View<const double, 6>(q.data()), puma560::View(same));
    for (std::size_t i = 0; i < 16; ++i) {
        check(raw[i] == found.entries[i] && kept[i] == raw[i] && same.entries[i] == raw[i], "views have the same bits");
        check(raw[i] == pose.entries[i], "a constant expression has the bits of a call");
        check(std::abs(T.entries[i] - raw[i]) < 1e-15, "the pose with its Jacobian is the pose");
    }
    check(J(5, 0) == 1.0, "joint 1 turns about z");
#if defined(__cpp_lib_span)
    std::span<double, 16> span(raw);
    puma560::fk(puma560::View(q), puma560::View(span));
    check(span[0] == found(0, 0), "spans are views");
#endif
}

void batches()
{
    std::vector<float> q(600, 0.25F);
    std::vector<float> poses(1600);
    q[6] = std::numeric_limits<float>::quiet_NaN();
    puma560::fk_batch(100, q.data(), poses.data());
    puma560::fk_batch<float>(0, nullptr, nullptr);
    check(poses[16 + 3] != poses[16 + 3] && poses[3] == poses[99 * 16 + 3], "NaN stays where it is");
}

void inverses()
{
    const auto solved = puma560::inverse(pose);
    std::size_t found = 0;
    for (std::size_t i = 0; i < puma560::branch_names.size(); ++i) {
        found += solved.valid[i] ? 1U : 0U;
    }
    check(found == solved.count() && found == all.count(), "branches are counted");
    const auto branch = puma560::Branch::shoulder_right_elbow_up_wrist_no_flip;
    check(solved[branch] == solved.solutions[branch], "solutions by name");
    check(!puma560::inverse_nearest(pose, {1e300, 0.0, 0.0, 0.0, 0.0, 0.0}), "nothing is near to what is too far");
    auto nowhere = pose;
    nowhere(0, 3) = 99.0;
    check(puma560::inverse(nowhere).count() == 0, "what is out of reach has no solution");
}

void parameters()
{
    calibrated_2r::Params<double> params;
    const auto usual = calibrated_2r::fk({0.1, 0.2});
    check(calibrated_2r::fk({0.1, 0.2}, params)(0, 3) == usual(0, 3), "defaults are those of the file");
    params.zero_2 += 0.1;
    check(calibrated_2r::fk({0.1, 0.2}, params)(0, 3) != usual(0, 3), "parameters count");
}

} // namespace

int main()
{
    views();
    batches();
    inverses();
    parameters();
    const auto frames = puma560::frames({0.1, -0.3, 0.6, 0.0, 0.4, 0.0});
    check(frames[puma560::Frame::tool](0, 3) == frames(puma560::Frame::tool, 0, 3), "frames by name");
    return failures;
}
