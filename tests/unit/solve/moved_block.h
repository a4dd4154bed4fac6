#pragma once
#include <random>
#include <utility>

#include "models.h"
#include "repose/discrete/objective.h"

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
  positions.keep_owned(values, v);
  return v;
}

/// A block held on two sides and at its depth, with springs of the quartic law.
inline model::Model held_block() {
  return block(9, 8, 4, 2, [](int i, int j, int a) {
    return i == 0 || j == 7 || a == 3 ? model::PointSet::bone : model::PointSet::soft_tissue;
  });
}

/// A model shared out over the ranks, by default a held block, whose unknowns can be moved.
struct MovedBlock {
  model::Model whole;
  discrete::Part part = discrete::distribute(MPI_COMM_WORLD, whole);
  discrete::Positions positions{MPI_COMM_WORLD, part};

  explicit MovedBlock(model::Model model = held_block()) : whole(std::move(model)) {}
  base::VecHandle vector(unsigned seed, double size) const {
    return random_vector(positions, seed, size);
  }
};

}  // namespace repose::testing
