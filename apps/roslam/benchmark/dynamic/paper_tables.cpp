// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/benchmark/dynamic/paper_tables.hpp"

#include <limits>

namespace roslam::app {

std::vector<PaperError> paper_table_3() {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  return {{"walking_halfsphere", 0.0250, 0.0222, 0.3510, 0.0210},
          {"walking_xyz", 0.0150, 0.0151, 0.4590, 0.0146},
          {"walking_rpy", 0.0400, 0.2835, 0.6620, 0.1300},
          {"walking_static", 0.0090, 0.0067, 0.0900, 0.0090},
          {"sitting_halfsphere", 0.0170, kNone, 0.0200, 0.0160},
          {"sitting_xyz", 0.0140, kNone, 0.0090, 0.0090}};
}

std::string tum_folder_of(const PaperError& row) { return "rgbd_dataset_freiburg3_" + row.sequence; }

std::vector<PaperTime> paper_table_5() {
  return {{"DynaSLAM with Mask R-CNN", 235.98},
          {"DynaSLAM with PSPNet", 198.42},
          {"RO-SLAM with improved PSPNet", 137.96}};
}

}  // namespace roslam::app
