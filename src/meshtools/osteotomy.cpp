#include "repose/meshtools/osteotomy.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "arrangement.h"
#include "cut_sheets.h"
#include "repose/base/error.h"
#include "repose/surface/component.h"
#include "repose/surface/defects.h"
#include "repose/surface/distance.h"
#include "repose/surface/edges.h"
#include "repose/surface/intersections.h"
#include "repose/surface/read.h"

namespace repose::meshtools {
using namespace surface;
namespace {

constexpr double slack = 1e-3;  // mm, more than a cut is ever shifted

enum class CellPart { outside, piece, kerf, rest };

/// Contents of a cell of the arrangement.
struct Cell {
  bool air = false, bone = false;  // outside of the bone's surface; its inside
  bool ahead = false, kerf = false, behind = false;

  bool cut() const { return ahead || kerf || behind; }
};

/// Assigns the cells of an arrangement to parts of the bone.
class Sorter {
 public:
  Sorter(const Surface& bone, const Osteotomy& plan, const std::vector<CutSheet>& sheets,
         const Arrangement& cells)
      : bone_(bone), plan_(plan), cells_(cells) {
    for (size_t t = 0; t < cells.triangles.size(); ++t) touch(sheets, t);
    for (const CutPlane& plane : plan.planes)
      if (!std::isfinite(plane.radius)) mark_behind(plane);
    for (const auto& [cell, what] : touched_)
      if (what.air && what.bone)
        base::refuse(
            "{}: its surface is not the border of a solid where it is cut; repair it in a "
            "mesh editor",
            bone.name);
  }

  /// Throws InputError where the cuts part nothing or a part is empty.
  std::map<int64_t, CellPart> sort() {
    require_parted();
    if (plan_.seed) seeded();
    for (const auto& [cell, what] : touched_)
      if (what.air)
        parts_[cell] = CellPart::outside;
      else if (what.cut() && !plan_.seed)
        parts_[cell] = in_front(what);
    require_part(CellPart::piece);
    require_part(CellPart::rest);
    assign_whole_shells();
    return parts_;
  }

  /// The border of the cells for which `inside` holds, outwards.
  Surface border(const std::function<bool(int64_t)>& inside, const std::string& name) const {
    std::vector<Triangle> triangles;
    for (size_t t = 0; t < cells_.triangles.size(); ++t) {
      const bool ahead = inside(cells_.cells[t][0]), behind = inside(cells_.cells[t][1]);
      if (ahead == behind) continue;
      Triangle& triangle = triangles.emplace_back(cells_.triangles[t]);
      if (ahead) std::swap(triangle[1], triangle[2]);
    }
    return compact(name, cells_.points, std::move(triangles));
  }

  Surface border(CellPart part, const std::string& name) const {
    return border(
        [&](int64_t cell) {
          const auto found = parts_.find(cell);
          return found != parts_.end() && found->second == part;
        },
        name);
  }

 private:
  void touch(const std::vector<CutSheet>& sheets, size_t t) {
    const auto [front, back] = cells_.cells[t];
    if (front == back) return;
    const int32_t origin = cells_.origin[t];
    if (origin < 0) {
      touched_[front].air = true;
      touched_[back].bone = true;
      return;
    }
    mark(touched_[front], sheets[origin].front);
    mark(touched_[back], sheets[origin].back);
  }

  static void mark(Cell& cell, Side side) {
    if (side == Side::ahead) cell.ahead = true;
    if (side == Side::behind) cell.behind = true;
    if (side == Side::kerf) cell.kerf = true;
  }

  /// A cell that does not touch an unbounded plane lies on one side of it all the same.
  void mark_behind(const CutPlane& plane) {
    const Vec3 normal = plane.normal.normalized();
    std::map<int64_t, double> farthest;
    for (size_t t = 0; t < cells_.triangles.size(); ++t)
      for (const int64_t cell : cells_.cells[t])
        for (const int64_t point : cells_.triangles[t]) {
          const double distance = (cells_.points[point] - plane.point).dot(normal);
          double& maximum = farthest[cell];
          if (std::abs(distance) > std::abs(maximum)) maximum = distance;
        }
    for (auto& [cell, what] : touched_)
      if (what.cut() && farthest[cell] < -plan_.kerf / 2 - slack) what.behind = true;
  }

