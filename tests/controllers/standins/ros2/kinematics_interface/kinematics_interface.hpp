// A stand-in for the header of the same name, written for tests: the functions that plug-ins have.
// SPDX-License-Identifier: MIT
#ifndef STANDIN_KINEMATICS_INTERFACE_HPP_
#define STANDIN_KINEMATICS_INTERFACE_HPP_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <string>

#include "rclcpp/node_interfaces/node_parameters_interface.hpp"

namespace kinematics_interface
{
using Joints = Eigen::VectorXd;
using Twist = Eigen::Matrix<double, 6, 1>;
using Columns = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, 6>;
using Place = Eigen::Matrix<double, 7, 1>;
using Parameters = std::shared_ptr<rclcpp::node_interfaces::NodeParametersInterface>;
using Name = std::string;

class KinematicsInterface
{
public:
  virtual ~KinematicsInterface() = default;
  virtual bool initialize(const Name &, Parameters, const Name &) = 0;
  virtual bool convert_cartesian_deltas_to_joint_deltas(const Joints &, const Twist &, const Name &, Joints &) = 0;
  virtual bool convert_joint_deltas_to_cartesian_deltas(const Joints &, const Joints &, const Name &, Twist &) = 0;
  virtual bool calculate_link_transform(const Joints &, const Name &, Eigen::Isometry3d &) = 0;
  virtual bool calculate_jacobian(const Joints &, const Name &, Columns &) = 0;
  virtual bool calculate_jacobian_inverse(const Joints &, const Name &, Rows &) = 0;
  virtual bool calculate_frame_difference(Place &, Place &, double, Twist &) = 0;
};
}  // namespace kinematics_interface

#endif
