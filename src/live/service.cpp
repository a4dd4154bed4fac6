#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <optional>

#include "listener.h"
#include "reply.h"
#include "repose/adapt/given_skin.h"
#include "repose/app/plan_session.h"
#include "repose/base/agreement.h"
#include "repose/base/program.h"
#include "repose/live/serve.h"
#include "requests.h"

namespace repose::live {

namespace {

using app::PlanSession;
using nlohmann::json;

constexpr const char* all_verbs = "describe, solve, write, quit";

/// Refuses members that a request does not have.
void require_known(const json& map, const char* where, std::initializer_list<const char*> known) {
  if (!map.is_object()) base::refuse("{} must be an object", where);
  for (const auto& [name, value] : map.items())
    if (std::ranges::none_of(known, [&](const char* k) { return name == k; }))
      base::refuse("{} has no member '{}'; it has {}", where, name, fmt::join(known, ", "));
}

Vec3 read_vector(const json& map, const char* name) {
  Vec3 vector = Vec3::Zero();
  if (!map.contains(name)) return vector;
  const json& value = map[name];
  if (!value.is_array() || value.size() != 3 ||
      !std::ranges::all_of(value, [](const json& v) { return v.is_number(); }))
    base::refuse("{} must be three numbers", name);
  for (int a = 0; a < 3; ++a) vector[a] = value[a].get<double>();
  return vector;
}

json write_vector(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

bool ends_a_solve(const std::string& line) {
  const json request = json::parse(line, nullptr, false);
  if (!request.is_object()) return false;
  const json verb = request.value("do", json());
  return verb == "solve" || verb == "quit";
}

/// Answers the requests of one channel about one scene.
class Service {
 public:
  Service(MPI_Comm comm, const std::filesystem::path& scene) : comm_(comm), session_(comm, scene) {}

  /// Answers until the input ends, the output is closed, or a request says quit; returns whether
  /// one did. Collective.
  bool run(int input, int output) {
    Requests requests(comm_, input);
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
  void dispatch(const json& request, Reply& reply);
  void describe(Reply& reply);
  void solve(const json& request, Reply& reply);
  PlanSession::Placements read_plan(const json& value) const;
  template <class Row>
  std::vector<Row> shown(const std::vector<Row>& rows) const;
  void find_shown();

  MPI_Comm comm_;
  PlanSession session_;
  Requests* requests_ = nullptr;  // of the channel that is answered, …
  int output_ = -1;               // … and where its answers go
  std::vector<int64_t> skin_;     // rows of the points of the skin, on rank 0
};

/// Returns whether the answer could be sent. Errors are the same on all ranks, as the lines are.
bool Service::answer(const std::string& line, bool& quits) {
  const json request = json::parse(line, nullptr, false);
  const bool good = request.is_object();
  Reply reply(good && request.contains("id") ? request["id"] : json());
  try {
    if (!good) base::refuse("a request must be one JSON object on a line");
    dispatch(request, reply);
  } catch (const base::InputError& error) {
    reply.refuse(error.what());
  } catch (const json::exception& error) {
    reply.refuse(error.what());
  }
  int sent = 1;
  if (base::rank(comm_) == 0) sent = send_all(output_, reply.bytes());
  MPI_Bcast(&sent, 1, MPI_INT, 0, comm_);
  quits = good && request.value("do", json()) == "quit";
  return sent != 0;
}

void Service::dispatch(const json& request, Reply& reply) {
  const json verb = request.value("do", json());
  if (verb == "describe") {
    require_known(request, "describe", {"id", "do"});
    describe(reply);
  } else if (verb == "solve") {
    solve(request, reply);
  } else if (verb == "write") {
    require_known(request, "write", {"id", "do", "output"});
    if (!request.contains("output") || !request["output"].is_string())
      base::refuse("write needs output, the path of the result without ending");
    session_.write(request["output"].get<std::string>());
  } else if (verb != "quit") {
    base::refuse("do must be one of {}", all_verbs);
  }
}

/// The skin's points: those of layer 0 that its triangles have.
void Service::find_shown() {
  if (!skin_.empty()) return;
  for (const auto& triangle : session_.model().skin)
    skin_.insert(skin_.end(), triangle.begin(), triangle.end());
  std::ranges::sort(skin_);
  skin_.erase(std::unique(skin_.begin(), skin_.end()), skin_.end());
}

template <class Row>
std::vector<Row> Service::shown(const std::vector<Row>& rows) const {
  std::vector<Row> picked;
  if (rows.empty()) return picked;
  for (const int64_t row : skin_) picked.push_back(rows[row]);
  return picked;
}

/// Adds the given skin and how it follows the one that is solved.
void add_given_skin(const surface::Surface& given, const surface::Surface& skin, Reply& reply) {
  constexpr size_t most = 16;  // points that a vertex follows
  const adapt::GivenSkinMap map = adapt::map_to_given(given, skin);
  std::vector<int32_t> row;
  std::vector<float> weight;
  for (const auto& sum : map.sum)
    for (size_t k = 0; k < most; ++k) {
      row.push_back(k < sum.size() ? static_cast<int32_t>(sum[k].first) : 0);
      weight.push_back(k < sum.size() ? static_cast<float>(sum[k].second) : 0);
    }
  reply.add("given_position", given.points);
  reply.add("given_triangles", given.triangles);
  reply.add("given_rows", row, most);
  reply.add("given_weights", weight, most);
}

void Service::describe(Reply& reply) {
  find_shown();
  json& head = reply.head();
  head["accuracy"] = session_.accuracy();
  head["box"] = {{"translate", write_vector(session_.box().translate)},
                 {"rotate", write_vector(session_.box().rotate)}};
  for (const PlanSession::Piece& piece : session_.pieces())
    head["pieces"].push_back({{"name", piece.name},
                              {"bone", piece.bone},
                              {"centroid", write_vector(piece.centroid)},
                              {"translate", write_vector(piece.scenes.translation)},
                              {"rotate", write_vector(piece.scenes.rotation)}});
  const std::vector<Vec3> initial = session_.initial();
  if (base::rank(comm_) > 0) return;
  const model::Model& model = session_.model();
  head["points"] = initial.size();
  head["bones"] = model.bones;
  head["cuts"] = session_.has_cuts();
  surface::Surface skin{"skin", shown(initial), {}};
  for (const auto& triangle : model.skin) {
    Triangle& corners = skin.triangles.emplace_back();
    for (int k = 0; k < 3; ++k)
      corners[k] = std::ranges::lower_bound(skin_, triangle[k]) - skin_.begin();
  }
  reply.add("position", skin.points);
  reply.add("triangles", skin.triangles);
  if (session_.given_skin()) add_given_skin(*session_.given_skin(), skin, reply);
  for (size_t b = 0; b < model.bone_surfaces.size(); ++b) {
    reply.add(fmt::format("bone_{}_points", b), model.bone_surfaces[b].points);
    reply.add(fmt::format("bone_{}_triangles", b), model.bone_surfaces[b].triangles);
  }
}

/// By the names of pieces; those that are not named stay.
PlanSession::Placements Service::read_plan(const json& value) const {
  if (!value.is_object()) base::refuse("plan must be an object: {{PIECE: {{translate, rotate}}}}");
  PlanSession::Placements plan(session_.pieces().size());
  for (const auto& [name, motion] : value.items()) {
    const auto piece = std::ranges::find(session_.pieces(), name, &PlanSession::Piece::name);
    if (piece == session_.pieces().end()) {
      std::vector<std::string> names;
      for (const PlanSession::Piece& other : session_.pieces()) names.push_back(other.name);
      base::refuse("plan: '{}' is no piece of the plan; its pieces are {}", name,
                   fmt::join(names, ", "));
    }
    require_known(motion, "a piece's motion", {"translate", "rotate"});
    plan[piece - session_.pieces().begin()] = {read_vector(motion, "translate"),
                                               read_vector(motion, "rotate")};
  }
  return plan;
}

void Service::solve(const json& request, Reply& reply) {
  require_known(request, "solve", {"id", "do", "plan", "accuracy", "tangents", "base", "points"});
  find_shown();
  PlanSession::Request wanted;
  wanted.plan = read_plan(request.value("plan", json::object()));
  wanted.accuracy = request.value("accuracy", session_.accuracy());
  if (!(wanted.accuracy >= 1e-6 && wanted.accuracy <= 10))
    base::refuse("accuracy must be 1e-6 … 10 mm");
  wanted.tangents = request.value("tangents", false);
  PlanSession::Placements scenes;
  for (const PlanSession::Piece& piece : session_.pieces()) scenes.push_back(piece.scenes);
  const json base = request.value("base", json("scene"));
  const bool at_rest = base == "rest";
  const PlanSession::Placements from = at_rest || base == "scene" ? scenes : read_plan(base);
  if (!at_rest) wanted.base = &from;
  wanted.abandoned = [this] { return requests_->overtaken(ends_a_solve); };
  const double before = base::cpu_seconds();
  const PlanSession::Answer answer = session_.solve(wanted);
  const solve::PathOutcome& path = answer.summary.path;
  if (path.last.stopped) base::refuse("abandoned: a later request overtook it");
  json& head = reply.head();
  head["converged"] = path.complete();
  head["error"] = path.last.displacement_error;
  head["reason"] = path.last.reason;
  head["evaluations"] = answer.summary.evaluations;
  head["from_base"] = answer.from_base;
  head["seconds"] = base::cpu_seconds() - before;
  if (base::rank(comm_) > 0) return;
  const bool all = request.value("points", "skin") == "all";
  reply.add("position", all ? answer.position : shown(answer.position));
  for (const model::PointField& field : answer.field) {
    std::vector<Vec3> vectors;
    if (field.vector)
      for (size_t i = 0; i + 2 < field.values.size(); i += 3)
        vectors.push_back(Vec3::Map(&field.values[i]));
    if (field.vector)
      reply.add(field.name, all ? vectors : shown(vectors));
    else
      reply.add(field.name, all ? field.values : shown(field.values));
    for (const auto& [name, flag] : field.flags) head["flags"][field.name][name] = flag;
  }
}

}  // namespace

base::Exit serve(MPI_Comm comm, const std::filesystem::path& scene, const Channel& channel) {
  std::signal(SIGPIPE, SIG_IGN);
  std::optional<Listener> listener;
  base::on_first_rank(comm, [&] {
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
    const int client = listener ? listener->accept() : -1;
    quits = service.run(client, client);
    if (client >= 0) close(client);
  }
  return base::Exit::done;
}

}  // namespace repose::live
