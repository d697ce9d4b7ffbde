#pragma once

#include <vector>

#include "capture/dataset.h"
#include "core/finding.h"

namespace atelier {

/// One finding in place of those that every camera has alike, two at least: with the same words,
/// its own name aside, or of lenses and sizes with other numbers, of which the first camera's are
/// given. Its place is "all N cameras"; of settings the values of all are joined ("all=270" of one
/// value); all cameras are never advised to be left out. Order is kept, at the first of them.
std::vector<Finding> join_alike(const std::vector<Finding>& findings, const Dataset& dataset);

}  // namespace atelier
