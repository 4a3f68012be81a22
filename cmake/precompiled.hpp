// SPDX-License-Identifier: BSD-3-Clause
// Headers that nearly every source includes, parsed once (ROSLAM_PRECOMPILED_HEADERS). Each source still
// includes what it uses: it has to compile without this file.
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>
#include <vector>
