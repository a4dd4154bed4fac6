#include "repose/discrete/contact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "repose/base/collective.h"
#include "repose/base/log.h"

namespace repose::discrete {

namespace {

/// Grids of rounded bodies in spacings of the exact ones: what measured best on real heads, and
/// where the tissue's mesh is coarser, 0.75 of its edges, by the areas that its points stand for.
/// Collective.
double rounding_times(MPI_Comm comm, const model::Contact& contact) {
  constexpr double minimum = 2.5, of_an_edge = 0.75, square_of_edge = 1.155;  // over a point's area
  const std::vector<double>& of = contact.pairs.area;
  const double area = base::sum_over_ranks(comm, std::accumulate(of.begin(), of.end(), 0.0));
  const auto points = static_cast<double>(base::sum_over_ranks(comm, of.size()));
  const double edge = std::sqrt(square_of_edge * area / std::max(points, 1.0));
  return std::max(minimum, of_an_edge * edge / contact.spacing);
}

/// The contact with bodies whose edges are rounded. Collective.
mechanics::BodyContact rounded_bodies(MPI_Comm comm, const Part& part) {
  if (!part.contact) return {};
  const double times = rounding_times(comm, part.model.contact);
  std::vector<mechanics::RigidBody> bodies;
  for (const mechanics::RigidBody& body : part.bodies) bodies.push_back(body.rounded(times));
  model::ContactPairs pairs = part.model.contact.pairs;
  if (!pairs.point.empty()) pairs.offset = mechanics::contact_offsets(part.model, bodies);
  return {pairs, part.model.contact.stiffness, std::move(bodies)};
}

/// Returns the nets of cuts' sides with rounder edges: of two controls that go round an edge, which
/// are sums of several points, the first lies halfway to the second.
model::CutFaces rounded_cut_faces(const model::CutFaces& sharp) {
  model::CutFaces rounded = sharp;
  rounded.begin.assign(sharp.empty() ? 0 : 1, 0), rounded.point.clear(), rounded.weight.clear();
  const auto several = [&](size_t c) { return sharp.begin[c + 1] > sharp.begin[c] + 1; };
  const auto add = [&](size_t c, double share) {
    for (auto k = sharp.begin[c]; k < sharp.begin[c + 1]; ++k) {
      rounded.point.push_back(sharp.point[k]);
      rounded.weight.push_back(share * sharp.weight[k]);
    }
  };
  size_t c = 0;
  for (const auto& [columns, rows] : sharp.size)
    for (int64_t k = 0; k < 2 * columns * rows; ++k, ++c) {
      const bool first = k % rows == 1 && several(c - 1);
      const bool last = k % rows == rows - 2 && several(c + 1);
      const bool between = several(c) && (first || last);
      add(between ? c - 1 : c, between ? 0.5 : 1);
      if (between) add(c + 1, 0.5);
      rounded.begin.push_back(static_cast<int64_t>(rounded.point.size()));
    }
  return rounded;
}

}  // namespace

Contact::Contact(const Positions& positions)
    : positions_(positions),
      bodies_(positions.part().model.contact.pairs, positions.part().model.contact.stiffness,
              positions.part().bodies),
      other_bodies_(rounded_bodies(positions.comm(), positions.part())),
      cut_faces_(positions.part().model.contact.cut_faces,
                 positions.part().model.contact.stiffness),
      other_cut_faces_(rounded_cut_faces(positions.part().model.contact.cut_faces),
                       positions.part().model.contact.stiffness) {}

void Contact::round_edges(bool rounded) {
  if (rounded == rounded_) return;
  rounded_ = rounded;
  other_bodies_.set_multipliers(bodies_.multipliers());
  other_bodies_.set_stiffness(bodies_.stiffness());
  std::swap(bodies_, other_bodies_);
  other_cut_faces_.set_multipliers(cut_faces_.multipliers());
  other_cut_faces_.set_stiffness(bodies_.stiffness());
  std::swap(cut_faces_, other_cut_faces_);
  placed_at_ = -1;
}

void Contact::set_stiffness(double stiffness) {
  bodies_.set_stiffness(stiffness);
  cut_faces_.set_stiffness(stiffness);
}

ContactPressures Contact::multipliers() const {
  const auto p = bodies_.multipliers(), q = cut_faces_.multipliers();
  ContactPressures all(p.begin(), p.end());
  all.insert(all.end(), q.begin(), q.end());
  return all;
}

void Contact::set_multipliers(ContactPressures to) {
  const size_t touching = bodies_.multipliers().size();
  to.resize(size(), 0.0);
  bodies_.set_multipliers(std::span(to).first(touching));
  cut_faces_.set_multipliers(std::span(to).subspan(touching));
}

void Contact::update_gaps() {
  bodies_.update_gaps(positions_.local());
  cut_faces_.update_gaps(positions_.local());
}

ContactPressures Contact::pressures() const {
  ContactPressures now;
  for (size_t c = 0; c < bodies_.multipliers().size(); ++c) now.push_back(bodies_.pressure(c));
  for (size_t w = 0; w < cut_faces_.size(); ++w) now.push_back(cut_faces_.pressure(w));
  return now;
}

std::vector<double> Contact::gaps() const {
  std::vector<double> now(bodies_.gaps().begin(), bodies_.gaps().end());
  for (size_t w = 0; w < cut_faces_.size(); ++w) now.push_back(cut_faces_.gap(w));
  return now;
}

void Contact::set_pressures(const std::vector<double>& pressure) {
  std::vector<double> minimum(pressure.size(), std::numeric_limits<double>::infinity());
  std::vector<double*> nearest(pressure.size(), nullptr);
  const size_t touching = bodies_.multipliers().size();
  ContactPressures multiplier(size(), 0.0);
  cut_faces_.update_gaps(positions_.local());
  for (size_t c = 0; c < multiplier.size(); ++c) {
    const bool touches = c < touching;
    const int64_t point = touches ? bodies_.pairs().point[c] : cut_faces_.point(c - touching);
    if (pressure[point] == 0) continue;
    const double gap =
        touches ? bodies_.measure_gap(c, positions_.local()) : cut_faces_.gap(c - touching);
    if (gap < minimum[point])
      std::tie(minimum[point], nearest[point]) = std::pair(gap, &multiplier[c]);
  }
  for (size_t i = 0; i < pressure.size(); ++i)
    if (nearest[i]) *nearest[i] = pressure[i];
  set_multipliers(std::move(multiplier));
}

double Contact::violation() {
  update_gaps();
  const ContactPressures now = pressures(), before = multipliers();
  double maximum = 0;
  for (size_t c = 0; c < now.size(); ++c) maximum = std::max(maximum, std::abs(now[c] - before[c]));
  return base::max_over_ranks(positions_.comm(), maximum / stiffness());
}

double Contact::penetration() {
  update_gaps();
  double deepest = 0;
  for (const double gap : gaps()) deepest = std::max(deepest, -gap);
  return base::max_over_ranks(positions_.comm(), deepest);
}

void Contact::place_bodies() {
  if (placed_at_ == positions_.revision()) return;
  placed_at_ = positions_.revision();
  mechanics::place_bodies(
      positions_.load(), [&](int32_t bone) { return positions_.bone_matrix(bone); },
      bodies_.bodies());
}

void Contact::reset() {
  const double stiffness = positions_.part().model.contact.stiffness;
  round_edges(false);
  bodies_.reset(stiffness);
  other_bodies_.reset(stiffness);
  set_multipliers({});
  set_stiffness(stiffness);
  placed_at_ = -1;
}

double Contact::add_gradient(double scale, std::span<Vec3> gradient) {
  if (!positions_.part().contact) return 0;
  static const PetscLogEvent event = base::log_event("RpContact");
  const base::Logged logged(event);
  place_bodies();
  return bodies_.add_gradient(positions_.local(), scale, gradient) +
         cut_faces_.add_gradient(positions_.local(), scale, gradient);
}

}  // namespace repose::discrete
