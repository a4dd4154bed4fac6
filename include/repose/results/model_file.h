#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "repose/model/model.h"
#include "repose/model/step.h"

namespace repose::results {

/// Reads /model of a model or result file, serially, and validates it. Refuses by name (InputError:
/// file, dataset, row, value, remedy) everything the format lists: a missing or misshapen dataset,
/// a lossy type, an index out of range, a value that is not finite, an unknown version, truncation.
/// Numeric types that convert without loss are taken, and strings of variable length. What may be
/// missing: point/mass and point/external_force (zero), the group prism, skin/points, bone,
/// bone_surface and bone_transform (none).
model::Model read_model(const std::filesystem::path& file);
/// Reads the slabs (base::slab) of points, springs, prisms and edges of one of `ranks`, and all
/// else on rank 0, without validation. InputError as read_model, whose rows count from the slab's
/// first. Not collective.
model::Model read_model_rows(const std::filesystem::path& file, int rank, int ranks);

/// One whole step of a result file, serially.
struct StoredStep {
  model::StepNumbers numbers;
  model::StepRows rows;            ///< all rows
  std::vector<Vec3> displacement;  ///< [N] mm
  std::vector<double> advance;     ///< [N] mm, along the skin's outward normal; empty: no skin
  std::vector<Vec3> bone_points;   ///< mm, of all bone surfaces in turn; empty: none, or not moved
  std::vector<Vec3> bone_displacement;  ///< mm, of the same points; empty: none
};

/// Returns whether a file is a checkpoint of a run that continued.
bool is_checkpoint(const std::filesystem::path& file);

/// Returns the number of steps of a file; 0 for a model. InputError where /step/0000 … are not in
/// sequence.
int64_t step_count(const std::filesystem::path& file);
/// Bulk modulus κ of the penalty (N/mm²) in the last step of a file; nothing where it has none.
std::optional<double> last_bulk_modulus(const std::filesystem::path& file);
/// The attributes of a step; InputError as read_model.
model::StepNumbers read_numbers(const std::filesystem::path& file, int64_t step);
/// Step number `step` (from 0) of a file with `model`; InputError as read_model.
StoredStep read_step(const std::filesystem::path& file, int64_t step, const model::Model& model);

}  // namespace repose::results
