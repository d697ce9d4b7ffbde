#pragma once

#include <string>

namespace atelier {

/// True for names that are safe as one part of a path: of [A-Za-z0-9._-], 1 to 100 bytes, not
/// starting with a dot.
bool is_plain_name(const std::string& name);

/// "000012": how frames are named in a capture's files.
std::string frame_name(int frame_id);

}  // namespace atelier
