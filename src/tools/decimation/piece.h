#pragma once
#include <array>
#include <span>

#include "repose/surface/triangle_tree.h"

namespace repose::tools::decimation {

using surface::Corners;

/// A convex flat piece of a triangle, as proofs about distances cut them.
class Piece {
 public:
  static constexpr int maximum = 12;  ///< corners

  explicit Piece(const Corners& triangle);

  std::span<const Vec3> corners() const { return {at_.data(), static_cast<size_t>(count_)}; }
  Vec3 center() const;

  /// Appends the parts that the piece is cut into by the edges of `triangle`, where that is several
  /// times `distance` across and cuts it, otherwise its halves.
  void split(const Corners& triangle, double distance, double margin, std::vector<Piece>& parts);

 private:
  Piece() = default;
  /// The part with normal · p ≤ offset stays; the rest is returned (perhaps empty).
  Piece cut(const Vec3& normal, double offset);
  /// Halves a triangle from the middle of its longest edge, another piece across its longest
  /// extent, one of many corners between them: this keeps one half and returns the other.
  Piece halve();
  /// Where the center lies over `triangle`, that is between the planes through its edges and
  /// upright on it, cuts to what lies between them, each moved outward by `margin`; the rest goes
  /// to `rest`. Whether anything was cut off.
  bool cut_to(const Corners& triangle, double margin, std::vector<Piece>& rest);
  void add(const Vec3& point) { at_[count_++] = point; }

  std::array<Vec3, maximum> at_;
  int count_ = 0;
};

}  // namespace repose::tools::decimation
