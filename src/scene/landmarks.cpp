#include "repose/scene/landmarks.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <optional>
#include <sstream>

#include "repose/base/error.h"
#include "repose/base/text.h"
#include "repose/base/whole_file.h"

namespace repose::scene {

namespace {

enum class Frame { lps, ras };

/// A coordinate system by name, or by number as old .fcsv files have it.
Frame frame_of(const std::string& place, const std::string& word) {
  if (word == "LPS" || word == "1") return Frame::lps;
  if (word == "RAS" || word == "0") return Frame::ras;
  base::refuse("{}: the coordinate system is {}; it must be LPS or RAS", place, base::quote(word));
}

Vec3 to_lps(Frame frame, const Vec3& position) {
  return frame == Frame::lps ? position : Vec3(-position.x(), -position.y(), position.z());
}

double coordinate(const std::string& place, const std::string& name, const std::string& word) {
  const auto number = base::parse_number(word);
  if (!number)
    base::refuse("{}: landmark {}: {} is not a finite number of mm", place, base::quote(name),
                 base::quote(word));
  return *number;
}

// --- .mrk.json

std::string place_of(const std::string& file, const YAML::Node& node) {
  return fmt::format("{}:{}:{}", file, node.Mark().line + 1, node.Mark().column + 1);
}

std::string scalar(const YAML::Node& node) {
  return node.IsDefined() && node.IsScalar() ? node.Scalar() : "";
}

void check_units(const std::string& file, const YAML::Node& markup) {
  const YAML::Node units = markup["coordinateUnits"];
  if (!units.IsDefined() || units.IsNull()) return;
  const auto is_mm = [](const YAML::Node& unit) { return scalar(unit) == "mm"; };
  const bool good =
      units.IsSequence() ? std::all_of(units.begin(), units.end(), is_mm) : is_mm(units);
  if (!good) base::refuse("{}: coordinateUnits must be mm", place_of(file, units));
}

Landmark control_point(const std::string& file, const YAML::Node& point, Frame frame,
                       size_t number) {
  Landmark landmark{scalar(point["label"]), {}};
  if (landmark.name.empty()) landmark.name = std::to_string(number);
  const YAML::Node position = point["position"];
  if (!position.IsDefined() || !position.IsSequence() || position.size() != 3)
    base::refuse("{}: landmark {} has no position of three numbers", place_of(file, point),
                 base::quote(landmark.name));
  for (int axis = 0; axis < 3; ++axis)
    landmark.position[axis] =
        coordinate(place_of(file, position), landmark.name, scalar(position[axis]));
  landmark.position = to_lps(frame, landmark.position);
  return landmark;
}

void add_markup(const std::string& file, const YAML::Node& markup, std::vector<Landmark>& found) {
  if (!markup.IsMap()) base::refuse("{}: a markup must be an object", place_of(file, markup));
  const YAML::Node frame = markup["coordinateSystem"];
  if (!frame.IsDefined())
    base::refuse(
        "{}: the markup does not say its coordinateSystem; add \"coordinateSystem\": \"LPS\" (or "
        "RAS)",
        place_of(file, markup));
  const Frame known = frame_of(place_of(file, frame), scalar(frame));
  check_units(file, markup);
  const YAML::Node points = markup["controlPoints"];
  if (!points.IsDefined() || !points.IsSequence()) return;
  for (const YAML::Node& point : points) {
    if (!point.IsMap())
      base::refuse("{}: a control point must be an object", place_of(file, point));
    const std::string status = scalar(point["positionStatus"]);
    if (status.empty() || status == "defined")
      found.push_back(control_point(file, point, known, found.size() + 1));
  }
}

/// Entries "name": [x, y, z], LPS.
void add_named_points(const std::string& file, const YAML::Node& root,
                      std::vector<Landmark>& found) {
  for (const auto& entry : root) {
    if (!root.IsMap() || !entry.second.IsSequence() || entry.second.size() != 3) continue;
    Landmark landmark{scalar(entry.first), {}};
    for (int axis = 0; axis < 3; ++axis)
      landmark.position[axis] =
          coordinate(place_of(file, entry.second), landmark.name, scalar(entry.second[axis]));
    found.push_back(landmark);
  }
  if (found.empty())
    base::refuse(
        "{}: holds no \"markups\" and no \"name\": [x, y, z]; save the points from 3D Slicer as "
        ".mrk.json",
        file);
}

/// JSON is read as the YAML that it also is.
std::vector<Landmark> read_markups(const std::string& file, const std::string& text) {
  try {
    const YAML::Node root = YAML::Load(text);
    const YAML::Node markups = root.IsMap() ? root["markups"] : YAML::Node();
    std::vector<Landmark> found;
    if (!markups.IsDefined() || !markups.IsSequence()) {
      add_named_points(file, root, found);
      return found;
    }
    for (const YAML::Node& markup : markups) add_markup(file, markup, found);
    return found;
  } catch (const YAML::Exception& error) {
    std::string reason = base::quote(error.msg);
    base::refuse("{}:{}:{}: not valid JSON: {}", file, error.mark.line + 1, error.mark.column + 1,
                 reason.substr(1, reason.size() - 2));
  }
}

// --- .fcsv and .csv

/// The fields of a line; a comma inside quotes does not part them.
std::vector<std::string> fields(const std::string& line) {
  std::vector<std::string> found(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"')
      quoted = !quoted;
    else if (c == ',' && !quoted)
      found.emplace_back();
    else
      found.back() += c;
  }
  for (std::string& field : found) field = base::trimmed(field);
  return found;
}

/// Where a row has its name (−1: nowhere) and its first coordinate.
struct Columns {
  int name, first;
};

class Table {
 public:
  Table(std::string file, bool fcsv) : file_(std::move(file)), fcsv_(fcsv) {}

