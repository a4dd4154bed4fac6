#include "repose/linear/column_multigrid.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "repose/base/collective.h"

namespace repose::linear {

using base::check;

namespace {

constexpr int64_t coarse_enough = 40;  // points that are solved for by factors
constexpr int64_t too_many = 1500;     // for factors
constexpr double min_coarsening = 0.7;
constexpr int coarse_sweeps = 2;  // down and up, on all levels but the finest

/// The unknown points of `part`. Collective.
IndexMap unknown_points(MPI_Comm comm, const discrete::Part& part) {
  std::vector<int64_t> ghost;
  for (size_t i = part.owned_points; i < part.unknown.size(); ++i)
    if (part.unknown[i] >= 0) ghost.push_back(part.unknown[i]);
  std::ranges::sort(ghost);
  return {comm, static_cast<int32_t>(part.unknowns.owned), std::move(ghost)};
}

/// Pairs of coupled points and their largest stiffness.
class Couplings {
 public:
  Couplings(const std::vector<int32_t>& number, const std::vector<int32_t>& layer, int32_t own)
      : number_(number), layer_(layer), right_(own), diagonal_(own, 0.0) {}
  void add(int32_t p, int32_t q, const Mat3& block) {
    const auto [i, j] = std::minmax(number_[p], number_[q]);
    if (i < 0 || i >= own()) return;
    if (i == j) diagonal_[i] += block.trace();
    if (std::abs(layer_[p] - layer_[q]) > 1) layered = false;
    auto& row = right_[i];
    if (std::find(row.begin(), row.end(), j) == row.end()) row.push_back(j);
  }
  double stiffest() const {
    return own() == 0 ? 0.0 : *std::max_element(diagonal_.begin(), diagonal_.end()) / 3;
  }
  /// Returns the pattern right of the diagonal and on it, and its transpose.
  BlockPattern pattern() {
    BlockPattern pattern;
    std::vector<int32_t>& column = pattern.column;
    std::vector<std::vector<int32_t>> left(own());
    for (int32_t i = 0; i < own(); ++i) {
      std::vector<int32_t>& right = right_[i];
      if (std::ranges::find(right, i) == right.end()) right.push_back(i);
      std::ranges::sort(right);
      column.insert(column.end(), left[i].begin(), left[i].end());
      column.insert(column.end(), right.begin(), right.end());
      pattern.begin.push_back(std::ssize(column));
      for (const int32_t j : right)
        if (j > i && j < own()) left[j].push_back(i);
    }
    return pattern;
  }

  bool layered = true;  // no coupling leaps over a layer

 private:
  int32_t own() const { return static_cast<int32_t>(right_.size()); }
  const std::vector<int32_t>&number_, &layer_;
  std::vector<std::vector<int32_t>> right_;
  std::vector<double> diagonal_;
};

std::vector<Place> places(const discrete::Part& part, bool layered) {
  std::vector<Place> place;
  int32_t column = 0;
  for (int64_t i = 0; i < part.owned_points; ++i) {
    if (i > 0 && part.model.points.column[i] != part.model.points.column[i - 1]) ++column;
    if (part.unknown[i] < 0) continue;
    const auto own = static_cast<int32_t>(place.size());
    place.push_back(layered ? Place{column, part.model.points.layer[i]} : Place{own, 0});
  }
  return place;
}

}  // namespace

/// A level and its vectors.
struct ColumnMultigrid::Level {
  ColumnLevel* matrix;
  int sweeps;
  std::vector<Lanes> b, x, r;  // [own + ghosts]
  std::vector<Lanes> change;   // of x by a further sweep, where there are any
  explicit Level(ColumnLevel& level, int sweeps = 1)
      : matrix(&level),
        sweeps(sweeps),
        b(level.own() + level.ghosts()),
        x(level.own() + level.ghosts()),
        r(level.own() + level.ghosts()),
        change(sweeps > 1 ? level.own() + level.ghosts() : 0) {}

  /// Sweeps down from x = 0 on A x = b. r = b − A x. Collective.
  void sweep_down() {
    matrix->forward(b, x);
    matrix->residual_of_forward(b, x, r);
    for (int sweep = 1; sweep < sweeps; ++sweep) {
      matrix->forward(r, change);
      matrix->residual_of_forward(r, change, r);
      for (size_t i = 0; i < x.size(); ++i) x[i] += change[i];
    }
  }
  /// Sweeps up on A x = b, the transpose of sweep_down(). Collective.
  void sweep_up() {
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      matrix->update_ghosts(x);
      matrix->backward(b, x);
    }
  }
};

