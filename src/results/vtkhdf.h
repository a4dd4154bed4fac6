#pragma once
#include <hdf5.h>

#include <cstdint>
#include <vector>

#include "xdmf.h"

namespace repose::results {

/// Adds the group /VTKHDF to an open result file of one process: the blocks as the parts of one
/// UnstructuredGrid with a time step a load, which VTK ≥ 9.3 and ParaView ≥ 5.12 open from the file
/// itself. Nothing of the steps or the model is stored twice: points and arrays are virtual
/// datasets over /step/NNNN and /model; new are what the format needs besides, offsets and types
/// of the cells. Arrays are matched by name; where a part or a step has none of an array it is NaN,
/// −1 of integers. Needs a load, a block and a cell in each. Throws Hdf5Error.
void write_vtkhdf(hid_t file, const std::vector<XdmfBlock>& blocks,
                  const std::vector<double>& loads);

/// At most so many bytes it adds to the file.
int64_t vtkhdf_bytes(const std::vector<XdmfBlock>& blocks, size_t steps);

}  // namespace repose::results
