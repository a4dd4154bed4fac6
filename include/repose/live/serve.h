#pragma once
#include <mpi.h>

#include <filesystem>
#include <optional>

#include "repose/base/error.h"

namespace repose::live {

/// Where requests come from and answers go to, unless a port is given.
struct Channel {
  int input;  ///< file descriptors, used by rank 0 alone
  int output;
  /// Port of 127.0.0.1, 0 for a free one: clients connect there, one after the other, and `output`
  /// gets one line with port and token.
  std::optional<int> port;
};

/// Builds a scene and answers requests about its plans (docs/guide/live.md), until one says quit or
/// the channel closes. Throws InputError where the scene has no session. Collective.
base::Exit serve(MPI_Comm comm, const std::filesystem::path& scene, const Channel& channel);

}  // namespace repose::live
