#pragma once

#include <string>

#include "core/tensor.h"

namespace atelier {

/// DataError unless the elements are real numbers, finite and from -`most` to `most`; names the
/// first that is not. For readers of bodies and motions, with `Limits::mesh_coordinate`.
void check_bounded(const Tensor& tensor, double most, const std::string& file,
                   const std::string& name);

}  // namespace atelier
