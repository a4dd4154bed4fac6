#pragma once
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "repose/base/geometry.h"
#include "repose/scene/scene.h"

namespace repose::model {

using scene::Functional;
using scene::VolumeTerm;

/// The numbers of one load step, one attribute each in the result file (names as there).
struct StepNumbers {
  double load = 0;
  Functional functional = Functional::energy;
  VolumeTerm volume = VolumeTerm::none;
  double lambda = 0;
  double bulk_modulus = 0;
  double epsilon = 0;
  double f_e = 0, potential = 0, f_f = 0, f_v = 0, penalty = 0, objective = 0;
  double gradient_max = 0;
  double volume_error_max = 0;
  int64_t inverted_prisms = 0;
  double displacement_error = 0;
  int64_t iterations = 0, evaluations = 0;
  double seconds = 0;
  std::string reason;
  bool converged = false;
  /// Eigenvalue of the exact Hessian over the unknowns, N/mm; NaN, and no attribute, unless
  /// requested.
  double smallest_eigenvalue = std::numeric_limits<double>::quiet_NaN();
  double largest_eigenvalue = std::numeric_limits<double>::quiet_NaN();  ///< likewise
  /// mm, estimate for the skin of a model coarser than the scene requests; NaN for the scene's own.
  double discretization_error = std::numeric_limits<double>::quiet_NaN();
  /// mm, largest depth past what is touched, by the smoothed distances that the search uses; NaN
  /// without contact.
  double penetration = std::numeric_limits<double>::quiet_NaN();
  /// mm, largest depth of a point inside a rigid body's own triangles (or closed form), less its
  /// initial depth; NaN without contact with rigid bodies.
  double penetration_exact = std::numeric_limits<double>::quiet_NaN();
  /// N mm, what contact adds to the objective, which vanishes as multipliers become exact;
  /// likewise.
  double contact_energy = std::numeric_limits<double>::quiet_NaN();
};

/// A number of a step that a file may do without; it is NaN then.
inline bool is_optional(std::string_view name) {
  return name.ends_with("_eigenvalue") || name == "discretisation_error" || name == "penetration" ||
         name == "penetration_exact" || name == "contact_energy";
}

/// Calls visit(name, member) for every number of a step, in the order of the file.
template <class Numbers, class Visit>
void for_each_number(Numbers& numbers, Visit&& visit) {
  visit("load", numbers.load);
  visit("functional", numbers.functional);
  visit("volume", numbers.volume);
  visit("lambda", numbers.lambda);
  visit("bulk_modulus", numbers.bulk_modulus);
  visit("epsilon", numbers.epsilon);
  visit("f_e", numbers.f_e);
  visit("potential", numbers.potential);
  visit("f_f", numbers.f_f);
  visit("f_v", numbers.f_v);
  visit("penalty", numbers.penalty);
  visit("objective", numbers.objective);
  visit("gradient_max", numbers.gradient_max);
  visit("volume_error_max", numbers.volume_error_max);
  visit("inverted_prisms", numbers.inverted_prisms);
  visit("displacement_error", numbers.displacement_error);
  visit("iterations", numbers.iterations);
  visit("evaluations", numbers.evaluations);
  visit("seconds", numbers.seconds);
  visit("reason", numbers.reason);
  visit("converged", numbers.converged);
  visit("smallest_eigenvalue", numbers.smallest_eigenvalue);
  visit("largest_eigenvalue", numbers.largest_eigenvalue);
  visit("discretisation_error", numbers.discretization_error);
  visit("penetration", numbers.penetration);
  visit("penetration_exact", numbers.penetration_exact);
  visit("contact_energy", numbers.contact_energy);
}

/// A further number or vector of every point; its name is that of the dataset.
struct PointField {
  std::string name;            ///< with the unit's meaning in docs/reference/formats.md
  bool vector = false;         ///< [N,3], else [N]
  std::vector<double> values;  ///< row by row
  /// Attributes of the dataset: texts and flags.
  std::vector<std::pair<std::string, std::string>> texts = {};
  std::vector<std::pair<std::string, bool>> flags = {};
};

/// This rank's slab (base::slab of N, M, S rows) of each array of a step, in natural row order.
struct StepRows {
  std::vector<Vec3> position;        ///< mm
  std::vector<Vec3> residual_force;  ///< N
  std::vector<double> volume_ratio;
  /// N/mm², compression positive; of a solid, else empty.
  std::vector<double> pressure;
  std::vector<Vec3> stretch;      ///< principal stretches of a solid, largest first; else empty
  std::vector<double> von_mises;  ///< N/mm², of a solid; else empty
  /// mm, how far mesh and layers leave the skin from the continuum; empty where not estimated.
  std::vector<double> discretization_error = {};
  std::vector<double> elongation;  ///< mm
  std::vector<double> tension;     ///< N
  /// Further fields of the points at this step; the same names on all ranks.
  std::vector<PointField> point_fields = {};
};

}  // namespace repose::model
