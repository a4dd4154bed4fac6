#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/Euler_operations.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <queue>
#include <utility>

#include "../../surface/cgal.h"
#include "phantom_shape.h"
#include "repose/base/error.h"
#include "repose/tools/phantom/phantom.h"

namespace repose::tools::phantom {
using namespace surface;
namespace {

using Mesh = CGAL::Surface_mesh<Point3>;
using Halfedge = Mesh::Halfedge_index;
using Vertex = Mesh::Vertex_index;
using Edge = Mesh::Edge_index;

const Vec3 center(0, 10, 34);  // the skin is a height over the directions from here
const Vec3 mouth_middle(0, -94, -23.2);
constexpr int sweeps = 10;  // of relaxation
// Mirror images tie to rounding; coarser comparisons keep the outcome the same on every machine.
constexpr double length_grain = 1e-6, cosine_grain = 1e-6;
// Needles between a fine rim and far corners differ by less: relative to what is left to 1.
constexpr double needle_grain = 0.1;

/// The skin on the ray from the center through `guess`: bracketed by sphere tracing from there,
/// then by regula falsi (Illinois).
Vec3 on_skin(const Vec3& guess) {
  const Vec3 ray = (guess - center).normalized();
  const auto height = [&](double r) { return skin_distance(center + r * ray); };
  double a = (guess - center).norm(), da = height(a), b = a, db = da;
  while (da * db > 0) {
    a = b;
    da = db;
    b -= std::abs(db) > 0.01 ? 0.9 * db : 2 * db + std::copysign(1e-9, db);
    db = height(b);
  }
  while (std::abs(db) > 1e-11 && std::abs(b - a) > 1e-10) {
    const double c = b - db * (b - a) / (db - da), dc = height(c);
    if (dc * db < 0) {
      a = b;
      da = db;
    } else {
      da /= 2;
    }
    if (c == b) break;
    b = c;
    db = dc;
  }
  return center + b * ray;
}

/// `n` points at equal arc lengths on the skin, on the rays through a closed curve, t in [0, 1).
std::vector<Vec3> ring(const std::function<Vec3(double)>& curve, int64_t n) {
  const int64_t samples = std::max<int64_t>(4 * n, 2000);
  std::vector<double> length(samples + 1, 0.0);
  Vec3 last = on_skin(curve(0));
  for (int64_t i = 1; i <= samples; ++i) {
    const Vec3 point = on_skin(curve(double(i) / samples));
    length[i] = length[i - 1] + (point - last).norm();
    last = point;
  }
  std::vector<Vec3> points;
  for (int64_t k = 0; k < n; ++k) {
    const double requested = length.back() * k / n;
    const int64_t i = std::upper_bound(length.begin(), length.end(), requested) - length.begin();
    const double t = (i - 1 + (requested - length[i - 1]) / (length[i] - length[i - 1])) / samples;
    points.push_back(on_skin(curve(t)));
  }
  return points;
}

/// The open mouth: an ellipse between the crests of the lips, counter-clockwise from the front.
Vec3 mouth_curve(double t) {
  const double angle = 2 * std::numbers::pi * t;
  return mouth_middle + Vec3(19 * std::cos(angle), 0, 4.4 * std::sin(angle));
}

double signed_power(double base, double exponent) {
  return std::copysign(std::pow(std::abs(base), exponent), base);
}

/// The outer rim: half superellipses in the equal-area map of an ellipsoid like the head, from the
/// forehead past the ears to under the chin, counter-clockwise from the front.
Vec3 rim_curve(double t) {
  const double angle = 2 * std::numbers::pi * t;
  const bool forehead = t < 0.5;
  const double power = forehead ? 0.85 : 2.0 / 3.0;
  const double u = 1.36 * signed_power(std::cos(angle), power);
  const double v = (forehead ? 0.8 : 1.04) * signed_power(std::sin(angle), power);
  const double r = std::hypot(u, v), tilt = 2 * std::asin(r / 2);
  const Vec3 normal(std::sin(tilt) * u / r, -std::cos(tilt), std::sin(tilt) * v / r);
  return Vec3(0, -10, 18) + normal.cwiseProduct(Vec3(75, 95, 100));
}

/// Equal-area map of directions from the center about straight ahead.
Vec3 flattened(const Vec3& point) {
  const Vec3 n = (point - center).normalized();
  return Vec3(n.x(), 0, n.z()) * std::sqrt(2 / (1 - n.y()));
}

/// Six times the volume of the tetrahedron with the center: positive for a triangle seen from
/// outside counter-clockwise.
double facing(const Vec3& a, const Vec3& b, const Vec3& c) {
  return (a - center).cross(b - center).dot(c - center);
}

/// Cosine of the smallest angle: 0.5 at best, 1 for a needle.
double sharpness(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 p = (b - a).normalized(), q = (c - b).normalized(), r = (a - c).normalized();
  return std::max({-p.dot(r), -q.dot(p), -r.dot(q)});
}

/// Turns (1 = full circle) of a ring's points about the mouth's middle, growing from the first
/// point round to it again.
std::vector<double> turns(const std::vector<Vec3>& points) {
  const Vec3 axis = (mouth_middle - center).normalized(), east(1, 0, 0), north = axis.cross(east);
  std::vector<double> result;
  for (size_t i = 0; i <= points.size(); ++i) {
    const Vec3 d = points[i % points.size()] - center;
    const double turn = std::atan2(d.dot(north), d.dot(east)) / (2 * std::numbers::pi);
    result.push_back(i == 0 ? turn : turn + std::round(result.back() - turn));
  }
  return result;
}

/// Returns whether triangles b c d and a d c have a larger smallest angle than a b c and b a d.
bool better_diagonal(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const double now = std::max(sharpness(a, b, c), sharpness(b, a, d));
  const double then = std::max(sharpness(c, d, b), sharpness(d, c, a));
  return then < now - std::min(cosine_grain, needle_grain * (1 - now));
}

/// The triangles between the two rings, each next one by the lesser turn.
Mesh strip(const std::vector<Vec3>& mouth, const std::vector<Vec3>& rim) {
  const std::vector<double> mouth_turns = turns(mouth), rim_turns = turns(rim);
  Mesh mesh;
  for (const auto* points : {&mouth, &rim})
    for (const Vec3& point : *points) mesh.add_vertex(to_cgal(point));
  const auto inner = [&](size_t i) { return Vertex(i % mouth.size()); };
  const auto outer = [&](size_t j) { return Vertex(mouth.size() + j % rim.size()); };
  for (size_t i = 0, j = 0; i < mouth.size() || j < rim.size();) {
    const bool along_rim =
        i == mouth.size() || (j < rim.size() && rim_turns[j + 1] < mouth_turns[i + 1]);
    mesh.add_face(inner(i), outer(j), along_rim ? outer(j + 1) : inner(i + 1));
    ++(along_rim ? j : i);
  }
  return mesh;
}

/// An edge waiting to be split; the longest first, among equals the first made.
struct Long {
  int64_t grains;
  Edge edge;
  bool operator<(const Long& other) const {
    return grains != other.grains ? grains < other.grains : edge > other.edge;
  }
};

/// Refines a triangulation of the patch to a number of vertices, then evens it out.
class SkinMesher {
 public:
  explicit SkinMesher(Mesh mesh) : mesh_(std::move(mesh)) {}

