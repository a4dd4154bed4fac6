#include "repose/base/agreement.h"

#include <climits>

#include "repose/base/error.h"

namespace repose::base {

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

void agree(MPI_Comm comm, Result mine) {
  int first = mine.outcome == fine ? INT_MAX : rank(comm);
  MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT, MPI_MIN, comm);
  if (first == INT_MAX) return;
  Message(comm, first)(mine.outcome, mine.text);
  if (mine.outcome == input_error) throw InputError(mine.text);
  throw InternalError(mine.text);
}

}  // namespace

void collective_try(MPI_Comm comm, const std::function<void()>& work) { agree(comm, run(work)); }

void on_root(MPI_Comm comm, const std::function<void()>& work) {
  agree(comm, rank(comm) == 0 ? run(work) : Result{});
}

}  // namespace repose::base
