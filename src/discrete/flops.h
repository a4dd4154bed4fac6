#pragma once
#include "repose/mechanics/loops.h"

namespace repose::discrete {

/// Floating-point operations of one spring, edge and prism, counted in the formulas.
struct ElementFlops {
  double spring, edge, prism;
};
inline constexpr ElementFlops gradient_flops{32, 20, 250};  ///< energy and gradient
inline constexpr ElementFlops action_flops{46, 12, 450};    ///< the Hessian times a vector

/// Returns the operations for all elements of a rank.
inline double flops_of(const mechanics::Loops& loops, const ElementFlops& each) {
  double flops = each.edge * static_cast<double>(loops.edges.size()) +
                 each.prism * static_cast<double>(loops.prisms.size());
  for (const mechanics::SpringLoop& loop : loops.springs)
    flops += each.spring * static_cast<double>(loop.size());
  return flops;
}

}  // namespace repose::discrete
