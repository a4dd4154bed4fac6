#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "repose/discrete/partition.h"
#include "repose/model/model.h"

/// The part of the tissue that feels what moves. All of this is serial and for rank 0, which alone
/// has the model.
namespace repose::solve {

/// Some points of a model as unknowns, with all they touch, as a model of its own.
struct Submodel {
  model::Model model;
  std::vector<int64_t> point_row;  ///< [its points] row in the whole model, ascending
};

/// The unknown points of `whole` (`unknown` [N], soft tissue only), the springs and prisms that
/// touch one, and those elements' other points; of these soft-tissue points become held where they
/// are initially. Bones move as in the whole model. Without surfaces to draw.
Submodel submodel(const model::Model& whole, const std::vector<char>& unknown);

/// The same at one state: every point that is not unknown is held at its place in `position` [N of
/// the whole model], mm, and there at load 1.
Submodel submodel_at(const model::Model& whole, const std::vector<char>& unknown,
                     const std::vector<Vec3>& position);

/// The force (N) on each soft-tissue point in the initial state, by springs, weight and external
/// force, [N]; zero at others. Prisms beside springs do not press: they
/// have their rest volume there.
std::vector<Vec3> initial_forces(const model::Model& model);

/// How far each column of tissue is from what sets tissue in motion: columns with a soft-tissue
/// point that shares a spring or prism with a fixed point that moves, or that is not at rest in
/// the initial state. Distances run from column to column along the skin and are counted in
/// thicknesses of the tissue they pass (length over mean thickness of the two columns; 1 where they
/// have none), by which displacements in a layer held at its depth decay, whatever the mesh.
class ActiveRegion {
 public:
  /// `force` as initial_forces gives it; at rest is what is below 1e-9 of Σ k0 r_0 of the springs
  /// at a point, of a solid Σ |w| r_0 of its edges. O(model + columns log columns).
  ActiveRegion(const model::Model& model, const std::vector<Vec3>& force);

  /// [N] soft-tissue points of the columns whose distance d is nearest ≤ d < farthest.
  std::vector<char> points(double nearest, double farthest) const;
  int64_t columns(double farthest) const;  ///< whose distance is below
  int64_t columns() const { return graph_.columns(); }
  int64_t moved() const { return moved_; }    ///< columns that fixed points set in motion
  int64_t uneasy() const { return uneasy_; }  ///< columns that are not at rest initially
  double largest() const;                     ///< distance of the farthest column that is reached

 private:
  std::vector<char> set_in_motion(const std::vector<Vec3>& force);
  void measure(const std::vector<char>& sources);

  const model::Model& model_;
  discrete::ColumnGraph graph_;
  std::vector<double> distance_;  // [columns], infinite where no way leads
  int64_t moved_ = 0, uneasy_ = 0;
};

}  // namespace repose::solve
