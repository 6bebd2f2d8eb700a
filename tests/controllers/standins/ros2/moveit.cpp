// Calls the MoveIt plug-in as the words of the standard input say and prints what it gives. SPDX-License-Identifier: MIT
#include <chrono>
#include <cmath>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <moveit/kinematics_base/kinematics_base.hpp>
#include <moveit/robot_model/robot_model.hpp>
#include <moveit/robot_state/robot_state.hpp>
#include <moveit/utils/logger.hpp>

std::unique_ptr<kinematics::KinematicsBase> make_plugin();

// Sets a runtime parameter of a plug-in that has some; each robot's tests define it.
bool set_parameter(kinematics::KinematicsBase & plugin, const std::string & name, double value);

rclcpp::Logger moveit::getLogger(const std::string & name) {return rclcpp::get_logger(name);}

// The classes of the model, which the contract declares: links between joints, without shapes.
namespace moveit
{
namespace core
{

const std::string & JointModel::getName() const {return name_;}
JointModel::JointType JointModel::getType() const {return type_;}
const JointModel::Bounds & JointModel::getVariableBounds() const {return bounds_;}

const std::string & JointModelGroup::getName() const {return name_;}
const std::vector<const JointModel *> & JointModelGroup::getActiveJointModels() const {return active_;}
const std::vector<std::string> & JointModelGroup::getActiveJointModelNames() const {return names_;}
const std::vector<const JointModel *> & JointModelGroup::getMimicJointModels() const {return mimic_;}
const std::vector<std::string> & JointModelGroup::getLinkModelNames() const {return links_;}
bool JointModelGroup::isChain() const {return is_chain_;}

bool RobotModel::hasLinkModel(const std::string & name) const
{
  const auto is_it = [&](const std::shared_ptr<JointModel> & joint) {return joint->child_ == name;};
  return name == root_ || std::any_of(joints_.begin(), joints_.end(), is_it);
}

const JointModelGroup * RobotModel::getJointModelGroup(const std::string & name) const
{
  return name == group_.name_ ? &group_ : nullptr;
}

RobotState::RobotState(const RobotModelConstPtr & robot_model)
: model_(robot_model)
{
}

void RobotState::setToDefaultValues()
{
  for (const auto & joint : model_->joints_) {
    values_[joint->name_] = 0.0;
  }
}

void RobotState::setVariablePosition(const std::string & variable, double value) {values_.at(variable) = value;}

// Joints are in an order in which parents come first.
void RobotState::update(bool)
{
  poses_[model_->root_] = Eigen::Isometry3d::Identity();
  for (const auto & joint : model_->joints_) {
    Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
    const double value = values_.at(joint->name_);
    if (joint->type_ == JointModel::REVOLUTE) {
      motion.linear() = Eigen::AngleAxisd(value, joint->axis_).toRotationMatrix();
    } else if (joint->type_ == JointModel::PRISMATIC) {
      motion.translation() = value * joint->axis_;
    }
    poses_[joint->child_] = poses_.at(joint->parent_) * joint->origin_ * motion;
  }
}

const Eigen::Isometry3d & RobotState::getGlobalLinkTransform(const std::string & link_name)
{
  return poses_.at(link_name);
}

}  // namespace core
}  // namespace moveit

