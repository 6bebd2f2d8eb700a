// A stand-in for the header of the same name, written for tests. SPDX-License-Identifier: MIT
#pragma once
#include <cstdio>
namespace rclcpp
{
inline const char * get_logger(const char * name) {return name;}
}  // namespace rclcpp
#define RCLCPP_ERROR(logger, ...) (std::fprintf(stderr, "%s: ", logger), std::fprintf(stderr, __VA_ARGS__), std::fputc('\n', stderr))
