#include "repose/model/collision.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "repose/base/error.h"
#include "repose/surface/collision.h"
#include "repose/surface/distance.h"
#include "repose/surface/edges.h"
#include "repose/surface/triangle_tree.h"

namespace repose::model {
namespace {

/// The constant twist of a screw motion, the logarithm of a small part of it:
/// t = (1 + (1−cos θ)/θ² K + (θ−sin θ)/θ³ K²) v with K = [θ u]× for a part that turns by θ.
surface::Twist twist_of(const scene::RigidMotion& motion) {
  constexpr double part = 1.0 / 64;
  const Mat4 step = motion.matrix(part);
  const Eigen::AngleAxisd turn(Mat3(step.topLeftCorner<3, 3>()));
  const double angle = turn.angle(), squared = angle * angle;
  const bool tiny = angle < 1e-4;
  const double first = tiny ? 0.5 : (1 - std::cos(angle)) / squared,
               second = tiny ? 1.0 / 6 : (angle - std::sin(angle)) / (squared * angle);
  const Vec3 w = angle * turn.axis();
  Mat3 k;
  k << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  const Mat3 whole = Mat3::Identity() + first * k + second * k * k;
  const Vec3 shift = step.topRightCorner<3, 1>();
  return {w / part, whole.inverse() * shift / part};
}

/// Place of bone b in the frame of bone a.
Mat4 relative(const scene::RigidMotion& a, const scene::RigidMotion& b, double load) {
  return scene::RigidMotion::from_matrix(a.matrix(load)).inverse().matrix() * b.matrix(load);
}

Vec3 placed(const Mat4& pose, const Vec3& point) {
  return pose.topLeftCorner<3, 3>() * point + pose.topRightCorner<3, 1>();
}

/// Length (mm) that triangles which may touch shall have at most: small, but not so that a cut
/// through a large bone has too many.
double small_side(const surface::Surface& surface) {
  return std::max(1.0, surface::bounding_diagonal(surface.points) / 200);
}

/// The points of a surface, and points of triangles with a side longer than `side` mm, no farther
/// than that from one another.
std::vector<Vec3> samples_of(const surface::Surface& surface, double side) {
  std::vector<Vec3> points = surface.points;
  for (const Triangle& triangle : surface.triangles) {
    const auto [a, b, c] = surface::corners(surface, triangle);
    const int parts = static_cast<int>(std::ceil(surface::longest_side({a, b, c}) / side));
    for (int i = 0; parts > 1 && i <= parts; ++i)
      for (int j = 0; i + j <= parts; ++j)
        points.push_back(a + (i * (b - a) + j * (c - a)) / parts);
  }
  return points;
}

struct Deepest {
  double depth = 0;  // mm
  Vec3 at = Vec3::Zero();
};

/// A bone with what questions about it need.
struct Mover {
  const surface::Surface& surface;
  const scene::RigidMotion& motion;
  std::vector<Vec3> samples;
  surface::CollisionTree tree;
  Eigen::AlignedBox3d box;
  std::vector<Vec3> of_parts;                     // a point of each connected part
  std::unique_ptr<surface::DistanceTree> inside;  // made when needed

  bool contains(const Vec3& point) {
    if (!box.contains(point)) return false;
    if (!inside) inside = std::make_unique<surface::DistanceTree>(surface);
    return inside->contains(point);
  }

  /// Returns whether a part of a bone, placed by `pose`, that does not touch this one is inside.
  bool encloses_part_of(const Mover& other, const Mat4& pose) {
    return std::ranges::any_of(other.of_parts,
                               [&](const Vec3& point) { return contains(placed(pose, point)); });
  }

  /// The deepest of `points`, placed by `pose`, inside this bone; in its frame.
  Deepest deepest_of(const std::vector<Vec3>& points, const Mat4& pose) {
    Deepest deepest;
    for (const Vec3& point : points) {
      const Vec3 p = placed(pose, point);
      if (!contains(p)) continue;
      const double depth = inside->nearest(p).distance;
      if (depth > deepest.depth) deepest = {depth, p};
    }
    return deepest;
  }