namespace
{

using moveit::core::JointModel;
using Values = std::vector<double>;

Values numbers(std::istringstream & words)
{
  Values found;
  for (std::string word; words >> word; ) {
    found.push_back(std::stod(word));
  }
  return found;
}

void read_joint(std::istringstream & words, moveit::core::RobotModel & model)
{
  auto joint = std::make_shared<JointModel>();
  std::string type;
  words >> joint->name_ >> type >> joint->parent_ >> joint->child_;
  const Values given = numbers(words);
  joint->type_ = type == "revolute" ? JointModel::REVOLUTE : type == "prismatic" ? JointModel::PRISMATIC :
    JointModel::FIXED;
  for (int k = 0; k < 12; ++k) {
    joint->origin_.matrix()(k / 4, k % 4) = given.at(static_cast<std::size_t>(k));
  }
  joint->axis_ << given.at(12), given.at(13), given.at(14);
  if (joint->type_ != JointModel::FIXED) {
    moveit::core::VariableBounds bounds;
    bounds.position_bounded_ = given.size() > 16;
    bounds.min_position_ = bounds.position_bounded_ ? given[15] : 0.0;
    bounds.max_position_ = bounds.position_bounded_ ? given[16] : 0.0;
    joint->bounds_ = {bounds};
  }
  model.joints_.push_back(joint);
}

void read_group(std::istringstream & words, moveit::core::RobotModel & model)
{
  std::string kind;
  words >> model.group_.name_ >> kind;
  model.group_.is_chain_ = kind != "tree";
  for (std::string name; words >> name; ) {
    for (const auto & joint : model.joints_) {
      if (joint->name_ == name) {
        model.group_.links_.push_back(joint->child_);
        if (kind == "mimic" && model.group_.mimic_.empty()) {
          model.group_.mimic_.push_back(joint.get());
        }
        if (joint->type_ != JointModel::FIXED) {
          model.group_.active_.push_back(joint.get());
          model.group_.names_.push_back(name);
        }
      }
    }
  }
}

void print(const char * word, bool good, int code, const std::vector<Values> & rows)
{
  std::cout.precision(17);
  std::cout << word << ' ' << good << ' ' << code;
  for (const Values & row : rows) {
    for (const double value : row) {
      std::cout << ' ' << value;
    }
  }
  std::cout << std::endl;
}

Values row_of(const geometry_msgs::msg::Pose & pose)
{
  return {pose.position.x, pose.position.y, pose.position.z, pose.orientation.x, pose.orientation.y,
    pose.orientation.z, pose.orientation.w};
}

}  // namespace

