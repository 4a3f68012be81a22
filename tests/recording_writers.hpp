// SPDX-License-Identifier: BSD-3-Clause
// Writers of ROS 1 bags, MCAP files and rosbag2 SQLite files, for tests: written from the specifications,
// independent of the readers. A writer that is destroyed without close() leaves a file as a crash does.
#pragma once

#include "tests/bag_writer.hpp"
#include "tests/db3_writer.hpp"
#include "tests/mcap_writer.hpp"
