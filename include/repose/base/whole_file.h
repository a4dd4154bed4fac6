#pragma once
#include <filesystem>
#include <string>
#include <string_view>

namespace repose::base {

/// Writes `bytes` to a part file and renames it to `file`, so that no half-written file is ever
/// seen. Throws InputError naming the file and the reason. Not collective.
void write_whole_file(const std::filesystem::path& file, std::string_view bytes);

/// Makes an empty file beside `file` that no other process writes, FILE.<number>.part, and returns
/// its path. Throws InputError where it cannot be made. Not collective.
std::filesystem::path begin_part(const std::filesystem::path& file);

/// The folder that a file is in.
std::filesystem::path folder_of(const std::filesystem::path& file);

/// Refuses, in one line, a path that cannot become a file: folder missing or not writable, a folder
/// in its place, a file that this process has read as an input.
void require_writable(const std::filesystem::path& file);

/// Refuses, in one line, a path without ending that names no files: empty, with control characters,
/// or one that ends as a folder's.
void require_name(const std::string& name);

/// Refuses what require_writable does, and from now on reading this file: an input that would be
/// replaced is named before the work. Not collective.
void reserve_output(const std::filesystem::path& file);

/// Records a file as an input of this process: begin_part and require_writable refuse it from now
/// on. Files that the process itself has begun to write are no inputs. Every reader calls this. Not
/// collective.
void record_input(const std::filesystem::path& file);

/// Reads a text file as an input of this process. Refuses no file, one larger than allowed and one
/// that cannot be read; the message says what it should be and ends with `advice`.
struct TextLimits {
  int mebibytes;
  const char *what, *advice;
};
std::string read_text_input(const std::filesystem::path& file, const TextLimits& limits);

}  // namespace repose::base
