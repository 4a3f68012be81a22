// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "roslam/loop_closing/loop_closer.hpp"
#include "roslam/map_io/saved_map.hpp"

namespace roslam {

/// Merges two maps by loop closing between them: keyframes of the second are recognised in the first, whose
/// coordinates are kept; the second is aligned, drift is corrected and duplicate landmarks are fused.
/// Keyframes that both hold, of the same time and features, are kept once. progress: receives the number of
/// keyframes of the second that are done. Throws InputError if the maps are of different cameras or do not
/// overlap, or if one contains all keyframes of the other.
SavedMap merge_maps(const SavedMap& first, const SavedMap& second,
                    std::shared_ptr<const Vocabulary> vocabulary, LoopCloser::Settings settings,
                    const std::function<void(std::size_t)>& progress = {});

}  // namespace roslam
