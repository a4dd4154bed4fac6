#include "repose/mechanics/term.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <map>

#include "adhesion.h"
#include "repose/base/error.h"

namespace repose::mechanics {

namespace {

/// Elastic support of a point of tissue by a bone: a spring of no rest length between the point and
/// its initial place on the bone (docs/theory/load_path.md). Numbers: the place, mm; the stiffness,
/// N/mm; the row of the bone.
struct ElasticSupport {
  static constexpr int points = 1, numbers = 5;
  template <class Number>
  static Number energy(const Corners<Number, points>& x, std::span<const double> n) {
    return n[3] / 2 * (x[0] - Vec3(n[0], n[1], n[2]).cast<Number>()).squaredNorm();
  }
};

std::map<std::string, std::unique_ptr<const Term>>& known_terms() {
  static std::map<std::string, std::unique_ptr<const Term>> terms = [] {
    std::map<std::string, std::unique_ptr<const Term>> built_in;
    built_in["adhesion"] = std::make_unique<DifferentiatedTerm<Adhesion>>();
    built_in["elastic_support"] = std::make_unique<DifferentiatedTerm<ElasticSupport>>();
    return built_in;
  }();
  return terms;
}

}  // namespace

void add_term(const std::string& name, std::unique_ptr<const Term> term) {
  known_terms()[name] = std::move(term);
}

const Term& term_of(const model::TermElements& elements) {
  const auto found = known_terms().find(elements.term);
  if (found == known_terms().end())
    base::refuse(
        "the model has elements of an energy \"{}\", which this program does not define; use the "
        "one that made it",
        elements.term);
  const Term& term = *found->second;
  if (term.points() != elements.points_each || term.numbers() != elements.numbers_each)
    base::refuse(
        "elements of the energy \"{}\" have {} points and {} numbers each, expected {} and {}",
        elements.term, elements.points_each, elements.numbers_each, term.points(), term.numbers());
  return term;
}

TermLoop::TermLoop(const model::TermElements& elements, const model::Points& points, int64_t owned)
    : term_(&term_of(elements)), each_(static_cast<size_t>(elements.points_each)) {
  for (const bool counts : {true, false}) {
    for (size_t e = 0; e < elements.size(); ++e) {
      const auto of = elements.points_of(e);
      const auto numbers = elements.numbers_of(e);
      if (!model::touches_soft_tissue(points, of) || (of[0] < owned) != counts) continue;
      points_.insert(points_.end(), of.begin(), of.end());
      numbers_.insert(numbers_.end(), numbers.begin(), numbers.end());
      bone_.push_back(elements.bone_of(e));
    }
    if (counts) counted_ = size();
  }
}

Mat4 TermLoop::pose_of(size_t e, BonePoses poses) const {
  return bone_[e] < 0 || poses.empty() ? Mat4(Mat4::Identity()) : poses[bone_[e]];
}

std::vector<Vec3> TermLoop::places(size_t e, std::span<const Vec3> position,
                                   BonePoses poses) const {
  const Mat4 pose = pose_of(e, poses);
  const Mat3 back = pose.topLeftCorner<3, 3>().transpose();
  std::vector<Vec3> x;
  for (const int32_t p : points_of(e)) x.push_back(back * (position[p] - pose.col(3).head<3>()));
  return x;
}

double TermLoop::value(std::span<const Vec3> position, BonePoses poses) const {
  double value = 0;
  Eigen::VectorXd slope;
  for (size_t e = 0; e < counted_; ++e)
    value += term_->gradient(places(e, position, poses), numbers_of(e), slope);
  return value;
}

double TermLoop::add_gradient(std::span<const Vec3> position, BonePoses poses, double scale,
                              std::span<Vec3> gradient) const {
  double value = 0;
  Eigen::VectorXd slope;
  for (size_t e = 0; e < size(); ++e) {
    const double here = term_->gradient(places(e, position, poses), numbers_of(e), slope);
    if (e < counted_) value += here;
    const Mat3 turn = pose_of(e, poses).topLeftCorner<3, 3>();
    for (size_t i = 0; i < each_; ++i)
      gradient[points_of(e)[i]] +=
          scale * turn * slope.segment<3>(static_cast<Eigen::Index>(3 * i));
  }
  return value;
}

Eigen::MatrixXd TermLoop::hessian_of(size_t e, std::span<const Vec3> position, BonePoses poses,
                                     bool exact) const {
  Eigen::MatrixXd hessian = term_->hessian(places(e, position, poses), numbers_of(e));
  if (exact) return hessian;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> of(hessian);
  return of.eigenvectors() * of.eigenvalues().cwiseMax(0).asDiagonal() *
         of.eigenvectors().transpose();
}

}  // namespace repose::mechanics
