#include "step_views.h"

#include <algorithm>

#include "repose/results/run_files.h"

namespace repose::results {

void StepViews::add(double load, bool bones_moved) {
  loads_.push_back(load);
  moved_.push_back(bones_moved);
}

void StepViews::remove_last() {
  loads_.pop_back();
  moved_.pop_back();
  for (OptionalField& field : fields_) field.in_step.resize(loads_.size());
  std::erase_if(fields_, [](const OptionalField& field) {
    return std::ranges::find(field.in_step, true) == field.in_step.end();
  });
}

void StepViews::note_field(const std::string& name, bool vector, size_t step) {
  auto known = std::ranges::find(fields_, name, &OptionalField::name);
  if (known == fields_.end()) known = fields_.insert(known, {name, vector, {}});
  known->in_step.resize(step + 1);
  known->in_step.back() = true;
}

std::vector<XdmfBlock> StepViews::blocks() const {
  std::vector<OptionalField> of_steps = fields_;
  for (OptionalField& field : of_steps) field.in_step.resize(loads_.size());
  return views(counts_, of_steps, moved_);
}

std::vector<XdmfBlock> StepViews::principal_blocks() const {
  std::vector<XdmfBlock> shown;
  for (const XdmfBlock& block : blocks())
    if (block.cells > 0 && (shown.empty() || block.name == "bones")) shown.push_back(block);
  return shown;
}

std::vector<std::unique_ptr<UnfinishedFile>> StepViews::describe(
    const std::filesystem::path& name) const {
  std::vector<std::unique_ptr<UnfinishedFile>> documents;
  const std::string h5 = name.filename().string() + ".h5";
  const auto describe_as = [&](const std::string& view, bool requested, const auto& shown) {
    const std::filesystem::path document = name.string() + view_ending(view);
    if (!requested) {
      std::error_code ignored;
      std::filesystem::remove(document, ignored);
      return;
    }
    documents.push_back(std::make_unique<UnfinishedFile>(document));
    documents.back()->write(xdmf_document(shown, h5, loads_));
  };
  const std::vector<XdmfBlock> all = blocks();
  for (const XdmfBlock& block : all) describe_as(block.name, block.cells > 0, block);
  const std::vector<XdmfBlock> named = named_blocks(all, bones_);
  describe_as(named_view, named.size() > 1, named);
  return documents;
}

}  // namespace repose::results
