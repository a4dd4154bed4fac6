/// repose-tradeoff SCENE: what accuracy costs on a scene, and whether the program knows it.
///
///     repose-tradeoff meshes/paper_jaw_advance.yaml
///     mpirun -n 2 repose-tradeoff my_head.yaml -methods ntr,lmvm -accuracies 1,0.1,0.01
///         -layers 2,4,6
///     drivers/plot_tradeoff.py paper_jaw_advance_tradeoff
///
/// Solves the scene with methods × accuracies, and varies load steps, volume term, layers and mesh
/// one at a time; each is compared with a reference of its own. Writes NAME.csv, NAME_map.csv and
/// NAME_triangles.csv. Exit status: 0 done, 1 bad input, 3 internal error.
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "repose/base/agreement.h"
#include "repose/base/log.h"
#include "repose/base/program.h"
#include "repose/base/text.h"
#include "repose/base/whole_file.h"
#include "tradeoff/study.h"

namespace {

using namespace repose;
using base::OptionKind;

const MPI_Comm comm = MPI_COMM_WORLD;

std::vector<base::Option> option_table() {
  return {
      {.name = "output",
       .kind = OptionKind::path,
       .default_text = "",
       .help = "Path of the tables; .csv, where it ends so, is left out.",
       .default_note = "SCENE_tradeoff",
       .endings = {".csv"}},
      {"methods", OptionKind::text, "ntr,nls,lmvm,cg", "TAO's methods, the usual one first."},
      {"accuracies", OptionKind::text, "1,0.3,0.1,0.03,0.01,0.001", "mm."},
      {"load_steps", OptionKind::text, "1,2,4,8,16", "Numbers of equal steps; a comma for none."},
      {"volumes", OptionKind::text, "none,paper,penalty", "Volume terms; a comma for none."},
      {"layers", OptionKind::text, "2,3,4,6", "Point layers, 2 … 64; a comma for none."},
      {"edges", OptionKind::text, "",
       "mm, edges of a remeshed skin; a comma for none (default 1.5 and 2 times its own)."},
      {"reference", OptionKind::number, "1e-8", "Accuracy of the reference.",
       base::Range::between(1e-12, 1), "mm"},
      {"time_limit", OptionKind::number, "60",
       "Of one run; a reference may take four times as long.", base::Range::between(1e-3, 1e6),
       "s"}};
}

std::vector<std::string> choices_of(const base::Options& options, const char* name,
                                    const std::vector<std::string>& allowed) {
  const std::vector<std::string> chosen = options.words(name);
  for (const std::string& word : chosen)
    if (std::find(allowed.begin(), allowed.end(), word) == allowed.end())
      base::refuse("-{} {}: {} is not one of {}", name, options.text(name), base::quote(word),
                   fmt::format("{}", fmt::join(allowed, ", ")));
  return chosen;
}

tradeoff::Plan read_plan(const base::Options& options) {
  using base::Range;
  tradeoff::Plan plan;
  plan.methods = choices_of(options, "methods", {"ntr", "nls", "lmvm", "cg", "bnls", "bntr"});
  plan.accuracies = options.numbers("accuracies", Range::between(1e-12, 100));
  const std::vector<std::string> volumes = {"none", "paper", "penalty"};  // as they are numbered
  for (const std::string& word : choices_of(options, "volumes", volumes))
    plan.volumes.push_back(static_cast<scene::VolumeTerm>(
        std::find(volumes.begin(), volumes.end(), word) - volumes.begin()));
  plan.load_steps = options.integers("load_steps", Range::between(1, 100000));
  plan.layers = options.integers("layers", Range::between(2, 64));
  if (options.has("edges")) plan.edges = options.numbers("edges", Range::between(0.1, 100));
  plan.reference_accuracy = options.number("reference");
  plan.seconds = options.number("time_limit");
  if (plan.methods.empty()) base::refuse("-methods: give one or more");
  return plan;
}

std::string triangle_table(const std::vector<Triangle>& triangles) {
  std::string text = "a,b,c\n";
  for (const auto& [a, b, c] : triangles) text += fmt::format("{},{},{}\n", a, b, c);
  return text;
}

base::Exit run(const base::Options& options) {
  const std::filesystem::path input = options.arguments()[0];
  tradeoff::Plan plan = read_plan(options);
  base::collective_try(comm, [&] { plan.scene = scene::read_scene(input); });
  const std::string name =
      options.has("output") ? options.text("output") : input.stem().string() + "_tradeoff";
  base::on_root(comm, [&] {
    for (const char* ending : {".csv", "_map.csv", "_triangles.csv"})
      base::require_writable(name + ending);
  });
  const auto tell = [](const std::string& line, size_t number, size_t runs) {
    const std::string counter = fmt::format("{:>3} of {}", number, runs);
    if (base::rank(comm) == 0)
      std::printf("  %s  %s\n", number > 0 ? counter.c_str() : "first", line.c_str());
    std::fflush(stdout);
  };
  const tradeoff::Findings found = tradeoff::measure(plan, tell);
  base::on_root(comm, [&] {
    base::write_whole_file(name + ".csv", tradeoff::table(found.measurements));
    base::write_whole_file(name + "_map.csv", tradeoff::map_table(found.map));
    base::write_whole_file(name + "_triangles.csv", triangle_table(found.map.triangles));
    std::printf("%s\n",
                tradeoff::conclude(found.measurements, tradeoff::usual_variant(plan)).c_str());
    std::printf("%s.csv, %s_map.csv, %s_triangles.csv: drivers/plot_tradeoff.py %s draws them\n",
                name.c_str(), name.c_str(), name.c_str(), name.c_str());
  });
  return base::Exit::done;
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(argc, argv, "Measures what accuracy costs on a scene.",
                        {{"SCENE", "scene (.yaml)"}}, option_table());
  return base::run_program(options, [&] { return run(options); });
}
