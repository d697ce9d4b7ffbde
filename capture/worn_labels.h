#pragma once

#include <string>
#include <vector>

#include "capture/label_taxonomy.h"

namespace atelier {

/// What is wrong with a comma-separated list of labels of what is worn; "" if nothing.
std::string excluded_problem(const std::string& list);

/// The labels of such a list, spaces aside. Throws DataError for one with a problem.
std::vector<Label> labels_of(const std::string& list);

}  // namespace atelier
