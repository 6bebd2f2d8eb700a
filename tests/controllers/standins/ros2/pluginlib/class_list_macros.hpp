// A stand-in for the header of the same name, written for tests: makes the plug-in. SPDX-License-Identifier: MIT
#pragma once
#define PLUGINLIB_EXPORT_CLASS(TYPE, BASE) \
  std::unique_ptr<BASE> make_plugin() {return std::make_unique<TYPE>();}
