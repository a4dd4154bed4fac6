#include "repose/surface/ply.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include "repose/base/error.h"
#include "repose/base/text.h"

namespace repose::surface {
namespace {

template <class Number>
double decode(const char* bytes) {
  Number number;
  std::memcpy(&number, bytes, sizeof number);
  return static_cast<double>(number);
}

template <class Number>
PlyType type_of(const char* name) {
  return {name, sizeof(Number), decode<Number>};
}

/// Each type with its two names.
const std::vector<std::pair<PlyType, const char*>>& known_types() {
  static const std::vector<std::pair<PlyType, const char*>> types = {
      {type_of<int8_t>("char"), "int8"},    {type_of<uint8_t>("uchar"), "uint8"},
      {type_of<int16_t>("short"), "int16"}, {type_of<uint16_t>("ushort"), "uint16"},
      {type_of<int32_t>("int"), "int32"},   {type_of<uint32_t>("uint"), "uint32"},
      {type_of<float>("float"), "float32"}, {type_of<double>("double"), "float64"}};
  return types;
}

/// Reads the lines of one header.
class HeaderParser {
 public:
  explicit HeaderParser(const Content& content) : content_(content) {}

  PlyHeader parse() {
    size_t position = 0;
    while (position < content_.bytes.size()) {
      const auto line = base::words(base::next_line(content_.bytes, position));
      ++header_.lines;
      if (!line.empty() && line[0] == "end_header") {
        header_.bytes = position;
        std::erase_if(header_.elements, [](const PlyElement& e) { return e.properties.empty(); });
        return header_;
      }
      if (!line.empty()) parse(line);
    }
    fail("the header has no end_header: the file is truncated");
  }

 private:
  void parse(const std::vector<std::string_view>& line) {
    const auto keyword = line[0];
    if (keyword == "ply" || keyword == "comment" || keyword == "obj_info") return;
    if (keyword == "format" && line.size() >= 2)
      header_.format = line[1];
    else if (keyword == "element" && line.size() == 3)
      header_.elements.push_back({std::string(line[1]), count(line[2]), {}});
    else if (keyword == "property" && line.size() == 3)
      add({std::string(line[2]), type(line[1]), {}});
    else if (keyword == "property" && line.size() == 5 && line[1] == "list")
      add({std::string(line[4]), type(line[3]), type(line[2])});
    else
      fail(base::quote(keyword) + " does not begin a line of a PLY header");
  }

  void add(PlyProperty property) {
    if (header_.elements.empty()) fail("a property before any element");
    header_.elements.back().properties.push_back(std::move(property));
  }

  uint64_t count(std::string_view word) const {
    const auto value = base::parse_integer(word);
    if (!value || *value < 0) fail(base::quote(word) + " is not a number of rows");
    return static_cast<uint64_t>(*value);
  }

  PlyType type(std::string_view word) const {
    for (const auto& [known, alias] : known_types())
      if (word == known.name || word == alias) return known;
    fail(fmt::format("unknown type {} (char, uchar, short, ushort, int, uint, float, double)",
                     base::quote(word)));
  }

  [[noreturn]] void fail(const std::string& reason) const {
    base::refuse("{}:{}: {}; export the mesh again as PLY", content_.file.string(), header_.lines,
                 reason);
  }

  const Content& content_;
  PlyHeader header_{"", {}, 0, 0};
};

const PlyElement* find_element(const PlyHeader& header, bool (PlyElement::*is)() const) {
  const auto found = std::ranges::find_if(header.elements, is);
  return found == header.elements.end() ? nullptr : &*found;
}

void check_coordinates(const PlyElement& vertex, const std::string& file) {
  for (const char* axis : {"x", "y", "z"}) {
    const auto& all = vertex.properties;
    const auto found = std::ranges::find(all, axis, &PlyProperty::name);
    if (found == all.end())
      base::refuse("{}: its vertices have no property {}; export the mesh with x, y and z", file,
                   axis);
    if (found->list_size || !found->type.is_real())
      base::refuse("{}: property {} is {}; export coordinates as float or double", file, axis,
                   found->list_size ? "a list" : found->type.name);
  }
}

void check_indices(const PlyElement& face, const std::string& file) {
  const size_t row = index_list(face);
  if (row == face.properties.size())
    base::refuse("{}: its faces have no property vertex_indices; export the mesh as polygons",
                 file);
  const PlyProperty& property = face.properties[row];
  if (!property.list_size) base::refuse("{}: property {} is not a list", file, property.name);
  if (property.list_size->is_real() || property.type.bytes != 4 || property.type.is_real())
    base::refuse("{}: property {} is a list {} {}; export vertex indices as list uchar int", file,
                 property.name, property.list_size->name, property.type.name);
}

/// Every value of a text body takes a character and a blank.
void check_text_size(const PlyHeader& header, const Content& content) {
  uint64_t room = (content.bytes.size() - header.bytes + 1) / 2;
  for (const auto& element : header.elements) {
    const uint64_t values = element.properties.size();
    if (element.count > room / values)
      base::refuse(
          "{}: truncated or damaged: the header promises {} rows of element {}, more than "
          "the file can hold ({} bytes); export it again",
          content.file.string(), element.count, base::quote(element.name), content.bytes.size());
    room -= element.count * values;
  }
}

}  // namespace

PlyHeader parse_ply_header(const Content& content) { return HeaderParser(content).parse(); }

void check_ply(const PlyHeader& header, const Content& content) {
  const std::string file = content.file.string();
  const bool text = header.format == "ascii";
  if (!text && header.format != "binary_little_endian" && header.format != "binary_big_endian")
    base::refuse("{}: format {} is none of ascii, binary_little_endian, binary_big_endian", file,
                 base::quote(header.format));
  const PlyElement* vertex = find_element(header, &PlyElement::is_vertex);
  const PlyElement* face = find_element(header, &PlyElement::is_face);
  if (!vertex || vertex->count == 0)
    base::refuse("{}: holds no vertices; export the mesh again", file);
  if (!face || face->count == 0)
    base::refuse("{}: holds no faces (a point cloud?); export a triangle mesh", file);
  check_coordinates(*vertex, file);
  check_indices(*face, file);
  if (text) check_text_size(header, content);
}

size_t index_list(const PlyElement& face) {
  const auto& all = face.properties;
  const auto is_list = [](const std::string& name) {
    return name == "vertex_indices" || name == "vertex_index";
  };
  return std::ranges::find_if(all, is_list, &PlyProperty::name) - all.begin();
}

}  // namespace repose::surface
