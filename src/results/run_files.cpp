#include "repose/results/run_files.h"

#include "views.h"

namespace repose::results {

std::string view_ending(const std::string& view) { return "_" + view + ".xdmf"; }

std::vector<std::string> run_file_endings() {
  std::vector<std::string> endings = {".h5", given_skin_ending, view_ending(named_view)};
  for (const XdmfBlock& view : views({}, {}, {})) endings.push_back(view_ending(view.name));
  for (size_t i = 0, count = endings.size(); i < count; ++i)
    endings.push_back(checkpoint_suffix + endings[i]);
  return endings;
}

}  // namespace repose::results
