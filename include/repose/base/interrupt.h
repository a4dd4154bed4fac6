#pragma once
#include <mpi.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>

namespace repose::base {

/// A person's wish that a run, all its searches, should end and keep what it has: SIGINT, SIGTERM
/// or SIGUSR1 to any rank (mpirun and batch systems pass the last one on to all), or a time limit.
/// The second signal of a sort does what it did before.
class Interrupt {
 public:
  /// `limit` in s of wall-clock time from now; without `signals` the limit alone counts.
  Interrupt(MPI_Comm comm, double limit, bool signals);
  ~Interrupt();  ///< signals do again what they did before
  Interrupt(Interrupt&&) = delete;

  bool requested();  ///< the same on all ranks; stays true. Collective.

  /// Calls `work` on a thread of its own as soon as a signal arrives, and at once if one has;
  /// mpirun kills its ranks a second after the signal, wherever their search is. `work` must not
  /// throw and must not communicate. An empty one ends this. Not collective.
  void on_signal(std::function<void()> work);

 private:
  class Listener;
  using Clock = std::chrono::steady_clock;
  MPI_Comm comm_;
  double limit_;
  bool signals_;
  Clock::time_point begin_ = Clock::now();
  bool requested_ = false;
  std::unique_ptr<Listener> listener_;
};

/// While it lives, a signal that ends the process (SIGHUP, SIGINT, SIGTERM, SIGUSR1) first removes
/// a file. Signals that the process ignores stay ignored. Of several that live at a time only the
/// first does this.
class RemovalOnSignal {
 public:
  explicit RemovalOnSignal(const std::filesystem::path& file);
  ~RemovalOnSignal();  ///< signals do again what they did before
  RemovalOnSignal(RemovalOnSignal&&) = delete;

 private:
  bool installed_ = false;
};

}  // namespace repose::base
