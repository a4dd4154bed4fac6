#include <CGAL/IO/OBJ.h>
#include <CGAL/IO/STL.h>

#include <algorithm>
#include <functional>
#include <sstream>

#include "cgal.h"
#include "repose/base/error.h"
#include "repose/base/text.h"
#include "soup.h"

/// STL and OBJ through CGAL's readers, which answer only yes or no and trust what they read:
/// each file is brought into the plainest form of its format first.
namespace repose::surface {
namespace {

using Points = std::vector<Point3>;
using Polygons = std::vector<std::vector<size_t>>;
using Reader = bool (*)(std::istream&, Points&, Polygons&);

/// Throws InputError; told what was read and at which byte the reader stopped.
using Complaint = std::function<void(std::string_view bytes, size_t stop)>;

Soup read_with(Reader read, std::string bytes, const Complaint& complain) {
  std::istringstream in(std::move(bytes));
  Points points;
  Polygons polygons;
  if (!read(in, points, polygons)) {
    in.clear();
    complain(in.view(), std::min(static_cast<size_t>(in.tellg()), in.view().size()));
  }
  Soup soup;
  soup.points.reserve(points.size());
  for (const auto& point : points) soup.points.push_back(from_cgal(point));
  for (const auto& polygon : polygons) soup.polygons.emplace_back(polygon.begin(), polygon.end());
  return soup;
}

bool read_stl(std::istream& in, Points& points, Polygons& polygons) {
  return CGAL::IO::read_STL(in, points, polygons);
}

Complaint damaged_binary(const std::string& file) {
  return [file](std::string_view bytes, size_t stop) {
    base::refuse("{}: damaged near byte {} of {}; export it again", file, stop, bytes.size());
  };
}

/// Names FILE:LINE and shows the line.
Complaint damaged_text(const std::string& file) {
  return [file](std::string_view text, size_t stop) {
    const size_t last = stop > 0 ? stop - 1 : 0;
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<int64_t>(last), '\n');
    size_t begin = last > 0 ? text.rfind('\n', last - 1) + 1 : 0;  // npos + 1 is the beginning
    base::refuse(
        "{}:{}: truncated, not a number where one belongs, or a vertex that is not there, near {}; "
        "export it again",
        file, line, base::quote(base::next_line(text, begin)));
  };
}

/// Rewrites a text line by line, so that line numbers stay: rewrite(line, line number from 1).
template <class Rewrite>
std::string rewrite_lines(const std::string& text, Rewrite rewrite) {
  std::string result;
  result.reserve(text.size());
  int64_t number = 0;
  for (size_t position = 0; position < text.size();) {
    result += rewrite(base::next_line(text, position), ++number);
    result += '\n';
  }
  return result;
}

/// The readers take the beginning of a word for a number, or say no without saying where.
void check_point(const std::vector<std::string_view>& line, const std::string& file,
                 int64_t number) {
  if (line.size() < 4)
    base::refuse("{}:{}: three coordinates expected; export it again", file, number);
  for (int k = 1; k <= 3; ++k)
    if (!base::parse_number(line[k]))
      base::refuse("{}:{}: {} is not a finite number; export it again", file, number,
                   base::quote(line[k]));
}

/// Lower case; solids lose their names, which could be keywords.
std::string plain_stl(const Content& content) {
  return rewrite_lines(content.bytes, [&](std::string_view line, int64_t number) {
    const std::string lowered = base::lower(line);
    const auto found = base::words(lowered);
    if (found.empty()) return std::string();
    if (found[0] == "vertex") check_point(found, content.file.string(), number);
    const bool solid = found[0] == "solid" || found[0] == "endsolid";
    return solid ? std::string(found[0]) : lowered;
  });
}

/// A vertex or face, its words separated by one blank; empty where a line holds neither.
std::string plain_obj_line(std::string_view line, const std::string& file, int64_t number) {
  const auto found = base::words(line);
  std::string plain;
  if (found.empty() || (found[0] != "v" && found[0] != "f")) return plain;
  if (found[0] == "v") check_point(found, file, number);
  for (const auto& word : found) {
    plain += word;
    plain += ' ';
  }
  return plain;
}

/// Vertices and faces only; a line that goes on in the next is joined with it.
std::string plain_obj(const Content& content) {
  const std::string file = content.file.string();
  std::string joined;
  std::string text = rewrite_lines(content.bytes, [&](std::string_view line, int64_t number) {
    joined += line.substr(0, line.find('#'));
    if (joined.ends_with('\\')) {
      joined.back() = ' ';
      return std::string();
    }
    std::string plain = plain_obj_line(joined, file, number);
    joined.clear();
    return plain;
  });
  if (!joined.empty()) base::refuse("{}: truncated: its last line goes on; export it again", file);
  return text;
}

}  // namespace

Soup parse_stl_text(Content content) {
  const Complaint complain = [&](std::string_view, size_t) {
    base::refuse(
        "{}: truncated or damaged: a facet without three vertices, or no endsolid; export "
        "it again",
        content.file.string());
  };
  // The reader takes a text it does not understand for a binary file, and one shorter than the
  // header of that for an empty file.
  const std::string padding(stl_header_bytes, '\n');
  return read_with(read_stl, plain_stl(content) + padding, complain);
}

Soup parse_stl_binary(Content content) {
  const std::string file = content.file.string();
  const size_t size = content.bytes.size(), promised = stl_size(content.bytes);
  if (promised == 0)
    base::refuse("{}: truncated: {} bytes, and a binary STL has at least {}; export it again", file,
                 size, stl_header_bytes);
  if (promised != size)
    base::refuse(
        "{}: truncated or damaged: {} bytes, but the {} triangles it promises take {}; "
        "export it again",
        file, size, (promised - stl_header_bytes) / stl_triangle_bytes, promised);
  content.bytes.replace(0, 5, "plain");  // "solid" would have it read as text
  return read_with(read_stl, std::move(content.bytes), damaged_binary(file));
}

Soup parse_obj(Content content) {
  const Reader read = [](std::istream& in, Points& points, Polygons& polygons) {
    return CGAL::IO::read_OBJ(in, points, polygons);
  };
  return read_with(read, plain_obj(content), damaged_text(content.file.string()));
}

}  // namespace repose::surface