  /// Splits the longest edge again and again. Which edges there are is decided on the map, because
  /// at first they are chords through the head.
  void refine(size_t vertices) {
    flat_ = true;
    flip_all();
    for (Edge edge : mesh_.edges()) wait(edge);
    while (mesh_.number_of_vertices() < vertices) {
      const Long longest = queue_.top();
      queue_.pop();
      if (grains(longest.edge) == longest.grains) split(longest.edge);
    }
    flat_ = false;
    flip_all();
  }

  void relax() {
    for (Vertex vertex : mesh_.vertices())
      if (!mesh_.is_border(vertex)) move(vertex);
    flip_all();
  }

  Surface surface() const { return surface_of(mesh_, "phantom skin"); }

 private:
  Vec3 tip(Halfedge h) const { return from_cgal(mesh_.point(mesh_.target(h))); }

  int64_t grains(Edge edge) const {
    const Halfedge h = mesh_.halfedge(edge);
    return std::llround((tip(h) - tip(mesh_.opposite(h))).norm() / length_grain);
  }

  void wait(Edge edge) {
    if (!mesh_.is_border(edge)) queue_.push({grains(edge), edge});
  }

  /// Puts a vertex on the skin above the middle of an edge, joined to both opposite corners.
  void split(Edge edge) {
    const Halfedge h = mesh_.halfedge(edge);
    const Vec3 middle = (tip(h) + tip(mesh_.opposite(h))) / 2;
    const Halfedge before = CGAL::Euler::split_edge(h, mesh_);
    mesh_.point(mesh_.target(before)) = to_cgal(on_skin(middle));
    const Halfedge back = mesh_.opposite(h);
    CGAL::Euler::split_face(before, mesh_.next(h), mesh_);
    CGAL::Euler::split_face(back, mesh_.next(mesh_.next(back)), mesh_);
    std::vector<Edge> opposite;
    for (Halfedge spoke : mesh_.halfedges_around_target(before)) {
      wait(mesh_.edge(spoke));
      opposite.push_back(mesh_.edge(mesh_.prev(spoke)));
    }
    flip(opposite);
  }

