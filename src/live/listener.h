#pragma once
#include <string>

#include "repose/live/serve.h"

namespace repose::live {

/// A socket of this machine alone (127.0.0.1), for clients that know its token. For rank 0.
class Listener {
 public:
  /// `port` 0: a free one. Throws InputError where the port is taken.
  explicit Listener(int port);
  ~Listener();
  Listener(Listener&&) = delete;

  int port() const { return port_; }
  const std::string& token() const { return token_; }
  /// Waits for a client whose first line is the token, {"token": "…"}; others are refused and
  /// closed. The caller closes its descriptor. Throws InputError where no client can connect.
  int accept() const;

 private:
  bool knows_token(int client) const;

  int socket_ = -1, port_ = 0;
  std::string token_;
};

/// Writes all of a text; returns whether that was possible.
bool send_all(int output, const std::string& bytes);

}  // namespace repose::live
