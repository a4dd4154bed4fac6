#pragma once
#include <functional>
#include <vector>

#include "contest.h"
#include "size.h"

namespace repose::paper {

/// The methods of Tables 2 and 3 on one functional.
struct Comparison {
  int layers = 0;
  Functional functional;
  Entry own;                     ///< as repose-solve does it
  bool reference_known = false;  ///< else it is only where the search for it came to
  bool from_energy = false;      ///< the reference was sought from the energy's rest position
  std::vector<Entry> entries;    ///< Polak–Ribière, then TAO's
};

/// The equations of motion of the springs alone, and the direct methods beside them.
struct MotionRun {
  int layers = 0;
  std::vector<Entry> entries;
};

/// Scene and settings of the measurements.
struct Plan {
  scene::Scene scene;
  std::vector<int> layers;
  Rules rules;
};

struct Findings {
  Plan plan;
  std::vector<Size> sizes;
  std::vector<Comparison> comparisons;
  std::vector<MotionRun> motions;
};

/// TAO's methods in the tables.
inline const std::vector<std::string> tao_methods = {"cg", "lmvm", "nls", "ntr"};

/// Runs all experiments; `tell` is given a line before each. Serial.
Findings measure(const Plan& plan, const std::function<void(const std::string&)>& tell);

}  // namespace repose::paper
