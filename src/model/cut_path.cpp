#include "repose/model/cut.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <set>

#include "repose/base/error.h"
#include "repose/surface/distance.h"
#include "repose/surface/triangle_tree.h"

namespace repose::model {
namespace {

constexpr double reach = 5;      // mm from the skin
constexpr double snap = 0.1;     // of an edge: nearer than this the path goes to its end
constexpr double spacing = 0.5;  // of an edge, between points of the path

using Chain = std::vector<int64_t>;

/// A triangle surface whose edges and triangles can be split, in place. New vertices and triangles
/// come at the end of their lists. Edges have at most two triangles.
class SplitMesh {
 public:
  explicit SplitMesh(surface::Surface& surface);

  const Vec3& point(int64_t vertex) const { return surface_.points[vertex]; }
  const Triangle& triangle(int64_t row) const { return surface_.triangles[row]; }
  const std::vector<int64_t>& triangles_of(int64_t vertex) const { return around_[vertex]; }
  bool has_edge(int64_t a, int64_t b) const { return !triangles_of_edge(a, b).empty(); }
  bool on_border(int64_t vertex) const;
  /// Mean length of a triangle's edges, mm.
  double edge_length(int64_t triangle) const;

  /// Both return the new vertex.
  int64_t split_edge(int64_t a, int64_t b, const Vec3& at);
  int64_t split_triangle(int64_t row, const Vec3& at);

 private:
  std::vector<int64_t> triangles_of_edge(int64_t a, int64_t b) const;
  int64_t add_vertex(const Vec3& at);
  void put(int64_t row, const Triangle& corners);
  void remove(int64_t row);

  surface::Surface& surface_;
  std::vector<std::vector<int64_t>> around_;  // [P] triangles of a vertex
};

SplitMesh::SplitMesh(surface::Surface& surface)
    : surface_(surface), around_(surface.points.size()) {
  for (size_t row = 0; row < surface.triangles.size(); ++row)
    for (const int64_t v : surface.triangles[row]) around_[v].push_back(static_cast<int64_t>(row));
}

std::vector<int64_t> SplitMesh::triangles_of_edge(int64_t a, int64_t b) const {
  std::vector<int64_t> rows;
  for (const int64_t row : around_[a]) {
    const Triangle& t = triangle(row);
    if (std::find(t.begin(), t.end(), b) != t.end()) rows.push_back(row);
  }
  return rows;
}

bool SplitMesh::on_border(int64_t vertex) const {
  for (const int64_t row : around_[vertex])
    for (const int64_t other : triangle(row))
      if (other != vertex && triangles_of_edge(vertex, other).size() < 2) return true;
  return false;
}

double SplitMesh::edge_length(int64_t row) const {
  const auto& [a, b, c] = triangle(row);
  return ((point(b) - point(a)).norm() + (point(c) - point(b)).norm() +
          (point(a) - point(c)).norm()) /
         3;
}

int64_t SplitMesh::add_vertex(const Vec3& at) {
  surface_.points.push_back(at);
  around_.emplace_back();
  return static_cast<int64_t>(surface_.points.size()) - 1;
}

void SplitMesh::remove(int64_t row) {
  for (const int64_t v : triangle(row)) std::erase(around_[v], row);
}

void SplitMesh::put(int64_t row, const Triangle& corners) {
  if (row < static_cast<int64_t>(surface_.triangles.size()))
    surface_.triangles[row] = corners;
  else
    surface_.triangles.push_back(corners);
  for (const int64_t v : corners) around_[v].push_back(row);
}

int64_t SplitMesh::split_edge(int64_t a, int64_t b, const Vec3& at) {
  const std::vector<int64_t> rows = triangles_of_edge(a, b);
  const int64_t middle = add_vertex(at);
  for (const int64_t row : rows) {
    Triangle near_a = triangle(row), near_b = near_a;
    remove(row);
    std::replace(near_a.begin(), near_a.end(), b, middle);
    std::replace(near_b.begin(), near_b.end(), a, middle);
    put(row, near_a);
    put(static_cast<int64_t>(surface_.triangles.size()), near_b);
  }
  return middle;
}

int64_t SplitMesh::split_triangle(int64_t row, const Vec3& at) {
  const Triangle whole = triangle(row);
  const int64_t middle = add_vertex(at);
  remove(row);
  for (int corner = 0; corner < 3; ++corner) {
    Triangle part = whole;
    part[corner] = middle;
    put(corner == 0 ? row : static_cast<int64_t>(surface_.triangles.size()), part);
  }
  return middle;
}

std::string format_point(const Vec3& x) { return fmt::format("{:.2f}", x); }

Vec3 unit_normal(const SplitMesh& mesh, int64_t row) {
  const auto& [a, b, c] = mesh.triangle(row);
  return (mesh.point(b) - mesh.point(a)).cross(mesh.point(c) - mesh.point(a)).normalized();
}

Vec3 vertex_normal(const SplitMesh& mesh, int64_t vertex) {
  Vec3 sum = Vec3::Zero();
  for (const int64_t row : mesh.triangles_of(vertex)) sum += unit_normal(mesh, row);
  return sum.normalized();
}

/// Makes a path of edges out of one incision.
class PathCutter {
 public:
  PathCutter(std::string place, surface::Surface& skin, std::set<int64_t>& taken,
             std::set<std::array<int64_t, 2>>& taken_edges)
      : place_(std::move(place)), skin_(skin), mesh_(skin), taken_(taken), edges_(taken_edges) {}