  std::vector<Landmark> read(const std::string& text) {
    std::istringstream stream(text);
    std::string line;
    for (size_t number = 1; std::getline(stream, line); ++number) {
      const std::string place = fmt::format("{}:{}", file_, number);
      line = base::trimmed(line);
      if (line.empty()) continue;
      if (line[0] == '#')
        take_comment(place, line);
      else
        take_row(place, fields(line));
    }
    return found_;
  }

 private:
  void take_comment(const std::string& place, const std::string& line) {
    const size_t equals = line.find('=');
    if (equals == std::string::npos) return;
    const std::string key = base::trimmed(line.substr(1, equals - 1));
    const std::string value = base::trimmed(line.substr(equals + 1));
    if (key == "CoordinateSystem") frame_ = frame_of(place, value);
    if (key != "columns" || !fcsv_) return;
    const auto names = fields(value);
    const auto at = [&](const char* name) {
      const auto found = std::find(names.begin(), names.end(), name);
      return found == names.end() ? -1 : static_cast<int>(found - names.begin());
    };
    if (at("x") < 0) base::refuse("{}: the columns name no x", place);
    columns_ = Columns{at("label"), at("x")};
  }

  void take_row(const std::string& place, const std::vector<std::string>& row) {
    const auto size = static_cast<int>(row.size());
    const Columns columns = columns_ ? *columns_
                            : fcsv_  ? Columns{11, 1}
                                     : Columns{size - 4, size - 3};
    const bool title = !fcsv_ && found_.empty() && size > 0 && !base::parse_number(row.back());
    if (title && !titled_) {
      titled_ = true;
      return;
    }
    if (columns.first < 0 || columns.first + 3 > size || (!fcsv_ && size > 4))
      base::refuse("{}: expected {}, got {} field(s)", place,
                   fcsv_ ? "the columns of a .fcsv file" : "name, x, y, z, separated by commas",
                   size);
    if (!frame_)
      base::refuse(
          "{}: the file does not say its coordinate system; put a line \"# CoordinateSystem = "
          "LPS\" (or RAS) before the points",
          place);
    Landmark landmark{columns.name >= 0 && columns.name < size ? row[columns.name] : "", {}};
    if (landmark.name.empty()) landmark.name = std::to_string(found_.size() + 1);
    for (int axis = 0; axis < 3; ++axis)
      landmark.position[axis] = coordinate(place, landmark.name, row[columns.first + axis]);
    landmark.position = to_lps(*frame_, landmark.position);
    found_.push_back(landmark);
  }

  std::string file_;
  bool fcsv_, titled_ = false;
  std::optional<Frame> frame_;
  std::optional<Columns> columns_;
  std::vector<Landmark> found_;
};

}  // namespace

std::vector<Landmark> read_landmarks(const std::filesystem::path& file) {
  const std::string name = file.string();
  const std::string text = base::read_text_input(
      file, {16, "a file of landmarks", "give landmarks as .mrk.json, .fcsv or .csv"});
  const std::string ending = base::lower(file.extension().string());
  std::vector<Landmark> found;
  if (ending == ".json")
    found = read_markups(name, text);
  else if (ending == ".fcsv" || ending == ".csv")
    found = Table(name, ending == ".fcsv").read(text);
  else
    base::refuse("{}: the ending is none of .mrk.json, .fcsv and .csv", name);
  if (found.empty()) base::refuse("{}: holds no landmark that is placed", name);
  return found;
}

std::map<std::string, Vec3> landmarks_by_name(const std::filesystem::path& file) {
  constexpr double same = 1e-3;  // mm
  std::map<std::string, Vec3> named;
  for (const auto& [name, position] : read_landmarks(file)) {
    const double apart = (named.try_emplace(name, position).first->second - position).norm();
    if (apart > same)
      base::refuse("{}: landmark {} comes twice, {:.1f} mm apart; rename or remove one",
                   file.string(), base::quote(name), apart);
  }
  return named;
}

namespace {

std::string json_text(const std::string& text) {
  YAML::Emitter emitter;
  emitter << YAML::EscapeAsJson << YAML::DoubleQuoted << text;
  return emitter.c_str();
}

}  // namespace

std::string markups_text(const std::map<std::string, Vec3>& landmarks) {
  std::string points;
  int number = 0;
  for (const auto& [name, at] : landmarks)
    points += fmt::format(
        "{}        {{\"id\": \"{}\", \"label\": {}, \"position\": [{:.4f}, {:.4f}, {:.4f}], "
        "\"positionStatus\": \"defined\"}}",
        points.empty() ? "" : ",\n", ++number, json_text(name), at.x(), at.y(), at.z());
  return "{\n"
         "  \"@schema\": \"https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/"
         "Markups/Resources/Schema/markups-schema-v1.0.3.json#\",\n"
         "  \"markups\": [\n    {\n      \"type\": \"Fiducial\",\n"
         "      \"coordinateSystem\": \"LPS\",\n      \"coordinateUnits\": \"mm\",\n"
         "      \"controlPoints\": [\n" +
         points + "\n      ]\n    }\n  ]\n}\n";
}

}  // namespace repose::scene
