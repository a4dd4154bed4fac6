#include "request.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "repose/base/error.h"
#include "repose/base/text.h"
#include "repose/base/whole_file.h"

namespace repose::live {

namespace {

using nlohmann::json;

constexpr base::Range accuracies = base::Range::between(1e-6, 10);  // mm

/// A value as a message shows it.
std::string shown(const json& value) {
  return base::quote(value.dump(-1, ' ', true, json::error_handler_t::replace));
}

[[noreturn]] void refuse_value(const std::string& name, const char* requested, const json& value) {
  base::refuse("{} must be {}, not {}", name, requested, shown(value));
}

void require_known(const json& map, const std::string& where,
                   const std::vector<std::string>& known) {
  if (!map.is_object()) base::refuse("{} must be an object, not {}", where, shown(map));
  for (const auto& [name, value] : map.items())
    if (std::ranges::find(known, name) == known.end())
      base::refuse("{} has no member {}; it has {}", where, base::quote(name),
                   fmt::join(known, ", "));
}

Vec3 read_vector(const json& motion, const std::string& piece, const char* name) {
  Vec3 vector = Vec3::Zero();
  if (!motion.contains(name)) return vector;
  const json& value = motion[name];
  const auto is_number = [](const json& v) { return v.is_number(); };
  if (!value.is_array() || value.size() != 3 || !std::ranges::all_of(value, is_number))
    refuse_value(fmt::format("{}: {}", base::quote(piece), name), "three numbers", value);
  for (int a = 0; a < 3; ++a) vector[a] = value[a].get<double>();
  return vector;
}

PlanMoves read_plan(const json& value, const std::string& where) {
  if (!value.is_object()) refuse_value(where, "an object {PIECE: {translate, rotate}}", value);
  PlanMoves plan;
  for (const auto& [piece, motion] : value.items()) {
    require_known(motion, "a piece's motion", {"translate", "rotate"});
    plan[piece] = {read_vector(motion, piece, "translate"), read_vector(motion, piece, "rotate")};
  }
  return plan;
}

void read_accuracy(const json& value, Request& request) {
  if (!value.is_number() || !accuracies.contains(value.get<double>()))
    refuse_value("accuracy", "a number, 1e-6 … 10 mm", value);
  request.accuracy = value.get<double>();
}

bool read_flag(const json& value, const char* name) {
  if (!value.is_boolean()) refuse_value(name, "true or false", value);
  return value.get<bool>();
}

/// Numbers beyond int64_t, which rows are, would come out negative.
bool is_row(const json& value) {
  return value.is_number_unsigned() && std::in_range<int64_t>(value.get<uint64_t>());
}

void read_gradient_of(const json& value, Request& request) {
  constexpr double least = 1e-100, most = 1e100;
  if (!value.is_array() || value.empty())
    refuse_value("gradient_of", "a list of {\"point\": row, \"weight\": [x, y, z]}", value);
  for (const json& one : value) {
    require_known(one, "gradient_of", {"point", "weight"});
    if (!one.contains("point") || !is_row(one["point"]) || !one.contains("weight"))
      refuse_value("gradient_of: point", "a row of the answer's points, from 0", one);
    const Vec3 weight = read_vector(one, "gradient_of", "weight");
    if ((weight.array() != 0 && (weight.array().abs() < least || weight.array().abs() > most))
            .any())
      refuse_value("gradient_of: weight", "three numbers, each 0 or of 1e-100 … 1e100", one);
    request.gradient_of.emplace_back(one["point"].get<int64_t>(), weight);
  }
}

void read_base(const json& value, Request& request) {
  request.from_rest = value == "rest";
  if (value == "rest" || value == "scene") return;
  if (!value.is_object()) refuse_value("base", "\"rest\", \"scene\" or a plan", value);
  request.base = read_plan(value, "base");
}

/// After `base`.
void read_other_rest(const json& value, Request& request) {
  request.other_rest = read_flag(value, "other_rest");
  if (request.other_rest && request.base)
    base::refuse(
        "other_rest is searched for from the state before the bones move, not from a "
        "plan; leave base out");
  if (request.other_rest) request.from_rest = true;
}

void read_requested_plan(const json& value, Request& request) {
  request.plan = read_plan(value, "plan");
}

void read_points(const json& value, Request& request) {
  if (value != "skin" && value != "all") refuse_value("points", "\"skin\" or \"all\"", value);
  request.all_points = value == "all";
}

void read_output(const json& value, Request& request) {
  if (!value.is_string()) refuse_value("output", "the path of the result without ending", value);
  request.output = base::without_ending(value.get<std::string>(), {".h5"});
  base::require_name(request.output);
}

template <const char* key>
void read_change(const json& value, Request& request) {
  request.changes[key] = value.dump();
}

constexpr char material[] = "tissue.material", attach_regions[] = "tissue.attach_regions",
               release[] = "tissue.release", boundary[] = "boundary";

struct Member {
  const char* name;
  void (*read)(const json& value, Request& request);
  bool required = false;
};

struct VerbMembers {
  const char* name;
  Verb verb;
  std::vector<Member> members;  ///< beside id and do
};

const std::vector<VerbMembers>& verbs() {
  static const std::vector<VerbMembers> table = {
      {"describe", Verb::describe, {}},
      {"solve",
       Verb::solve,
       {{"plan", read_requested_plan},
        {"accuracy", read_accuracy},
        {"tangents",
         [](const json& value, Request& r) { r.tangents = read_flag(value, "tangents"); }},
        {"gradient_of", read_gradient_of},
        {"base", read_base},
        {"other_rest", read_other_rest},
        {"summary", [](const json& value, Request& r) { r.summary = read_flag(value, "summary"); }},
        {"points", read_points}}},
      {"change",
       Verb::change,
       {{"material", read_change<material>},
        {"attach_regions", read_change<attach_regions>},
        {"release", read_change<release>},
        {"boundary", read_change<boundary>}}},
      {"write", Verb::write, {{"output", read_output, true}, {"plan", read_requested_plan}}},
      {"quit", Verb::quit, {}}};
  return table;
}

/// Returns the depth of the deepest array or object outside of texts.
int nesting(const std::string& line) {
  int depth = 0, deepest = 0;
  bool in_text = false;
  for (size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (in_text && c == '\\')
      ++i;
    else if (c == '"')
      in_text = !in_text;
    else if (!in_text && (c == '{' || c == '['))
      deepest = std::max(deepest, ++depth);
    else if (!in_text && (c == '}' || c == ']'))
      --depth;
  }
  return deepest;
}

}  // namespace

json parse_line(const std::string& line) {
  constexpr int deepest = 8;  // a plan's vector is at 4; JSON values are copied by recursion
  if (line.size() > longest_line)
    base::refuse("a request must be a line of at most {} bytes; this one is longer", longest_line);
  if (const int depth = nesting(line); depth > deepest)
    base::refuse("a request nests at most {} arrays and objects; this one nests {}", deepest,
                 depth);
  json object = json::parse(line, nullptr, false);
  if (!object.is_object()) base::refuse("a request must be one JSON object on a line");
  return object;
}

Request read_request(const json& object) {
  const json verb = object.value("do", json());
  const auto found =
      std::ranges::find_if(verbs(), [&](const VerbMembers& other) { return verb == other.name; });
  if (found == verbs().end()) {
    std::vector<std::string> names;
    for (const VerbMembers& other : verbs()) names.emplace_back(other.name);
    base::refuse("do must be one of {}", fmt::join(names, ", "));
  }
  if (object.contains("id") && object["id"].is_structured())
    refuse_value("id", "a text or a number", object["id"]);
  std::vector<std::string> known = {"id", "do"};
  for (const Member& member : found->members) known.emplace_back(member.name);
  require_known(object, found->name, known);
  Request request;
  request.verb = found->verb;
  for (const Member& member : found->members)
    if (object.contains(member.name))
      member.read(object[member.name], request);
    else if (member.required)
      base::refuse("{} needs the member {}", found->name, member.name);
  return request;
}

}  // namespace repose::live
