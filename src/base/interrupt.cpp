#include "repose/base/interrupt.h"

#include <array>
#include <csignal>

namespace repose::base {

namespace {

constexpr std::array<int, 3> signals = {SIGINT, SIGTERM, SIGUSR1};
std::array<struct sigaction, signals.size()> before;
volatile std::sig_atomic_t received = 0;

extern "C" void remember(int) { received = 1; }

}  // namespace

Interrupt::Interrupt(MPI_Comm comm, double limit, bool heeds_signals)
    : comm_(comm), limit_(limit), signals_(heeds_signals) {
  received = 0;
  if (!signals_) return;
  struct sigaction action = {};
  action.sa_handler = remember;
  action.sa_flags = static_cast<int>(SA_RESETHAND) | SA_RESTART;
  for (size_t k = 0; k < signals.size(); ++k) sigaction(signals[k], &action, &before[k]);
}

Interrupt::~Interrupt() {
  if (!signals_) return;
  for (size_t k = 0; k < signals.size(); ++k) sigaction(signals[k], &before[k], nullptr);
}

bool Interrupt::wanted() {
  if (wanted_) return true;
  const double elapsed = std::chrono::duration<double>(Clock::now() - begin_).count();
  int any = received != 0 || elapsed > limit_;
  MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_MAX, comm_);
  wanted_ = any;
  return wanted_;
}

}  // namespace repose::base
