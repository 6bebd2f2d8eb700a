// What users of Eigen write; it returns the number of checks that fail.
#include "puma560.hpp"

#include <cstdio>

int main()
{
    Eigen::Matrix<double, 6, 1> q;
    q << 0.1, -0.3, 0.6, 0.0, 0.4, 0.0;
    const Eigen::VectorXd dynamic = q;
    const auto plain = puma560::fk({0.1, -0.3, 0.6, 0.0, 0.4, 0.0});
    const Eigen::Matrix4d pose = puma560::fk(q);
    const Eigen::Isometry3d isometry = puma560::isometry(plain);
    auto mapped = plain;
    puma560::map(mapped)(0, 3) += 1.0;
    const auto [T, J] = puma560::fk_jacobian(dynamic);
    const Eigen::Matrix<double, 6, 1> velocity = J * q;
    const auto twist = puma560::twist(q, q);
    const auto [solutions, valid] = puma560::inverse(isometry.matrix());
    const auto frames = puma560::frames(q * 1.0);
    const auto nearest = puma560::inverse_nearest(pose, q);
    const bool holds[] = {
        (pose - T).cwiseAbs().maxCoeff() < 1e-15 && pose(0, 3) == plain(0, 3) && pose(0, 1) == plain(0, 1),
        isometry.translation().x() == plain(0, 3) && isometry.linear()(0, 1) == plain(0, 1),
        mapped(0, 3) == plain(0, 3) + 1.0 && puma560::map(plain)(0, 1) == plain(0, 1),
        (velocity - twist).norm() < 1e-15,
        solutions.rows() == 8 && solutions.cols() == 6 && valid.size() == 8,
        (frames.back() - pose).norm() < 1e-15,
        nearest.has_value() && (*nearest - q).norm() < 1e-9,
        puma560::fk(q.cast<float>().eval())(3, 3) == 1.0F,
    };
    int failures = 0;
    for (const bool each : holds) {
        failures += each ? 0 : 1;
        std::printf("%s", each ? "" : "a check of Eigen fails\n");
    }
    return failures;
}
