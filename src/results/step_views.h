#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "unfinished_file.h"
#include "views.h"

namespace repose::results {

/// The steps of a result file as viewers see them: loads, optional arrays, and the XDMF files.
class StepViews {
 public:
  StepViews() = default;
  StepViews(const FileCounts& counts, std::vector<NamedBone> bones)
      : counts_(counts), bones_(std::move(bones)) {}

  FileCounts& counts() { return counts_; }
  const FileCounts& counts() const { return counts_; }
  const std::vector<double>& loads() const { return loads_; }

  /// Adds a step at a load; `bones_moved`: it stores moved bone surfaces.
  void add(double load, bool bones_moved);
  void remove_last();
  /// Step `step`, which may be the next one, has an array that others may be without.
  void note_field(const std::string& name, bool vector, size_t step);

  /// Returns views() of the steps that there are.
  std::vector<XdmfBlock> blocks() const;
  /// Returns the first block with a cell and the bones, for readers that open the file itself.
  std::vector<XdmfBlock> principal_blocks() const;
  /// Returns NAME_….xdmf, unfinished, of NAME.h5; one of an earlier run that would describe nothing
  /// is removed.
  std::vector<std::unique_ptr<UnfinishedFile>> describe(const std::filesystem::path& name) const;

 private:
  FileCounts counts_;
  std::vector<NamedBone> bones_;
  std::vector<OptionalField> fields_;
  std::vector<double> loads_;  // [steps]
  std::vector<bool> moved_;    // [steps] whether they hold bone surfaces
};

}  // namespace repose::results
