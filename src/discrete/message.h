#pragma once
#include <mpi.h>

#include <cstdint>
#include <vector>

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

}  // namespace repose::discrete
