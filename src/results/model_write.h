#pragma once
#include "repose/base/hdf5.h"
#include "repose/model/model.h"
#include "repose/results/merged_bones.h"

namespace repose::results {

/// Writes format, version and /model, serially; and, where there are bone surfaces,
/// /model/bone_surfaces (points f64 [P,3], triangles i64 [T,3], bone i32 [T]), the same merged.
void write_model(const base::Hdf5File& file, const model::Model& model, const MergedBones& bones);

/// Enough bytes for write_model, descriptions included.
int64_t model_bytes(const model::Model& model, const MergedBones& bones);

}  // namespace repose::results
