#pragma once
#include <array>
#include <string>

#include "repose/solve/repose.h"

/// The paper's four functionals (Eqs. 7–12), λ = 0.5 where the volume term f_v is on.
namespace repose::paper {

struct Functional {
  const char* name;
  bool force = false, volume = false;
};

inline constexpr std::array<Functional, 4> functionals = {
    {{.name = "f_e"},
     {.name = "f_e + f_v", .volume = true},
     {.name = "f_f", .force = true},
     {.name = "f_f + f_v", .force = true, .volume = true}}};

/// Returns the settings of an equivalent run of repose-solve, with automatic load steps.
solve::Settings settings_of(const Functional& functional, double accuracy);

}  // namespace repose::paper
