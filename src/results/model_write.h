#pragma once
#include <functional>

#include "repose/base/hdf5.h"
#include "repose/model/model.h"
#include "repose/results/merged_bones.h"

namespace repose::results {

/// Writes format, version and what of /model is neither points nor elements, serially; and, where
/// there are bone surfaces, /model/bone_surfaces (points f64 [P,3], triangles i64 [T,3], bone i32
/// [T]), the same merged. Creates the arrays of points and elements that the first of the slabs
/// has, for fill_model().
void write_model(hid_t file, const model::Model& model, const model::ModelRows& slabs,
                 const MergedBones& bones);

/// Work on a file that all ranks do, and all fail if one does.
using OnDisk = std::function<void(const std::function<void()>&)>;

/// Returns the numbers of a body's shape, model::shape_numbers of them; zeros for a bone, which has
/// its surface.
std::vector<double> shape_row(const model::Body& body);

/// Writes every rank's slabs. Collective; `file` is open on all ranks.
void fill_model(MPI_Comm comm, hid_t file, const model::ModelRows& slabs, const OnDisk& on_disk);

/// Enough bytes for write_model, descriptions included.
int64_t model_bytes(const model::Model& model, const model::ModelRows& slabs,
                    const MergedBones& bones);

}  // namespace repose::results
