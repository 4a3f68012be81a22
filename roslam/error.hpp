// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>

namespace roslam {

/// Base of every exception the library throws. The message is one line that names what is wrong and the
/// remedy.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file, folder or stream that is missing, unreadable or malformed.
class InputError : public Error {
 public:
  using Error::Error;
};

/// A camera model no real camera has: zero, negative or non-finite values.
class CalibrationError : public Error {
 public:
  using Error::Error;
};

/// An option outside its range, or an unknown key in a configuration file.
class OptionsError : public Error {
 public:
  using Error::Error;
};

/// A network that is missing, damaged or not the one expected.
class ModelError : public Error {
 public:
  using Error::Error;
};

/// Less memory left than something needs.
class MemoryError : public Error {
 public:
  using Error::Error;
};

/// A result that could not be written: folder not writable, disk full.
class OutputError : public Error {
 public:
  using Error::Error;
};

}  // namespace roslam
