#pragma once

#include <string>
#include <vector>

#include "capture/label_taxonomy.h"

namespace atelier {

/// The error in a comma-separated list of labels of worn things; "" if there is none.
std::string excluded_problem(const std::string& list);

/// The labels of such a list, spaces aside. Throws DataError for one with a problem.
std::vector<Label> labels_of(const std::string& list);

}  // namespace atelier
