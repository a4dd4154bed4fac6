/// One method of the contest of docs/measurements/minimizers.md, which tests/benchmark/contest.py
/// runs:
///     benchmark_contest RESULT.h5 METHOD [-scene SCENE.yaml] [-accuracy 0.01] [-count]
/// Takes model, volume term and rest position from a result of repose-solve, starts from the
/// initial positions and stops at the first evaluated state that is as near to the rest position as
/// asked for. One line of JSON for each entry. With -scene the default may solve coarser models
/// first, as repose-solve does. Serial.
#include <cstdio>
#include <functional>
#include <map>

#include "paper/contest.h"
#include "paper/motion_methods.h"
#include "paper/polak_ribiere.h"
#include "repose/base/options.h"
#include "repose/base/program.h"
#include "repose/results/model_file.h"
#include "repose/scene/scene.h"

#ifdef REPOSE_LIBLBFGS
#include <lbfgs.h>
#endif

namespace {

using namespace repose;
using base::check, base::OptionKind;
using paper::Contest, paper::Entry;

const MPI_Comm comm = MPI_COMM_SELF;

/// Counts the values taken without a gradient.
class Counter : public discrete::Function {
 public:
  explicit Counter(discrete::Function& inner) : Function(inner.positions()), inner_(inner) {}
  int64_t values() const { return values_; }

 private:
  double value_and_gradient(Vec displacement, Vec gradient) override {
    if (!gradient) ++values_;
    return inner_.evaluate(displacement, gradient);
  }
  discrete::Function& inner_;
  int64_t values_ = 0;
};

#ifdef REPOSE_LIBLBFGS
/// liblbfgs with its own defaults (m = 6, Moré and Thuente's line search), its stopping tests off.
class Liblbfgs {
 public:
  explicit Liblbfgs(discrete::Function& function)
      : function_(function),
        at_(function.positions().make_vector()),
        gradient_(function.positions().make_vector()) {}

  void minimize(Vec displacement) {
    PetscInt size = 0;
    check(VecGetSize(displacement, &size));
    std::vector<double> x(size);
    copy(displacement, x.data());
    lbfgs_parameter_t settings;
    lbfgs_parameter_init(&settings);
    settings.epsilon = 0;
    lbfgs(size, x.data(), nullptr, evaluate, progress, this, &settings);
    if (thrown_) std::rethrow_exception(thrown_);
    copy(x.data(), displacement);
  }

 private:
  static void copy(Vec from, double* to) {
    const PetscScalar* values = nullptr;
    PetscInt size = 0;
    check(VecGetSize(from, &size));
    check(VecGetArrayRead(from, &values));
    std::copy(values, values + size, to);
    check(VecRestoreArrayRead(from, &values));
  }
  static void copy(const double* from, Vec to) {
    PetscScalar* values = nullptr;
    PetscInt size = 0;
    check(VecGetSize(to, &size));
    check(VecGetArrayWrite(to, &values));
    std::copy(from, from + size, values);
    check(VecRestoreArrayWrite(to, &values));
  }
  /// Nothing is thrown through C: the gradient is zero then, which ends the line search, and
  /// progress() ends the rest.
  static double evaluate(void* me, const double* x, double* gradient, int size, double) {
    auto* self = static_cast<Liblbfgs*>(me);
    try {
      copy(x, self->at_);
      const double value = self->function_.evaluate(self->at_, self->gradient_);
      copy(self->gradient_, gradient);
      return value;
    } catch (...) {
      self->thrown_ = std::current_exception();
      std::fill(gradient, gradient + size, 0.0);
      return -1e300;
    }
  }
  static int progress(void* me, const double*, const double*, double, double, double, double, int,
                      int, int) {
    return static_cast<Liblbfgs*>(me)->thrown_ ? 1 : 0;
  }

