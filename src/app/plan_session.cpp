#include "repose/app/plan_session.h"

#include <algorithm>
#include <list>

#include "answer.h"
#include "given_skin_file.h"
#include "job.h"
#include "plan_pieces.h"
#include "report.h"
#include "repose/app/settings.h"
#include "repose/base/agreement.h"
#include "repose/base/collective.h"
#include "repose/base/error.h"
#include "repose/discrete/natural_rows.h"
#include "repose/model/collision.h"
#include "repose/model/material.h"
#include "repose/results/additions.h"
#include "repose/results/name_lock.h"
#include "repose/results/result_file.h"
#include "repose/scene/landmark_names.h"

namespace repose::app {

namespace {

constexpr size_t max_bases = 32, max_preconditioners = 4;  // of the latest bases

/// A solved plan that searches begin at: this rank's slabs.
struct Base {
  PlanSession::Placements plan;
  std::vector<Vec3> position;
  std::vector<double> pressure;
  std::vector<model::PointField> tangents;  // empty: it is no rest position
  std::shared_ptr<const linear::KeptPreconditioner> preconditioner;
};

/// A solved plan that can be written: this rank's rows.
struct Solved {
  PlanSession::Placements plan;
  double accuracy;  // mm
  model::StepNumbers numbers;
  model::StepRows rows;
  solve::Summary summary;
};

bool same(const PlanSession::Placements& a, const PlanSession::Placements& b) {
  return std::ranges::equal(a, b, [](const scene::Placement& p, const scene::Placement& q) {
    return p.translation == q.translation && p.rotation == q.rotation;
  });
}

/// Returns all rows of fields, on rank 0. Collective.
std::vector<model::PointField> gather_fields(MPI_Comm comm, std::vector<model::PointField> fields) {
  for (model::PointField& field : fields) field.values = base::gather(comm, field.values);
  return fields;
}

bool is_tangent(const model::PointField& field) { return field.name.starts_with("tangent_"); }

/// Gives the bones of a model other motions.
void set_motions(const std::vector<solve::PlanPiece>& pieces, model::Model& model) {
  for (const solve::PlanPiece& piece : pieces) {
    const scene::RigidMotion motion = scene::motion_of(piece.placement, piece.centroid);
    model.bone_transform[piece.bone] = motion.matrix();
    model::Points& points = model.points;
    for (size_t i = 0; i < points.position.size(); ++i)
      if (points.set[i] == model::PointSet::bone && points.bone[i] == piece.bone)
        points.target[i] = motion.apply(points.position[i]);
  }
}

/// Refuses what a session does not solve. On rank 0.
void require_plan(const std::filesystem::path& input, const Job& job) {
  const std::string file = input.string();
  if (!job.anatomy) base::refuse("{}: a session needs a scene (.yaml)", file);
  if (!job.anatomy->scene.plan)
    base::refuse("{}: the scene has no plan; add plan: {{pieces: [BONE, …]}}", file);
  if (job.tearing) base::refuse("{}: tissue that tears has no session; remove tearing", file);
  if (job.requested.functional == scene::Functional::force)
    base::refuse("{}: a session minimizes the energy; remove solve.functional", file);
}

}  // namespace

struct PlanSession::State {
  MPI_Comm comm;
  Job job;
  std::optional<SolvedSkin> skin;
  std::vector<Piece> pieces;
  solve::Derivatives derivatives;  // its pieces at the latest plan
  scene::Plan box;
  solve::Settings settings;
  std::list<Base> bases;  // the latest first
  std::optional<Solved> last;
  std::optional<solve::RestSolver> solver;  // once a solve is requested

