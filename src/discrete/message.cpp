#include "message.h"

#include <algorithm>

namespace repose::discrete {

namespace {

/// Calls work(begin, length) for pieces that fit MPI's int counts.
template <class Work>
void in_pieces(size_t size, Work&& work) {
  constexpr size_t maximum = size_t{1} << 30;
  for (size_t at = 0; at < size; at += maximum)
    work(at, static_cast<int>(std::min(maximum, size - at)));
}

}  // namespace

void Sender::send_bytes(const void* data, size_t size) {
  const auto* bytes = static_cast<const char*>(data);
  in_pieces(size, [&](size_t begin, int length) {
    MPI_Send(bytes + begin, length, MPI_BYTE, to_, 0, comm_);
  });
}

void Receiver::receive_bytes(void* data, size_t size) {
  auto* bytes = static_cast<char*>(data);
  in_pieces(size, [&](size_t begin, int length) {
    MPI_Recv(bytes + begin, length, MPI_BYTE, from_, 0, comm_, MPI_STATUS_IGNORE);
  });
}

void Broadcaster::broadcast_bytes(void* data, size_t size) {
  auto* bytes = static_cast<char*>(data);
  in_pieces(size, [&](size_t begin, int length) {
    MPI_Bcast(bytes + begin, length, MPI_BYTE, 0, comm_);
  });
}

}  // namespace repose::discrete
