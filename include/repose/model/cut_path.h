#pragma once
#include <string>
#include <vector>

#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

namespace repose::model {

/// An incision in a model's own terms.
struct Cut {
  std::vector<int64_t> columns;  ///< skin vertices along it, neighbours joined by edges; tips first
                                 ///< and last
  int layers;                    ///< point layers that it parts, from the skin down
  bool meets = false;            ///< its sides touch and do not pass each other
};

/// Makes the paths of incisions edges of the skin: triangles and edges that a path crosses are
/// split where it runs, and the vertices that come of it added at the end. A path nearer to a
/// vertex or an edge than a tenth of the edges there is moved onto it, against slivers; of path
/// points closer to one another than half an edge the later are passed over. Between its points the
/// path runs in the plane through both that holds the skin's normal. `skin` must be a valid skin
/// (skin_mesh.h). Throws InputError naming `scene_file` and the incision where a path is further
/// than 5 mm from the skin, shorter than an edge, comes to the skin's rim, or meets itself or
/// another.
std::vector<Cut> insert_paths(const std::vector<scene::Incision>& incisions,
                              const std::string& scene_file, surface::Surface& skin);

}  // namespace repose::model
