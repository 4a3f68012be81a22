// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>

#include "roslam/common/export.hpp"

namespace roslam {

/// Base of every exception the library throws. The message is one line that names what is wrong and the
/// remedy.
class ROSLAM_EXPORT Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file, folder or stream that is missing, unreadable or malformed.
class ROSLAM_EXPORT InputError : public Error {
 public:
  using Error::Error;
};

/// A calibration that no real camera has, such as zero, negative or non-finite values.
class ROSLAM_EXPORT CalibrationError : public Error {
 public:
  using Error::Error;
};

/// An option outside its range, or an unknown key in a configuration file.
class ROSLAM_EXPORT OptionsError : public Error {
 public:
  using Error::Error;
};

/// A network that is missing, damaged or not the one expected.
class ROSLAM_EXPORT ModelError : public Error {
 public:
  using Error::Error;
};

/// Not enough memory for an operation.
class ROSLAM_EXPORT MemoryError : public Error {
 public:
  using Error::Error;
};

/// A call whose preconditions are not met: an invalid id, results read at the wrong time.
class ROSLAM_EXPORT UsageError : public Error {
 public:
  using Error::Error;
};

/// A result that could not be written: folder not writable, disk full.
class ROSLAM_EXPORT OutputError : public Error {
 public:
  using Error::Error;
};

}  // namespace roslam
