#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "repose/base/interrupt.h"

namespace repose::results {

/// Returns whether the process that a lock file names may still live: not if it is one of this
/// host's that has ended, even if its number has been given to another since.
bool may_be_running(const std::string& holder);

/// The right to write results of one name, NAME.h5 and what goes with it: one run's at a time. It
/// is an advisory lock (flock) on NAME.lock, so that it ends with its process however that ends:
/// what a killed run left behind is no obstacle, and its unfinished files (NAME….part) are removed.
/// Where the file system has no locks, NAME.lock itself is the lock as long as the process that
/// it names may live. For one process; not copied or moved.
class NameLock {
 public:
  /// `name` is a path without ending. InputError at once where another run holds it, naming that
  /// run, and where the folder is missing or not writable.
  explicit NameLock(const std::filesystem::path& name);
  ~NameLock();  ///< removes NAME.lock, as does a signal that ends the process
  NameLock(NameLock&&) = delete;

 private:
  bool acquire();
  void remove_leftovers() const;

  std::filesystem::path name_, file_;
  int descriptor_ = -1;
  std::optional<base::RemovalOnSignal> on_signal_;
};

}  // namespace repose::results
