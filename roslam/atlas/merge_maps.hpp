// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "roslam/atlas/saved_map.hpp"
#include "roslam/loop/loop_closer.hpp"

namespace roslam {

/// Makes one map of two: places of the second are recognised in the first, whose coordinates stay; the second
/// moves to where it belongs, drift between them is taken out, what both have becomes one. progress: told how
/// many of the second's keyframes are done. Throws InputError if the maps are of different cameras or show no
/// place in common.
SavedMap merge_maps(const SavedMap& first, const SavedMap& second,
                    std::shared_ptr<const Vocabulary> vocabulary, LoopCloser::Settings settings,
                    const std::function<void(std::size_t)>& progress = {});

}  // namespace roslam