  Chain cut(const std::vector<Vec3>& path) {
    std::vector<Foot> feet = on_skin(path);
    const bool backwards = ends_farther(feet);
    if (backwards) std::reverse(feet.begin(), feet.end());
    Chain stops;
    for (const Vec3& x : thinned(feet)) {
      const int64_t vertex = insert(x);
      if (stops.empty() || stops.back() != vertex) stops.push_back(vertex);
    }
    if (stops.size() < 2) refuse_short(path);
    append(stops.front());
    for (size_t i = 0; i + 1 < stops.size(); ++i) run(stops[i], stops[i + 1]);
    if (chain_.size() < 3) refuse_short(path);
    if (backwards) std::reverse(chain_.begin(), chain_.end());
    return chain_;
  }

 private:
  template <class... Args>
  [[noreturn]] void refuse(fmt::format_string<Args...> format, Args&&... args) const {
    base::refuse("{}: {}", place_, fmt::format(format, std::forward<Args>(args)...));
  }
  [[noreturn]] void refuse_short(const std::vector<Vec3>& path) const {
    refuse(
        "the path from {} to {} is no longer than an edge of the skin there; lengthen it or "
        "refine the skin",
        format_point(path.front()), format_point(path.back()));
  }

  /// A point of the path, put on the skin.
  struct Foot {
    Vec3 point;
    double edge;  // mm, of the skin there
  };

  /// Returns whether the last point is farther than the first from the middle of all, or by the
  /// next ones where these are as far: a path and its mirror image are cut from the same end.
  static bool ends_farther(const std::vector<Foot>& feet) {
    constexpr double rounding = 1e-6;  // mm
    Vec3 middle = Vec3::Zero();
    for (const Foot& foot : feet) middle += foot.point / static_cast<double>(feet.size());
    for (size_t i = 0; i < feet.size() / 2; ++i) {
      const double more =
          (feet[feet.size() - 1 - i].point - middle).norm() - (feet[i].point - middle).norm();
      if (std::abs(more) > rounding) return more > 0;
    }
    return false;
  }

  std::vector<Foot> on_skin(const std::vector<Vec3>& path) const {
    const surface::DistanceTree tree(skin_);
    std::vector<Foot> feet;
    double length = 0;
    for (size_t i = 0; i < path.size(); ++i) {
      const auto foot = tree.nearest(path[i]);
      if (foot.distance > reach)
        refuse(
            "point {} of the path, {}, is {:.1f} mm from the skin, allowed are {} mm; put the "
            "path on the skin",
            i, format_point(path[i]), foot.distance, reach);
      if (i > 0) length += (foot.point - feet.back().point).norm();
      feet.push_back({foot.point, mesh_.edge_length(foot.triangle)});
    }
    if (!(length > feet.back().edge)) refuse_short(path);
    return feet;
  }

  /// Leaves out points that lie too close together.
  static std::vector<Vec3> thinned(const std::vector<Foot>& feet) {
    std::vector<Vec3> kept;
    for (const Foot& foot : feet) {
      const auto close = [&] { return (foot.point - kept.back()).norm() < spacing * foot.edge; };
      const bool last = &foot == &feet.back();
      if (last && kept.size() > 1 && close()) kept.pop_back();
      if (last || kept.empty() || !close()) kept.push_back(foot.point);
    }
    return kept;
  }

