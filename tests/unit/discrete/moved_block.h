#pragma once
#include <random>
#include <utility>

#include "models.h"
#include "repose/discrete/objective.h"
#include "repose/model/material.h"

namespace repose::testing {

/// Displacements (or directions) of the unknowns, random in [−size, size] but the same for every
/// distribution: each depends on the row of the point in the model.
inline base::VecHandle random_vector(const discrete::Positions& positions, unsigned seed,
                                     double size) {
  base::VecHandle v = positions.make_vector();
  const std::vector<int64_t>& row = positions.part().point_row;
  std::vector<Vec3> values(row.size());
  for (size_t i = 0; i < values.size(); ++i) {
    std::mt19937 random(seed + 1000003u * static_cast<unsigned>(row[i]));
    for (double& x : values[i]) x = size * (random() / 2147483648.0 - 1.0);
  }
  positions.restrict_to_owned(values, v);
  return v;
}

/// A block held on two sides and at its depth, with springs of the quartic law.
inline model::Model held_block() {
  return block(9, 8, 4, 2, [](int i, int j, int a) {
    return i == 0 || j == 7 || a == 3 ? model::PointSet::bone : model::PointSet::soft_tissue;
  });
}

/// The same as a solid of two materials whose volumes are averaged around points.
inline model::Model averaged_block() {
  model::Model m = held_block();
  m.springs = {};
  model::Prisms& prisms = m.prisms;
  for (size_t p = 0; p < prisms.points.size(); ++p) {
    const model::Moduli moduli = model::moduli({p % 5 < 2 ? 0.03 : 0.015, 0.49});
    prisms.shear_modulus.push_back(moduli.shear);
    prisms.modulus.push_back(moduli.volume);
    prisms.nodal_modulus.push_back(moduli.volume - moduli.shear);
    prisms.target_volume.push_back(prisms.rest_volume[p] * (1 + moduli.shear / moduli.volume));
  }
  model::assemble_edges("block", m);
  return m;
}

/// A model shared out over the ranks, by default a held block, whose unknowns can be moved.
struct MovedBlock {
  model::Model whole;
  discrete::Part part = discrete::build_local_from_root(MPI_COMM_WORLD, whole).part;
  discrete::Positions positions{MPI_COMM_WORLD, part};

  explicit MovedBlock(model::Model model = held_block()) : whole(std::move(model)) {}
  base::VecHandle vector(unsigned seed, double size) const {
    return random_vector(positions, seed, size);
  }
};

}  // namespace repose::testing
