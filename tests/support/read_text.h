#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace atelier::fixtures {

/// Everything in a file; "" of one that is not there.
inline std::string read_text(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

}  // namespace atelier::fixtures
