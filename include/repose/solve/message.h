#pragma once
#include <mpi.h>

#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

/// Arrays as one message between ranks.
namespace repose::solve {

/// Appends values and vectors of trivially copyable (or fixed-size Eigen) elements to bytes.
class Packer {
 public:
  template <class... T>
  void operator()(const T&... values) {
    (pack(values), ...);
  }
  const std::vector<char>& bytes() const { return bytes_; }

 private:
  void append(const void* data, size_t size) {
    const size_t before = bytes_.size();
    bytes_.resize(before + size);
    if (size > 0) std::memcpy(bytes_.data() + before, data, size);
  }
  template <class T>
  void pack(const T& value) {
    append(&value, sizeof value);
  }
  template <class T>
  void pack(const std::vector<T>& values) {
    pack(static_cast<int64_t>(values.size()));
    append(values.data(), values.size() * sizeof(T));
  }
  std::vector<char> bytes_;
};

/// Reads back what a Packer wrote, in the same order.
class Unpacker {
 public:
  explicit Unpacker(std::span<const char> bytes) : rest_(bytes) {}
  template <class... T>
  void operator()(T&... values) {
    (unpack(values), ...);
  }

 private:
  void take(void* data, size_t size) {
    if (size > 0) std::memcpy(data, rest_.data(), size);
    rest_ = rest_.subspan(size);
  }
  template <class T>
  void unpack(T& value) {
    take(static_cast<void*>(&value), sizeof value);
  }
  template <class T>
  void unpack(std::vector<T>& values) {
    int64_t count = 0;
    unpack(count);
    values.resize(count);
    take(static_cast<void*>(values.data()), values.size() * sizeof(T));
  }
  std::span<const char> rest_;
};

/// Sends or receives bytes of any length (in pieces that fit MPI's int counts). An empty message
/// means that the sender failed.
void send(MPI_Comm comm, int to, const std::vector<char>& bytes);
std::vector<char> receive(MPI_Comm comm, int from);

}  // namespace repose::solve
