#pragma once
#include <vector>

#include "repose/model/model.h"

namespace repose::model {

/// What went with springs that tore.
struct Tear {
  int64_t prisms = 0, triangles = 0;  ///< removed, triangles of the drawn skin
};

/// Removes springs (`torn` [S]), and prisms and triangles of the drawn skin that have one of them
/// for an edge. A prism's edges are the six of its triangles and the three that connect them; a
/// diagonal is none. Points and the order of what is left stay as they are. Throws InputError,
/// naming `what`, the point and its place, where soft tissue would be left that no springs join to
/// a point that is held; the model is unchanged then.
Tear remove_springs(const std::vector<char>& torn, const std::string& what, Model& model);

}  // namespace repose::model
