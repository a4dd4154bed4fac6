#pragma once
#include <optional>
#include <vector>

#include "repose/model/build.h"
#include "repose/scene/scene.h"
#include "repose/surface/distance.h"

/// Rigid bodies pushed into the skin.
namespace repose::model {

/// Reads the mesh of an instrument. Throws InputError for one that is not closed.
surface::Surface read_body(const scene::ClosedMesh& mesh);

/// A part of a line p + t d, in mm along d.
struct Stretch {
  double enter, leave;
};

/// Where a line meets an instrument at the end of its push: from the point `p` on, along the unit
/// vector of the push. Of a mesh that the line meets more than once, the first part. Nullopt where
/// it misses.
class PushedShape {
 public:
  /// Reads the file of a mesh. Throws InputError for one that is not closed, and for a half-space
  /// that is not pushed out of itself.
  explicit PushedShape(const scene::Instrument& instrument);

  std::optional<Stretch> along(const Vec3& p) const;

 private:
  std::optional<Stretch> in_mesh(const Vec3& p) const;

  scene::Instrument instrument_;
  Vec3 direction_;
  std::optional<surface::DistanceTree> mesh_;
};

/// Measures how deep points are inside a closed mesh, by its triangles.
class MeshDepth {
 public:
  /// Throws InputError for a mesh without area.
  explicit MeshDepth(const surface::Surface& mesh) : tree_(mesh) {}

  /// mm, 0 outside.
  double at(const Vec3& point) const {
    return tree_.contains(point) ? tree_.nearest(point).distance : 0;
  }

 private:
  surface::DistanceTree tree_;
};

/// Finds the columns whose skin point an instrument to which the skin sticks sweeps over or ends
/// on: their target is where the push takes them, on the surface of the instrument at the end of
/// its push. A column goes with the first instrument of the scene that reaches it. `skin` [V] is
/// where columns begin, mm; those of the `rim` [V] are not free. Throws InputError naming the scene
/// and an instrument that reaches no free column.
ColumnLoads hold_by_instruments(const scene::Scene& scene, const std::vector<Vec3>& skin,
                                const std::vector<char>& rim);

}  // namespace repose::model
