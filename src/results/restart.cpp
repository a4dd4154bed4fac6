#include "repose/results/restart.h"

#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/results/model_file.h"

namespace repose::results {

namespace {

struct Found {
  StoredStep step;
  bool guess = false;
};

Found find_step(const std::filesystem::path& file, const model::Model& model) {
  const int64_t count = step_count(file);
  Found found;
  for (int64_t step = count - 1; step >= 0 && !found.step.numbers.converged; --step)
    found.step = read_step(file, step, model);
  const bool none = !found.step.numbers.converged;
  if (count > 0 && (none || found.step.numbers.load == 0)) {
    StoredStep end = read_step(file, count - 1, model);
    if (end.numbers.load == 1) return {std::move(end), true};
  }
  if (none)
    base::refuse("{}: no converged step to go on from; start without -restart", file.string());
  return found;
}

void refuse_another_model(const std::filesystem::path& file, const model::Model& model) {
  if (read_model(file).points.position != model.points.position)
    base::refuse(
        "{}: -restart needs a result of the same model, but its points differ from the "
        "input's; give the scene or model it was made from",
        file.string());
}

}  // namespace

Restart read_restart(MPI_Comm comm, const std::filesystem::path& file, const model::Model& model) {
  Restart restart;
  std::vector<Vec3> all;
  base::on_first_rank(comm, [&] {
    refuse_another_model(file, model);
    Found found = find_step(file, model);
    restart.guess = found.guess;
    restart.load = found.guess ? 0 : found.step.numbers.load;
    all = std::move(found.step.rows.position);
  });
  MPI_Bcast(&restart.guess, 1, MPI_C_BOOL, 0, comm);
  MPI_Bcast(&restart.load, 1, MPI_DOUBLE, 0, comm);
  restart.position = base::scatter(comm, all);
  return restart;
}

}  // namespace repose::results
