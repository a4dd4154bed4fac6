#pragma once
#include "repose/base/collective.h"
#include "repose/base/petsc.h"
#include "repose/discrete/objective.h"
#include "repose/model/step.h"

namespace repose::discrete {

/// Brings each rank's values of its points, springs and prisms into the rows of the result file:
/// slabs (base::slab) in natural order, whatever the distribution; and back. All members
/// collective.
class NaturalRows {
 public:
  /// Ranks that get rows: each its slab, or rank 0 all.
  enum class Holders { slabs, root };

  /// `at_once` rows are carried at a time, in twice their memory.
  NaturalRows(MPI_Comm comm, const Part& part, Holders holders = Holders::slabs,
              int64_t at_once = int64_t{1} << 20);

  /// The arrays of a step at the objective's last update.
  model::StepRows rows(Objective& objective) const;

  /// The arrays of a local model in its present state.
  static model::ModelRows of_model(MPI_Comm comm, const LocalModel& local_model,
                                   Holders holders = Holders::slabs);

  /// This rank's slab of values [at least owned points] at the points, in natural order.
  std::vector<Vec3> natural(std::span<const Vec3> values) const;
  /// Returns values in natural order as a field of the result.
  model::PointField field(const std::string& name, std::span<const Vec3> values) const;
  /// [owned points] the values of this rank's points, of which `slab` has this rank's natural rows.
  std::vector<Vec3> owned(const std::vector<Vec3>& slab) const;
  std::vector<double> owned(const std::vector<double>& slab) const;
  /// Returns values at any rows of the whole model's `total`, of which `slab` has this rank's.
  std::vector<double> at_rows(const std::vector<int64_t>& rows, int64_t total,
                              const std::vector<double>& slab) const;
  /// Sets the unknowns to the displacements that take the initial positions to those of `slab`, mm.
  void set_unknowns(const std::vector<Vec3>& slab, const Positions& positions,
                    Vec displacement) const;

 private:
  struct Rows {
    std::span<const int64_t> row;  // natural rows of what this rank owns
    int64_t total;
  };
  /// Rows of `total` that a rank gets.
  base::Slab slab(int64_t total, int rank) const;
  /// Calls work(places) for chunks of rows: of each rank places of those that lie in its slab.
  template <class Work>
  void for_each_chunk(const Rows& rows, const Work& work) const;
  /// Brings the first of `owned`, as many as there are rows, to the slabs.
  template <class Value>
  std::vector<Value> to_slab(const Rows& rows, std::span<const Value> owned) const;
  template <class Value>
  std::vector<Value> from_slab(const Rows& rows, const std::vector<Value>& slab) const;
  void add_springs(std::span<const Vec3> position, model::StepRows& rows) const;
  void add_stress(std::span<const Vec3> position, model::StepRows& rows) const;
  void add_contact(Objective& objective, model::StepRows& rows) const;
  void add_prisms(std::span<const Vec3> position, model::StepRows& rows) const;

  MPI_Comm comm_;
  const Part& part_;
  Holders holders_;
  int64_t at_once_;
  Rows points_, springs_, prisms_;
};

/// Returns the whole model on rank 0, for what is no matter of columns; of the other ranks nothing
/// but the metadata. Collective.
model::Model gather_model(MPI_Comm comm, const LocalModel& local_model);

}  // namespace repose::discrete
