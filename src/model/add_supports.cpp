#include "add_supports.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "loads.h"
#include "region.h"

namespace repose::model {

namespace {

/// Compliance of the tissue of columns, by the materials on their way.
class Compliance {
 public:
  explicit Compliance(const scene::Material& material) : material_(material) {
    for (const scene::Stratum& stratum : material.strata) thickness_.push_back(stratum.thickness);
    for (const scene::MaterialRegion& region : material.regions)
      regions_.push_back(contains_tissue(region.where));
  }

  /// Returns ∫ ds/E from the first to the last point of a column, mm³/N, in each stratum, in what
  /// is below all, and in regions.
  std::vector<double> along(std::span<const Vec3> column) const {
    std::vector<double> sums(thickness_.size() + 2, 0);
    for (size_t i = 0; i + 1 < column.size(); ++i) {
      const double length = (column[i + 1] - column[i]).norm();
      if (const scene::Elasticity* own = region_at((column[i] + column[i + 1]) / 2, column[0])) {
        sums.back() += length / own->young;
        continue;
      }
      const auto shares = strata_shares(
          thickness_, {(column[i] - column[0]).norm(), (column[i + 1] - column[0]).norm()});
      for (size_t s = 0; s < shares.size(); ++s) sums[s] += length * shares[s] / young(s);
    }
    return sums;
  }

 private:
  double young(size_t stratum) const {
    return stratum < thickness_.size() ? material_.strata[stratum].elasticity.young
                                       : material_.deep.young;
  }
  /// The material of the last region that tissue lies in; null in none.
  const scene::Elasticity* region_at(const Vec3& place, const Vec3& skin) const {
    for (size_t r = regions_.size(); r-- > 0;)
      if (regions_[r](place, skin)) return &material_.regions[r].elasticity;
    return nullptr;
  }

  const scene::Material& material_;
  std::vector<double> thickness_;  // mm, of strata
  std::vector<ContainsTissue> regions_;
};

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// The elements of a model's elastic supports; null where it has none.
template <class AnyModel>
auto* find_supports(AnyModel& model) {
  const auto found =
      std::ranges::find(model.elements, std::string("elastic_support"), &TermElements::term);
  return found == model.elements.end() ? nullptr : &*found;
}

}  // namespace

void add_supports(const ColumnEnds& ends, const scene::Material& material, const SkinMesh& mesh,
                  Model& model) {
  TermElements elements{"elastic_support", 1, 5, {}, {}, 4};
  const Compliance compliance(material);
  const std::vector<double> area = point_areas(mesh, model);
  const std::span<const Vec3> x = model.points.position;
  const size_t columns = ends.support.size(), layers = x.size() / std::max<size_t>(columns, 1);
  for (size_t c = 0; c < columns; ++c) {
    if (ends.support[c] < 0) continue;
    const size_t first = c * layers, deepest = first + layers - 1;
    const double stiffness =
        ends.support_stiffness[c] / sum(compliance.along(x.subspan(first, layers)));  // N/mm³
    for (size_t i = ends.supported_whole[c] ? first : deepest; i <= deepest; ++i) {
      if (model.points.set[i] != PointSet::soft_tissue) continue;
      elements.add(std::array{static_cast<int64_t>(i)},
                   std::array{x[i].x(), x[i].y(), x[i].z(), stiffness * area[i],
                              static_cast<double>(ends.support[c])});
    }
  }
  model.elements.push_back(std::move(elements));
}

std::vector<std::vector<double>> support_shares(const scene::Material& material,
                                                const Model& model) {
  const TermElements* const supports = find_supports(model);
  if (!supports) return {};
  const Points& points = model.points;
  std::map<int64_t, std::vector<double>> shares;  // by column
  for (const int64_t point : supports->points) shares[points.column[point]];
  std::map<int64_t, std::map<int32_t, Vec3>> columns;  // positions by layer
  for (size_t i = 0; i < points.column.size(); ++i)
    if (shares.contains(points.column[i]))
      columns[points.column[i]][points.layer[i]] = points.position[i];
  const Compliance compliance(material);
  for (auto& [column, share] : shares) {
    std::vector<Vec3> positions;
    for (const auto& [layer, position] : columns[column]) positions.push_back(position);
    share = compliance.along(positions);
    const double whole = sum(share);
    share.pop_back();
    for (double& part : share) part /= whole;
  }
  std::vector<std::vector<double>> found;
  for (const int64_t point : supports->points) found.push_back(shares[points.column[point]]);
  return found;
}

void share_supports(const std::vector<std::array<int64_t, 2>>& twins, Model& model) {
  TermElements* const supports = find_supports(model);
  if (!supports) return;
  const auto stiffness_of = [&](size_t e) -> double& {
    return supports->numbers[e * static_cast<size_t>(supports->numbers_each) + 3];
  };
  for (const auto& [row, twin] : twins) {
    const auto found = std::ranges::find(supports->points, row);
    if (found == supports->points.end()) continue;
    const auto e = static_cast<size_t>(found - supports->points.begin());
    stiffness_of(e) /= 2;
    const auto numbers = supports->numbers_of(e);
    const std::vector<double> shared(numbers.begin(), numbers.end());
    supports->add(std::array{twin}, shared);
  }
}

}  // namespace repose::model
