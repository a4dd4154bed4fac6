#include "requests.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <span>
#include <utility>

#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "request.h"

namespace repose::live {

void broadcast_asleep(MPI_Comm comm, std::string& text) {
  using namespace std::chrono_literals;
  const auto wait = [](MPI_Request request) {
    for (int done = 0; !done;) {
      MPI_Test(&request, &done, MPI_STATUS_IGNORE);
      if (!done) std::this_thread::sleep_for(1ms);
    }
  };
  auto length = static_cast<int>(text.size());
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ibcast(&length, 1, MPI_INT, 0, comm, &request);
  wait(request);
  text.resize(length);
  MPI_Ibcast(text.data(), length, MPI_CHAR, 0, comm, &request);
  wait(request);
}

Requests::Requests(MPI_Comm comm, int input, int output)
    : comm_(comm), input_(input), output_(output) {
  if (base::rank(comm) > 0) return;
  if (pipe(stop_) != 0) throw base::InternalError("no pipe can be made");
  reader_ = std::thread([this] { read(); });
}

Requests::~Requests() {
  if (!reader_.joinable()) return;
  close(stop_[1]);
  reader_.join();
  close(stop_[0]);
}

void Requests::add(std::string line) {
  const std::lock_guard lock(mutex_);
  lines_.push_back(std::move(line));
  changed_.notify_one();
}

/// On the thread. Of a line that is too long one byte more than allowed is kept.
void Requests::read() {
  std::string line;
  std::array<char, 1 << 16> buffer;
  while (true) {
    std::array<pollfd, 2> watched = {pollfd{input_, POLLIN, 0}, pollfd{stop_[0], POLLIN, 0}};
    ssize_t count = poll(watched.data(), watched.size(), -1);
    if (count > 0 && watched[1].revents != 0) break;
    if (count > 0) count = ::read(input_, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    for (const char letter : std::span(buffer.data(), static_cast<size_t>(count)))
      if (letter == '\n')
        add(std::exchange(line, {}));
      else if (line.size() <= longest_line)
        line += letter;
  }
  if (!line.empty()) add(std::move(line));
  const std::lock_guard lock(mutex_);
  ended_ = true;
  changed_.notify_one();
}

/// On rank 0.
std::optional<std::string> Requests::wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return ended_ || !lines_.empty(); });
  if (lines_.empty()) return {};
  std::string line = std::move(lines_.front());
  lines_.pop_front();
  return line;
}

std::optional<std::string> Requests::next() {
  std::string text;  // with a first character that tells a line from the end
  if (base::rank(comm_) == 0) {
    const std::optional<std::string> line = wait();
    text = line ? "l" + *line : "e";
  }
  broadcast_asleep(comm_, text);
  if (text[0] == 'e') return {};
  return text.substr(1);
}

/// On rank 0, with the lock. A peer that has closed its socket looks like one that sends no more
/// but still reads, until bytes are sent: a blank, which JSON allows before an object.
bool Requests::is_output_closed() {
  if (ended_ && input_ == output_ && !std::exchange(probed_, true))
    if (::send(output_, " ", 1, MSG_NOSIGNAL | MSG_DONTWAIT) < 0) return true;
  pollfd watched{output_, 0, 0};
  return poll(&watched, 1, 0) > 0 && (watched.revents & (POLLERR | POLLHUP)) != 0;
}

bool Requests::superseded(const std::function<bool(const std::string&)>& overtakes) {
  bool superseded = false;
  if (base::rank(comm_) == 0) {
    const std::lock_guard lock(mutex_);
    superseded = std::ranges::any_of(lines_, overtakes) || is_output_closed();
  }
  base::broadcast(comm_, superseded);
  return superseded;
}

}  // namespace repose::live
