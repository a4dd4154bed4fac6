#include "piece.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace repose::tools::decimation {
using namespace surface;
namespace {

/// Least share of a piece's size that a cut takes off on either side: less is rounding.
constexpr double min_cut = 1e-3;
/// Triangles this many times the distance across are worth a cut along their edges.
constexpr double large = 4;

bool longer(const Corners& triangle, double length) {
  const int k = longest_edge(triangle);
  return (triangle[(k + 1) % 3] - triangle[k]).squaredNorm() > length * length;
}

}  // namespace

Piece::Piece(const Corners& triangle) : count_(3) {
  std::copy(triangle.begin(), triangle.end(), at_.begin());
}

Vec3 Piece::center() const {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& corner : corners()) sum += corner;
  return sum / count_;
}

Piece Piece::cut(const Vec3& normal, double offset) {
  std::array<double, maximum> height;
  for (int i = 0; i < count_; ++i) height[i] = normal.dot(at_[i]) - offset;
  const auto end = height.begin() + count_;
  if (std::all_of(height.begin(), end, [](double h) { return h <= 0; })) return {};
  Piece below, above;
  for (int i = 0; i < count_; ++i) {
    const int j = (i + 1) % count_;
    (height[i] <= 0 ? below : above).add(at_[i]);
    if ((height[i] <= 0) == (height[j] <= 0)) continue;
    const Vec3 between = at_[i] + height[i] / (height[i] - height[j]) * (at_[j] - at_[i]);
    below.add(between);
    above.add(between);
  }
  *this = below;
  return above;
}

Piece Piece::halve() {
  if (count_ == 3) {
    const Corners t{at_[0], at_[1], at_[2]};
    const int k = longest_edge(t);
    const Vec3 between = 0.5 * (t[k] + t[(k + 1) % 3]);
    *this = Piece({t[k], between, t[(k + 2) % 3]});
    return Piece({between, t[(k + 1) % 3], t[(k + 2) % 3]});
  }
  if (count_ > maximum / 2) {  // fewer corners for both, so that cuts never outgrow the room
    Piece half;
    for (int i = count_ / 2; i <= count_; ++i) half.add(at_[i % count_]);
    count_ = count_ / 2 + 1;
    return half;
  }
  const Vec3 middle = center();
  Vec3 longest = Vec3::Zero();
  for (int i = 0; i < count_; ++i)
    for (int j = 0; j < i; ++j)
      if ((at_[i] - at_[j]).squaredNorm() > longest.squaredNorm()) longest = at_[i] - at_[j];
  return cut(longest, longest.dot(middle));
}

void Piece::split(const Corners& triangle, double distance, double margin,
                  std::vector<Piece>& parts) {
  if (!longer(triangle, large * distance) || !cut_to(triangle, margin, parts))
    parts.push_back(halve());
  parts.push_back(*this);
}

bool Piece::cut_to(const Corners& triangle, double margin, std::vector<Piece>& rest) {
  const Vec3 middle = center();
  double size = 0;
  for (const Vec3& corner : corners()) size = std::max(size, (corner - middle).norm());
  const Vec3 upright = scaled_normal(triangle);
  std::array<Vec3, 3> outward;
  for (int k = 0; k < 3; ++k) {
    outward[k] = (triangle[(k + 1) % 3] - triangle[k]).cross(upright).normalized();
    if (!(outward[k].dot(middle - triangle[k]) < -min_cut * size)) return false;
  }
  bool was_cut = false;
  for (int k = 0; k < 3 && count_ < maximum; ++k) {
    const double side = outward[k].dot(triangle[k]) + margin;
    const auto beyond = [&](const Vec3& p) { return outward[k].dot(p) > side + min_cut * size; };
    if (std::none_of(at_.begin(), at_.begin() + count_, beyond)) continue;
    rest.push_back(cut(outward[k], side));
    was_cut = true;
  }
  return was_cut;
}

}  // namespace repose::tools::decimation
