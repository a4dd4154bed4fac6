#include "repose/base/interrupt.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstring>
#include <thread>

#include "repose/base/error.h"

namespace repose::base {

namespace {

constexpr std::array<int, 3> signals = {SIGINT, SIGTERM, SIGUSR1};
std::array<struct sigaction, signals.size()> before;
volatile std::sig_atomic_t received = 0;
std::atomic<int> wake = -1;  // the pipe to the listener, if there is one
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler reads it");

constexpr char signaled = 's', ended = 'e';

void send(int pipe, char word) {
  while (write(pipe, &word, 1) < 0 && errno == EINTR) {
  }
}

extern "C" void remember(int signal) {
  const int reason = errno;
  received = 1;
  for (size_t k = 0; k < signals.size(); ++k)
    if (signals[k] == signal) sigaction(signal, &before[k], nullptr);
  if (wake >= 0) send(wake, signaled);
  errno = reason;
}

}  // namespace

/// A thread that sleeps until a signal arrives.
class Interrupt::Listener {
 public:
  explicit Listener(std::function<void()> work) : work_(std::move(work)) {
    if (pipe(ends_.data()) != 0)
      throw InternalError(std::string("no pipe for signals: ") + std::strerror(errno));
    sigset_t all, usual;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &usual);  // signals are the main thread's
    thread_ = std::thread([this] { listen(); });
    pthread_sigmask(SIG_SETMASK, &usual, nullptr);
    wake = ends_[1];
    if (received != 0) send(ends_[1], signaled);
  }
  ~Listener() {
    wake = -1;
    send(ends_[1], ended);
    thread_.join();
    for (const int end : ends_) close(end);
  }
  Listener(Listener&&) = delete;

 private:
  void listen() {
    for (char word = 0; word != ended;) {
      const ssize_t length = read(ends_[0], &word, 1);
      if (length < 0 && errno != EINTR) return;
      if (length == 1 && word == signaled) work_();
    }
  }

  std::function<void()> work_;
  std::array<int, 2> ends_ = {-1, -1};
  std::thread thread_;
};

void Interrupt::on_signal(std::function<void()> work) {
  listener_.reset();
  if (work && signals_) listener_ = std::make_unique<Listener>(std::move(work));
}

Interrupt::Interrupt(MPI_Comm comm, double limit, bool heeds_signals)
    : comm_(comm), limit_(limit), signals_(heeds_signals) {
  received = 0;
  if (!signals_) return;
  struct sigaction action = {};
  action.sa_handler = remember;
  action.sa_flags = SA_RESTART;
  for (size_t k = 0; k < signals.size(); ++k) sigaction(signals[k], nullptr, &before[k]);
  for (const int signal : signals) sigaction(signal, &action, nullptr);
}

Interrupt::~Interrupt() {
  listener_.reset();
  if (!signals_) return;
  for (size_t k = 0; k < signals.size(); ++k) sigaction(signals[k], &before[k], nullptr);
}

namespace {

constexpr std::array<int, 4> ending_signals = {SIGHUP, SIGINT, SIGTERM, SIGUSR1};
std::array<struct sigaction, ending_signals.size()> usual_actions;
std::array<char, PATH_MAX> file_to_remove{};  // empty: none

extern "C" void remove_and_end(int signal) {
  unlink(file_to_remove.data());
  std::signal(signal, SIG_DFL);
  std::raise(signal);  // delivered when this function returns
}

}  // namespace

RemovalOnSignal::RemovalOnSignal(const std::filesystem::path& file) {
  const std::string path = std::filesystem::absolute(file).string();
  if (file_to_remove[0] != '\0' || path.size() >= file_to_remove.size()) return;
  installed_ = true;
  std::copy_n(path.c_str(), path.size() + 1, file_to_remove.begin());
  struct sigaction action = {};
  action.sa_handler = remove_and_end;
  for (size_t k = 0; k < ending_signals.size(); ++k) {
    sigaction(ending_signals[k], nullptr, &usual_actions[k]);
    // An ignored signal ends nothing, nor does one that a library takes: UCX, which Open MPI 5
    // needs, takes SIGHUP before main().
    if (usual_actions[k].sa_handler == SIG_DFL) sigaction(ending_signals[k], &action, nullptr);
  }
}

RemovalOnSignal::~RemovalOnSignal() {
  if (!installed_) return;
  for (size_t k = 0; k < ending_signals.size(); ++k)
    sigaction(ending_signals[k], &usual_actions[k], nullptr);
  file_to_remove[0] = '\0';
}

bool Interrupt::requested() {
  if (requested_) return true;
  const double elapsed = std::chrono::duration<double>(Clock::now() - begin_).count();
  requested_ = on_any_rank(comm_, received != 0 || elapsed > limit_);
  return requested_;
}

}  // namespace repose::base
