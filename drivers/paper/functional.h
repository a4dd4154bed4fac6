#pragma once
#include <array>
#include <string>

#include "repose/solve/repose.h"

/// The paper's four functionals (Eqs. 7–12), λ = 0.5 where the volume term f_v is on.
namespace repose::paper {

struct Functional {
  const char* name;
  bool force, volume;
};

inline constexpr std::array<Functional, 4> functionals = {{{"f_e", false, false},
                                                           {"f_e + f_v", false, true},
                                                           {"f_f", true, false},
                                                           {"f_f + f_v", true, true}}};

/// What repose-solve would be asked for, with automatic load steps.
solve::Settings settings_of(const Functional& functional, double accuracy);

}  // namespace repose::paper
