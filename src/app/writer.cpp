#include "writer.h"

#include "report.h"
#include "repose/adapt/discretization.h"
#include "repose/base/agreement.h"
#include "repose/base/collective.h"
#include "repose/discrete/natural_rows.h"
#include "repose/results/run_files.h"
#include "repose/solve/reaction.h"

namespace repose::app {

Writer::Writer(MPI_Comm comm, const std::filesystem::path& name, const Job& job,
               const Coarser& coarser, double interval, std::string unsettled)
    : comm_(comm),
      name_(name),
      job_(job),
      coarser_(coarser),
      unsettled_(std::move(unsettled)),
      file_(open("", results::Kind::result)),
      checkpoints_{interval} {}

results::ResultFile Writer::open(const std::string& ending, results::Kind kind) const {
  return results::ResultFile(comm_, name_.string() + ending, job_.local_model.global_metadata,
                             discrete::NaturalRows::of_model(comm_, job_.local_model), kind);
}

void Writer::operator()(model::StepNumbers numbers, model::StepRows rows) {
  if (numbers.load == 1 && coarser_.discretization_error)
    numbers.discretization_error = *coarser_.discretization_error;
  if (coarser_.compared) compare(numbers, rows);
  if (numbers.load == 1 && !unsettled_.empty()) {
    numbers.converged = false;
    numbers.reason += "; " + unsettled_;
  }
  file_.append(numbers, rows);
  begun_ = true;
  last_.numbers = numbers;
  last_.rows.position = rows.position;
  last_.rows.volume_ratio = rows.volume_ratio;
  last_.rows.point_fields = rows.point_fields;
  if (!makes_checkpoints() || !numbers.converged) return;
  checkpoints_.reached = {numbers, rows};
  checkpoints_.saved = false;
  if (due()) write_checkpoint(nullptr);
}

void Writer::keep(const std::filesystem::path& earlier, int64_t count) {
  file_.keep(earlier, count);
}

void Writer::on_iterate(double load, const solve::StateSnapshot& snapshot) {
  if (!begun_)
    snapshot(
        [&](const auto& numbers, const auto& rows) { file_.append_provisional(numbers, rows); });
  begun_ = true;
  if (!makes_checkpoints()) return;
  const bool news = !checkpoints_.saved || load == 1;
  if (checkpoints_.reached && news && due()) write_checkpoint(load == 1 ? snapshot : nullptr);
}

std::vector<Vec3> Writer::positions() const { return base::gather(comm_, last_.rows.position); }

std::vector<double> Writer::contact_pressures() const {
  for (const model::PointField& field : last_.rows.point_fields)
    if (field.name == "contact_pressure") return base::gather(comm_, field.values);
  return {};
}

std::string Writer::reactions() const {
  const auto forces =
      solve::reactions(comm_, job_.local_model.part, job_.held, last_.numbers, last_.rows.position);
  return forces.empty() ? "" : describe_reactions(job_.held, forces);
}

void Writer::compare(model::StepNumbers& numbers, model::StepRows& rows) {
  rows.discretization_error.assign(rows.position.size(), 0.0);
  if (numbers.load < 1) return;
  const std::vector<Vec3> position = base::gather(comm_, rows.position);
  std::vector<double> at_point;
  base::on_root(comm_, [&] {
    const auto found = adapt::discretization_of(position, *coarser_.compared);
    numbers.discretization_error = found.largest;
    comparison_ = adapt::describe_discretization(found);
    at_point = found.at_point;
  });
  rows.discretization_error = base::scatter(comm_, at_point);
}

bool Writer::due() const {
  bool due = MPI_Wtime() - checkpoints_.written > checkpoints_.interval;
  base::broadcast(comm_, due);
  return due;
}

/// The last rest position reached and, of a search at load 1, the state it is at: with both a run
/// can go on from there or, should that lead astray, along the path.
void Writer::write_checkpoint(const solve::StateSnapshot& snapshot) {
  results::ResultFile file = open(results::checkpoint_suffix, results::Kind::checkpoint);
  file.append(checkpoints_.reached->numbers, checkpoints_.reached->rows);
  if (snapshot && checkpoints_.reached->numbers.load < 1)
    snapshot([&](const auto& numbers, const auto& rows) { file.append(numbers, rows); });
  file.commit();
  checkpoints_.saved = true;
  checkpoints_.written = MPI_Wtime();
}

}  // namespace repose::app
