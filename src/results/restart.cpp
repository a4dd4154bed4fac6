#include "repose/results/restart.h"

#include "repose/base/agreement.h"
#include "repose/base/deal_out.h"
#include "repose/base/error.h"
#include "repose/results/model_file.h"

namespace repose::results {

namespace {

StoredStep last_converged_step(const std::filesystem::path& file, const model::Model& model) {
  for (int64_t step = step_count(file) - 1; step >= 0; --step) {
    StoredStep stored = read_step(file, step, model);
    if (stored.numbers.converged) return stored;
  }
  base::refuse("{}: no converged step to go on from; start without -restart", file.string());
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
    StoredStep stored = last_converged_step(file, model);
    restart.load = stored.numbers.load;
    all = std::move(stored.rows.position);
  });
  MPI_Bcast(&restart.load, 1, MPI_DOUBLE, 0, comm);
  restart.position = base::deal_out(comm, all);
  return restart;
}

}  // namespace repose::results
