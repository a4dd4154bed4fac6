#include "reply.h"

#include <utility>

namespace repose::live {

void Reply::append(const std::string& name, const char* type, std::vector<int64_t> shape,
                   const void* data, size_t size) {
  head_["arrays"].push_back({{"name", name}, {"type", type}, {"shape", std::move(shape)}});
  arrays_.append(static_cast<const char*>(data), size);
}

void Reply::add(const std::string& name, const std::vector<Vec3>& rows) {
  std::vector<float> flat;
  flat.reserve(3 * rows.size());
  for (const Vec3& row : rows)
    for (int a = 0; a < 3; ++a) flat.push_back(static_cast<float>(row[a]));
  add(name, flat, 3);
}

void Reply::add(const std::string& name, const std::vector<double>& values) {
  const std::vector<float> flat(values.begin(), values.end());
  append(name, "f4", {static_cast<int64_t>(flat.size())}, flat.data(), flat.size() * sizeof(float));
}

void Reply::add(const std::string& name, const std::vector<Triangle>& triangles) {
  std::vector<int32_t> flat;
  flat.reserve(3 * triangles.size());
  for (const Triangle& t : triangles)
    for (const int64_t corner : t) flat.push_back(static_cast<int32_t>(corner));
  add(name, flat, 3);
}

void Reply::refuse(const std::string& error) {
  head_ = {
      {"id", head_["id"]}, {"ok", false}, {"error", error}, {"arrays", nlohmann::json::array()}};
  arrays_.clear();
}

std::string Reply::bytes() const {
  // What is not UTF-8 came from a request or a file's name.
  return head_.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) + '\n' + arrays_;
}

}  // namespace repose::live
