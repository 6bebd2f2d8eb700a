#include <array>
#include <cstdio>
#include <vector>

#include "puma560.hpp"

// A pose that the compiler computes.
constexpr auto home = puma560::fk({0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
static_assert(home(0, 3) > 0.45 && home(0, 3) < 0.46);

int main()
{
    // One configuration: angles in rad, a 4x4 matrix.
    const std::array<double, puma560::dof> q{0.0, -0.3, 0.6, 0.0, 0.4, 0.0};
    const auto T = puma560::fk(q);
    std::printf("position %.4f %.4f %.4f\n", T(0, 3), T(1, 3), T(2, 3));

    // The same in single precision, and into memory that is there already.
    const auto single = puma560::fk<float>({0.0F, -0.3F, 0.6F, 0.0F, 0.4F, 0.0F});
    double matrix[16];
    puma560::fk(puma560::View(q), puma560::View(matrix));
    std::printf("x in float %.4f, in a C array %.4f\n", single(0, 3), matrix[3]);

    // All joint vectors of a pose, by the names of their branches.
    const auto all = puma560::inverse(T);
    const auto branch = puma560::Branch::shoulder_right_elbow_down_wrist_no_flip;
    std::printf("solutions %zu of %zu\n", all.count(), puma560::branch_names.size());
    if (all.is_valid(branch)) {
        std::printf("%s: joint 1 is %.3f\n", puma560::branch_names[6].data(), all[branch][0]);
    }
    if (const auto near = puma560::inverse_nearest(T, q)) {
        std::printf("nearest: joint 2 is %.3f\n", (*near)[1]);
    }

    // Many configurations at once.
    const std::vector<double> many(1000 * puma560::dof, 0.1);
    std::vector<double> poses(1000 * 16);
    puma560::fk_batch(1000, many.data(), poses.data());
    std::printf("poses %zu\n", poses.size() / 16);
}
