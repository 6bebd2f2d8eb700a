// A stand-in for the header of the same name, written for tests: one parameter. SPDX-License-Identifier: MIT
#pragma once
#include <string>
namespace rclcpp
{
class Parameter
{
public:
  Parameter(const std::string &, const std::string & value) : value_(value) {}
  std::string as_string() const {return value_;}

private:
  std::string value_;
};

namespace node_interfaces
{
class NodeParametersInterface
{
public:
  bool has_parameter(const std::string & name) const {return name == "kinematics.tip";}
  bool get_parameter(const std::string &, Parameter & parameter) const
  {
    parameter = Parameter("tip", "flange");
    return true;
  }
};
}  // namespace node_interfaces
}  // namespace rclcpp
