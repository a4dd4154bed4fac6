#include "add_supports.h"

#include <algorithm>

#include "loads.h"

namespace repose::model {

void add_supports(const ColumnEnds& ends, double young, const SkinMesh& mesh, Model& model) {
  TermElements elements{"elastic_support", 1, 5, {}, {}, 4};
  const std::vector<double> area = point_areas(mesh, model);
  const std::vector<Vec3>& x = model.points.position;
  const size_t columns = ends.support.size(), layers = x.size() / std::max<size_t>(columns, 1);
  for (size_t c = 0; c < columns; ++c) {
    if (ends.support[c] < 0) continue;
    const size_t first = c * layers, deepest = first + layers - 1;
    const double stiffness =
        ends.support_stiffness[c] * young / (x[deepest] - x[first]).norm();  // N/mm³
    for (size_t i = ends.supported_whole[c] ? first : deepest; i <= deepest; ++i) {
      if (model.points.set[i] != PointSet::soft_tissue) continue;
      elements.points.push_back(static_cast<int64_t>(i));
      elements.numbers.insert(elements.numbers.end(),
                              {x[i].x(), x[i].y(), x[i].z(), stiffness * area[i],
                               static_cast<double>(ends.support[c])});
    }
  }
  model.elements.push_back(std::move(elements));
}

void share_supports(const std::vector<std::array<int64_t, 2>>& twins, Model& model) {
  const auto supports =
      std::ranges::find(model.elements, std::string("elastic_support"), &TermElements::term);
  if (supports == model.elements.end()) return;
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
    supports->points.push_back(twin);
    supports->numbers.insert(supports->numbers.end(), shared.begin(), shared.end());
  }
}

}  // namespace repose::model