  void flip_all() {
    std::vector<Edge> all(mesh_.edges().begin(), mesh_.edges().end());
    flip(all);
  }

  /// Flips edges, and those around a flipped one, as long as the smallest angle of the two
  /// triangles grows. Ends, because the sorted list of all angles only ever grows.
  void flip(std::vector<Edge>& pending) {
    while (!pending.empty()) {
      const Edge edge = pending.back();
      pending.pop_back();
      if (mesh_.is_border(edge) || !better_flipped(mesh_.halfedge(edge))) continue;
      const Halfedge h = mesh_.halfedge(edge), o = mesh_.opposite(h);
      for (Halfedge side : {mesh_.next(h), mesh_.prev(h), mesh_.next(o), mesh_.prev(o)})
        pending.push_back(mesh_.edge(side));
      CGAL::Euler::flip_edge(h, mesh_);
      if (flat_) wait(edge);
    }
  }

  bool better_flipped(Halfedge h) const {
    const Halfedge o = mesh_.opposite(h), left = mesh_.next(h), right = mesh_.next(o);
    const Vec3 a = tip(o), b = tip(h), c = tip(left), d = tip(right);
    if (facing(c, d, b) <= 0 || facing(d, c, a) <= 0) return false;
    const bool better =
        flat_ ? better_diagonal(flattened(a), flattened(b), flattened(c), flattened(d))
              : better_diagonal(a, b, c, d);
    return better && !joined(left, right);
  }

  /// Returns whether an edge joins the vertices two halfedges point to. Walks round both at once,
  /// so that a vertex with an edge to half the rim costs no more than the other.
  bool joined(Halfedge g, Halfedge h) const {
    const Vertex u = mesh_.target(g), v = mesh_.target(h);
    Halfedge at_u = g, at_v = h;
    do {
      if (mesh_.source(at_u) == v || mesh_.source(at_v) == u) return true;
      at_u = mesh_.next_around_target(at_u);
      at_v = mesh_.next_around_target(at_v);
    } while (at_u != g && at_v != h);
    return false;
  }

  /// Moves an inner vertex to the area-weighted mean of its triangles' centroids, on the skin, if
  /// no triangle turns over or becomes a worse needle than there was.
  void move(Vertex vertex) {
    const Vec3 old = from_cgal(mesh_.point(vertex));
    Vec3 sum = Vec3::Zero();
    double area = 0, before = 0.9, after = 0;
    for (Halfedge h : mesh_.halfedges_around_target(mesh_.halfedge(vertex))) {
      const Vec3 a = tip(mesh_.opposite(h)), b = tip(mesh_.next(h));
      const double weight = (a - old).cross(b - old).norm();
      sum += weight * (old + a + b) / 3;
      area += weight;
      before = std::max(before, sharpness(old, a, b));
    }
    const Vec3 moved = on_skin(sum / area);
    for (Halfedge h : mesh_.halfedges_around_target(mesh_.halfedge(vertex))) {
      const Vec3 a = tip(mesh_.opposite(h)), b = tip(mesh_.next(h));
      if (facing(b, a, moved) <= 0) return;
      after = std::max(after, sharpness(moved, a, b));
    }
    if (after <= before) mesh_.point(vertex) = to_cgal(moved);
  }

  Mesh mesh_;
  std::priority_queue<Long> queue_;
  bool flat_ = false;  // angles are measured on the map
};

}  // namespace

Surface make_phantom_skin(int64_t vertices) {
  if (vertices < phantom_vertices_min || vertices > phantom_vertices_max)
    base::refuse("skin_vertices: {} is not in {} … {}", vertices, phantom_vertices_min,
                 phantom_vertices_max);
  const int64_t border = std::llround(80 * std::sqrt(vertices / 477.0));
  const int64_t mouth = std::llround(0.15 * border);
  SkinMesher mesher(strip(ring(mouth_curve, mouth), ring(rim_curve, border - mouth)));
  mesher.refine(vertices);
  for (int i = 0; i < sweeps; ++i) mesher.relax();
  return mesher.surface();
}

}  // namespace repose::tools::phantom