  discrete::Function& function_;
  base::VecHandle at_, gradient_;
  std::exception_ptr thrown_;
};
#endif

/// A result file's model, what was minimized and where it came to rest.
struct Task {
  model::Model model;
  mechanics::Weights weights;
  std::vector<Vec3> rest;  // [N] mm
};

Task read_task(const std::string& file) {
  Task task;
  task.model = results::read_model(file);
  const int64_t steps = results::step_count(file);
  if (steps == 0) base::refuse("{}: /step holds no step; solve the model first", file);
  results::StoredStep last = results::read_step(file, steps - 1, task.model);
  const model::StepNumbers& numbers = last.numbers;
  using model::VolumeTerm;
  if (numbers.functional != model::Functional::energy)
    base::refuse(
        "{}: functional {}, volume {}: the contest takes an energy with volume none, paper, "
        "penalty or material",
        file, word(numbers.functional), word(numbers.volume));
  task.weights = {numbers.lambda, numbers.volume, 1};
  if (numbers.volume == VolumeTerm::penalty) task.weights.volume_weight = numbers.bulk_modulus;
  if (numbers.volume == VolumeTerm::paper) task.weights.volume_weight = 1 - numbers.lambda;
  task.rest = std::move(last.rows.position);
  return task;
}

/// An entry with what only some methods have.
struct Line {
  Entry entry;
  int64_t values = 0;  // of the evaluations, those without gradient
};

void print(const Line& line) {
  static const char* const ends[] = {"reached", "own_minimum", "limit", "elsewhere"};
  const Entry& e = line.entry;
  std::printf(
      "%s\n",
      fmt::format("{{\"method\": \"{}\", \"end\": \"{}\", \"evaluations\": {}, \"values\": {}, "
                  "\"assemblies\": {}, \"renewals\": {}, \"actions\": {}, "
                  "\"applications\": {}, \"seconds\": {}, \"distance\": {}, "
                  "\"excess\": {}}}",
                  e.method, ends[static_cast<size_t>(e.end)], e.evaluations, line.values,
                  e.assemblies, e.renewals, e.actions, e.applications, e.seconds, e.distance,
                  e.excess)
          .c_str());
}

class Runner {
 public:
  Runner(const base::Options& options, const Task& task)
      : options_(options), task_(task), contest_(task.model, task.weights, false, rules()) {
    contest_.set_reference(contest_.displacement_to(task.rest));
  }

  void run(const std::string& method) {
    if (method == "default" || method == "default_end") return run_default(method);
    if (method == "stiffness" || method == "stiffness_step") return run_stiffness(method);
    if (method == "polak_ribiere") return run_polak_ribiere();
    if (method == "motion") return run_motion();
    if (method == "liblbfgs") return run_liblbfgs();
    Line line{contest_.run_tao(method)};
    line.entry.method = method;
    print(line);
  }

 private:
  paper::Rules rules() const {
    const double seconds = options_.number("seconds");
    return {.accuracy = options_.number("accuracy"),
            .limit = options_.integer("limit"),
            .path_seconds = seconds,
            .seconds = seconds};
  }

  /// As repose-solve does it, until the rest position is near or, `default_end`, until it says so.
  void run_default(const std::string& method) {
    Line line;
    if (method != "default_end") {
      line.entry = contest_.run_path();
    } else {
      const base::VecHandle rest = contest_.copy_of_reference();
      line.entry = contest_.follow_path();
      line.entry.distance = contest_.distance(rest);
    }
    line.entry.method = method;
    print(line);
  }

  /// The same with L-BFGS from the stiffness, with its load steps or in one predicted step.
  void run_stiffness(const std::string& method) {
    const base::ScopedOption type("-tao_type", "lmvm"), initial("-tao_lmvm_initial", "stiffness");
    if (method == "stiffness") return run_default(method);
    Line line{contest_.run_path(1)};
    line.entry.method = method;
    print(line);
  }