  discrete::Part& part() { return job.local_model.part; }
  void require_inside(const Placements& placements) const;
  void take(const Placements& placements);
  std::vector<Vec3> weights(const std::vector<std::pair<int64_t, Vec3>>& functional);
  Solved search(const Placements& placements, const solve::Settings& settings,
                const solve::Start& start);
  Base* base(const Placements& placements, const std::function<bool()>& abandoned);
  void precondition(Base& base);
  solve::Start start_at(const Base& base, const Placements& placements) const;
  std::string describe(const std::vector<Vec3>& now);
};

void PlanSession::State::require_inside(const Placements& placements) const {
  if (placements.size() != pieces.size())
    throw base::InternalError("a plan places as many pieces as the session has");
  for (size_t k = 0; k < pieces.size(); ++k)
    if (const std::string outside = scene::outside_box(placements[k], box); !outside.empty())
      base::refuse("plan: '{}': {}", pieces[k].name, outside);
}

void PlanSession::State::take(const Placements& placements) {
  std::vector<solve::PlanPiece>& plan = derivatives.pieces;
  for (size_t k = 0; k < plan.size(); ++k) plan[k].placement = placements[k];
  set_motions(plan, part().model);
  if (base::rank(comm) == 0) set_motions(plan, job.local_model.global_metadata);
  if (!solver) solver.emplace(comm, part(), settings);
  for (const solve::PlanPiece& piece : plan) {
    const scene::RigidMotion motion = scene::motion_of(piece.placement, piece.centroid);
    solver->set_motion(piece.bone, motion);
    if (job.anatomy) job.anatomy->scene.moves[piece.bone] = motion;
  }
}

/// This rank's slab of the weights of points, which rank 0 has; empty if there are none.
std::vector<Vec3> PlanSession::State::weights(
    const std::vector<std::pair<int64_t, Vec3>>& functional) {
  bool any = !functional.empty();
  base::broadcast(comm, any);
  if (!any) return {};
  std::vector<Vec3> all;
  if (base::rank(comm) == 0) {
    all.assign(part().total_points, Vec3::Zero());
    for (const auto& [point, weight] : functional) all.at(point) += weight;
  }
  return base::scatter(comm, all);
}

Solved PlanSession::State::search(const Placements& placements, const solve::Settings& with,
                                  const solve::Start& start) {
  Solved solved{placements, with.path.accuracy, {}, {}, {}};
  solved.summary = solver->find(with, start, [&](const auto& numbers, const auto& rows) {
    solved.numbers = numbers;
    solved.rows = rows;
  });
  return solved;
}

/// Solves a base from the initial state, unless it is known; null where that was abandoned.
Base* PlanSession::State::base(const Placements& placements,
                               const std::function<bool()>& abandoned) {
  const auto known =
      std::ranges::find_if(bases, [&](const Base& other) { return same(other.plan, placements); });
  if (known != bases.end()) {
    bases.splice(bases.begin(), bases, known);
    return &bases.front();
  }
  require_inside(placements);
  take(placements);
  solve::Settings with = settings;
  with.derivatives.pieces = derivatives.pieces;
  with.abandoned = abandoned;
  Solved solved = search(placements, with, {});
  const solve::PathOutcome& path = solved.summary.path;
  if (path.last.stopped || solved.summary.abandoned) return nullptr;
  Base base{placements, std::move(solved.rows.position), {}, {}, {}};
  for (model::PointField& field : solved.rows.point_fields) {
    if (field.name == "contact_pressure") base.pressure = field.values;
    if (is_tangent(field) && path.complete()) base.tangents.push_back(std::move(field));
  }
  bases.push_front(std::move(base));
  if (bases.size() > max_bases) bases.pop_back();
  return &bases.front();
}

/// Makes the preconditioner of a base, of which only the latest few keep theirs.
void PlanSession::State::precondition(Base& base) {
  if (base.preconditioner) return;
  take(base.plan);
  base.preconditioner = solver->make_preconditioner({base.position, true, true, base.pressure, {}});
  size_t kept = 0;
  for (Base& other : bases)
    if (other.preconditioner && ++kept > max_preconditioners) other.preconditioner.reset();
}

/// The rest position that the base's tangents predict.
solve::Start PlanSession::State::start_at(const Base& base, const Placements& placements) const {
  solve::Start start{base.position, true, true, base.pressure, base.preconditioner};
  size_t column = 0;
  for (size_t k = 0; k < placements.size(); ++k)
    for (int c = 0; c < 6; ++c, ++column) {
      const auto component = [&](const scene::Placement& p) {
        return (c < 3 ? p.translation : p.rotation)[c % 3];
      };
      const double by = component(placements[k]) - component(base.plan[k]);
      const double* values = base.tangents[column].values.data();
      for (size_t i = 0; i < start.position.size(); ++i)
        start.position[i] += by * Eigen::Map<const Vec3>(values + 3 * i);
    }
  return start;
}

/// Describes the last answer, whose skin has the points `now`. Collective; on rank 0.
std::string PlanSession::State::describe(const std::vector<Vec3>& now) {
  const auto& [plan, accuracy, numbers, rows, summary] = *last;
  std::string text = describe_folds(comm, part(), numbers.inverted_prisms, rows.volume_ratio);
  base::on_root(comm, [&] {
    model::Anatomy& anatomy = *job.anatomy;
    anatomy.move_warnings = model::describe_overlaps_at_end(anatomy.bones, anatomy.scene);
    text = describe_answer(job, *skin, now, summary, -1) + text + describe_failure(job, summary) +
           describe_touching(job, *skin, now, summary);
  });
  return text;
}

PlanSession::PlanSession(MPI_Comm comm, const std::filesystem::path& input,
                         const scene::SceneChanges& changes)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.comm = comm;
  s.job = read_job(comm, input, {}, changes);
  base::on_root(comm, [&] {
    require_plan(input, s.job);
    s.box = *s.job.anatomy->scene.plan;
  });
  s.skin.emplace(comm, s.job);
  s.box.pieces.clear();
  base::broadcast(comm, s.box.translate, s.box.rotate);
  s.settings = settings_of(s.job.requested, s.job.local_model.part.solid);
  s.settings.initial_equilibrium = s.job.initial_equilibrium;
  s.settings.finds_other_rest = false;
  s.derivatives = plan_derivatives(comm, s.job);
  for (const solve::PlanPiece& piece : s.derivatives.pieces) {
    std::string name =
        base::rank(comm) == 0 ? s.job.local_model.global_metadata.bones[piece.bone] : "";
    base::broadcast(comm, name);
    s.pieces.push_back({name, piece.bone, piece.centroid, piece.placement});
  }
}

