#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "repose/base/geometry.h"

namespace repose::surface {

/// Answers which of many points are near. Construction O(P log P), each question O(log P).
class PointTree {
 public:
  explicit PointTree(const std::vector<Vec3>& points);
  ~PointTree();

  /// Rows of the `count` points closest to `query` (all where there are fewer), nearest first.
  std::vector<int64_t> nearest(const Vec3& query, int count) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace repose::surface
