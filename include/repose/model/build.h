#pragma once
#include <optional>
#include <string>
#include <vector>

#include "repose/model/cut.h"
#include "repose/model/instruments.h"
#include "repose/model/model.h"
#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

namespace repose::model {

/// What was done to make a valid model, for the closing table.
struct BuildReport {
  int64_t skin_vertices = 0, skin_edges = 0, skin_triangles = 0;
  int64_t attached = 0;   ///< columns that end in bone
  int64_t free_deep = 0;  ///< columns that end free: no bone near, unattached, or released
  int64_t released = 0;   ///< of those, let go near a piece that moves differently
  int64_t shortened = 0;  ///< columns made shorter so that neighbours do not cross
  double thickness_min = 0, thickness_median = 0, thickness_max = 0;  ///< mm
  double effective_modulus = 0;      ///< N/mm², as the function below
  std::vector<std::string> remarks;  ///< lines for a person, each complete
};

struct BuiltModel {
  Model model;
  BuildReport report;
  std::vector<std::vector<int64_t>> held;  ///< [instruments] rows of the points that each holds
  std::vector<Cut> cuts;  ///< the incisions, not made yet: cut_along after the prestress (cut.h)
};

/// Scene and surfaces to model: columns, layers, springs, prisms, sets, attachment. `bones` in the
/// order of scene.bones. Serial. Throws InputError naming the place where no valid model exists.
BuiltModel build_model(const scene::Scene& scene, const surface::Surface& skin,
                       const std::vector<surface::Surface>& bones);

/// What a scene's model is built from, at any resolution.
struct Anatomy {
  scene::Scene scene;     ///< with moves that heed collisions
  surface::Surface skin;  ///< that is solved
  /// The skin that the scene names, where another is solved in its place (solved_skin.h).
  std::optional<surface::Surface> given_skin;
  std::vector<surface::Surface> bones;  ///< [scene.bones]
  std::vector<std::string> remarks;     ///< lines for a person, each complete
};

/// Reads the scene's surfaces, cuts its bones and heeds collisions. Serial.
Anatomy load_anatomy(const scene::Scene& scene);

BuiltModel build_model(const Anatomy& anatomy);

/// Reads the scene's surfaces and builds.
BuiltModel build_model(const scene::Scene& scene);

/// N/mm²: of springs Σ k0 r_0² / Σ v_0, of a solid the mean of Young's modulus over its volume.
double effective_modulus(const Model& model);

/// κ (N/mm²) of the volume term where a scene of springs names none: what springs lack in bulk
/// modulus for Poisson's ratio `solve.poisson`, or that of the isotropic solid. Springs of modulus
/// Y in all directions have the shear modulus Y/15, so that ν = 0.45 makes 8/15 Y of the effective
/// modulus Y. An exact volume starts with 10 Y.
double default_bulk_modulus(const scene::Tissue& tissue, const scene::Solve& solve,
                            const Model& model);

/// The surfaces of a scene's bones at their initial position, named as in the scene.
struct Bones {
  std::vector<surface::Surface> surfaces;  ///< [scene.bones], pieces cut off, kerfs taken out
  std::vector<std::string> remarks;        ///< lines for a person: what was cut
};

/// Reads the files of the scene's bones and makes its osteotomies in their order. Throws
/// InputError naming the scene and the osteotomy where one cannot be made.
Bones read_bones(const scene::Scene& scene);

}  // namespace repose::model
