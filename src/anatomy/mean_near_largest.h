#pragma once
#include <algorithm>
#include <cmath>
#include <type_traits>

namespace repose::anatomy {

template <class Items, class Value>
double largest_of(const Items& items, Value&& value) {
  double largest = -INFINITY;
  for (const auto& item : items) largest = std::max(largest, value(item));
  return largest;
}

/// The mean of the places of items, each weighted with how much its value exceeds the largest less
/// `range`, so that neither noise nor one item among equals decides. Needs an item.
template <class Items, class Value, class Place>
auto mean_near_largest(const Items& items, double range, Value&& value, Place&& place) {
  const double least = largest_of(items, value) - range;
  std::decay_t<decltype(place(*items.begin()))> moment = 0.0 * place(*items.begin());
  double weights = 0;
  for (const auto& item : items) {
    const double weight = std::max(value(item) - least, 0.0);
    weights += weight;
    moment += weight * place(item);
  }
  moment /= weights;
  return moment;
}

}  // namespace repose::anatomy
