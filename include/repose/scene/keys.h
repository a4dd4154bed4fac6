#pragma once
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "repose/base/text.h"

/// The one table of a scene file's keys: what is checked, suggested and documented comes from it.
namespace repose::scene {

enum class KeyKind {
  map,
  list,
  number,
  integer,
  numbers,  ///< list of numbers
  vector,   ///< [x, y, z]
  choice,
  text,
  texts,  ///< a text or a list of texts
  place,  ///< [x, y, z] or the name of a landmark
  file,
  mesh,       ///< a file, or a map that names a volume
  volume,     ///< a file, or a folder of DICOM slices
  transform,  ///< a file, a 4×4 matrix, or a list of forms
  curve       ///< a list of [x, y, z], or a file of landmarks
};

struct Key {
  std::string
      path;  ///< "tissue.layers"; [] stands for an item of a list, * for a name of one's own
  KeyKind kind;
  std::string standard;  ///< default as written in a file, "required", or empty: not modeled
  std::string sentence;  ///< what it is
  std::string unit{};
  base::Range range{};                 ///< of a number, or of each of several
  std::vector<std::string> choices{};  ///< words; for a number those that may stand in its place
  std::map<std::string, std::string>
      removed{};  ///< words of earlier versions: what to give instead

  bool required() const { return standard == "required"; }
};

const std::vector<Key>& all_keys();

/// The row of a path; InternalError where the table has none.
const Key& find_key(std::string_view path);

/// The rows directly below a path ("" for the file), in the table's order.
std::vector<const Key*> keys_below(std::string_view path);

/// The last word of a path: what is written in the file.
std::string last_word(std::string_view path);

/// Describes a valid value, for messages and the documentation: "a number of mm, > 0".
std::string expected(const Key& key);

/// The table in Markdown, one row a key: key, value, default, meaning.
std::string describe_keys();

}  // namespace repose::scene
