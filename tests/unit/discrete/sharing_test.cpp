#include <gtest/gtest.h>

#include <set>

#include "../../layered_patch.h"
#include "discrete/countable.h"
#include "discrete/exchange.h"
#include "discrete/partition.h"
#include "gathered.h"
#include "repose/base/collective.h"
#include "repose/base/error.h"
#include "repose/discrete/model_rows.h"
#include "repose/discrete/natural_rows.h"
#include "repose/model/build.h"

namespace repose {
namespace sharing_test {

using test::layered_patch;

/// On rank 0 a patch of 20 columns, whose springs are out of order.
model::Model patch() {
  model::Model m = layered_patch({.columns_x = 5, .columns_y = 4});
  std::swap(m.springs.points.front(), m.springs.points.back());
  std::swap(m.springs.rest_length.front(), m.springs.rest_length.back());
  std::swap(m.springs.reference.front(), m.springs.reference.back());
  return m;
}

TEST(Sharing, AGraphHasEveryLinkOnce) {
  const std::set<std::array<int64_t, 2>> links = {{0, 1}, {0, 3}, {1, 0}, {1, 3}, {3, 0}, {3, 1}};
  const discrete::ColumnGraph graph = discrete::column_graph(5, [&](const auto& link) {
    for (int often = 0; often < 3; ++often)
      for (auto at = links.rbegin(); at != links.rend(); ++at) link((*at)[0], (*at)[1]);
  });
  EXPECT_EQ(graph.row_begin, (std::vector<int64_t>{0, 2, 4, 4, 6, 6}));
  EXPECT_EQ(graph.neighbor, (std::vector<int64_t>{1, 3, 0, 3, 0, 1}));
}

/// [n] rows of a rank that holds more the higher it is, and none where it is 1.
std::vector<int64_t> rows_held(int64_t n) {
  const int rank = base::rank(MPI_COMM_WORLD), ranks = base::size(MPI_COMM_WORLD);
  std::vector<int64_t> begin(ranks + 1, 0), rows;
  for (int r = 0; r < ranks; ++r) begin[r + 1] = begin[r] + (r == 1 ? 0 : n / ranks);
  begin[ranks] = n;
  for (int64_t row = begin[rank]; row < begin[rank + 1]; ++row) rows.push_back(row);
  return rows;
}

TEST(Sharing, RowsAreFetchedFromWhereTheyLie) {
  constexpr int64_t n = 200;
  const std::vector<int64_t> mine = rows_held(n);
  discrete::RowIndex index(n);
  for (int64_t row = base::rank(MPI_COMM_WORLD); row < n; row += 3) index.add(row), index.add(row);
  const std::vector<int64_t> rows = index.sort();
  ASSERT_EQ(rows.size(), (n - base::rank(MPI_COMM_WORLD) + 2) / 3);
  for (size_t k = 0; k < rows.size(); ++k) {
    EXPECT_EQ(rows[k], base::rank(MPI_COMM_WORLD) + 3 * static_cast<int64_t>(k));
    EXPECT_EQ(index.place(rows[k]), static_cast<int64_t>(k));
  }
  const discrete::Exchange fetch =
      discrete::Exchange::fetch(MPI_COMM_WORLD, rows, static_cast<int64_t>(mine.size()));
  EXPECT_EQ(fetch(mine), rows);
}

TEST(Sharing, RowsComeBackInTheModelsOrderHoweverFewAreCarriedAtOnce) {
  const model::Model m = patch();
  std::vector<Vec3> moved = m.points.position;
  for (size_t i = 0; i < moved.size(); ++i) moved[i].z() += 1e-3 * static_cast<double>(i);
  const discrete::Part part = discrete::build_local_from_root(MPI_COMM_WORLD, m).part;
  discrete::Positions positions(MPI_COMM_WORLD, part);
  discrete::Objective objective(positions, {});
  const base::VecHandle displacement = positions.make_vector();
  for (const int64_t at_once : {7, 1000000}) {
    const discrete::NaturalRows natural(MPI_COMM_WORLD, part, discrete::NaturalRows::Holders::slabs,
                                        at_once);
    natural.set_unknowns(base::scatter(MPI_COMM_WORLD, moved), positions, displacement);
    positions.update(displacement);
    const model::StepRows rows = natural.rows(objective);
    const std::vector<Vec3> position = testing::gather(rows.position);
    const std::vector<double> elongation = testing::gather(rows.elongation);
    for (size_t i = 0; i < position.size(); ++i)
      EXPECT_EQ(position[i],
                m.points.set[i] == model::PointSet::soft_tissue ? moved[i] : m.points.position[i])
          << i;
    for (size_t j = 0; j < elongation.size(); ++j) {
      const auto [p, q] = m.springs.points[j];
      EXPECT_NEAR(elongation[j], (position[q] - position[p]).norm() - m.springs.rest_length[j],
                  1e-14)
          << j;
    }
  }
}

/// A rank's slab of rows of a model, and on rank 0 all else.
model::Model slab_of(model::Model m) {
  const int rank = base::rank(MPI_COMM_WORLD), ranks = base::size(MPI_COMM_WORLD);
  const auto keep_slab = [&](const char*, auto& values) {
    const base::Slab slab = base::slab(static_cast<int64_t>(values.size()), rank, ranks);
    values = {values.begin() + slab.begin, values.begin() + slab.end};
  };
  model::Model rows;
  if (rank == 0) rows = m;
  rows.points = m.points, rows.springs = m.springs, rows.prisms = m.prisms, rows.edges = m.edges;
  model::for_each_array(rows.points, keep_slab);
  model::for_each_array(rows.springs, keep_slab);
  model::for_each_array(rows.prisms, keep_slab);
  model::for_each_array(rows.edges, keep_slab);
  return rows;
}

TEST(Sharing, ASlabOfAModelOnEachRankIsAcceptedOrRefusedLikeTheWhole) {
  model::Model m = patch();
  model::Model rows = slab_of(m);
  const std::vector<Vec3> held = rows.points.position;
  EXPECT_EQ(discrete::validate(MPI_COMM_WORLD, rows, "patch"), model::effective_modulus(m));
  EXPECT_EQ(rows.points.position, held);
  const auto ends = base::gather(MPI_COMM_WORLD, rows.springs.points);
  EXPECT_TRUE(base::rank(MPI_COMM_WORLD) > 0 || ends == m.springs.points);
  for (auto& set : m.points.set) set = model::PointSet::soft_tissue;
  rows = slab_of(m);
  EXPECT_THROW(discrete::validate(MPI_COMM_WORLD, rows, "patch"), base::InputError);
  m = patch();
  m.springs.points.back()[1] = static_cast<int64_t>(m.points.set.size());
  rows = slab_of(m);
  EXPECT_THROW(discrete::validate(MPI_COMM_WORLD, rows, "patch"), base::InputError);
}

TEST(Sharing, CountsCoordinatesBeyondTwoBillionOrRefuses) {
  constexpr PetscInt largest = 2147483647;
  EXPECT_NO_THROW(discrete::require_countable(715827882, largest));
  EXPECT_THROW(discrete::require_countable(715827883, largest), base::InputError);
  EXPECT_NO_THROW(discrete::require_addressable(238609294, largest));
  EXPECT_THROW(discrete::require_addressable(238609295, largest), base::InputError);
  constexpr int64_t many = 3'000'000'001;
  int64_t next = 0;
  for (int rank = 0; rank < 7; ++rank) {
    const base::Slab slab = base::slab(many, rank, 7);
    EXPECT_EQ(slab.begin, next);
    EXPECT_EQ(slab.rows(), rank < 5 ? 428571429 : 428571428);
    next = slab.end;
  }
  EXPECT_EQ(next, many);
}

TEST(Sharing, KeepsAMotionThatIsRecoveredFromThePoints) {
  model::Model m = patch();
  ASSERT_TRUE(m.bone_transform.empty());
  const Vec3 way(1, -3, 0.5);
  for (Vec3& target : m.points.target) target += way;
  const model::Model metadata =
      discrete::build_local_from_root(PETSC_COMM_WORLD, m).global_metadata;
  if (base::rank(PETSC_COMM_WORLD) > 0) return;
  ASSERT_EQ(metadata.bone_transform.size(), 1U);
  Mat4 expected = Mat4::Identity();
  expected.topRightCorner<3, 1>() = way;
  EXPECT_LT((metadata.bone_transform[0] - expected).norm(), 1e-12);
}

TEST(Sharing, GathersSlabsOfDifferentLengthsInOrder) {
  const int rank = base::rank(PETSC_COMM_WORLD), ranks = base::size(PETSC_COMM_WORLD);
  const std::vector<double> mine(rank, 10.0 + rank);  // none on rank 0
  const std::vector<double> all = base::gather(PETSC_COMM_WORLD, mine);
  std::vector<double> expected;
  for (int r = 0; r < ranks && rank == 0; ++r) expected.insert(expected.end(), r, 10.0 + r);
  EXPECT_EQ(all, expected);
}

}  // namespace sharing_test
}  // namespace repose
