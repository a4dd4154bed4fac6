#include "repose/model/material.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "region.h"
#include "repose/base/error.h"
#include "repose/model/build.h"

namespace repose::model {

namespace {

using Gradients = Eigen::Matrix<double, 3, 6>;

/// Derivatives of the wedge's shape functions by its own coordinates: ξ, η in the triangle, ζ from
/// a (0) to b (1).
Gradients local_gradients(double xi, double eta, double zeta) {
  const double in_triangle[3] = {1 - xi - eta, xi, eta};
  const double by_xi[3] = {-1, 1, 0}, by_eta[3] = {-1, 0, 1};
  Gradients g;
  for (int i = 0; i < 3; ++i) {
    g.col(i) << by_xi[i] * (1 - zeta), by_eta[i] * (1 - zeta), -in_triangle[i];
    g.col(i + 3) << by_xi[i] * zeta, by_eta[i] * zeta, in_triangle[i];
  }
  return g;
}

/// ∂X/∂(ξ, η, ζ).
Mat3 map_gradient(const std::array<Vec3, 6>& corners, const Gradients& local) {
  Mat3 map = Mat3::Zero();
  for (int i = 0; i < 6; ++i) map += corners[i] * local.col(i).transpose();
  return map;
}

Vec3 middle_of(const std::array<Vec3, 6>& corners) {
  return std::accumulate(corners.begin(), corners.end(), Vec3(Vec3::Zero())) / 6;
}

Moduli mean_moduli(const std::vector<Moduli>& strata, const std::vector<double>& share) {
  Moduli mean{0, 0};
  for (size_t s = 0; s < share.size(); ++s) {
    mean.shear += share[s] * strata[s].shear;
    mean.volume += share[s] * strata[s].volume;
  }
  return mean;
}

void set_moduli(const Moduli& here, size_t prism, Prisms& prisms) {
  prisms.shear_modulus[prism] = here.shear;
  prisms.modulus[prism] = here.volume;
}

/// Gives every prism the means of the strata that it crosses.
void set_strata_moduli(const scene::Material& material, const std::vector<int64_t>& skin,
                       Model& model) {
  std::vector<double> thickness;
  std::vector<Moduli> strata;
  for (const scene::Stratum& stratum : material.strata) {
    thickness.push_back(stratum.thickness);
    strata.push_back(moduli(stratum.elasticity));
  }
  strata.push_back(moduli(material.deep));
  for (size_t m = 0; m < model.prisms.points.size(); ++m) {
    const std::array<double, 2> depth = depth_of(model, model.prisms.points[m], skin);
    set_moduli(mean_moduli(strata, strata_shares(thickness, depth)), m, model.prisms);
  }
}

/// Calls visit(prism) for each prism whose middle a region holds; `skin` [points] is the row of the
/// point at the top of the column.
template <class Visit>
void for_each_prism_in(const scene::MaterialRegion& region, const Model& model,
                       const std::vector<int64_t>& skin, const Visit& visit) {
  const ContainsTissue inside = contains_tissue(region.where);
  for (size_t m = 0; m < model.prisms.points.size(); ++m) {
    Vec3 top = Vec3::Zero();
    for (int c = 0; c < 3; ++c) top += model.points.position[skin[model.prisms.points[m][c]]] / 3;
    if (inside(middle_of(corners_of(model, m)), top)) visit(m);
  }
}

/// [regions] how many prisms each holds.
std::vector<int64_t> set_region_moduli(const scene::Material& material,
                                       const std::vector<int64_t>& skin, Model& model) {
  std::vector<int64_t> found;
  for (const scene::MaterialRegion& region : material.regions) {
    found.push_back(0);
    for_each_prism_in(region, model, skin, [&](size_t m) {
      set_moduli(moduli(region.elasticity), m, model.prisms);
      ++found.back();
    });
  }
  return found;
}

/// The weights of all prisms by the lower of their points, which is a row.
struct PairRows {
  std::vector<int64_t> begin;  // [N + 1]
  struct Entry {
    int64_t other;
    double weight;
  };
  std::vector<Entry> entry;
};

PairRows pair_rows(const std::string& file, const Model& model) {
  const Prisms& prisms = model.prisms;
  PairRows rows;
  rows.begin.assign(model.points.position.size() + 1, 0);
  const auto lower = [](const std::array<int64_t, 6>& p, const std::array<int, 2>& pair) {
    return std::min(p[pair[0]], p[pair[1]]);
  };
  for (const auto& p : prisms.points)
    for (const auto& pair : prism_pairs) ++rows.begin[lower(p, pair) + 1];
  std::partial_sum(rows.begin.begin(), rows.begin.end(), rows.begin.begin());
  rows.entry.resize(rows.begin.back());
  std::vector<int64_t> end(rows.begin.begin(), rows.begin.end() - 1);
  for (size_t m = 0; m < prisms.points.size(); ++m) {
    const std::array<Vec3, 6> corners = corners_of(model, m);
    const auto weights = pair_weights(corners);
    if (!weights) {
      const Vec3 at = middle_of(corners);
      base::refuse(
          "{}: prism {} near {:.2f} mm is too distorted to be a solid: its map folds; smooth or "
          "remesh the skin there",
          file, m, at);
    }
    for (size_t k = 0; k < prism_pairs.size(); ++k) {
      const int64_t p = prisms.points[m][prism_pairs[k][0]],
                    q = prisms.points[m][prism_pairs[k][1]];
      rows.entry[end[std::min(p, q)]++] = {std::max(p, q), prisms.shear_modulus[m] * (*weights)[k]};
    }
  }
  return rows;
}

/// N/mm.
double skin_tension(const scene::Tissue& tissue, const std::string& file) {
  const std::vector<scene::Stratum>& strata = tissue.material->strata;
  if (strata.empty())
    base::refuse(
        "{}: tissue.turgor stretches the outermost stratum of tissue.material, which has none; "
        "give tissue.material.skin",
        file);
  const auto& [thickness, skin] = strata.front();
  return skin.young * tissue.turgor * thickness / (1 - skin.poisson);
}

void add_skin_tension(double tension, Model& model) {
  const std::vector<Vec3>& x = model.points.position;
  for (const Triangle& t : model.skin)
    for (int corner = 0; corner < 3; ++corner) {
      const int64_t p = t[(corner + 1) % 3], q = t[(corner + 2) % 3];
      const Vec3 a = x[p] - x[t[corner]], b = x[q] - x[t[corner]];
      add_to_edge(p, q, tension * a.dot(b) / a.cross(b).norm() / 2, model.edges);
    }
}

}  // namespace

Moduli moduli(const scene::Elasticity& e) {
  const double shear = e.young / (2 * (1 + e.poisson));
  return {shear, e.young * e.poisson / ((1 + e.poisson) * (1 - 2 * e.poisson)) + shear};
}

double young_modulus(const Moduli& moduli) {
  const double lame = moduli.volume - moduli.shear;
  return moduli.shear * (3 * lame + 2 * moduli.shear) / moduli.volume;
}

std::array<Vec3, 6> corners_of(const Model& model, size_t prism) {
  return base::pick(model.points.position, model.prisms.points[prism]);
}

std::vector<double> strata_shares(const std::vector<double>& thickness,
                                  const std::array<double, 2>& depth) {
  std::vector<double> shares;
  double top = 0, left = 1;
  for (const double thick : thickness) {
    const double within = std::min(top + thick, depth[1]) - std::max(top, depth[0]);
    shares.push_back(std::clamp(within / (depth[1] - depth[0]), 0.0, left));
    left -= shares.back();
    top += thick;
  }
  shares.push_back(left);
  return shares;
}

std::array<double, 2> depth_of(const Model& model, const std::array<int64_t, 6>& prism,
                               const std::vector<int64_t>& skin) {
  const std::vector<Vec3>& x = model.points.position;
  std::array<double, 2> depth{};
  for (int c = 0; c < 6; ++c) depth[c / 3] += (x[prism[c]] - x[skin[prism[c]]]).norm() / 3;
  return depth;
}

std::optional<std::array<double, 15>> pair_weights(const std::array<Vec3, 6>& corners,
                                                   const Mat3& A) {
  constexpr double in_triangle[3][2] = {{1. / 6, 1. / 6}, {2. / 3, 1. / 6}, {1. / 6, 2. / 3}};
  const double half = 0.5 / std::sqrt(3.0);
  std::array<double, 15> weights{};
  for (const auto& [xi, eta] : in_triangle)
    for (const double zeta : {0.5 - half, 0.5 + half}) {
      const Gradients local = local_gradients(xi, eta, zeta);
      const Mat3 map = map_gradient(corners, local);
      const double determinant = map.determinant();
      if (!(determinant > 0)) return {};
      const Gradients gradients = map.inverse().transpose() * local, weighted = A * gradients;
      for (size_t k = 0; k < prism_pairs.size(); ++k)
        weights[k] -= determinant / 12 *
                      gradients.col(prism_pairs[k][0]).dot(weighted.col(prism_pairs[k][1]));
    }
  return weights;
}

Mat3 deformation_gradient(const std::array<Vec3, 6>& before, const std::array<Vec3, 6>& now) {
  const Gradients local = local_gradients(1. / 3, 1. / 3, 0.5);
  return map_gradient(now, local) * map_gradient(before, local).inverse();
}

void assemble_edges(const std::string& file, Model& model) {
  PairRows rows = pair_rows(file, model);
  model.edges = {};
  for (size_t p = 0; p + 1 < rows.begin.size(); ++p) {
    const auto first = rows.entry.begin() + rows.begin[p];
    const auto last = rows.entry.begin() + rows.begin[p + 1];
    std::stable_sort(first, last, [](auto& a, auto& b) { return a.other < b.other; });
    for (auto next = first; next != last;) {
      double weight = 0;
      const int64_t other = next->other;
      for (; next != last && next->other == other; ++next) weight += next->weight;
      model.edges.points.push_back({static_cast<int64_t>(p), other});
      model.edges.weight.push_back(weight);
    }
  }
}

void add_to_edge(int64_t p, int64_t q, double weight, Edges& edges) {
  const auto ends = base::sorted_pair(p, q);
  const auto edge = std::ranges::lower_bound(edges.points, ends);
  if (edge != edges.points.end() && *edge == ends)
    edges.weight[edge - edges.points.begin()] += weight;
}

std::vector<int64_t> skin_rows(const Points& points) {
  std::unordered_map<int64_t, int64_t> top;
  for (size_t i = 0; i < points.layer.size(); ++i)
    if (points.layer[i] == 0) top[points.column[i]] = static_cast<int64_t>(i);
  std::vector<int64_t> rows;
  for (const int64_t column : points.column) rows.push_back(top.at(column));
  return rows;
}

std::vector<char> in_regions(const std::vector<scene::MaterialRegion>& regions,
                             const Model& model) {
  std::vector<char> held(model.prisms.points.size(), 0);
  if (regions.empty()) return held;
  const std::vector<int64_t> skin = skin_rows(model.points);
  for (const scene::MaterialRegion& region : regions)
    for_each_prism_in(region, model, skin, [&](size_t m) { held[m] = 1; });
  return held;
}

std::vector<int64_t> set_material(const scene::Tissue& tissue, const std::string& file,
                                  Model& model) {
  const scene::Material& material = *tissue.material;
  Prisms& prisms = model.prisms;
  const size_t count = prisms.points.size();
  prisms.shear_modulus.resize(count);
  prisms.modulus.resize(count);
  const std::vector<int64_t> skin = skin_rows(model.points);
  set_strata_moduli(material, skin, model);
  std::vector<int64_t> found = set_region_moduli(material, skin, model);
  if (material.dilatation == scene::Dilatation::nodal)
    for (size_t m = 0; m < count; ++m)
      prisms.nodal_modulus.push_back(prisms.modulus[m] - prisms.shear_modulus[m]);
  for (size_t m = 0; m < count; ++m)
    prisms.target_volume.push_back(prisms.rest_volume[m] *
                                   (1 + prisms.shear_modulus[m] / prisms.modulus[m]));
  assemble_edges(file, model);
  if (tissue.turgor > 0) add_skin_tension(skin_tension(tissue, file), model);
  return found;
}

void require_regions(const std::vector<int64_t>& found, const std::string& file) {
  for (size_t r = 0; r < found.size(); ++r)
    if (found[r] == 0)
      base::refuse(
          "{}: tissue.material.regions[{}]: holds no prism of the tissue; move or enlarge it, or "
          "give the tissue more layers",
          file, r);
}

}  // namespace repose::model