/// The coarsest matrix, whole on every rank.
class ColumnMultigrid::Coarsest {
 public:
  Coarsest(MPI_Comm comm, const ColumnLevel& level)
      : comm_(comm), level_(level), right_side_(3 * level.points().total()) {}

  void factor() {
    constexpr double lift = 1e-5;  // of the largest diagonal entry: above what rounding leaves
    const int64_t n = 3 * level_.points().total();
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n, n);
    for (int32_t i = 0; i < level_.own(); ++i)
      for (int64_t k = level_.pattern().begin[i]; k < level_.pattern().begin[i + 1]; ++k)
        matrix.block<3, 3>(3 * level_.points().global(i),
                           3 * level_.points().global(level_.pattern().column[k])) =
            level_.block(k).cast<double>();
    MPI_Allreduce(MPI_IN_PLACE, matrix.data(), static_cast<int>(n * n), MPI_DOUBLE, MPI_SUM, comm_);
    const double largest = n > 0 ? matrix.diagonal().maxCoeff() : 0.0;
    matrix.diagonal().array() += lift * (largest > 0 ? largest : 1.0);
    factors_.compute(matrix);
  }

  void solve(std::span<const Lanes> b, std::span<Lanes> x) {
    right_side_.setZero();
    for (int32_t i = 0; i < level_.own(); ++i)
      for (int d = 0; d < 3; ++d) right_side_[3 * (level_.points().first() + i) + d] = b[i][d];
    MPI_Allreduce(MPI_IN_PLACE, right_side_.data(), static_cast<int>(right_side_.size()),
                  MPI_DOUBLE, MPI_SUM, comm_);
    factors_.solveInPlace(right_side_);
    for (int32_t i = 0; i < level_.own(); ++i)
      for (int d = 0; d < 3; ++d)
        x[i][d] = static_cast<float>(right_side_[3 * (level_.points().first() + i) + d]);
  }

  using Factors = Eigen::LLT<Eigen::MatrixXd>;
  const Factors& factors() const { return factors_; }
  void set_factors(const Factors& factors) { factors_ = factors; }

 private:
  MPI_Comm comm_;
  const ColumnLevel& level_;
  Eigen::VectorXd right_side_;
  Factors factors_;
};

struct ColumnMultigrid::Numbers {
  std::vector<ColumnLevel::Numbers> level;  // finest first
  Coarsest::Factors factors;
  Extra extra;
};

ColumnMultigrid::ColumnMultigrid(MPI_Comm comm, const discrete::Part& part,
                                 const BlockSource& blocks)
    : comm_(comm) {
  make_fine(part, blocks);
  fill_fine(blocks);
  levels_.emplace_back(*fine_);
  std::vector<Vec3> at;
  for (int64_t i = 0; i < part.owned_points; ++i)
    if (part.unknown[i] >= 0) at.push_back(part.model.points.position[i]);
  while (levels_.back().matrix->points().total() > coarse_enough) {
    const ColumnLevel& above = *levels_.back().matrix;
    auto next = std::make_unique<Coarsening>(comm_, above, at);
    const auto total = static_cast<double>(next->coarse().points().total());
    if (total > min_coarsening * static_cast<double>(above.points().total())) break;
    next->refill(above);
    at = next->center();
    levels_.emplace_back(next->coarse(), coarse_sweeps);
    coarsening_.push_back(std::move(next));
  }
  const ColumnLevel& last = *levels_.back().matrix;
  if (last.points().total() <= too_many) coarsest_ = std::make_unique<Coarsest>(comm_, last);
  factor();
}

ColumnMultigrid::~ColumnMultigrid() = default;

void ColumnMultigrid::make_fine(const discrete::Part& part, const BlockSource& blocks) {
  IndexMap points = unknown_points(comm_, part);
  for (const int64_t unknown : part.unknown)
    number_.push_back(unknown < 0 ? -1 : points.local(unknown));
  Couplings couplings(number_, part.model.points.layer, points.own());
  blocks([&](int32_t p, int32_t q, const Mat3& block) { couplings.add(p, q, block); });
  const bool layered = base::on_all_ranks(comm_, couplings.layered);
  const double stiffest = base::max_over_ranks(comm_, couplings.stiffest());
  if (stiffest > 0 && std::isfinite(stiffest)) scale_ = stiffest;
  fine_ =
      std::make_unique<ColumnLevel>(std::move(points), places(part, layered), couplings.pattern());
}

