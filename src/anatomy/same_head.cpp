#include "repose/anatomy/same_head.h"

#include <cmath>
#include <deque>

#include "repose/base/error.h"
#include "repose/surface/triangle_tree.h"

namespace repose::anatomy {
namespace {

using surface::TriangleTree;

/// Landmarks with the surfaces that they are on by their names.
class Placed {
 public:
  Placed(const scene::Landmarks& landmarks, const surface::Surface& skin,
         const std::vector<surface::Surface>& bones)
      : landmarks_(landmarks), skin_(skin) {
    for (const surface::Surface& bone : bones) bones_.emplace_back(bone);
  }

  TriangleTree::Nearest nearest_bone(const Vec3& place) const {
    TriangleTree::Nearest best;
    for (const TriangleTree& bone : bones_)
      if (const auto found = bone.nearest(place, best.squared); found.squared < best.squared)
        best = found;
    return best;
  }

  TriangleTree::Nearest nearest(const scene::LandmarkName& name, const Vec3& place) const {
    return name.on_skin ? skin_.nearest(place) : nearest_bone(place);
  }

  double to_bone(const char* name, size_t bone) const {
    return std::sqrt(bones_[bone].nearest(landmarks_.at(name)).squared);
  }

  /// The number of the bone on which the first of some landmarks lies that is known; none of the
  /// bones where none is.
  size_t bone_of(std::initializer_list<const char*> names) const {
    for (const char* name : names) {
      if (!landmarks_.contains(name)) continue;
      size_t best = 0;
      for (size_t bone = 1; bone < bones_.size(); ++bone)
        if (to_bone(name, bone) < to_bone(name, best)) best = bone;
      return best;
    }
    return bones_.size();
  }

  template <class Visit>
  void visit(const Visit& visit) const {
    for (const scene::LandmarkName& name : scene::landmark_names())
      if (const Vec3* place = scene::find(landmarks_, name.name.c_str())) visit(name, *place);
  }

 private:
  const scene::Landmarks& landmarks_;
  TriangleTree skin_;
  std::deque<TriangleTree> bones_;
};

void require_near(const Placed& head, const std::string& file) {
  constexpr double off_surface = 15;  // mm, farther than a landmark is ever placed beside it
  head.visit([&](const scene::LandmarkName& name, const Vec3& place) {
    const double off = std::sqrt(head.nearest(name, place).squared);
    if (off > off_surface)
      base::refuse(
          "{}: landmark {} lies {:.0f} mm from the {}; the landmarks are those of another head or "
          "in another frame",
          file, name.name, off, name.on_skin ? "skin" : "bones");
  });
}

void require_soft_near_bone(const scene::Landmarks& landmarks, const std::string& file) {
  constexpr double farthest = 40;  // mm
  for (const auto& [soft, bone] : {std::pair{"nasion_soft", "nasion_bone"},
                                   {"subnasale", "nasal_spine"},
                                   {"b_soft", "b_point"},
                                   {"pogonion_soft", "pogonion_bone"},
                                   {"menton_soft", "menton_bone"}}) {
    const Vec3 *skin = scene::find(landmarks, soft), *below = scene::find(landmarks, bone);
    if (!skin || !below) continue;
    if (const double apart = (*skin - *below).norm(); apart > farthest)
      base::refuse("{}: {} lies {:.0f} mm from {}, at most {:g} mm in a head: place it again", file,
                   soft, apart, bone, farthest);
  }
}

/// Ways from landmarks, moved by a shift, to their surfaces, without those inside of bone.
std::vector<Vec3> ways_to_surface(const Placed& head, const Vec3& shift) {
  std::vector<Vec3> ways;
  head.visit([&](const scene::LandmarkName& name, const Vec3& place) {
    if (name.name.ends_with("_center")) return;
    ways.push_back(head.nearest(name, place + shift).point - place - shift);
  });
  return ways;
}

double mean_length(const std::vector<Vec3>& ways) {
  double sum = 0;
  for (const Vec3& way : ways) sum += way.norm();
  return sum / static_cast<double>(ways.size());
}

/// Refuses landmarks that a shift brings to their surfaces: iterated closest points with the
/// weights 1/(1 + d²/s²).
void require_unshifted(const Placed& head, const std::string& file) {
  constexpr size_t needed = 8;  // landmarks
  constexpr int rounds = 40;
  constexpr double scale = 2, most = 4;  // mm
  Vec3 shift = Vec3::Zero();
  const std::vector<Vec3> before = ways_to_surface(head, shift);
  if (before.size() < needed) return;
  for (int round = 0; round < rounds; ++round) {
    Vec3 sum = Vec3::Zero();
    double weights = 0;
    for (const Vec3& way : ways_to_surface(head, shift)) {
      const double weight = 1 / (1 + way.squaredNorm() / (scale * scale));
      sum += weight * way;
      weights += weight;
    }
    shift += sum / weights;
  }
  const double off = mean_length(before), after = mean_length(ways_to_surface(head, shift));
  if (shift.norm() > most && 2 * after < off)
    base::refuse(
        "{}: the landmarks lie {:.1f} mm from skin and bones in the mean, and {:.1f} mm when all "
        "are moved by {:.1f} mm: they are of another scan or frame; give those "
        "of these surfaces, or propose them with repose-landmarks",
        file, off, after, shift);
}

void require_own_jaws(const Placed& head, const std::string& file) {
  const char *upper = "upper_incisor_edge", *lower = "lower_incisor_edge";
  const size_t skull = head.bone_of({"nasal_spine", "nasion_bone"}),
               jaw = head.bone_of({"menton_bone", "pogonion_bone", "b_point"});
  const size_t of_upper = head.bone_of({upper}), of_lower = head.bone_of({lower});
  if (skull == jaw || of_upper != jaw || of_lower != skull) return;
  base::refuse(
      "{}: {} lies {:.1f} mm from the lower jaw and {:.1f} mm from the upper, {} {:.1f} mm from "
      "the upper and {:.1f} mm from the lower: they are exchanged",
      file, upper, head.to_bone(upper, jaw), head.to_bone(upper, skull), lower,
      head.to_bone(lower, skull), head.to_bone(lower, jaw));
}

}  // namespace

void require_same_head(const scene::Landmarks& landmarks, const std::string& file,
                       const surface::Surface& skin, const std::vector<surface::Surface>& bones) {
  const Placed head(landmarks, skin, bones);
  require_near(head, file);
  require_soft_near_bone(landmarks, file);
  require_unshifted(head, file);
  require_own_jaws(head, file);
}

}  // namespace repose::anatomy
