#pragma once
#include <petscksp.h>

#include <cstdint>
#include <vector>

namespace repose::solve {

/// Multigrid for layered tissue: aggregates of neighbouring points of the same layer become points
/// of a coarser tissue with as many layers (semicoarsening along the skin), again and again, and
/// smoothed aggregation (Vaněk, Mandel & Brezina 1996) carries translations between the levels.
///
/// Makes `pc` (PCMG) have these levels below the symmetric positive definite `fine` (MATAIJ of 3×3
/// blocks); `layer` of each block row of this rank. Their matrices are PETSc's Galerkin products,
/// their smoothers PETSc's, under the options prefix mg_levels_. Collective.
void make_hierarchy(PC pc, Mat fine, std::vector<int32_t> layer);

}  // namespace repose::solve