int main()
{
  std::vector<std::unique_ptr<kinematics::KinematicsBase>> plugins;
  plugins.push_back(make_plugin());
  kinematics::KinematicsBase * plugin = plugins.front().get();
  const auto node = std::make_shared<rclcpp::Node>();
  auto model = std::make_shared<moveit::core::RobotModel>();
  geometry_msgs::msg::Pose pose;
  Values seed, limits;
  kinematics::KinematicsQueryOptions options;
  for (std::string line; std::getline(std::cin, line); ) {
    std::istringstream words(line);
    std::string word, name, other;
    words >> word;
    moveit_msgs::msg::MoveItErrorCodes code;
    Values solution;
    if (word == "root") {
      words >> model->root_;
    } else if (word == "joint") {
      read_joint(words, *model);
    } else if (word == "group") {
      read_group(words, *model);
    } else if (word == "parameter") {
      // A type, a name, a value.
      words >> other >> name >> word;
      node->launched_[name] = other == "bool" ? rclcpp::ParameterValue(word == "true") :
        other == "integer" ? rclcpp::ParameterValue(std::int64_t(std::stoll(word))) :
        other == "double" ? rclcpp::ParameterValue(std::stod(word)) : rclcpp::ParameterValue(word);
    } else if (word == "declare") {
      // As a node does that declares every parameter of its launch file.
      node->declare_launched();
    } else if (word == "set") {
      words >> name >> other;
      print("set", set_parameter(*plugin, name, std::stod(other)), 0, {});
    } else if (word == "another") {
      // A second plug-in beside the first one; those of both stay.
      plugins.push_back(make_plugin());
      plugin = plugins.back().get();
    } else if (word == "first") {
      plugin = plugins.front().get();
    } else if (word == "initialize") {
      double step = 0.0;
      words >> name >> step >> other;
      std::vector<std::string> tips;
      for (std::string tip; words >> tip; ) {
        tips.push_back(tip);
      }
      print("initialize", plugin->initialize(node, *model, name, other, tips, step), 0, {});
    } else if (word == "names") {
      std::cout << "names";
      for (const auto & each : plugin->getJointNames()) {
        std::cout << ' ' << each;
      }
      std::cout << " /";
      for (const auto & each : plugin->getLinkNames()) {
        std::cout << ' ' << each;
      }
      std::cout << std::endl;
    } else if (word == "seed") {
      seed = numbers(words);
    } else if (word == "limits") {
      limits = numbers(words);
    } else if (word == "options") {
      int method = 1;
      words >> options.lock_redundant_joints >> method;
      options.discretization_method = static_cast<kinematics::DiscretizationMethod>(method);
    } else if (word == "redundant") {
      std::vector<unsigned int> indices;
      for (const double each : numbers(words)) {
        indices.push_back(static_cast<unsigned int>(each));
      }
      print("redundant", plugin->setRedundantJoints(indices), 0, {});
    } else if (word == "pose") {
      const Values given = numbers(words);
      pose.position.x = given.at(0);
      pose.position.y = given.at(1);
      pose.position.z = given.at(2);
      pose.orientation.x = given.at(3);
      pose.orientation.y = given.at(4);
      pose.orientation.z = given.at(5);
      pose.orientation.w = given.at(6);
    } else if (word == "fk") {
      std::vector<geometry_msgs::msg::Pose> poses;
      std::vector<std::string> links;
      for (std::string link; words >> link; ) {
        links.push_back(link);
      }
      const bool good = plugin->getPositionFK(links, seed, poses);
      std::vector<Values> rows;
      for (const auto & each : poses) {
        rows.push_back(row_of(each));
      }
      print("fk", good, 0, rows);
    } else if (word == "ik") {
      const bool good = plugin->getPositionIK(pose, seed, solution, code, options);
      print("ik", good, code.val, {solution});
    } else if (word == "all") {
      std::size_t count = 1;
      words >> count;
      kinematics::KinematicsResult result;
      std::vector<Values> solutions;
      const std::vector<geometry_msgs::msg::Pose> poses(count, pose);
      const bool good = plugin->getPositionIK(poses, seed, solutions, result, options);
      print("all", good, static_cast<int>(result.kinematic_error), solutions);
    } else if (word == "search") {
      // Through each of the forms: with neither, with limits, with a callback, with both, for a list, with a cost.
      double timeout = 1.0, slow = 0.0;
      int form = 0, rejected = 0, calls = 0;
      // Streams do not read nan.
      words >> form >> other >> rejected >> slow;
      timeout = std::stod(other);
      std::vector<Values> offered;
      const kinematics::KinematicsBase::IKCallbackFn callback = [&](
        const geometry_msgs::msg::Pose &, const Values & values, moveit_msgs::msg::MoveItErrorCodes & answer) {
          const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(slow);
          while (std::chrono::steady_clock::now() < end) {
          }
          offered.push_back(values);
          answer.val = calls++ < rejected ? moveit_msgs::msg::MoveItErrorCodes::GOAL_IN_COLLISION :
            moveit_msgs::msg::MoveItErrorCodes::SUCCESS;
        };
      // The cost is the height of the second link that moves, with the sign that the callback's count states.
      const kinematics::KinematicsBase::IKCostFn cost = [&](
        const geometry_msgs::msg::Pose &, const moveit::core::RobotState & state,
        const moveit::core::JointModelGroup * group, const Values &) {
          return -moveit::core::RobotState(state).getGlobalLinkTransform(group->getLinkModelNames().at(2)).translation().z();
        };
      const std::vector<geometry_msgs::msg::Pose> poses(1, pose);
      bool good = false;
      const auto begin = std::chrono::steady_clock::now();
      switch (form) {
        case 0: good = plugin->searchPositionIK(pose, seed, timeout, solution, code, options); break;
        case 1: good = plugin->searchPositionIK(pose, seed, timeout, limits, solution, code, options); break;
        case 2: good = plugin->searchPositionIK(pose, seed, timeout, solution, callback, code, options); break;
        case 3: good = plugin->searchPositionIK(pose, seed, timeout, limits, solution, callback, code, options); break;
        case 4: good = plugin->searchPositionIK(poses, seed, timeout, limits, solution, callback, code, options); break;
        case 5:
          good = plugin->searchPositionIK(poses, seed, timeout, limits, solution, callback, cost, code, options);
          break;
        case 6: {
            // A cost with the context of a state, and no callback.
            moveit::core::RobotState state(model);
            state.setToDefaultValues();
            good = plugin->searchPositionIK(
              poses, seed, timeout, limits, solution, nullptr, cost, code, options, &state);
            break;
          }
        default:
          good = plugin->searchPositionIK(
            std::vector<geometry_msgs::msg::Pose>(2, pose), seed, timeout, limits, solution, callback, code, options);
      }
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      print("search", good, code.val, {solution});
      print("offered", true, static_cast<int>(offered.size()), offered);
      print("seconds", true, 0, {{seconds}});
    }
  }
  return 0;
}
