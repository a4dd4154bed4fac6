#include "find_runs.h"

namespace repose::mechanics {

std::vector<int64_t> ordered_by(const std::vector<int64_t>& keys, int64_t end) {
  std::vector<int64_t> begin(end + 1, 0), order(keys.size());
  for (const int64_t key : keys) ++begin[key + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  for (size_t k = 0; k < keys.size(); ++k) order[begin[keys[k]]++] = static_cast<int64_t>(k);
  return order;
}

}  // namespace repose::mechanics
