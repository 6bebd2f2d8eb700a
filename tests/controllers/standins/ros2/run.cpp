// Calls the plug-in as the words of the standard input say and prints what it gives. SPDX-License-Identifier: MIT
#include <Eigen/Geometry>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "kinematics_interface/kinematics_interface.hpp"
#include "rclcpp/node_interfaces/node_parameters_interface.hpp"

std::unique_ptr<kinematics_interface::KinematicsInterface> make_plugin();

// The parameters of a node: strings, lists of strings, numbers.
class Parameters : public rclcpp::node_interfaces::NodeParametersInterface
{
public:
  std::map<std::string, rclcpp::Parameter> values;
  bool has_parameter(const std::string & name) const override {return values.count(name) > 0;}
  bool get_parameter(const std::string & name, rclcpp::Parameter & parameter) const override
  {
    if (!has_parameter(name)) {
      return false;
    }
    parameter = values.at(name);
    return true;
  }
};

template<typename Matrix>
void print(const char * name, bool good, const Matrix & matrix)
{
  std::cout.precision(17);
  std::cout << name << ' ' << good;
  for (Eigen::Index row = 0; good && row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      std::cout << ' ' << matrix(row, column);
    }
  }
  std::cout << std::endl;
}

std::vector<std::string> rest(std::istringstream & words)
{
  std::vector<std::string> found;
  for (std::string word; words >> word; ) {
    found.push_back(word);
  }
  return found;
}

int main()
{
  const auto plugin = make_plugin();
  const auto parameters = std::make_shared<Parameters>();
  Eigen::VectorXd q, deltas;
  Eigen::Isometry3d pose;
  Eigen::Matrix<double, 6, 1> twist;
  for (std::string line; std::getline(std::cin, line); ) {
    std::istringstream words(line);
    std::string word, name;
    words >> word;
    if (word == "string" || word == "strings" || word == "double") {
      words >> name;
      const auto type = word == "string" ? rclcpp::PARAMETER_STRING :
        word == "double" ? rclcpp::PARAMETER_DOUBLE : rclcpp::PARAMETER_STRING_ARRAY;
      parameters->values[name] = rclcpp::Parameter(type, rest(words));
    } else if (word == "initialize") {
      words >> name;
      std::cout << "initialize " << plugin->initialize("", parameters, name) << std::endl;
    } else if (word == "q") {
      const auto numbers = rest(words);
      q.resize(static_cast<Eigen::Index>(numbers.size()));
      for (std::size_t k = 0; k < numbers.size(); ++k) {
        q[static_cast<Eigen::Index>(k)] = std::stod(numbers[k]);
      }
    } else if (word == "link") {
      words >> name;
      Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(6, q.size());
      Eigen::Matrix<double, Eigen::Dynamic, 6> inverse(q.size(), 6);
      const Eigen::VectorXd given = Eigen::VectorXd::LinSpaced(q.size(), 1e-3, 2e-3);
      print("pose", plugin->calculate_link_transform(q, name, pose), pose.matrix());
      print("jacobian", plugin->calculate_jacobian(q, name, jacobian), jacobian);
      print("inverse", plugin->calculate_jacobian_inverse(q, name, inverse), inverse);
      print("twist", plugin->convert_joint_deltas_to_cartesian_deltas(q, given, name, twist), twist);
      print("deltas", plugin->convert_cartesian_deltas_to_joint_deltas(q, twist, name, deltas), deltas);
#ifdef PARAMETERS
    } else if (word == "set") {
      double value = 0.0;
      words >> name >> value;
      std::cout << "set " << dynamic_cast<PLUGIN &>(*plugin).set_parameter(name, value) << std::endl;
#endif
    } else if (word == "follow") {
      // From other joint values to the last pose.
      Eigen::VectorXd joints;
      const Eigen::VectorXd present = q.array() + 0.01;
      const bool good = dynamic_cast<PLUGIN &>(*plugin).calculate_joints(pose, present, joints);
      print("joints", good, joints);
    } else if (word == "deltas") {
      // The same number for each delta.
      words >> name;
      const double value = std::stod(name);
      const Eigen::VectorXd given = Eigen::VectorXd::Constant(q.size(), value);
      const Eigen::Matrix<double, 6, 1> moved = Eigen::Matrix<double, 6, 1>::Constant(value);
      print("twist", plugin->convert_joint_deltas_to_cartesian_deltas(q, given, "tool", twist), twist);
      print("deltas", plugin->convert_cartesian_deltas_to_joint_deltas(q, moved, "tool", deltas), deltas);
    } else if (word == "difference") {
      Eigen::Matrix<double, 7, 1> a, b;
      double period = 0.0;
      words >> period;
      a << 1, 2, 3, 0, 0, 0, 1;
      b << 1.5, 2, 2, 0, 0, std::sin(0.3), std::cos(0.3);
      print("difference", plugin->calculate_frame_difference(a, b, period, twist), twist);
    }
  }
  return 0;
}