  /// Splits what lies at a point of the skin, so that it is a vertex; an edge or vertex near by
  /// takes its place.
  int64_t insert(const Vec3& x) {
    const surface::DistanceTree tree(skin_);
    const int64_t row = tree.nearest(x).triangle;
    const Triangle t = mesh_.triangle(row);
    const Vec3 weight =
        surface::barycentric({mesh_.point(t[0]), mesh_.point(t[1]), mesh_.point(t[2])}, x);
    Eigen::Index largest = 0, minimum = 0;
    if (weight.maxCoeff(&largest) > 1 - snap) return t[largest];
    if (weight.minCoeff(&minimum) > snap) return mesh_.split_triangle(row, x);
    const int64_t a = t[(minimum + 1) % 3], b = t[(minimum + 2) % 3];
    const double w = weight[(minimum + 2) % 3] / (1 - weight[minimum]);
    return on_edge(a, b, std::clamp(w, 0.0, 1.0));
  }

  /// The vertex at the fraction `w` of an edge from a to b: one of its ends, or a new one.
  int64_t on_edge(int64_t a, int64_t b, double w) {
    if (w < snap) return a;
    if (w > 1 - snap) return b;
    if (edges_.contains(base::sorted_pair(a, b))) refuse_meeting(mesh_.point(a));
    return mesh_.split_edge(a, b, (1 - w) * mesh_.point(a) + w * mesh_.point(b));
  }

  [[noreturn]] void refuse_lost(const Vec3& from, const Vec3& to) const {
    refuse(
        "the path leaves the skin near {} on its way to {}; keep it inside its rim, and give "
        "more points where the skin bends",
        format_point(from), format_point(to));
  }

  [[noreturn]] void refuse_meeting(const Vec3& at) const {
    refuse("the path meets itself or another incision near {}; cuts must not cross or touch",
           format_point(at));
  }

  void append(int64_t vertex) {
    if (mesh_.on_border(vertex))
      refuse("the path reaches the rim of the skin near {}; keep it inside",
             format_point(mesh_.point(vertex)));
    if (!taken_.insert(vertex).second) refuse_meeting(mesh_.point(vertex));
    if (!chain_.empty()) edges_.insert(base::sorted_pair(chain_.back(), vertex));
    chain_.push_back(vertex);
  }

  /// Goes on along the skin from one vertex to another.
  void run(int64_t from, int64_t to) {
    const Vec3 normal = (vertex_normal(mesh_, from) + vertex_normal(mesh_, to)).normalized();
    const size_t maximum = chain_.size() + skin_.triangles.size();
    while (!mesh_.has_edge(chain_.back(), to)) {
      if (chain_.size() > maximum) refuse_lost(mesh_.point(from), mesh_.point(to));
      append(next(chain_.back(), to, normal));
    }
    append(to);
  }

  /// Where the plane through two vertices along `normal` leaves the triangles around the first.
  int64_t next(int64_t vertex, int64_t to, const Vec3& normal) {
    const Vec3 &here = mesh_.point(vertex), heading = mesh_.point(to) - here;
    const Vec3 across = normal.cross(heading), ahead = across.cross(normal);
    struct {
      double ahead = 0, w = 0;
      int64_t a = -1, b = -1;
    } best;
    for (const int64_t row : mesh_.triangles_of(vertex)) {
      const Triangle& t = mesh_.triangle(row);
      const auto corner = std::find(t.begin(), t.end(), vertex) - t.begin();
      const int64_t a = t[(corner + 1) % 3], b = t[(corner + 2) % 3];
      const double of_a = (mesh_.point(a) - here).dot(across),
                   of_b = (mesh_.point(b) - here).dot(across);
      if ((of_a > 0) == (of_b > 0)) continue;
      const double w = of_a / (of_a - of_b);
      const Vec3 out = (1 - w) * mesh_.point(a) + w * mesh_.point(b) - here;
      const double forward = out.dot(ahead) / out.norm();
      if (forward > best.ahead) best = {forward, w, a, b};
    }
    if (best.a < 0) refuse_lost(here, mesh_.point(to));
    return on_edge(best.a, best.b, best.w);
  }

  std::string place_;
  surface::Surface& skin_;
  SplitMesh mesh_;
  std::set<int64_t>& taken_;                 // vertices of all paths so far
  std::set<std::array<int64_t, 2>>& edges_;  // their edges, lower vertex first
  Chain chain_;
};

}  // namespace

std::vector<Cut> insert_paths(const std::vector<scene::Incision>& incisions,
                              const std::string& scene_file, surface::Surface& skin) {
  std::vector<Cut> cuts;
  std::set<int64_t> taken;
  std::set<std::array<int64_t, 2>> edges;
  for (size_t i = 0; i < incisions.size(); ++i) {
    PathCutter cutter(fmt::format("{}: {}", scene_file, incisions[i].name), skin, taken, edges);
    const scene::Incision& incision = incisions[i];
    cuts.push_back({.columns = cutter.cut(incision.path),
                    .layers = incision.layers,
                    .lips = incision.parts_lips()});
  }
  return cuts;
}

}  // namespace repose::model
