#include "listener.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>
#include <random>

namespace repose::live {

namespace {

/// 128 bits in hexadecimal.
std::string random_token() {
  std::random_device random;
  std::string token;
  for (int k = 0; k < 4; ++k) token += fmt::format("{:08x}", random());
  return token;
}

/// Compares in a time that does not depend on where texts differ.
bool equal(const std::string& a, const std::string& b) {
  unsigned different = a.size() != b.size();
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    different |= static_cast<unsigned char>(a[i] ^ b[i]);
  return different == 0;
}

using Clock = std::chrono::steady_clock;

/// Waits until there is something to read, at most until `deadline`.
bool becomes_readable(int client, Clock::time_point deadline) {
  using std::chrono::milliseconds;
  const auto left = std::chrono::duration_cast<milliseconds>(deadline - Clock::now());
  pollfd watched{client, POLLIN, 0};
  return left.count() > 0 && poll(&watched, 1, static_cast<int>(left.count())) > 0;
}

}  // namespace

bool send_all(int output, const std::string& bytes) {
  size_t sent = 0;
  while (sent < bytes.size()) {
    const ssize_t count = ::write(output, bytes.data() + sent, bytes.size() - sent);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    sent += count;
  }
  return true;
}

Listener::Listener(int port) : token_(random_token()) {
  socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<uint16_t>(port));
  socklen_t size = sizeof address;
  auto* const any = reinterpret_cast<sockaddr*>(&address);
  if (socket_ < 0 || bind(socket_, any, size) != 0 || listen(socket_, 4) != 0 ||
      getsockname(socket_, any, &size) != 0) {
    const std::string reason = std::strerror(errno);
    if (socket_ >= 0) close(socket_);
    base::refuse("-port {}: {}; choose another, or 0 for a free one", port, reason);
  }
  port_ = ntohs(address.sin_port);
}

Listener::~Listener() { close(socket_); }

/// Reads the first line, without what follows it.
bool Listener::knows_token(int client) const {
  constexpr size_t longest = 200;
  const Clock::time_point deadline = Clock::now() + std::chrono::seconds(5);
  std::string line;
  for (char letter = 0; line.size() < longest && becomes_readable(client, deadline) &&
                        ::read(client, &letter, 1) == 1;) {
    if (letter == '\n') break;
    line += letter;
  }
  const auto request = nlohmann::json::parse(line, nullptr, false);
  return request.is_object() && request.contains("token") && request["token"].is_string() &&
         equal(request["token"].get<std::string>(), token_);
}

int Listener::accept() const {
  while (true) {
    const int client = ::accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) {
      if (errno == EINTR || errno == ECONNABORTED) continue;
      base::refuse("-port {}: no client can connect: {}", port_, std::strerror(errno));
    }
    if (knows_token(client)) return client;
    send_all(client,
             "{\"ok\":false,\"error\":\"the first line must be {\\\"token\\\": …} with the "
             "token that repose-live printed\",\"arrays\":[]}\n");
    close(client);
  }
}

}  // namespace repose::live
