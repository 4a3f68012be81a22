// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace roslam::telemetry {

/// Where a server listens.
struct Endpoint {
  std::string address = "127.0.0.1";  ///< of one of this computer's networks; 0.0.0.0 or ::, all of them
  int port = 8080;                    ///< 0: any that is free

  std::string in_words() const;  ///< ADDRESS:PORT
};

/// Of ADDRESS:PORT, [ADDRESS]:PORT, ADDRESS or PORT; what is left out is as above. Throws InputError.
Endpoint parse_endpoint(const std::string& text);

/// Whether only programs of this computer reach that address. In brackets too.
bool is_loopback(const std::string& address);

/// An address at which others reach this computer, as it seems; 127.0.0.1 if it is in no network.
std::string own_address();

/// Whether it is an address in digits rather than a name. In brackets too.
bool is_numeric(const std::string& address);

}  // namespace roslam::telemetry
