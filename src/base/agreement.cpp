#include "repose/base/agreement.h"

#include <algorithm>
#include <climits>
#include <vector>

#include "repose/base/error.h"

namespace repose::base {

int rank(MPI_Comm comm) {
  int r = 0;
  MPI_Comm_rank(comm, &r);
  return r;
}

int size(MPI_Comm comm) {
  int s = 1;
  MPI_Comm_size(comm, &s);
  return s;
}

namespace {

enum Outcome { fine = 0, input_error = 1, internal_error = 2 };

struct Result {
  Outcome outcome = fine;
  std::string text;
};

Result run(const std::function<void()>& work) {
  try {
    work();
    return {};
  } catch (const InputError& e) {
    return {input_error, e.what()};
  } catch (const std::bad_alloc&) {
    return {internal_error, "out of memory"};
  } catch (const std::exception& e) {
    return {internal_error, e.what()};
  }
}

void agree(MPI_Comm comm, const Result& mine) {
  int failing = mine.outcome == fine ? INT_MAX : rank(comm);
  int first = INT_MAX;
  MPI_Allreduce(&failing, &first, 1, MPI_INT, MPI_MIN, comm);
  if (first == INT_MAX) return;
  int header[2] = {mine.outcome, static_cast<int>(mine.text.size())};
  MPI_Bcast(header, 2, MPI_INT, first, comm);
  std::vector<char> text(mine.text.begin(), mine.text.end());
  text.resize(header[1]);
  MPI_Bcast(text.data(), header[1], MPI_CHAR, first, comm);
  const std::string message(text.begin(), text.end());
  if (header[0] == input_error) throw InputError(message);
  throw InternalError(message);
}

}  // namespace

void collective_try(MPI_Comm comm, const std::function<void()>& work) { agree(comm, run(work)); }

void on_root(MPI_Comm comm, const std::function<void()>& work) {
  agree(comm, rank(comm) == 0 ? run(work) : Result{});
}

void broadcast(MPI_Comm comm, std::string& text) {
  int length = static_cast<int>(text.size());
  MPI_Bcast(&length, 1, MPI_INT, 0, comm);
  text.resize(length);
  MPI_Bcast(text.data(), length, MPI_CHAR, 0, comm);
}

Slab slab(int64_t n, int rank, int size) {
  const int64_t share = n / size, extra = n % size;
  const int64_t begin = rank * share + std::min<int64_t>(rank, extra);
  return {begin, begin + share + (rank < extra ? 1 : 0)};
}

// One message each, of whole points: bytes and coordinates may be too many for an int.
std::vector<Vec3> scatter(MPI_Comm comm, const std::vector<Vec3>& all) {
  const int ranks = size(comm), rank = base::rank(comm);
  int64_t total = static_cast<int64_t>(all.size());
  MPI_Bcast(&total, 1, MPI_INT64_T, 0, comm);
  const Slab mine = slab(total, rank, ranks);
  MPI_Datatype point;
  MPI_Type_contiguous(3, MPI_DOUBLE, &point);
  MPI_Type_commit(&point);
  std::vector<Vec3> rows(mine.rows());
  if (rank == 0) {
    std::copy_n(all.begin(), mine.rows(), rows.begin());
    for (int to = 1; to < ranks; ++to) {
      const Slab theirs = slab(total, to, ranks);
      MPI_Send(all.data() + theirs.begin, static_cast<int>(theirs.rows()), point, to, 0, comm);
    }
  } else {
    MPI_Recv(rows.data(), static_cast<int>(mine.rows()), point, 0, 0, comm, MPI_STATUS_IGNORE);
  }
  MPI_Type_free(&point);
  return rows;
}

}  // namespace repose::base