  /// [triangles of another bone] 1 where one lies in this bone from the start.
  std::vector<char> holds(const surface::CollisionTree& other) {
    std::vector<char> held(other.triangles());
    for (int64_t t = 0; t < static_cast<int64_t>(held.size()); ++t)
      held[t] = contains(other.corners(t)[0]);
    return held;
  }
};

/// Where two bones lie deepest inside one another at a load; negative where they are apart.
Deepest overlap(Mover& a, Mover& b, double load) {
  const Mat4 pose = relative(a.motion, b.motion, load),
             reverse = relative(b.motion, a.motion, load);
  if (!surface::touch(a.tree, b.tree, pose) && !a.encloses_part_of(b, pose) &&
      !b.encloses_part_of(a, reverse))
    return {.depth = -1};
  Deepest in_a = a.deepest_of(b.samples, pose), in_b = b.deepest_of(a.samples, reverse);
  in_a.at = a.motion.apply(in_a.at, load);
  in_b.at = b.motion.apply(in_b.at, load);
  return in_a.depth > in_b.depth ? in_a : in_b;
}

/// The trees of two bones, finer where they touch from the start.
std::pair<surface::CollisionTree, surface::CollisionTree> finer(const Mover& a, const Mover& b,
                                                                double touching) {
  const auto one = [&](const Mover& own, const Mover& other) {
    return surface::CollisionTree(
        surface::refine_near(own.surface, own.tree, other.tree, touching, small_side(own.surface)));
  };
  return {one(a, b), one(b, a)};
}

/// Finds the load from which bones that overlap from the start lie deeper in one another by `more`
/// mm, for their triangles there are ignored.
void find_press(Mover& a, Mover& b, double more, BonePair& pair) {
  constexpr int steps = 16;
  constexpr double close = 1e-3;  // of the load
  const double allowed = std::max(-pair.gap, 0.0) + more;
  double low = 0, high = 0;
  for (int step = 1; step <= steps && low < pair.load; ++step, low = high) {
    high = static_cast<double>(step) / steps;
    if (overlap(a, b, high).depth > allowed) break;
  }
  if (low == 1) return;
  while (high - low > close) {
    const double middle = (low + high) / 2;
    (overlap(a, b, middle).depth > allowed ? high : low) = middle;
  }
  if (low >= pair.load) return;
  pair.load = low;
  pair.at = overlap(a, b, high).at;
}

void follow(Mover& a, Mover& b, const scene::Collision& requested, BonePair& pair) {
  const double touching = requested.clearance + 2 * requested.tolerance;
  std::optional<std::pair<surface::CollisionTree, surface::CollisionTree>> fine;
  std::array<std::vector<char>, 2> inside;
  if (pair.gap <= touching) {
    fine.emplace(finer(a, b, touching));
    inside = {b.holds(fine->first), a.holds(fine->second)};
  }
  surface::Encounter encounter(fine ? fine->first : a.tree, fine ? fine->second : b.tree,
                               twist_of(a.motion), twist_of(b.motion), touching, inside);
  pair.ignored = encounter.ignored_area();
  constexpr double caution = 1 - 1e-9;  // of a step: twists are rounded
  for (double load = 0; load <= 1;) {
    const auto next = encounter.next(relative(a.motion, b.motion, load), requested.clearance);
    if (next.approach.distance <= requested.clearance + requested.tolerance) {
      pair.load = load;
      pair.at = a.motion.apply(next.approach.at, load);
      break;
    }
    load += caution * next.load;
  }
  const auto held = [](const std::vector<char>& of) { return std::ranges::count(of, 1) > 0; };
  if (held(inside[0]) || held(inside[1])) find_press(a, b, touching, pair);
  if (!pair.contact()) return;
  pair.depth = std::max(overlap(a, b, 1).depth, 0.0);
  const Mat4 end = relative(a.motion, b.motion, 1);
  pair.crossings = static_cast<int64_t>(
      surface::pairs_within(a.tree, b.tree, end, surface::contact_margin).size());
}

std::vector<Vec3> points_of_parts(const surface::Surface& bone) {
  std::vector<Vec3> points;
  surface::UnionFind parts = connected(bone.triangles, surface::EdgeTable(bone.triangles));
  for (int64_t t = 0; t < static_cast<int64_t>(bone.triangles.size()); ++t)
    if (parts.find(t) == t) points.push_back(bone.points[bone.triangles[t][0]]);
  return points;
}

std::vector<Mover> movers_of(const std::vector<surface::Surface>& bones,
                             const std::vector<scene::RigidMotion>& moves) {
  std::vector<Mover> movers;
  for (size_t k = 0; k < bones.size(); ++k)
    movers.push_back({bones[k], moves[k], samples_of(bones[k], 2 * small_side(bones[k])),
                      surface::CollisionTree(bones[k]), surface::bounding_box(bones[k].points),
                      points_of_parts(bones[k]), nullptr});
  return movers;
}

/// Calls visit("bones 'NAME' and 'NAME'", mm) for pairs that lie deeper than `limit` (mm) in one
/// another before all moves (load 0), or at their end if they move differently (load 1).
template <class Visit>
void for_each_overlap(std::vector<Mover>& movers, const scene::Scene& scene, double load,
                      double limit, Visit&& visit) {
  for (size_t i = 0; i < movers.size(); ++i)
    for (size_t j = i + 1; j < movers.size(); ++j) {
      if (load > 0 && move_alike(movers[i].motion, movers[j].motion)) continue;
      if (const double depth = overlap(movers[i], movers[j], load).depth; depth > limit)
        visit(fmt::format("bones '{}' and '{}'", scene.bones[i].name, scene.bones[j].name), depth);
    }
}

std::vector<std::string> describe_overlaps_at_end(std::vector<Mover>& movers,
                                                  const scene::Scene& scene) {
  std::vector<std::string> lines;
  for_each_overlap(movers, scene, 1, 1, [&](const std::string& pair, double depth) {
    lines.push_back(fmt::format(
        "{} end {:.1f} mm inside one another; repose-collide reports where they meet, and "
        "collision: {{mode: clamp}} moves them no farther",
        pair, depth));
  });
  return lines;
}

/// Follows all pairs that move differently.
CollisionReport follow_all(std::vector<Mover>& movers, const scene::Collision& requested) {
  CollisionReport report;
  for (size_t i = 0; i < movers.size(); ++i)
    for (size_t j = i + 1; j < movers.size(); ++j) {
      if (move_alike(movers[i].motion, movers[j].motion)) continue;
      BonePair pair{.a = static_cast<int32_t>(i), .b = static_cast<int32_t>(j), .gap = 0};
      pair.gap = -overlap(movers[i], movers[j], 0).depth;
      if (pair.gap > 0)
        pair.gap = surface::nearest(movers[i].tree, movers[j].tree, Mat4::Identity())->distance;
      follow(movers[i], movers[j], requested, pair);
      report.safe_load = std::min(report.safe_load, pair.load);
      report.pairs.push_back(pair);
    }
  return report;
}

}  // namespace

bool move_alike(const scene::RigidMotion& a, const scene::RigidMotion& b) {
  constexpr double same = 1e-9;  // largest difference of matrix entries, mm or none
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff() <= same;
}

CollisionReport follow_moves(const std::vector<surface::Surface>& bones,
                             const std::vector<scene::RigidMotion>& moves,
                             const scene::Collision& requested) {
  std::vector<Mover> movers = movers_of(bones, moves);
  return follow_all(movers, requested);
}

std::vector<std::string> describe(const CollisionReport& report, const scene::Scene& scene,
                                  const scene::Collision& requested) {
  std::vector<std::string> lines;
  for (const BonePair& pair : report.pairs) {
    constexpr double shown = 0.005;  // mm, with two decimals
    const bool overlapping = pair.gap < -shown;
    const std::string start = overlapping ? fmt::format("{:.2f} mm inside one another", -pair.gap)
                              : pair.gap > 0 ? fmt::format("{:.2f} mm apart", pair.gap)
                                             : "touching";
    std::string line =
        fmt::format("bones '{}' and '{}', {} at the start: ", scene.bones[pair.a].name,
                    scene.bones[pair.b].name, start);
    if (!pair.contact() && overlapping)
      line += "go no deeper";
    else if (!pair.contact())
      line += requested.clearance > 0 ? fmt::format("stay {:g} mm apart", requested.clearance)
                                      : std::string("do not come to touch");
    else if (overlapping)
      line += fmt::format("touch elsewhere or lie {:g} mm deeper at load {:.4f}, at {:.1f}",
                          requested.clearance + 2 * requested.tolerance, pair.load, pair.at);
    else
      line += fmt::format("come within {:g} mm at load {:.4f}, at {:.1f}",
                          requested.clearance + requested.tolerance, pair.load, pair.at);
    if (pair.crossings > 0 || pair.depth > 0)
      line += fmt::format("; at the end {} pairs of triangles cross, {:.2f} mm deep",
                          pair.crossings, pair.depth);
    if (pair.ignored > 0)
      line += fmt::format(
          "; {:.1f} mm² of their surfaces touch or overlap from the start (within {:g} mm) and are "
          "left out",
          pair.ignored, requested.clearance + 2 * requested.tolerance);
    lines.push_back(line);
  }
  return lines;
}

std::vector<std::string> describe_overlaps_at_end(const std::vector<surface::Surface>& bones,
                                                  const scene::Scene& scene) {
  std::vector<Mover> movers = movers_of(bones, scene.moves);
  return describe_overlaps_at_end(movers, scene);
}

std::vector<std::string> resolve_collisions(const std::vector<surface::Surface>& bones,
                                            scene::Scene& scene, std::vector<std::string>& remarks,
                                            std::vector<std::string>& warnings) {
  using Mode = scene::CollisionMode;
  std::vector<Mover> movers = movers_of(bones, scene.moves);
  constexpr double known = 2;  // mm: segmented teeth overlap by tenths
  for_each_overlap(movers, scene, 0, known, [&](const std::string& pair, double depth) {
    warnings.push_back(fmt::format(
        "{} lie {:.1f} mm inside one another before they move: check that both come from one "
        "scan and in one frame, or separate their segmentations",
        pair, depth));
  });
  if (!scene.collision) return describe_overlaps_at_end(movers, scene);
  const CollisionReport report = follow_all(movers, *scene.collision);
  const std::vector<std::string> lines = describe(report, scene, *scene.collision);
  remarks.insert(remarks.end(), lines.begin(), lines.end());
  if (scene.collision->mode == Mode::report) return describe_overlaps_at_end(movers, scene);
  if (report.safe_load >= 1) return {};
  if (scene.collision->mode == Mode::stop) {
    const auto first =
        std::min_element(report.pairs.begin(), report.pairs.end(),
                         [](const BonePair& p, const BonePair& q) { return p.load < q.load; });
    base::refuse("{}: {}; change the moves, or collision.mode to clamp or report",
                 scene.file.string(), lines[first - report.pairs.begin()]);
  }
  for (scene::RigidMotion& move : scene.moves)
    move = scene::RigidMotion::from_matrix(move.matrix(report.safe_load));
  return {fmt::format("all moves end at load {:.4f} of the plan, before the first contact",
                      report.safe_load)};
}

}  // namespace repose::model
