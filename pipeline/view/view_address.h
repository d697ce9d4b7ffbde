#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace atelier {

/// The file of a page that the path of an address asks for: "data/0/1.js" of
/// "/TOKEN/data/0/1.js", "index.html" of "/TOKEN/". None where the token is another (compared in a
/// time that does not tell how much of it is right) or the path has anything but names of
/// [a-z0-9._-] between single "/", none of which begins with a dot.
std::optional<std::string> page_file_of(std::string_view path, std::string_view token);

}  // namespace atelier
