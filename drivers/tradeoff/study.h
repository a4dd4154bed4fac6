#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "repose/scene/scene.h"
#include "repose/surface/surface.h"

/// Cost of accuracy: one scene solved in many variants, each against one reference.
namespace repose::tradeoff {

/// One variant of solving the scene.
struct Variant {
  std::string study;   ///< what is varied: solver, load steps, volume, layers, springs, mesh
  std::string method;  ///< -tao_type
  double accuracy;     ///< mm requested
  scene::VolumeTerm volume;
  int load_steps = 0;  ///< 0: automatic
  int layers = 0;      ///< point layers
  double edge = 0;     ///< mm, mean edge of the remeshed skin; 0: the skin as it is
};

/// Cost and accuracy of a variant. Errors are largest distances to the reference, mm; NaN where
/// there is nothing to compare.
struct Measurement {
  Variant variant;
  int64_t points = 0, unknowns = 0;
  bool converged = false;
  std::string reason;
  double seconds = 0;  ///< CPU, of the rank that took longest, distribution included
  int64_t evaluations = 0, assemblies = 0, iterations = 0;
  double estimate = 0;  ///< mm, the program's own displacement_error
  double error = 0;     ///< mm, over all points, against the same model converged to rounding
  double skin_rms = 0;  ///< mm, over the vertices of the scene's skin, against the reference
  double skin_95 = 0;   ///< likewise, 95 %
  double skin_max = 0;  ///< likewise
};

/// Returns the difference from the other variants of its study: "lmvm, 0.01 mm", "6 layers",
/// "penalty".
std::string label(const Variant& variant);

/// Settings to be varied, one thing at a time but for methods × accuracies.
struct Plan {
  scene::Scene scene;
  std::vector<std::string> methods;
  std::vector<double> accuracies;  ///< mm
  std::vector<scene::VolumeTerm> volumes;
  std::vector<int> load_steps, layers;
  /// mm, of the remeshed skin; nothing: one and a half and two times the skin's own.
  std::optional<std::vector<double>> edges;
  double reference_accuracy = 1e-8;  ///< mm
  double seconds = 60;               ///< time limit of one run
};

/// The scene as it stands, solved by the first method.
Variant usual_variant(const Plan& plan);
/// All ways of a plan, those of one model one after another.
std::vector<Variant> variants_of(const Plan& plan);

/// The face on which errors are mapped: the scene's skin at rest in the reference, and how far from
/// it each way, but those that differ in method or accuracy alone, leaves it.
struct Map {
  std::vector<Vec3> rest;           ///< [V] mm
  std::vector<Triangle> triangles;  ///< of the skin
  std::vector<Variant> variants;
  std::vector<std::vector<double>> error;  ///< [ways][V] mm
};

struct Findings {
  std::vector<Measurement> measurements;
  Map map;  ///< of the ways that differ in layers, mesh or volume term
};

/// Receives a line before each run, its number from 1 and how many there are; 0 for the reference.
using Tell = std::function<void(const std::string& line, size_t number, size_t runs)>;

/// Runs the study. The plan is the same on all ranks; findings are complete on rank 0.
/// The reference has the most layers and the skin as it is. Throws InputError as the solver does.
/// Collective.
Findings measure(const Plan& plan, const Tell& tell);

/// Returns a paragraph: the cost of accuracy, the errors due to layers and mesh, and which of these
/// to reduce first. `usual` is the scene as it stands.
std::string conclude(const std::vector<Measurement>& found, const Variant& usual);

/// CSV: a line of names, then one row a measurement.
std::string table(const std::vector<Measurement>& measurements);
/// CSV: one row a skin vertex, its position and the error of each way.
std::string map_table(const Map& map);

}  // namespace repose::tradeoff
