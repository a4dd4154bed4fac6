#include "moving_border.h"

#include <array>
#include <map>

#include "report.h"
#include "repose/model/skin_mesh.h"

namespace repose::app {

std::string describe_moving_border(const surface::Surface& initial, const std::vector<Vec3>& now) {
  constexpr double reported = 1;  // mm
  const model::SkinMesh mesh = model::make_skin_mesh(initial);
  if (mesh.border_loops.empty()) return "";
  const std::vector<int64_t>& border = mesh.border_loops.front();
  const auto place = [&](int64_t v) {
    return std::array{mesh.points[v].x(), mesh.points[v].y(), mesh.points[v].z()};
  };
  std::map<std::array<double, 3>, int> vertices;  // more than one at a place: sides of a cut
  for (const int64_t v : border) ++vertices[place(v)];
  double most = reported;
  int64_t where = -1;
  for (const int64_t v : border) {
    const double moved = (now[v] - mesh.points[v]).norm();
    if (moved < most || vertices[place(v)] > 1) continue;
    most = moved;
    where = v;
  }
  if (where < 0) return "";
  return report_row("border of the skin",
                    "the skin that is solved ends where it still moves by {:.1f} mm, at {:.1f} mm: "
                    "less certain there; give or solve more of it (tissue.margin, tissue.face)",
                    most, now[where]);
}

}  // namespace repose::app
