/// repose-paper: reruns the experiments of Teschner, Girod & Girod (VMV 2000) on the shipped head
/// of the paper's size and writes one page.
///
///     repose-paper
///     repose-paper -layers 2 -limit 2000 -output quick
///     drivers/plot_paper.py paper
///
/// Writes DIR/paper.md, and for the pictures laws.csv, equilibrium.csv and the results opening.h5,
/// forward.h5 and turned.h5. Serial. Exit status: 0 done, 1 bad input, 3 internal error.
#include <cstdio>
#include <filesystem>

#include "paper/figures.h"
#include "paper/page.h"
#include "repose/base/agreement.h"
#include "repose/base/program.h"
#include "repose/base/whole_file.h"

namespace {

using namespace repose;
using base::OptionKind;

std::vector<base::Option> option_table() {
  return {{"output", OptionKind::path, "paper", "Folder of the page and its files."},
          {"meshes", OptionKind::path, "",
           "Folder of the shipped heads; default: the one that is shipped."},
          {"layers", OptionKind::text, "2,4,6", "Point layers, 2 … 64, one or several."},
          {"accuracy", OptionKind::number, "0.1",
           "Methods are stopped at this distance from the rest position.",
           base::Range::between(1e-3, 10), "mm"},
          {"limit", OptionKind::integer, "20000", "Evaluations of a method.",
           base::Range::between(1, 100000000)},
          {"seconds", OptionKind::number, "3", "CPU time of a method.",
           base::Range::between(1e-3, 1e6), "s"},
          {"path_seconds", OptionKind::number, "12", "The same of our default.",
           base::Range::between(1e-3, 1e6), "s"},
          {"images", OptionKind::text, "paper_", "What the page's pictures' names begin with."}};
}

/// Figs. 5 and 7 are drawn from results of the shipped scenes.
void write_results(const std::filesystem::path& meshes, const scene::Scene& advance,
                   const std::filesystem::path& folder) {
  const auto solved = [&](const scene::Scene& scene, const char* name) {
    if (!paper::write_rest(scene, folder / name))
      std::printf("%s.h5 did not reach its accuracy\n", (folder / name).c_str());
  };
  solved(scene::read_scene(meshes / "paper_jaw_opening.yaml"), "opening");
  solved(advance, "forward");
  scene::Scene turned = advance;
  const auto turn = scene::RigidMotion::rotation(Vec3::UnitX(), Vec3::Zero(), 4);
  turned.moves.back() = advance.moves.back().after(turn);
  solved(turned, "turned");
}

/// Returns the command that makes this page, without the output's folder.
std::string command_of(const base::Options& options) {
  std::string command = "repose-paper";
  for (const char* name : {"layers", "accuracy", "limit", "seconds", "path_seconds", "images"})
    if (options.has(name)) command += fmt::format(" -{} {}", name, options.text(name));
  return command;
}

base::Exit run(const base::Options& options) {
  if (base::size(MPI_COMM_WORLD) > 1) base::refuse("repose-paper is serial: run it without mpirun");
  const std::filesystem::path folder = options.text("output");
  const std::filesystem::path meshes = options.has("meshes")
                                           ? std::filesystem::path(options.text("meshes"))
                                           : base::shipped_folder("meshes");
  const paper::Plan plan{.scene = scene::read_scene(meshes / "paper_jaw_advance.yaml"),
                         .layers = options.integers("layers", base::Range::between(2, 64)),
                         .rules = {.accuracy = options.number("accuracy"),
                                   .limit = options.integer("limit"),
                                   .path_seconds = options.number("path_seconds"),
                                   .seconds = options.number("seconds")}};
  if (plan.layers.empty()) base::refuse("-layers: give numbers of layers, such as 2,4,6");
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    base::refuse("{}: cannot be made: {}; choose another -output", folder.string(),
                 error.message());
  base::require_writable(folder / "paper.md");
  const paper::Findings findings = paper::measure(plan, [](const std::string& line) {
    std::printf("  %s\n", line.c_str());
    std::fflush(stdout);
  });
  base::write_whole_file(folder / "paper.md",
                         paper::page(findings, command_of(options), options.text("images")));
  paper::write_laws(folder / "laws.csv");
  paper::write_equilibrium(plan.scene, folder / "equilibrium.csv");
  write_results(meshes, plan.scene, folder);
  std::printf("  wrote %s; its pictures: drivers/plot_paper.py %s\n", (folder / "paper.md").c_str(),
              folder.c_str());
  return base::Exit::done;
}

}  // namespace

int main(int argc, char** argv) {
  base::Options options(argc, argv,
                        "Reruns the paper's tables, figures and claims on the shipped head.", {},
                        option_table());
  return base::run_program(options, [&] { return run(options); });
}
