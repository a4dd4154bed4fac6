#include "repose/linear/column_coarsening.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <functional>

#include "repose/base/collective.h"

namespace repose::linear {

namespace {

constexpr int32_t none = -1;

std::vector<int32_t> columns_of_points(const ColumnLevel& level) {
  std::vector<int32_t> column(level.own());
  for (size_t c = 0; c + 1 < level.columns().size(); ++c)
    for (int32_t i = level.columns()[c]; i < level.columns()[c + 1]; ++i)
      column[i] = static_cast<int32_t>(c);
  return column;
}

/// Calls visit(own column) for the columns that column `c` is coupled to, some more than once.
/// Points on either side of a cut, which contact alone may couple, have a block of zeros.
template <class Visit>
void for_each_neighbor(const ColumnLevel& level, const std::vector<int32_t>& column, size_t c,
                       Visit&& visit) {
  const BlockPattern& pattern = level.pattern();
  for (int64_t k = pattern.begin[level.columns()[c]]; k < pattern.begin[level.columns()[c + 1]];
       ++k)
    if (const int32_t j = pattern.column[k];
        j < level.own() && column[j] != static_cast<int32_t>(c) && !level.block(k).isZero(0))
      visit(column[j]);
}

/// Columns whose neighbors are all free start an aggregate with them; what is left joins a
/// neighbor's or stays alone.
std::vector<int32_t> aggregate(const ColumnLevel& fine) {
  const std::vector<int32_t> column = columns_of_points(fine);
  const size_t columns = fine.columns().size() - 1;
  std::vector<int32_t> group(columns, none);
  int32_t groups = 0;
  for (size_t c = 0; c < columns; ++c) {
    bool free = group[c] == none;
    for_each_neighbor(fine, column, c, [&](int32_t d) { free &= group[d] == none; });
    if (!free) continue;
    group[c] = groups++;
    for_each_neighbor(fine, column, c, [&](int32_t d) { group[d] = group[c]; });
  }
  const std::vector<int32_t> roots = group;
  for (size_t c = 0; c < columns; ++c)
    if (roots[c] == none)
      for_each_neighbor(fine, column, c, [&](int32_t d) {
        if (group[c] == none) group[c] = roots[d];
      });
  for (int32_t& g : group)
    if (g == none) g = groups++;
  return group;
}

/// Coarse points in the order of aggregates, from the top down; `point`: that of each fine one.
std::vector<Place> number_points(const ColumnLevel& fine, const std::vector<int32_t>& group,
                                 std::vector<int32_t>& point) {
  const std::vector<int32_t> column = columns_of_points(fine);
  std::vector<Place> of_fine;
  for (int32_t i = 0; i < fine.own(); ++i)
    of_fine.push_back({group[column[i]], fine.place()[i].layer});
  std::vector<Place> place = of_fine;
  base::sort_unique(place);
  for (const Place& p : of_fine)
    point.push_back(static_cast<int32_t>(std::ranges::lower_bound(place, p) - place.begin()));
  return place;
}

/// Coupling strength of a block between two points.
float pull(const Eigen::Matrix3f& block) { return -block.trace(); }

}  // namespace

Coarsening::Coarsening(MPI_Comm comm, const ColumnLevel& fine, const std::vector<Vec3>& at)
    : fine_own_(fine.own()) {
  const std::vector<int32_t> group = aggregate(fine);
  std::vector<int32_t> point;
  std::vector<Place> place = number_points(fine, group, point);
  const auto own = static_cast<int32_t>(place.size());
  find_centers(at, point, own);
  smooth(fine, at, point);
  transpose(own);
  IndexMap points = number_ghosts(comm, fine, own);
  BlockPattern pattern = find_pattern(fine, own, points.ghosts());
  coarse_ = std::make_unique<ColumnLevel>(std::move(points), std::move(place), std::move(pattern));
}

void Coarsening::find_centers(const std::vector<Vec3>& at, const std::vector<int32_t>& point,
                              int32_t own) {
  center_.assign(own, Vec3::Zero());
  std::vector<int> members(own, 0);
  for (int32_t i = 0; i < fine_own_; ++i) {
    center_[point[i]] += at[i];
    ++members[point[i]];
  }
  for (int32_t a = 0; a < own; ++a) center_[a] /= members[a];
}

/// Changes weights that add up to 1 as little as carries linear fields, nearly.
void Coarsening::make_linear(const Vec3& at, std::vector<Candidate>& found) const {
  constexpr double regularization = 0.02;  // of the scatter: layers are flat
  Vec3 mean = Vec3::Zero();
  for (const Candidate& c : found) mean += c.weight * center_[c.point];
  Mat3 scatter = Mat3::Zero();
  for (const Candidate& c : found) {
    const Vec3 away = center_[c.point] - mean;
    scatter += c.weight * away * away.transpose();
  }
  const double size = scatter.trace();
  if (!(size > 0)) return;
  const Vec3 slope = (scatter + regularization * size * Mat3::Identity()).ldlt().solve(at - mean);
  for (Candidate& c : found) c.weight *= 1 + slope.dot(center_[c.point] - mean);
}

/// The coarse points that own point `i` moves with, by how strongly its neighbors of the layer
/// hold it, at most `maximum`.
void Coarsening::find_candidates(const ColumnLevel& fine, const std::vector<int32_t>& point,
                                 int32_t i, std::vector<Candidate>& found) {
  constexpr double damping = 0.85;
  const BlockPattern& pattern = fine.pattern();
  found.assign(1, {0.0, point[i]});
  double total = 0;
  for (int64_t k = pattern.begin[i]; k < pattern.begin[i + 1]; ++k) {
    const int32_t j = pattern.column[k];
    if (j == i || j >= fine.own() || fine.place()[j].layer != fine.place()[i].layer) continue;
    const double strength = std::max(0.0f, pull(fine.block(k)));
    total += strength;
    const auto same = std::ranges::find(found, point[j], &Candidate::point);
    if (same == found.end())
      found.push_back({strength, point[j]});
    else
      same->weight += strength;
  }
  for (Candidate& c : found) c.weight *= total > 0 ? damping / total : 0.0;
  found.front().weight += total > 0 ? 1 - damping : 1.0;
  std::ranges::sort(found, std::greater(), &Candidate::weight);
  if (found.size() > maximum) found.resize(maximum);
  double sum = 0;
  for (const Candidate& c : found) sum += c.weight;
  for (Candidate& c : found) c.weight /= sum;
}

void Coarsening::smooth(const ColumnLevel& fine, const std::vector<Vec3>& at,
                        const std::vector<int32_t>& point) {
  weights_.resize(fine.own() + fine.ghosts());
  std::vector<Candidate> found;
  for (int32_t i = 0; i < fine.own(); ++i) {
    find_candidates(fine, point, i, found);
    make_linear(at[i], found);
    Weights& weights = weights_[i];
    for (size_t m = 0; m < maximum; ++m) {
      weights.point[m] = m < found.size() ? found[m].point : point[i];
      weights.weight[m] = m < found.size() ? static_cast<float>(found[m].weight) : 0.0f;
    }
  }
}

/// Gives the ghosts their weights. Returns the coarse points, with those that ghosts move with.
IndexMap Coarsening::number_ghosts(MPI_Comm comm, const ColumnLevel& fine, int32_t own) {
  struct Message {
    std::array<int64_t, maximum> point;
    std::array<float, maximum> weight;
  };
  const int64_t first = base::count_before(comm, own);
  std::vector<Message> sent(fine.own()), received(fine.ghosts());
  for (int32_t i = 0; i < fine.own(); ++i)
    for (int m = 0; m < maximum; ++m) {
      sent[i].point[m] = first + weights_[i].point[m];
      sent[i].weight[m] = weights_[i].weight[m];
    }
  const FloatsType unit(sizeof(Message) / sizeof(float));
  fine.points().share(sent.data(), received.data(), unit);
  std::vector<int64_t> ghost;
  for (const Message& message : received)
    for (int m = 0; m < maximum; ++m) ghost.push_back(message.point[m]);
  base::sort_unique(ghost);
  IndexMap points(comm, own, std::move(ghost));
  for (size_t g = 0; g < received.size(); ++g)
    for (int m = 0; m < maximum; ++m) {
      weights_[fine.own() + g].point[m] = points.local(received[g].point[m]);
      weights_[fine.own() + g].weight[m] = received[g].weight[m];
    }
  return points;
}

void Coarsening::transpose(int32_t own) {
  share_begin_.assign(own + 1, 0);
  const auto for_each_share = [&](auto&& visit) {
    for (int32_t i = 0; i < fine_own_; ++i)
      weights_[i].visit([&](int32_t point, float weight) { visit(point, i, weight); });
  };
  for_each_share([&](int32_t point, int32_t, float) { ++share_begin_[point + 1]; });
  for (int32_t a = 0; a < own; ++a) share_begin_[a + 1] += share_begin_[a];
  share_.resize(share_begin_.back());
  std::vector<int64_t> next(share_begin_.begin(), share_begin_.end() - 1);
  for_each_share([&](int32_t point, int32_t i, float weight) {
    share_[next[point]++] = {i, weight};
  });
}

BlockPattern Coarsening::find_pattern(const ColumnLevel& fine, int32_t own, int32_t ghosts) const {
  BlockPattern pattern;
  std::vector<int32_t> seen_in(own + ghosts, none), row;
  for (int32_t a = 0; a < own; ++a) {
    row.clear();
    for (int64_t s = share_begin_[a]; s < share_begin_[a + 1]; ++s) {
      const int32_t i = share_[s].fine;
      for (int64_t k = fine.pattern().begin[i]; k < fine.pattern().begin[i + 1]; ++k)
        weights_[fine.pattern().column[k]].visit([&](int32_t b, float) {
          if (seen_in[b] == a) return;
          seen_in[b] = a;
          row.push_back(b);
        });
    }
    std::sort(row.begin(), row.end());
    pattern.column.insert(pattern.column.end(), row.begin(), row.end());
    pattern.begin.push_back(std::ssize(pattern.column));
  }
  return pattern;
}

void Coarsening::refill(const ColumnLevel& fine) {
  coarse_->clear();
  std::vector<int32_t> at(coarse_->own() + coarse_->ghosts(), none), point;
  std::vector<Eigen::Matrix3f> row;  // of A P
  for (int32_t i = 0; i < fine_own_; ++i) {
    row.clear();
    point.clear();
    for (int64_t k = fine.pattern().begin[i]; k < fine.pattern().begin[i + 1]; ++k) {
      const Eigen::Matrix3f& block = fine.block(k);
      weights_[fine.pattern().column[k]].visit([&](int32_t b, float weight) {
        if (at[b] == none) {
          at[b] = static_cast<int32_t>(point.size());
          point.push_back(b);
          row.push_back(weight * block);
        } else {
          row[at[b]] += weight * block;
        }
      });
    }
    weights_[i].visit([&](int32_t a, float weight) {
      for (size_t k = 0; k < point.size(); ++k)
        if (point[k] >= a) coarse_->add_upper(a, point[k], weight * row[k]);
    });
    for (const int32_t b : point) at[b] = none;
  }
  coarse_->mirror_upper();
}

void Coarsening::restrict_to(std::span<const Lanes> fine, std::span<Lanes> coarse) const {
  for (int32_t a = 0; a < coarse_->own(); ++a) {
    Lanes sum{};
    for (int64_t s = share_begin_[a]; s < share_begin_[a + 1]; ++s)
      sum += share_[s].weight * fine[share_[s].fine];
    coarse[a] = sum;
  }
}

void Coarsening::add_to(std::span<const Lanes> coarse, std::span<Lanes> fine) const {
  for (int32_t i = 0; i < fine_own_; ++i) {
    const Weights& w = weights_[i];
    Lanes sum{};
    for (int m = 0; m < maximum; ++m) sum += w.weight[m] * coarse[w.point[m]];
    fine[i] += sum;
  }
}

}  // namespace repose::linear
