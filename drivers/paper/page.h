#pragma once
#include <string>

#include "findings.h"

namespace repose::paper {

/// The page as Markdown: tables, claims with verdicts, and the pictures under `images` (a path from
/// the page, without ending). `command` is what made it.
std::string page(const Findings& findings, const std::string& command, const std::string& images);

/// The paper's claims, each with a verdict and figures.
std::string claims(const Findings& findings);

}  // namespace repose::paper
