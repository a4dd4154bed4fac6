#include "repose/solve/message.h"

#include <algorithm>

namespace repose::solve {

namespace {

constexpr int64_t piece = int64_t{1} << 30;

}  // namespace

void send(MPI_Comm comm, int to, const std::vector<char>& bytes) {
  const int64_t total = static_cast<int64_t>(bytes.size());
  MPI_Send(&total, 1, MPI_INT64_T, to, 0, comm);
  for (int64_t at = 0; at < total; at += piece)
    MPI_Send(bytes.data() + at, static_cast<int>(std::min(piece, total - at)), MPI_CHAR, to, 0,
             comm);
}

std::vector<char> receive(MPI_Comm comm, int from) {
  int64_t total = 0;
  MPI_Recv(&total, 1, MPI_INT64_T, from, 0, comm, MPI_STATUS_IGNORE);
  std::vector<char> bytes(total);
  for (int64_t at = 0; at < total; at += piece)
    MPI_Recv(bytes.data() + at, static_cast<int>(std::min(piece, total - at)), MPI_CHAR, from, 0,
             comm, MPI_STATUS_IGNORE);
  return bytes;
}

}  // namespace repose::solve
