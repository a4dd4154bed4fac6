#include "repose/results/restart.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "model_write.h"
#include "repose/base/agreement.h"
#include "repose/base/error.h"
#include "repose/results/model_file.h"
#include "repose/results/result_file.h"

namespace repose::results {

namespace {

struct Found {
  StoredStep step;
  bool guess = false;
  int64_t row = 0;  // of the step in the file
};

bool is_rest(const model::StepNumbers& numbers) {
  return numbers.converged || numbers.reason == stopped_at_rest;
}

Found find_step(const std::filesystem::path& file, const model::Model& model) {
  const int64_t count = step_count(file);
  if (count == 0) base::refuse("{}: no step to resume from; start without -restart", file.string());
  Found found;
  for (int64_t step = count - 1; step >= 0 && !is_rest(found.step.numbers); --step) {
    found.step = read_step(file, step, model);
    found.row = step;
  }
  if (is_rest(found.step.numbers) && found.step.numbers.load > 0) return found;
  StoredStep end = read_step(file, count - 1, model);
  if (end.numbers.load == 1) return {std::move(end), true, 0};
  found.row = 0;
  found.step.numbers.load = 0;
  return found;
}

void refuse_another_model(const std::filesystem::path& file, const model::Model& stored,
                          const model::Model& model) {
  const auto refuse = [&](const char* what) {
    base::refuse(
        "{}: -restart needs a result of the same model, but its {} differ from the input's; give "
        "the scene or model it was made from",
        file.string(), what);
  };
  if (stored.points.position != model.points.position) refuse("points");
  if (stored.springs.points.size() != model.springs.points.size()) refuse("springs");
  if (stored.prisms.points.size() != model.prisms.points.size()) refuse("prisms");
}

/// The numbers of arrays, one list an array, with its name in /model of the file.
class Numbers {
 public:
  template <class Row>
  void add(const std::string& array, const std::vector<Row>& rows) {
    std::vector<double>& list = lists_.emplace_back(array, std::vector<double>()).second;
    for (const Row& row : rows)
      if constexpr (std::is_arithmetic_v<Row> || std::is_enum_v<Row>)
        list.push_back(static_cast<double>(row));
      else
        list.insert(list.end(), row.data(), row.data() + row.size());
  }
  template <class Arrays>
  void add_group(const std::string& name, const Arrays& arrays) {
    model::for_each_array(arrays, [&](const char* array, const auto& rows) {
      add(fmt::format("{}/{}", name, array), rows);
    });
  }
  /// Returns the first array that differs by more than rounding, with which an initial equilibrium
  /// depends on the ranks; empty where there is none.
  std::string first_difference(const Numbers& other) const {
    const auto [here, there] = std::ranges::mismatch(lists_, other.lists_, are_close);
    if (here != lists_.end()) return here->first;
    return there != other.lists_.end() ? there->first : "";
  }

 private:
  using List = std::pair<std::string, std::vector<double>>;
  static bool are_close(const List& one, const List& other) {
    constexpr double rounding = 1e-9;
    double largest = 0;
    for (const double number : one.second) largest = std::max(largest, std::abs(number));
    return one.first == other.first &&
           std::ranges::equal(one.second, other.second, [&](double a, double b) {
             return std::abs(a - b) <= rounding * largest;
           });
  }
  std::vector<List> lists_;
};

void add_contact(const model::Contact& contact, Numbers& numbers) {
  numbers.add_group("contact", contact.pairs);
  numbers.add("contact", std::vector{contact.stiffness, contact.spacing});
  numbers.add_group("contact/wall", contact.cut_faces);
  for (const model::Body& body : contact.bodies) {
    numbers.add("body_push", std::vector{body.push});
    numbers.add("body_shape", shape_row(body));
    const auto* mesh = std::get_if<surface::Surface>(&body.shape);
    if (body.bone < 0 && mesh) numbers.add("body mesh", mesh->points);
  }
}

Numbers numbers_of(const model::Model& m) {
  Numbers numbers;
  numbers.add("gravity", std::vector{m.gravity});
  numbers.add_group("point", m.points);
  numbers.add_group("prism", m.prisms);
  numbers.add_group("edge", m.edges);
  numbers.add("bone_transform", m.bone_transform);
  if (!m.contact.empty()) add_contact(m.contact, numbers);
  numbers.add_group("spring", m.springs);
  for (const model::TermElements& elements : m.elements) {
    numbers.add(elements.term + "/points", elements.points);
    numbers.add(elements.term + "/numbers", elements.numbers);
  }
  return numbers;
}

}  // namespace

Restart read_restart(MPI_Comm comm, const std::filesystem::path& file, const model::Model& model) {
  Restart restart;
  std::vector<Vec3> all;
  std::vector<double> pressures;
  base::on_root(comm, [&] {
    const model::Model stored = read_model(file);
    refuse_another_model(file, stored, model);
    Found found = find_step(file, model);
    restart.guess = found.guess;
    restart.load = found.guess ? 0 : found.step.numbers.load;
    restart.differing = numbers_of(stored).first_difference(numbers_of(model));
    const bool same = !is_checkpoint(file) && restart.differing.empty();
    if (same) restart.kept = found.row;
    const bool last = found.row + 1 == step_count(file);
    if (same && last && restart.load == 1) restart.end = found.step.numbers;
    all = std::move(found.step.rows.position);
    pressures.assign(all.size(), 0.0);
    for (model::PointField& field : found.step.rows.point_fields)
      if (field.name == "contact_pressure") pressures = std::move(field.values);
  });
  base::broadcast(comm, restart.guess, restart.load, restart.kept);
  restart.position = base::scatter(comm, all);
  restart.pressure = base::scatter(comm, pressures);
  return restart;
}

}  // namespace repose::results