PlanSession::~PlanSession() = default;

const std::vector<PlanSession::Piece>& PlanSession::pieces() const { return state_->pieces; }
const scene::Plan& PlanSession::box() const { return state_->box; }
double PlanSession::accuracy() const { return state_->settings.path.accuracy; }
const model::Model& PlanSession::model() const { return state_->job.local_model.global_metadata; }

const surface::Surface* PlanSession::given_skin() const {
  const auto& anatomy = state_->job.anatomy;
  return anatomy && anatomy->given_skin ? &*anatomy->given_skin : nullptr;
}

bool PlanSession::has_cuts() const { return !state_->job.cuts.empty(); }

Mat3 PlanSession::axes() const {
  const auto& anatomy = state_->job.anatomy;
  return scene::head_axes(anatomy ? anatomy->scene.landmarks : scene::Landmarks());
}

const surface::Surface& PlanSession::skin() const { return state_->skin->initial(); }
const std::vector<int64_t>& PlanSession::skin_rows() const { return state_->skin->rows(); }

int64_t PlanSession::points() const { return state_->part().total_points; }

PlanSession::Answer PlanSession::solve(const Request& request) {
  State& s = *state_;
  s.require_inside(request.plan);
  Answer answer;
  solve::Start start;
  if (request.base) {
    Base* base = s.base(*request.base, request.abandoned);
    if (base && !base->tangents.empty()) {
      s.precondition(*base);
      start = s.start_at(*base, request.plan);
    }
  }
  s.take(request.plan);
  solve::Settings with = s.settings;
  with.path.accuracy = request.accuracy;
  with.finds_other_rest = request.other_rest;
  with.abandoned = request.abandoned;
  with.derivatives = s.derivatives;
  with.derivatives.fields = request.tangents;
  with.derivatives.functional = s.weights(request.functional);
  Solved solved = s.search(request.plan, with, start);
  answer.summary = solved.summary;
  answer.abandoned = answer.summary.path.last.stopped || answer.summary.abandoned;
  if (answer.abandoned) return answer;
  answer.from_base = answer.summary.path.leapt;
  answer.position = base::gather(s.comm, solved.rows.position);
  answer.field = gather_fields(s.comm, solved.rows.point_fields);
  s.last = std::move(solved);
  if (request.described) answer.description = s.describe(s.skin->points_at(s.last->rows.position));
  return answer;
}

bool PlanSession::has_solved(const Placements& plan, double accuracy) const {
  const std::optional<Solved>& last = state_->last;
  return last && same(last->plan, plan) && last->accuracy <= accuracy;
}

std::string PlanSession::write(const std::filesystem::path& name) {
  State& s = *state_;
  if (!s.last) base::refuse("there is no solved plan to write; solve one first");
  const Solved& last = *s.last;
  s.take(last.plan);
  std::optional<results::NameLock> lock;
  base::on_root(s.comm, [&] { lock.emplace(name); });
  results::ResultFile file(s.comm, name, s.job.local_model.global_metadata,
                           discrete::NaturalRows::of_model(s.comm, s.job.local_model));
  file.append(last.numbers, last.rows);
  file.commit();
  const std::string result = name.string() + ".h5";
  const std::vector<Vec3> now = s.skin->points_at(last.rows.position);
  std::string text = s.describe(now);
  const std::string given = write_given_skin(s.comm, s.job, name.string(), *s.skin, now);
  base::on_root(s.comm, [&] {
    text += report_row("result", "{}, {}_*.xdmf (ParaView)", result, name.string()) + given;
    const std::string refused = results::add_summary(result, text);
    if (!refused.empty()) text += report_row("warning", "{}", refused);
  });
  return text;
}

}  // namespace repose::app