void ColumnMultigrid::fill_fine(const BlockSource& blocks) {
  const int32_t own = fine_->own();
  const double unit = 1 / scale_;
  fine_->clear();
  blocks([&](int32_t p, int32_t q, const Mat3& block) {
    const int32_t i = number_[p], j = number_[q];
    if (i < 0 || j < 0 || std::min(i, j) >= own) return;
    if (i <= j)
      fine_->add_upper(i, j, (unit * block).cast<float>());
    else
      fine_->add_upper(j, i, (unit * block.transpose()).cast<float>());
  });
  fine_->mirror_upper();
}

void ColumnMultigrid::factor() {
  for (const Level& level : levels_) level.matrix->factor();
  if (coarsest_) coarsest_->factor();
}

void ColumnMultigrid::set_extra(const BlockSource& blocks) {
  const auto add = [](Extra& to, int32_t i, int32_t j, const Eigen::Matrix3f& block) {
    to.try_emplace({i, j}, Eigen::Matrix3f::Zero()).first->second += block;
  };
  Extra change;
  for (const auto& [at, block] : extra_) change[at] = -block;
  extra_.clear();
  blocks([&](int32_t p, int32_t q, const Mat3& block) {
    const int32_t i = number_[p], j = number_[q];
    if (i < 0 || j < 0 || std::max(i, j) >= fine_->own()) return;
    const Eigen::Matrix3f scaled = (block / scale_).cast<float>();
    add(extra_, std::min(i, j), std::max(i, j), i <= j ? scaled : scaled.transpose());
  });
  for (const auto& [at, block] : extra_) add(change, at[0], at[1], block);
  for (size_t l = 0; l < levels_.size(); ++l) {
    std::vector<int32_t> touched;
    Extra next;
    for (const auto& [at, block] : change) {
      if (block.isZero(0)) continue;
      levels_[l].matrix->add(at[0], at[1], block);
      touched.insert(touched.end(), at.begin(), at.end());
      if (l < coarsening_.size())
        coarsening_[l]->visit_change(
            at[0], at[1], block,
            [&](int32_t a, int32_t b, const Eigen::Matrix3f& sum) { add(next, a, b, sum); });
    }
    std::ranges::sort(touched);
    levels_[l].matrix->factor(touched);
    change = std::move(next);
  }
  if (coarsest_) coarsest_->factor();
}

void ColumnMultigrid::refill(const BlockSource& blocks) {
  extra_.clear();
  fill_fine(blocks);
  for (size_t l = 0; l < coarsening_.size(); ++l) coarsening_[l]->refill(*levels_[l].matrix);
  factor();
}

std::shared_ptr<const ColumnMultigrid::Numbers> ColumnMultigrid::numbers() const {
  auto numbers = std::make_shared<Numbers>();
  for (const Level& level : levels_) numbers->level.push_back(level.matrix->numbers());
  if (coarsest_) numbers->factors = coarsest_->factors();
  numbers->extra = extra_;
  return numbers;
}

void ColumnMultigrid::set_numbers(const Numbers& numbers) {
  for (size_t l = 0; l < levels_.size(); ++l) levels_[l].matrix->set_numbers(numbers.level[l]);
  if (coarsest_) coarsest_->set_factors(numbers.factors);
  extra_ = numbers.extra;
}

void ColumnMultigrid::cycle(size_t l) {
  Level& level = levels_[l];
  if (l == coarsening_.size() && coarsest_) {
    coarsest_->solve(level.b, level.x);
    return;
  }
  level.sweep_down();
  if (l < coarsening_.size()) {
    Level& coarse = levels_[l + 1];
    coarsening_[l]->restrict_to(level.r, coarse.b);
    cycle(l + 1);
    coarsening_[l]->add_to(coarse.x, level.x);
  }
  level.sweep_up();
}

void ColumnMultigrid::apply(Vec r, Vec z) {
  PetscReal largest = 0;
  check(VecNorm(r, NORM_INFINITY, &largest));
  const double unit = largest > 0 && std::isfinite(largest) ? largest : 1.0;
  const int32_t own = fine_->own();
  Level& finest = levels_.front();
  const PetscScalar* from = nullptr;
  check(VecGetArrayRead(r, &from));
  for (int32_t i = 0; i < own; ++i)
    for (int d = 0; d < 3; ++d) finest.b[i][d] = static_cast<float>(from[3 * i + d] / unit);
  check(VecRestoreArrayRead(r, &from));
  cycle(0);
  PetscScalar* to = nullptr;
  check(VecGetArrayWrite(z, &to));
  for (int32_t i = 0; i < own; ++i)
    for (int d = 0; d < 3; ++d) to[3 * i + d] = unit / scale_ * finest.x[i][d];
  check(VecRestoreArrayWrite(z, &to));
}

}  // namespace repose::linear
