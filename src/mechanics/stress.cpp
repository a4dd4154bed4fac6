#include "repose/mechanics/stress.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

#include "repose/model/material.h"

namespace repose::mechanics {

PrismState prism_state(double shear, double volume_slope, const std::array<Vec3, 6>& before,
                       const std::array<Vec3, 6>& now) {
  const Mat3 f = model::deformation_gradient(before, now);
  const Eigen::SelfAdjointEigenSolver<Mat3> squares(f.transpose() * f, Eigen::EigenvaluesOnly);
  PrismState state;
  state.stretch = squares.eigenvalues().cwiseMax(0).cwiseSqrt().reverse();
  const Vec3 along = shear / f.determinant() * state.stretch.cwiseAbs2();
  state.pressure = -along.mean() - volume_slope;
  const Vec3 apart = along.array() - along.mean();
  state.von_mises = std::sqrt(1.5) * apart.norm();
  return state;
}

}  // namespace repose::mechanics
