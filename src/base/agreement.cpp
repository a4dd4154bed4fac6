#include "repose/base/agreement.h"

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

struct Told {
  Outcome outcome = fine;
  std::string text;
};

Told run(const std::function<void()>& work) {
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

void agree(MPI_Comm comm, const Told& mine) {
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

void together(MPI_Comm comm, const std::function<void()>& work) { agree(comm, run(work)); }

void on_first_rank(MPI_Comm comm, const std::function<void()>& work) {
  agree(comm, rank(comm) == 0 ? run(work) : Told{});
}

void share(MPI_Comm comm, std::string& text) {
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

}  // namespace repose::base
