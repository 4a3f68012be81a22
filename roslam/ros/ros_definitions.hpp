// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "roslam/common/export.hpp"

namespace roslam {

/// The definition of a ROS 2 message with those of all types it uses, as MCAP files hold it (schema encoding
/// "ros2msg"). type: such as sensor_msgs/msg/Image. Throws UsageError for a type that is not written here.
ROSLAM_EXPORT std::string ros_definition(std::string_view type);

}  // namespace roslam
