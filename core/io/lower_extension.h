#pragma once

#include <algorithm>
#include <filesystem>
#include <string>

namespace atelier {

/// A file's extension with its dot, A to Z as small letters whatever the locale: ".obj" of "A.OBJ".
inline std::string lower_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return extension;
}

}  // namespace atelier
