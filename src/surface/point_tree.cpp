#include "repose/surface/point_tree.h"

#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Search_traits_adapter.h>
#include <CGAL/property_map.h>

#include <utility>

#include "cgal.h"

namespace repose::surface {

namespace {

using Row = std::pair<Point3, int64_t>;
using Traits = CGAL::Search_traits_adapter<Row, CGAL::First_of_pair_property_map<Row>,
                                           CGAL::Search_traits_3<Kernel>>;
using Search = CGAL::Orthogonal_k_neighbor_search<Traits>;

}  // namespace

struct PointTree::Tree {
  Search::Tree rows;
};

PointTree::PointTree(const std::vector<Vec3>& points) : tree_(std::make_unique<Tree>()) {
  for (size_t p = 0; p < points.size(); ++p)
    tree_->rows.insert({to_cgal(points[p]), static_cast<int64_t>(p)});
  tree_->rows.build();
}

PointTree::~PointTree() = default;

std::vector<int64_t> PointTree::nearest(const Vec3& query, int count) const {
  std::vector<int64_t> rows;
  for (const auto& [row, squared] : Search(tree_->rows, to_cgal(query), count))
    rows.push_back(row.second);
  return rows;
}

}  // namespace repose::surface
