#pragma once
#include <mpi.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace repose::live {

/// Gives rank 0's text to all ranks, which wait for it asleep. Collective.
void broadcast_asleep(MPI_Comm comm, std::string& text);

/// Lines that a thread of rank 0 reads from a file descriptor as they come, for all ranks. Answers
/// go to another descriptor, or the same socket.
class Requests {
 public:
  Requests(MPI_Comm comm, int input, int output);
  ~Requests();
  Requests(Requests&&) = delete;

  /// The next line, the same on all ranks; nothing once the input has ended. Waits without load.
  /// Collective.
  std::optional<std::string> next();
  /// Returns whether a line waits that `overtakes` the present request, or nobody reads answers any
  /// more; the end of the input alone is no reason. Collective.
  bool superseded(const std::function<bool(const std::string&)>& overtakes);

 private:
  void read();
  void add(std::string line);
  std::optional<std::string> wait();
  bool is_output_closed();

  MPI_Comm comm_;
  int input_, output_;
  bool probed_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::string> lines_;
  bool ended_ = false;
  int stop_[2] = {-1, -1};  // a pipe that ends the thread
  std::thread reader_;
};

}  // namespace repose::live
