#include "repose/linear/index_map.h"

#include <algorithm>

#include "repose/base/collective.h"

namespace repose::linear {

using base::check;

namespace {

/// [ranks] Colors that differ between neighbors, as few as a greedy coloring finds; `beside`
/// [ranks]: which are this rank's neighbors. Collective.
std::vector<int> color_ranks(MPI_Comm comm, const std::vector<char>& beside) {
  const size_t ranks = beside.size();
  std::vector<char> coupled(ranks * ranks);
  MPI_Allgather(beside.data(), static_cast<int>(ranks), MPI_CHAR, coupled.data(),
                static_cast<int>(ranks), MPI_CHAR, comm);
  std::vector<int> color;
  for (size_t r = 0; r < ranks; ++r) {
    std::vector<char> taken(ranks, 0);
    for (size_t s = 0; s < r; ++s)
      if (coupled[r * ranks + s] || coupled[s * ranks + r]) taken[color[s]] = 1;
    color.push_back(static_cast<int>(std::ranges::find(taken, 0) - taken.begin()));
  }
  return color;
}

}  // namespace

FloatsType::FloatsType(int count) {
  MPI_Type_contiguous(count, MPI_FLOAT, &type_);
  MPI_Type_commit(&type_);
}

IndexMap::IndexMap(MPI_Comm comm, int32_t own, std::vector<int64_t> ghost)
    : own_(own), ghost_(std::move(ghost)) {
  const int ranks = base::size(comm), rank = base::rank(comm);
  std::vector<int64_t> first(ranks + 1, 0);
  const int64_t mine = own;
  MPI_Allgather(&mine, 1, MPI_INT64_T, first.data() + 1, 1, MPI_INT64_T, comm);
  for (int r = 0; r < ranks; ++r) first[r + 1] += first[r];
  first_ = first[rank];
  total_ = first[ranks];
  if (ranks == 1) return;
  std::vector<PetscSFNode> roots;
  std::vector<char> beside(ranks, 0);
  for (const int64_t number : ghost_) {
    const auto owner = std::upper_bound(first.begin(), first.end(), number) - first.begin() - 1;
    roots.push_back({static_cast<PetscInt>(owner), static_cast<PetscInt>(number - first[owner])});
    beside[owner] = 1;
  }
  const std::vector<int> color = color_ranks(comm, beside);
  color_ = color[rank];
  colors_ = 1 + *std::ranges::max_element(color);
  check(PetscSFCreate(comm, forest_.out()));
  check(PetscSFSetGraph(forest_, own, ghosts(), nullptr, PETSC_OWN_POINTER, roots.data(),
                        PETSC_COPY_VALUES));
}

void IndexMap::share(const void* own_entries, void* ghost_entries, MPI_Datatype unit) const {
  if (!forest_) return;
  check(PetscSFBcastBegin(forest_, unit, own_entries, ghost_entries, MPI_REPLACE));
  check(PetscSFBcastEnd(forest_, unit, own_entries, ghost_entries, MPI_REPLACE));
}

}  // namespace repose::linear
