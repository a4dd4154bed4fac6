#include "level_cut.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace repose::meshtools {
using namespace surface;
namespace {

constexpr double off_vertices = 1e-3;  // of an edge: a cut keeps this far from its ends

/// Builds the part that is kept.
class Cut {
 public:
  Cut(const Surface& surface, const std::vector<double>& values)
      : surface_(surface), values_(values), row_(values.size(), -1), part_{surface.name, {}, {}} {}

  void add(const Triangle& triangle) {
    std::vector<int64_t> corners;
    for (int k = 0; k < 3; ++k) {
      const int64_t a = triangle[k], b = triangle[(k + 1) % 3];
      if (inside(a)) corners.push_back(vertex(a));
      if (inside(a) != inside(b)) corners.push_back(inside(a) ? crossing(a, b) : crossing(b, a));
    }
    for (size_t k = 2; k < corners.size(); ++k)
      part_.triangles.push_back({corners[0], corners[k - 1], corners[k]});
  }

  Surface result() { return std::move(part_); }

 private:
  bool inside(int64_t v) const { return values_[v] >= 0; }

  int64_t append(const Vec3& point) {
    part_.points.push_back(point);
    return static_cast<int64_t>(part_.points.size()) - 1;
  }

  int64_t vertex(int64_t v) {
    if (row_[v] < 0) row_[v] = append(surface_.points[v]);
    return row_[v];
  }

  int64_t crossing(int64_t in, int64_t out) {
    const auto [place, fresh] = crossing_.try_emplace({in, out}, -1);
    if (!fresh) return place->second;
    const double share =
        std::clamp(values_[in] / (values_[in] - values_[out]), off_vertices, 1 - off_vertices);
    return place->second = append((1 - share) * surface_.points[in] + share * surface_.points[out]);
  }

  const Surface& surface_;
  const std::vector<double>& values_;
  std::vector<int64_t> row_;
  std::map<std::pair<int64_t, int64_t>, int64_t> crossing_;
  Surface part_;
};

}  // namespace

Surface cut_at_zero(const Surface& surface, const std::vector<double>& values) {
  Cut cut(surface, values);
  for (const Triangle& triangle : surface.triangles) cut.add(triangle);
  return cut.result();
}

}  // namespace repose::meshtools
