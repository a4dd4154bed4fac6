#pragma once
#include <mpi.h>
#include <functional>
#include <string>
#include <vector>

#include "repose/base/geometry.h"

namespace repose::base {

int rank(MPI_Comm comm);
int size(MPI_Comm comm);

/// Runs `work` on every rank (or on rank 0 only) and agrees on the outcome: if it threw anywhere,
/// every rank throws the same error (that of the lowest rank, InputError or InternalError kept).
/// No rank is left waiting in a collective that another never reaches. Collective.
void collective_try(MPI_Comm comm, const std::function<void()>& work);
void on_root(MPI_Comm comm, const std::function<void()>& work);

/// Gives rank 0's text to all ranks. Collective.
void broadcast(MPI_Comm comm, std::string& text);

/// The part [begin, end) of n rows that a rank holds in natural order; sizes differ by at most one.
struct Slab {
  int64_t begin, end;
  int64_t rows() const { return end - begin; }
};
Slab slab(int64_t n, int rank, int size);

/// Rows that rank 0 holds, as a slab (base::slab) on every rank. Collective.
std::vector<Vec3> scatter(MPI_Comm comm, const std::vector<Vec3>& all);

}  // namespace repose::base
