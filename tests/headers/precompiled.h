#pragma once

// Parsed once for the headers that bring it (CMakeLists.txt beside).

#include <Eigen/Core>