  void run_polak_ribiere() {
    Line line;
    line.entry = contest_.run("polak_ribiere", [&](discrete::Function& function, Vec displacement) {
      Counter counter(function);
      try {
        paper::polak_ribiere(counter, displacement);
      } catch (...) {
        line.values = counter.values();
        throw;
      }
    });
    print(line);
  }

  void run_motion() {
    for (const Entry& entry : paper::run_motion(contest_, options_.number("accuracy")))
      print({entry});
  }

  void run_liblbfgs() {
#ifdef REPOSE_LIBLBFGS
    print({contest_.run("liblbfgs", [](discrete::Function& function, Vec displacement) {
      Liblbfgs(function).minimize(displacement);
    })});
#else
    base::refuse("liblbfgs is not built in: apt-get install liblbfgs-dev, then cmake again");
#endif
  }

  const base::Options& options_;
  const Task& task_;
  Contest contest_;
};

/// CPU seconds of `work`, the least of several goes.
double seconds_of(const std::function<void()>& work) {
  double minimum = 1e300, total = 0;
  for (int go = 0; go < 5 || total < 0.2; ++go) {
    const double begin = base::cpu_seconds();
    work();
    const double took = base::cpu_seconds() - begin;
    minimum = std::min(minimum, took);
    total += took;
  }
  return minimum;
}

/// Measures one evaluation, one new preconditioner, and an action of the Hessian with one
/// application of the preconditioner.
void measure_costs(const Task& task) {
  const discrete::Part part = discrete::build_local_from_root(comm, task.model).part;
  discrete::Positions positions(comm, part);
  solve::Problem problem(positions, task.weights, false);
  const base::VecHandle at = positions.make_vector(), gradient = positions.make_vector();
  double load = 0.1;
  const double evaluation = seconds_of([&] { problem.function().evaluate(at, gradient); });
  const double renewal = seconds_of([&] {
    positions.set_load(load += 1e-4);
    problem.tangent().assemble(at);
    problem.solver().preconditioner().rebuild();
  });
  check(VecSet(at, 1e-3));
  const double action = seconds_of([&] {
    check(MatMult(problem.tangent().action(), at, gradient));
    check(PCApply(problem.solver().preconditioner(), gradient, at));
  });
  std::printf("%s\n", fmt::format("{{\"evaluation\": {}, \"renewal\": {}, \"action\": {}}}",
                                  evaluation, renewal, action)
                          .c_str());
}

const std::vector<std::string> methods = {
    "default", "default_end",   "stiffness", "stiffness_step", "ntr",
    "lmvm",    "polak_ribiere", "motion",    "liblbfgs",       "costs"};

std::vector<base::Option> option_table() {
  return {{"scene", OptionKind::path, "", "The result's scene, for coarser models."},
          {"accuracy", OptionKind::number, "0.01", "Distance from rest.", {1e-6, 10}, "mm"},
          {"limit", OptionKind::integer, "200000", "Evaluations.", {1, 1000000000}},
          {"seconds", OptionKind::number, "60", "CPU time of a search.", {1e-3, 1e6}, "s"},
          {"count", OptionKind::flag, "",
           "Count preconditioners and actions too, which takes a little time."}};
}

base::Exit run(const base::Options& options) {
  const std::string method = options.arguments()[1];
  if (std::find(methods.begin(), methods.end(), method) == methods.end())
    base::refuse("'{}' is none of {}", method, fmt::join(methods, ", "));
  if (options.flag("count")) check(PetscLogDefaultBegin());
  const Task task = read_task(options.arguments()[0]);
  if (method == "costs")
    measure_costs(task);
  else
    Runner(options, task).run(method);
  return base::Exit::done;
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(argc, argv, "Takes one method to a known rest position.",
                        {{"RESULT.h5", "a result of repose-solve"}, {"METHOD", "a method"}},
                        option_table());
  return base::run_program(options, [&] { return run(options); });
}
