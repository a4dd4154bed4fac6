#pragma once
#include "repose/model/build.h"

namespace repose::model {

/// The skin that a scene names.
struct GivenSkin {
  surface::Surface surface;
  std::string obstacle;  ///< why it is not solved as it is, a clause; empty where it may be
};

/// Reads it: as a skin, or raw where it is to be remeshed, because of tissue.edge or because it has
/// defects, is that of a whole head, or has more triangles than are solved.
GivenSkin load_skin(const scene::Scene& scene);

/// Puts a skin fit to be solved (meshtools/face.h), with edges of scene.tissue.edge, in the place
/// of the given one, which the anatomy keeps: in the regions of scene.tissue.face or, without any,
/// over the bones that move, forces and incisions; of all that is given where instruments are
/// pushed or nothing of these is. A remark says how near it is. Vertices that lie up to 3 mm inside
/// bone are moved out of it, with a remark.
void remesh_skin(Anatomy& anatomy);

}  // namespace repose::model