  static CellPart in_front(const Cell& what) {
    if (what.behind) return CellPart::rest;
    return what.kerf ? CellPart::kerf : CellPart::piece;
  }

  bool solid(int64_t cell) const { return !touched_.at(cell).air; }

  void require_parted() const {
    bool met = false, parted = false;
    for (size_t t = 0; t < cells_.triangles.size(); ++t) {
      if (cells_.origin[t] < 0) continue;
      const auto [front, back] = cells_.cells[t];
      const bool within = front == back ? !is_air(front) : solid(front) && solid(back);
      met = met || within;
      parted = parted || (within && front != back);
    }
    if (!met)
      base::refuse("{}: the cut of piece '{}' misses the bone{}", bone_.name, plan_.piece, where());
    if (!parted)
      base::refuse(
          "{}: the cut of piece '{}' ends inside the bone and parts nothing; give a greater radius "
          "or a larger cutting surface",
          bone_.name, plan_.piece);
  }

  bool is_air(int64_t cell) const {
    const auto found = touched_.find(cell);
    return found != touched_.end() && found->second.air;
  }

  /// Where the bone lies as seen from a lone plane.
  std::string where() const {
    if (plan_.planes.size() != 1 || plan_.surface) return "; move the cut, or name another bone";
    const CutPlane& plane = plan_.planes[0];
    double minimum = std::numeric_limits<double>::infinity(), maximum = -minimum;
    for (const Vec3& p : bone_.points) {
      const double distance = (p - plane.point).dot(plane.normal.normalized());
      minimum = std::min(minimum, distance);
      maximum = std::max(maximum, distance);
    }
    const char* const wider = std::isfinite(plane.radius) ? ", or give a greater radius" : "";
    if (minimum < 0 && maximum > 0)
      return fmt::format(", which lies on both sides of its plane; move the plane{}", wider);
    return fmt::format(
        ", which lies {:.1f} to {:.1f} mm in front of its plane; move the plane along its normal "
        "by a distance between the two, or name another bone{}",
        minimum, maximum, wider);
  }

  /// The piece is the cell around the seed, the kerf what the saw took; all else stays.
  void seeded() {
    std::optional<int64_t> chosen;
    for (const auto& [cell, what] : touched_) {
      if (what.air || !what.cut()) continue;
      parts_[cell] = what.kerf ? CellPart::kerf : CellPart::rest;
      const Surface shell = border([c = cell](int64_t other) { return other == c; }, "cell");
      if (DistanceTree(shell).contains(*plan_.seed)) chosen = cell;
    }
    const Vec3& seed = *plan_.seed;
    if (!DistanceTree(bone_).contains(seed))
      base::refuse("{}: the seed of piece '{}', {:g}, is not inside the bone; move it", bone_.name,
                   plan_.piece, seed);
    if (!chosen)
      base::refuse("{}: the seed of piece '{}', {:g}, is in a component that no cut meets; move it",
                   bone_.name, plan_.piece, seed);
    if (parts_[*chosen] == CellPart::kerf)
      base::refuse("{}: the seed of piece '{}', {:g}, is in the kerf; move it", bone_.name,
                   plan_.piece, seed);
    parts_[*chosen] = CellPart::piece;
  }

  void require_part(CellPart part) const {
    for (const auto& [cell, what] : parts_)
      if (what == part) return;
    if (part == CellPart::rest)
      base::refuse(
          "{}: nothing is left of the bone but piece '{}'; turn the cut's normal round or "
          "give a seed",
          bone_.name, plan_.piece);
    base::refuse(
        "{}: piece '{}' comes out empty: no part of the bone lies in front of every cut and apart "
        "from what lies behind; turn normals round, let the cuts reach through the bone, or give a "
        "seed",
        bone_.name, plan_.piece);
  }

