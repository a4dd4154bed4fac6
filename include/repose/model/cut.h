#pragma once
#include <string>
#include <vector>

#include "repose/model/model.h"
#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

namespace repose::model {

/// An incision in a model's own terms.
struct Cut {
  std::vector<int64_t> columns;  ///< skin vertices along it, neighbors joined by edges; tips first
                                 ///< and last
  int layers;                    ///< point layers that it parts, from the skin down
  bool meets = false;            ///< its sides touch and do not pass each other
  bool lips = false;             ///< parts lips, which the initial equilibrium finds parted
  std::vector<Triangle> around = {};  ///< [T] skin vertices of the skin's triangles at the columns
  double edge = 0;                    ///< mm, mean length of the sides of the skin's triangles
};

/// Gives a cut the skin around it, `around` and `edge`. `points` [V] mm and `triangles` are the
/// whole skin's.
void add_skin_around(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles,
                     Cut& cut);

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

/// Parts the tissue of a model made by make_layers along a cut. Points on the path but its two tips
/// are doubled in layers 0 … cut.layers − 1, except bone points, which stay joined; the doubles
/// come at the end of the points, in the same column and layer, and belong to the left of the path.
/// A spring that lies in the cut becomes two, its stiffness shared in proportion to the prisms'
/// volume on either side, and so do the mass and the force of a doubled point. The edges of a solid
/// are made again from its prisms, and what tension they carried besides is shared like that.
/// Positions and rest lengths stay as they are: where the tissue was in equilibrium, the tension
/// that crossed the cut now opens it. Returns the rows of the doubled points, the double second.
/// The model may be one of build_local(), of a piece: values at elements of the columns that the
/// piece was made around are those of the whole model, and `cut.meets` requires that the piece was
/// made around the whole path. Throws InternalError where the columns are no path of edges.
std::vector<std::array<int64_t, 2>> cut_along(const Cut& cut, Model& model);

/// Makes the cuts of the lips, or all others, in their order (cut_along).
void make_cuts(const std::vector<Cut>& cuts, bool lips, Model& model);

/// Elements removed with torn springs.
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
