#pragma once
#include <mpi.h>

#include <cstdint>
#include <vector>

#include "repose/base/agreement.h"

/// Arrays of any length between two ranks, without a copy of them.
namespace repose::discrete {

/// Sends values and vectors of trivially copyable (or fixed-size Eigen) elements to a rank.
class Sender {
 public:
  Sender(MPI_Comm comm, int to) : comm_(comm), to_(to) {}
  template <class... T>
  void operator()(const T&... values) {
    (send(values), ...);
  }

 private:
  void send_bytes(const void* data, size_t size);
  template <class T>
  void send(const T& value) {
    send_bytes(&value, sizeof value);
  }
  template <class T>
  void send(const std::vector<T>& values) {
    send(static_cast<int64_t>(values.size()));
    send_bytes(values.data(), values.size() * sizeof(T));
  }
  MPI_Comm comm_;
  int to_;
};

/// Receives what a Sender sent, in the same order.
class Receiver {
 public:
  Receiver(MPI_Comm comm, int from) : comm_(comm), from_(from) {}
  template <class... T>
  void operator()(T&... values) {
    (receive(values), ...);
  }

 private:
  void receive_bytes(void* data, size_t size);
  template <class T>
  void receive(T& value) {
    receive_bytes(&value, sizeof value);
  }
  template <class T>
  void receive(std::vector<T>& values) {
    int64_t count = 0;
    receive(count);
    values.resize(count);
    receive_bytes(values.data(), values.size() * sizeof(T));
  }
  MPI_Comm comm_;
  int from_;
};

/// Gives rank 0's values to all ranks. Collective.
class Broadcaster {
 public:
  explicit Broadcaster(MPI_Comm comm) : comm_(comm) {}
  template <class... T>
  void operator()(T&... values) {
    (broadcast(values), ...);
  }

 private:
  void broadcast_bytes(void* data, size_t size);
  template <class T>
  void broadcast(T& value) {
    broadcast_bytes(&value, sizeof value);
  }
  template <class T>
  void broadcast(std::vector<T>& values) {
    auto count = static_cast<int64_t>(values.size());
    broadcast(count);
    values.resize(count);
    broadcast_bytes(values.data(), values.size() * sizeof(T));
  }
  MPI_Comm comm_;
};

/// Sends, receives or broadcasts surfaces; names stay behind.
template <class Archive, class Surface>
void pass_surfaces(Archive& archive, std::vector<Surface>& surfaces) {
  auto count = static_cast<int64_t>(surfaces.size());
  archive(count);
  surfaces.resize(count);
  for (Surface& of : surfaces) archive(of.points, of.triangles);
}

/// Arrays of all ranks one after the other, on rank 0; empty on the others. Collective.
template <class T>
std::vector<T> gather_arrays(MPI_Comm comm, std::vector<T> mine) {
  if (base::rank(comm) > 0) {
    Sender(comm, 0)(mine);
    return {};
  }
  for (int from = 1; from < base::size(comm); ++from) {
    std::vector<T> theirs;
    Receiver(comm, from)(theirs);
    mine.insert(mine.end(), theirs.begin(), theirs.end());
  }
  return mine;
}

}  // namespace repose::discrete
