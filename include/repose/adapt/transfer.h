#pragma once
#include <vector>

#include "repose/model/model.h"

namespace repose::adapt {

/// Carries the displacements [N of `from`] (mm) from one model of an anatomy to another, [N of
/// `to`] at full load: each column of `to` finds its place on the initial skin of `from`, and each
/// of its points that depth below it; displacements are interpolated linearly over the skin's
/// triangles and down the columns. A column whose deepest point is fixed in `to` is drawn to where
/// that point goes, in proportion to depth; fixed points go where they are taken. Both models are
/// those of scenes without incisions (points in columns, layer by layer). Serial.
std::vector<Vec3> transfer(const model::Model& from, const model::Model& to,
                           const std::vector<Vec3>& displacement);

}  // namespace repose::adapt
