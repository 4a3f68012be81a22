// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace roslam::app {

/// A row of table 3 of the paper: RMSE of the absolute trajectory error in metres, median of ten runs; NaN
/// where the paper gives none.
struct PaperError {
  std::string sequence;  ///< as the paper names it, without fr3/
  double dynaslam;
  double ds_slam;
  double orb_slam2;
  double ro_slam;
};

/// In the paper's order.
std::vector<PaperError> paper_table_3();

/// Folder name of a sequence of table 3 in the TUM benchmark.
std::string tum_folder_of(const PaperError& row);

/// A row of table 5 of the paper: mean time per frame in milliseconds, with a GPU (GTX 1060).
struct PaperTime {
  std::string method;
  double milliseconds;
};

std::vector<PaperTime> paper_table_5();

}  // namespace roslam::app
