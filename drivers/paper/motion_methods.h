#pragma once
#include "contest.h"

namespace repose::paper {

/// The equations of motion integrated from the initial positions to the accuracy of the rest
/// position: semi-implicit Euler and Runge–Kutta 3(2), with the damping, and for Euler the step,
/// that do best of a scan. Damping: 1, 2 and 4 times the critical one of the softest mode at rest;
/// steps: 1, ½, … of Euler's largest stable one there. One evaluation is one of the forces.
std::vector<Entry> run_motion(Contest& contest, double accuracy);

}  // namespace repose::paper
