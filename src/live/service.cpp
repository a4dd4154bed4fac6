#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <memory>
#include <optional>

#include "listener.h"
#include "reply.h"
#include "repose/adapt/given_skin.h"
#include "repose/app/plan_session.h"
#include "repose/base/agreement.h"
#include "repose/base/program.h"
#include "repose/base/text.h"
#include "repose/live/serve.h"
#include "request.h"
#include "requests.h"

namespace repose::live {

namespace {

using app::PlanSession;
using nlohmann::json;

json write_vector(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

bool ends_a_solve(const std::string& line) {
  try {
    const Verb verb = read_request(parse_line(line)).verb;
    return verb == Verb::solve || verb == Verb::quit;
  } catch (const base::InputError&) {
    return false;
  }
}

/// Answers the requests of one channel about one scene.
class Service {
 public:
  Service(MPI_Comm comm, const std::filesystem::path& scene)
      : comm_(comm), scene_(scene), session_(std::make_unique<PlanSession>(comm, scene)) {}

  /// Answers until the input ends, the output is closed, or a request says quit; returns whether
  /// one did. Collective.
  bool run(int input, int output) {
    Requests requests(comm_, input, output);
    requests_ = &requests;
    output_ = output;
    bool quits = false;
    while (!quits) {
      const auto line = requests.next();
      if (!line) break;
      if (line->find_first_not_of(" \t\r") == std::string::npos) continue;
      if (!answer(*line, quits)) break;
    }
    return quits;
  }

 private:
  bool answer(const std::string& line, bool& quits);
  void dispatch(const Request& request, Reply& reply);
  void change(const scene::SceneChanges& changes);
  void describe(Reply& reply);
  void solve(const Request& request, Reply& reply);
  PlanSession::Placements place(const PlanMoves& plan) const;
  PlanSession::Placements scenes_plan() const;
  void write(const Request& request, Reply& reply);
  template <class Row>
  std::vector<Row> visible(const std::vector<Row>& rows) const;
  std::vector<std::pair<int64_t, Vec3>> functional(const Request& request) const;
  nlohmann::json write_gradient(const solve::Gradient& gradient) const;
  void add_arrays(const PlanSession::Answer& answer, bool all, Reply& reply) const;

  MPI_Comm comm_;
  std::filesystem::path scene_;
  std::unique_ptr<PlanSession> session_;
  Requests* requests_ = nullptr;  // of the channel that is answered, …
  int output_ = -1;               // … and where its answers go
};

/// Returns whether the answer could be sent. Errors are the same on all ranks, as the lines are.
bool Service::answer(const std::string& line, bool& quits) {
  Reply reply;
  try {
    const json object = parse_line(line);
    reply.head()["id"] = object.value("id", json());
    const Request request = read_request(object);
    quits = request.verb == Verb::quit;
    dispatch(request, reply);
  } catch (const base::InputError& error) {
    reply.refuse(error.what());
  }
  bool sent = true;
  if (base::rank(comm_) == 0) {
    std::string bytes = reply.bytes();
    if (base::size(comm_) > 1 && bytes.back() != '\n')
      bytes += '\n';  // Open MPI 5 passes on whole lines
    sent = send_all(output_, bytes);
  }
  base::broadcast(comm_, sent);
  return sent;
}

void Service::dispatch(const Request& request, Reply& reply) {
  if (request.verb == Verb::change) change(request.changes);
  if (request.verb == Verb::describe || request.verb == Verb::change) describe(reply);
  if (request.verb == Verb::solve) solve(request, reply);
  if (request.verb == Verb::write) write(request, reply);
}

/// Builds the scene with changes in place of those before. Where it cannot be, it stays as it is.
void Service::change(const scene::SceneChanges& changes) {
  session_ = std::make_unique<PlanSession>(comm_, scene_, changes);
}

template <class Row>
std::vector<Row> Service::visible(const std::vector<Row>& rows) const {
  std::vector<Row> picked;
  if (rows.empty()) return picked;
  for (const int64_t row : session_->skin_rows()) picked.push_back(rows[row]);
  return picked;
}

/// Adds the given skin and how it follows the one that is solved.
void add_given_skin(const surface::Surface& given, const surface::Surface& skin, Reply& reply) {
  constexpr size_t maximum = 16;  // points that a vertex follows
  const adapt::GivenSkinMap map = adapt::map_to_given(given, skin);
  std::vector<int32_t> row;
  std::vector<float> weight;
  for (const auto& sum : map.sum)
    for (size_t k = 0; k < maximum; ++k) {
      row.push_back(k < sum.size() ? static_cast<int32_t>(sum[k].first) : 0);
      weight.push_back(k < sum.size() ? static_cast<float>(sum[k].second) : 0);
    }
  reply.add("given_position", given.points);
  reply.add("given_triangles", given.triangles);
  reply.add("given_rows", row, maximum);
  reply.add("given_weights", weight, maximum);
}

void Service::describe(Reply& reply) {
  json& head = reply.head();
  head["accuracy"] = session_->accuracy();
  head["box"] = {{"translate", write_vector(session_->box().translate)},
                 {"rotate", write_vector(session_->box().rotate)}};
  for (const PlanSession::Piece& piece : session_->pieces())
    head["pieces"].push_back({{"name", piece.name},
                              {"bone", piece.bone},
                              {"centroid", write_vector(piece.centroid)},
                              {"translate", write_vector(piece.scenes.translation)},
                              {"rotate", write_vector(piece.scenes.rotation)}});
  if (base::rank(comm_) > 0) return;
  const model::Model& model = session_->model();
  head["points"] = session_->points();
  for (int row = 0; row < 3; ++row) head["axes"].push_back(write_vector(session_->axes().row(row)));
  head["bones"] = model.bones;
  head["cuts"] = session_->has_cuts();
  const surface::Surface& skin = session_->skin();
  reply.add("position", skin.points);
  reply.add("triangles", skin.triangles);
  if (session_->given_skin()) add_given_skin(*session_->given_skin(), skin, reply);
  for (size_t b = 0; b < model.bone_surfaces.size(); ++b) {
    reply.add(fmt::format("bone_{}_points", b), model.bone_surfaces[b].points);
    reply.add(fmt::format("bone_{}_triangles", b), model.bone_surfaces[b].triangles);
  }
}

/// By the names of pieces; those that are not named stay.
PlanSession::Placements Service::place(const PlanMoves& plan) const {
  PlanSession::Placements placements(session_->pieces().size());
  for (const auto& [name, placement] : plan) {
    const auto piece = std::ranges::find(session_->pieces(), name, &PlanSession::Piece::name);
    if (piece == session_->pieces().end()) {
      std::vector<std::string> names;
      for (const PlanSession::Piece& other : session_->pieces()) names.push_back(other.name);
      base::refuse("plan: {} is no piece of the plan; its pieces are {}", base::quote(name),
                   fmt::join(names, ", "));
    }
    placements[piece - session_->pieces().begin()] = placement;
  }
  return placements;
}

/// Weights by rows of the model. On rank 0.
std::vector<std::pair<int64_t, Vec3>> Service::functional(const Request& request) const {
  const std::vector<int64_t>& rows = session_->skin_rows();
  const auto count = request.all_points ? session_->points() : static_cast<int64_t>(rows.size());
  std::vector<std::pair<int64_t, Vec3>> functional;
  for (const auto& [point, weight] : request.gradient_of) {
    if (point >= count)
      base::refuse("gradient_of: point {} is none of the answer's {} points", point, count);
    functional.emplace_back(request.all_points ? point : rows[point], weight);
  }
  return functional;
}

json Service::write_gradient(const solve::Gradient& gradient) const {
  json pieces = json::object();
  for (size_t k = 0; k < session_->pieces().size(); ++k) {
    const auto begin = gradient.by_pieces.begin() + static_cast<std::ptrdiff_t>(6 * k);
    pieces[session_->pieces()[k].name] = {{"translate", std::vector<double>(begin, begin + 3)},
                                          {"rotate", std::vector<double>(begin + 3, begin + 6)}};
  }
  return {{"pieces", pieces},
          {"young", gradient.by_strata},
          {"finished", gradient.finished},
          {"convex", gradient.convex}};
}

json write_other_rest(const solve::Outcome& last) {
  if (!last.other) return {};
  return {{"distance", last.other->distance}, {"place", last.other->place}};
}

/// Adds positions and fields, of all points or of the visible ones. On rank 0.
void Service::add_arrays(const PlanSession::Answer& answer, bool all, Reply& reply) const {
  reply.add("position", all ? answer.position : visible(answer.position));
  for (const model::PointField& field : answer.field) {
    if (field.vector) {
      std::vector<Vec3> vectors;
      for (size_t i = 0; i + 2 < field.values.size(); i += 3)
        vectors.push_back(Vec3::Map(&field.values[i]));
      reply.add(field.name, all ? vectors : visible(vectors));
    } else {
      reply.add(field.name, all ? field.values : visible(field.values));
    }
    for (const auto& [name, flag] : field.flags) reply.head()["flags"][field.name][name] = flag;
  }
}

PlanSession::Placements Service::scenes_plan() const {
  PlanSession::Placements plan;
  for (const PlanSession::Piece& piece : session_->pieces()) plan.push_back(piece.scenes);
  return plan;
}

/// Writes the requested plan, which is solved unless it was solved last. No later request ends
/// that.
void Service::write(const Request& request, Reply& reply) {
  if (request.plan) {
    const PlanSession::Placements plan = place(*request.plan), from = scenes_plan();
    const double accuracy = session_->accuracy();
    if (!session_->has_solved(plan, accuracy))
      session_->solve({.plan = plan, .accuracy = accuracy, .base = &from});
  }
  reply.head()["summary"] = session_->write(request.output);
}

void Service::solve(const Request& request, Reply& reply) {
  PlanSession::Request requested;
  requested.plan = place(request.plan.value_or(PlanMoves()));
  requested.accuracy = request.accuracy.value_or(session_->accuracy());
  requested.tangents = request.tangents;
  base::on_root(comm_, [&] { requested.functional = functional(request); });
  const PlanSession::Placements from = request.base ? place(*request.base) : scenes_plan();
  if (!request.from_rest) requested.base = &from;
  requested.other_rest = request.other_rest;
  requested.described = request.summary;
  requested.abandoned = [this] { return requests_->superseded(ends_a_solve); };
  const double before = base::cpu_seconds();
  const PlanSession::Answer answer = session_->solve(requested);
  const solve::PathOutcome& path = answer.summary.path;
  if (answer.abandoned) base::refuse("abandoned: a later request overtook it");
  json& head = reply.head();
  head["converged"] = path.complete();
  head["error"] = path.last.displacement_error;
  head["energy"] = path.last.objective;
  head["reason"] = path.last.reason;
  head["evaluations"] = answer.summary.evaluations;
  head["from_base"] = answer.from_base;
  if (request.other_rest) head["other_rest"] = write_other_rest(path.last);
  if (request.summary) head["summary"] = answer.description;
  head["seconds"] = base::cpu_seconds() - before;
  if (answer.summary.gradient) head["gradient"] = write_gradient(*answer.summary.gradient);
  if (base::rank(comm_) == 0) add_arrays(answer, request.all_points, reply);
}

/// Waits for a client, whose descriptor rank 0 gets. Collective.
int accept_client(MPI_Comm comm, const std::optional<Listener>& listener) {
  int client = -1;
  std::string refused;
  try {
    if (listener) client = listener->accept();
  } catch (const base::InputError& error) {
    refused = error.what();
  }
  broadcast_asleep(comm, refused);
  if (!refused.empty()) throw base::InputError(refused);
  return client;
}

}  // namespace

base::Exit serve(MPI_Comm comm, const std::filesystem::path& scene, const Channel& channel) {
  std::signal(SIGPIPE, SIG_IGN);
  std::optional<Listener> listener;
  base::on_root(comm, [&] {
    if (channel.port) listener.emplace(*channel.port);
  });
  Service service(comm, scene);
  if (!channel.port) {
    service.run(channel.input, channel.output);
    return base::Exit::done;
  }
  if (listener) {
    const json address = {{"port", listener->port()}, {"token", listener->token()}};
    send_all(channel.output, address.dump() + "\n");
  }
  for (bool quits = false; !quits;) {
    const int client = accept_client(comm, listener);
    quits = service.run(client, client);
    if (client >= 0) close(client);
  }
  return base::Exit::done;
}

}  // namespace repose::live
