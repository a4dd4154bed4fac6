#pragma once
#include <petscsf.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "repose/base/petsc.h"

namespace repose::linear {

/// `count` floats, or as many bytes of anything, as one thing to send.
class FloatsType {
 public:
  explicit FloatsType(int count);
  ~FloatsType() { MPI_Type_free(&type_); }
  FloatsType(FloatsType&&) = delete;
  operator MPI_Datatype() const { return type_; }

 private:
  MPI_Datatype type_;
};

/// Numbers of points that are distributed over ranks. Local numbers are those of this rank's
/// points, then of ghosts, which other ranks own; global numbers are those of own points, rank
/// after rank.
class IndexMap {
 public:
  /// `ghost`: global numbers of the ghosts, ascending. Collective.
  IndexMap(MPI_Comm comm, int32_t own, std::vector<int64_t> ghost);

  int32_t own() const { return own_; }
  int32_t ghosts() const { return static_cast<int32_t>(ghost_.size()); }
  int64_t first() const { return first_; }  ///< global number of this rank's first point
  int64_t total() const { return total_; }  ///< points of all ranks
  int64_t global(int32_t local) const {
    return local < own_ ? first_ + local : ghost_[local - own_];
  }
  /// Returns the local number of an own point or a ghost.
  int32_t local(int64_t global) const {
    const int64_t before = global - first_;
    if (before >= 0 && before < own_) return static_cast<int32_t>(before);
    return own_ + static_cast<int32_t>(std::ranges::lower_bound(ghost_, global) - ghost_.begin());
  }
  /// Returns this rank's number in a coloring of the ranks: those with ghosts of one another
  /// differ.
  int color() const { return color_; }
  int colors() const { return colors_; }
  /// Sends each own entry to the ranks where it is a ghost; entries of type `unit`. Collective.
  void share(const void* own_entries, void* ghost_entries, MPI_Datatype unit) const;

 private:
  int32_t own_;
  std::vector<int64_t> ghost_;
  int64_t first_ = 0, total_ = 0;
  int color_ = 0, colors_ = 1;
  base::Handle<PetscSF, PetscSFDestroy> forest_;
};

}  // namespace repose::linear
