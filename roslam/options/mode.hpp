// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace roslam {

/// How the stages run.
enum class Mode {
  kDeterministic,  ///< one after the other; the same input gives the same bytes
  kRealTime        ///< on threads joined by bounded queues; frames are dropped and counted rather than queued
};

}  // namespace roslam
