// Calls the plug-in with joint values from the standard input and prints what it gives. SPDX-License-Identifier: MIT
#include <iostream>
#include <memory>
#include <vector>

#include "kinematics_interface/kinematics_interface.hpp"

std::unique_ptr<kinematics_interface::KinematicsInterface> make_plugin();

template<typename Matrix>
void print(const char * name, const Matrix & matrix)
{
  std::cout.precision(17);
  std::cout << name;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      std::cout << ' ' << matrix(row, column);
    }
  }
  std::cout << '\n';
}

int main()
{
  const auto plugin = make_plugin();
  const std::string tip = "flange";
  std::vector<double> numbers;
  for (double number; std::cin >> number; ) {
    numbers.push_back(number);
  }
  const auto count = static_cast<Eigen::Index>(numbers.size());
  const Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(numbers.data(), count);
  Eigen::Isometry3d pose;
  const bool before = plugin->calculate_link_transform(q, tip, pose);
  plugin->initialize("", std::make_shared<rclcpp::node_interfaces::NodeParametersInterface>(), "kinematics");
  const bool other = plugin->calculate_link_transform(q, "elbow", pose);
  const bool shorter = plugin->calculate_link_transform(q.head(count - 1), tip, pose);
  std::cout << "refused " << before << other << shorter << '\n';

  kinematics_interface::Columns jacobian(6, count);
  kinematics_interface::Rows inverse(count, 6);
  kinematics_interface::Twist twist, back;
  Eigen::VectorXd deltas, again = Eigen::VectorXd::LinSpaced(count, 1e-3, 2e-3);
  bool good = plugin->calculate_link_transform(q, tip, pose);
  good &= plugin->calculate_jacobian(q, tip, jacobian);
  good &= plugin->calculate_jacobian_inverse(q, tip, inverse);
  good &= plugin->convert_joint_deltas_to_cartesian_deltas(q, again, tip, twist);
  good &= plugin->convert_cartesian_deltas_to_joint_deltas(q, twist, tip, deltas);
  std::cout << "good " << good << '\n';
  print("pose", pose.matrix());
  print("jacobian", jacobian);
  print("product", (inverse * jacobian).eval());
  print("deltas", (deltas - again).eval());

  kinematics_interface::Place a, b;
  a << 1, 2, 3, 0, 0, 0, 1;
  b << 1.5, 2, 2, 0, 0, std::sin(0.3), std::cos(0.3);
  good = plugin->calculate_frame_difference(a, b, 0.5, back);
  print("difference", back);
  std::cout << "good " << good << plugin->calculate_frame_difference(a, b, 0.0, back) << '\n';
  return 0;
}
