#pragma once
#include <hdf5.h>

#include <cstdint>
#include <vector>

#include "repose/results/xdmf.h"

namespace repose::results {

/// Adds the group /VTKHDF to an open result file of one process: the block as an UnstructuredGrid
/// with one time step a load, which VTK ≥ 9.3 and ParaView ≥ 5.12 open from the file itself.
/// Nothing of the steps or the model is stored twice: what moves are virtual datasets over
/// /step/NNNN, what stays are links; new are what the format asks for besides, offsets and types of
/// the cells. Needs a load and a cell. Throws Hdf5Error.
void write_vtkhdf(hid_t file, const XdmfBlock& block, const std::vector<double>& loads);

/// At most so many bytes it adds to the file.
int64_t vtkhdf_bytes(const XdmfBlock& block, size_t steps);

}  // namespace repose::results
