#include "repose/linear/sweep_order.h"

namespace repose::linear {

SweepOrder::SweepOrder(const IndexMap& points, const BlockPattern& pattern,
                       std::span<const int32_t> begin)
    : beside_border_(begin.size() - 1), turn_(points.color()), turns_(points.colors()) {
  const auto columns = static_cast<int32_t>(beside_border_.size());
  std::vector<char> at_border(points.own(), 0);  // [points] ghosts, then columns of the border
  at_border.resize(points.own() + points.ghosts(), 1);
  const auto find_beside = [&] {
    for (int32_t c = 0; c < columns; ++c)
      beside_border_[c] = std::any_of(pattern.column.begin() + pattern.begin[begin[c]],
                                      pattern.column.begin() + pattern.begin[begin[c + 1]],
                                      [&](int32_t j) { return at_border[j] != 0; });
  };
  find_beside();
  for (int32_t c = columns; c-- > 0;)  // up the numbers, so that the others go down from the border
    if (beside_border_[c]) order_.push_back(c);
  border_ = std::ssize(order_);
  for (int32_t c = 0; c < columns; ++c)
    if (beside_border_[c])
      std::fill(at_border.begin() + begin[c], at_border.begin() + begin[c + 1], 1);
    else
      order_.push_back(c);
  find_beside();
}

}  // namespace repose::linear
