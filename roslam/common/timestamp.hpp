// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "roslam/common/export.hpp"

namespace roslam {

/// Nanoseconds as seconds, rounded as the decimal number in a text file would be.
ROSLAM_EXPORT double seconds_of(std::int64_t nanoseconds);

/// Seconds as nanoseconds: of the shortest decimal number that is read as these seconds, so that a time of a
/// text file stays what is written there; seconds_of() gives the same seconds again if that has at most nine
/// decimals. Throws InputError for a time that does not fit (about 292 years).
ROSLAM_EXPORT std::int64_t nanoseconds_of(double seconds);

}  // namespace roslam