  /// Shells that no cut meets.
  void assign_whole_shells() {
    std::optional<DistanceTree> piece;
    for (size_t t = 0; t < cells_.triangles.size(); ++t) {
      const int64_t cell = cells_.cells[t][1];
      if (cells_.origin[t] >= 0 || parts_.contains(cell)) continue;
      if (!piece) piece.emplace(border(CellPart::piece, "piece"));
      const Vec3& point = cells_.points[cells_.triangles[t][0]];
      parts_[cell] =
          piece->contains(point) || before_planes(point) ? CellPart::piece : CellPart::rest;
    }
  }

  bool before_planes(const Vec3& point) const {
    return !plan_.seed && !plan_.surface &&
           std::all_of(plan_.planes.begin(), plan_.planes.end(), [&](const CutPlane& plane) {
             return !std::isfinite(plane.radius) && (point - plane.point).dot(plane.normal) > 0;
           });
  }

  const Surface& bone_;
  const Osteotomy& plan_;
  const Arrangement& cells_;
  std::map<int64_t, Cell> touched_;
  std::map<int64_t, CellPart> parts_;
};

/// Returns whether a part can be written, read again and cut again.
bool is_sound(const Surface& part) {
  const Defects d = inspect(part, false);
  return d.outward && d.border_edges + d.non_manifold_edges + d.non_manifold_vertices +
                              d.misoriented_edges + d.degenerate_triangles + d.duplicate_vertices ==
                          0;
}

Pieces cut_shifted(const Surface& bone, const Osteotomy& plan, double shift) {
  const std::vector<CutSheet> sheets = cut_sheets(bone, plan, shift);
  std::vector<Surface> surfaces;
  for (const CutSheet& sheet : sheets) surfaces.push_back(sheet.surface);
  const Arrangement cells = arrange(bone, surfaces);
  Sorter sorter(bone, plan, sheets, cells);
  sorter.sort();
  Pieces pieces;
  pieces.piece = sorter.border(CellPart::piece, plan.piece);
  pieces.rest = sorter.border(CellPart::rest, bone.name);
  pieces.kerf_volume = volume_of(sorter.border(CellPart::kerf, "kerf"));
  return pieces;
}

void check_plan(const Surface& bone, const Osteotomy& plan) {
  if (plan.planes.empty() && !plan.surface)
    base::refuse("{}: piece '{}' has no cut; give planes or a cutting surface", bone.name,
                 plan.piece);
  for (const CutPlane& plane : plan.planes)
    if (!(plane.normal.norm() > 0))
      base::refuse("{}: a plane of piece '{}' has a normal without length; give a direction",
                   bone.name, plan.piece);
  const Defects d = inspect(bone, false);
  if (!d.outward || d.non_manifold_vertices > 0)
    base::refuse("{}: only a closed, manifold bone can be cut; it has {}", bone.name, describe(d));
}

}  // namespace

Pieces cut_bone(const Surface& bone, const Osteotomy& plan) {
  check_plan(bone, plan);
  constexpr double step = 1e-4;  // mm
  constexpr int attempts = 6;
  for (int attempt = 0; attempt < attempts; ++attempt) {
    const int steps = (attempt + 1) / 2;
    const double shift = (attempt % 2 ? step : -step) * steps;
    Pieces pieces = cut_shifted(bone, plan, shift);
    if (!is_sound(pieces.piece) || !is_sound(pieces.rest)) continue;
    if (attempt > 0)
      pieces.remarks.push_back(fmt::format(
          "{}: the cut of piece '{}' was shifted by {:g} mm, as it ran exactly through vertices",
          bone.name, plan.piece, shift));
    return pieces;
  }
  base::refuse("{}: the parts of the cut of piece '{}' touch themselves; shift the cut by 0.1 mm",
               bone.name, plan.piece);
}

Surface load_cutter(const std::filesystem::path& file) {
  Surface cutter = weld_and_orient(read_surface(file));
  const Defects d = inspect(cutter, false);
  if (cutter.triangles.empty() ||
      d.non_manifold_edges + d.non_manifold_vertices + d.misoriented_edges > 0)
    base::refuse("{}: a cutting surface must be manifold and oriented; it has {}", file.string(),
                 describe(d));
  return cutter;
}

}  // namespace repose::meshtools
