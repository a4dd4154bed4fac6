#include "repose/model/stiffness.h"

#include <algorithm>
#include <cmath>

#include "layers.h"
#include "repose/base/error.h"
#include "repose/model/build.h"
#include "repose/model/material.h"

namespace repose::model {
namespace {

constexpr double default_stiffness = 1.0, default_reference = 1.0;  // N/mm, mm
constexpr int springs_of_prism = 15;

/// The rule that holds for a set once everything less specific is filled in.
struct FullRule {
  std::optional<double> modulus;
  double stiffness = default_stiffness;
  scene::Law law = scene::Law::quartic;
  double reference = default_reference;

  void refine(const scene::SpringRule& rule) {
    if (rule.stiffness) {
      stiffness = *rule.stiffness;
      modulus.reset();
    }
    if (rule.modulus) modulus = rule.modulus;
    law = rule.law.value_or(law);
    reference = rule.reference.value_or(reference);
  }
};

std::string kind_of(const std::string& set) { return set.substr(0, set.find(' ')); }

FullRule rule_of(const std::map<std::string, scene::SpringRule>& rules, const std::string& set) {
  FullRule full;
  for (const std::string& name : {std::string("default"), kind_of(set), set})
    if (const auto found = rules.find(name); found != rules.end()) full.refine(found->second);
  return full;
}

/// Moduli of the three kinds of spring by which a network of prisms whose gaps are as thick as
/// `slope` times its edges are long resembles an isotropic solid at small strains, in units of its
/// shear modulus.
std::map<std::string, double> isotropic_moduli(double slope) {
  constexpr double flattest = 0.5, steepest = 1.22;  // where all are positive
  const double t = std::clamp(slope, flattest, steepest), square = t * t;
  return {{"layer", 2.5 * (8 - 2 / square)},
          {"connecting", 5 * (3 - 2 * square)},
          {"diagonal", 5 * (1 + square) * (1 + square) / square}};
}

std::map<std::string, scene::SpringRule> isotropic_rules(const scene::Elasticity& solid,
                                                         double slope) {
  std::map<std::string, scene::SpringRule> rules;
  const double shear = moduli(solid).shear;
  for (const auto& [kind, modulus] : isotropic_moduli(slope))
    rules[kind] = {
        .stiffness = {}, .modulus = shear * modulus, .law = scene::Law::linear, .reference = 0.0};
  return rules;
}

void refuse_unknown_sets(const std::map<std::string, scene::SpringRule>& rules,
                         const std::vector<std::string>& sets) {
  for (const auto& [name, rule] : rules) {
    const bool known =
        name == "default" || std::any_of(sets.begin(), sets.end(), [&, &name = name](auto& set) {
          return set == name || kind_of(set) == name;
        });
    if (!known)
      base::refuse(
          "tissue.springs: no spring set is called '{}'; with these layers the sets are default, "
          "layer, connecting, diagonal and '{}' to '{}'",
          name, sets.front(), sets.back());
  }
}

}  // namespace

std::vector<double> spring_volumes(const SkinMesh& mesh, const std::vector<double>& prism_volumes) {
  const auto edges = static_cast<int64_t>(mesh.edges.size());
  const auto columns = static_cast<int64_t>(mesh.points.size());
  const auto triangles = static_cast<int64_t>(mesh.triangles.size());
  const auto gaps = static_cast<int64_t>(prism_volumes.size()) / triangles;
  const int64_t connecting = (gaps + 1) * edges, diagonal = connecting + gaps * columns;
  std::vector<double> volumes(diagonal + gaps * 2 * edges, 0);
  for (int64_t gap = 0; gap < gaps; ++gap)
    for (int64_t f = 0; f < triangles; ++f) {
      const double share = prism_volumes[gap * triangles + f] / springs_of_prism;
      for (const int64_t e : mesh.triangle_edges[f])
        for (const int64_t spring :
             {gap * edges + e, (gap + 1) * edges + e, diagonal + 2 * (gap * edges + e),
              diagonal + 2 * (gap * edges + e) + 1})
          volumes[spring] += share;
      for (const int64_t c : mesh.triangles[f]) volumes[connecting + gap * columns + c] += share;
    }
  return volumes;
}

double layer_slope(const SkinMesh& mesh, const std::vector<Vec3>& deep,
                   const scene::Tissue& tissue) {
  const std::vector<double> depths = layer_depths(tissue);
  const auto points_of = [&](int64_t c) {
    return column_points(mesh.points[c], deep[c], depths, tissue.depths_mm);
  };
  double thickness = 0, length = 0;
  for (size_t c = 0; c < deep.size(); ++c) thickness += (deep[c] - mesh.points[c]).norm();
  for (const auto& [c, d] : mesh.edges) {
    const std::vector<Vec3> from = points_of(c), to = points_of(d);
    for (size_t a = 0; a < from.size(); ++a) length += (to[a] - from[a]).norm();
  }
  const double gaps = static_cast<double>(deep.size() * (depths.size() - 1));
  return thickness / gaps / (length / static_cast<double>(mesh.edges.size() * depths.size()));
}

void set_stiffness(const scene::Tissue& tissue, const SkinMesh& mesh, double slope, Model& model) {
  refuse_unknown_sets(tissue.springs, model.spring_sets);
  const auto given = tissue.isotropic ? isotropic_rules(*tissue.isotropic, slope) : tissue.springs;
  std::vector<FullRule> rules;
  for (const std::string& set : model.spring_sets) rules.push_back(rule_of(given, set));
  std::vector<double> volumes;
  if (std::any_of(rules.begin(), rules.end(), [](const FullRule& r) { return r.modulus; }))
    volumes = spring_volumes(mesh, model.prisms.rest_volume);
  Springs& springs = model.springs;
  for (size_t j = 0; j < springs.points.size(); ++j) {
    const FullRule& rule = rules[springs.set[j]];
    const auto [p, q] = springs.points[j];
    const double r0 = (model.points.position[q] - model.points.position[p]).norm();
    springs.stiffness[j] = rule.modulus ? *rule.modulus * volumes[j] / (r0 * r0) : rule.stiffness;
    springs.exponent[j] = static_cast<int8_t>(rule.law);
    springs.reference[j] = rule.reference > 0 ? rule.reference : r0;
  }
}

namespace {

/// K − 5/3 G, N/mm², of Poisson's ratio ν: springs alone have ν = 1/4, K = 5/3 G.
double missing_bulk_modulus(double shear, double poisson) {
  return shear * (2 * (1 + poisson) / (3 * (1 - 2 * poisson)) - 5.0 / 3);
}

}  // namespace

double default_bulk_modulus(const scene::Tissue& tissue, const scene::Solve& solve,
                            double effective_modulus) {
  if (tissue.isotropic)
    return missing_bulk_modulus(tissue.isotropic->young / (2 * (1 + tissue.isotropic->poisson)),
                                tissue.isotropic->poisson);
  constexpr double evenly = 15;  // 1/⟨u_x² u_y²⟩ over all directions u
  return missing_bulk_modulus(effective_modulus / evenly, solve.poisson);
}

namespace {

/// Calls add(point, E V, V) for each prism (0 for E of springs) and add(point, k r², 0) for each
/// spring, with its first point.
template <class Add>
void for_each_stiffness(const Model& model, Add&& add) {
  for (size_t m = 0; m < model.prisms.points.size(); ++m) {
    const double volume = model.prisms.rest_volume[m];
    const double young =
        is_solid(model) ? young_modulus({model.prisms.shear_modulus[m], model.prisms.modulus[m]})
                        : 0;
    add(model.prisms.points[m][0], young * volume, volume);
  }
  for (size_t j = 0; j < model.springs.points.size(); ++j) {
    const auto [p, q] = model.springs.points[j];
    const Vec3 along = model.points.position[q] - model.points.position[p];
    add(p, model.springs.stiffness[j] * along.squaredNorm(), 0.0);
  }
}

}  // namespace

void add_elements(const Model& model, ColumnSums& sums) {
  for_each_stiffness(model,
                     [&](int64_t, double k, double v) { sums.stiffness += k, sums.volume += v; });
}

double effective_modulus(const Model& model) {
  ColumnSums sums;
  add_elements(model, sums);
  return effective_modulus(std::vector{sums});
}

std::vector<ColumnSums> column_sums(const Model& model, int64_t layers) {
  const std::vector<Vec3>& x = model.points.position;
  std::vector<ColumnSums> sums(x.size() / layers);
  for (size_t c = 0; c < sums.size(); ++c)
    sums[c].thickness = (x[(c + 1) * layers - 1] - x[c * layers]).norm();
  for_each_stiffness(model, [&](int64_t point, double stiffness, double volume) {
    sums[point / layers].stiffness += stiffness;
    sums[point / layers].volume += volume;
  });
  return sums;
}

double effective_modulus(const std::vector<ColumnSums>& columns) {
  double stiffness = 0, volume = 0;
  for (const ColumnSums& column : columns) stiffness += column.stiffness, volume += column.volume;
  return volume > 0 ? stiffness / volume : 0;
}

double contact_stiffness(const scene::Scene& scene, const std::vector<ColumnSums>& columns) {
  // Of the tissue's own stiffness at its thickness, and at the width of a column, where a softer
  // penalty takes many rounds of multipliers.
  constexpr double times = 25, times_at_width = 7;
  constexpr double largest = 3;  // of the median, so that a stiff part does not decide
  if (scene.contact && scene.contact->stiffness) return *scene.contact->stiffness;
  std::vector<double> thickness, moduli;
  double volume = 0, length = 0;
  for (const ColumnSums& column : columns) {
    thickness.push_back(column.thickness);
    if (column.volume > 0) moduli.push_back(column.stiffness / column.volume);
    volume += column.volume, length += column.thickness;
  }
  const double width = std::sqrt(volume / length);
  double modulus = effective_modulus(columns);
  if (!moduli.empty()) modulus = std::min(modulus, largest * base::median(std::move(moduli)));
  return std::max(times * modulus / base::median(std::move(thickness)),
                  times_at_width * modulus / width);
}

}  // namespace repose::model
