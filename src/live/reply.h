#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "repose/base/geometry.h"

namespace repose::live {

/// An answer: a line of JSON, then the bytes of the arrays that its member `arrays` lists.
class Reply {
 public:
  Reply() : head_{{"id", nullptr}, {"ok", true}, {"arrays", nlohmann::json::array()}} {}

  nlohmann::json& head() { return head_; }
  /// Adds an array to the answer, as little-endian float32: rows of three, or single values.
  void add(const std::string& name, const std::vector<Vec3>& rows);
  void add(const std::string& name, const std::vector<double>& values);
  /// Adds an array of little-endian int32, rows of three.
  void add(const std::string& name, const std::vector<Triangle>& triangles);
  /// Adds an array of rows of `columns` numbers, float32 or int32.
  template <class Number>
  void add(const std::string& name, const std::vector<Number>& values, size_t columns) {
    append(name, std::is_same_v<Number, float> ? "f4" : "i4",
           {static_cast<int64_t>(values.size() / columns), static_cast<int64_t>(columns)},
           values.data(), values.size() * sizeof(Number));
  }
  /// Turns the answer into a refusal.
  void refuse(const std::string& error);
  std::string bytes() const;

 private:
  void append(const std::string& name, const char* type, std::vector<int64_t> shape,
              const void* data, size_t size);
  nlohmann::json head_;
  std::string arrays_;
};

}  // namespace repose::live
