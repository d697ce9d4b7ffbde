#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/io/file_bytes.h"
#include "core/store/stage.h"
#include "tests/support/places.h"

namespace atelier::fixtures {

/// Stages of a fixture that make results in the name of the program's own, with the versions that
/// those have: with others their results would be outdated.
inline std::vector<Stage> with_program_versions(std::span<const Stage> stages) {
  const std::string text =
      read_file_text(source_directory() / "pipeline/stages/stages.cpp", 1 << 20);
  const std::string version = ".version = ";
  std::vector<Stage> all(stages.begin(), stages.end());
  for (Stage& stage : all) {
    const std::size_t at = text.find("Stage{.name = \"" + std::string(stage.name) + "\"");
    const std::size_t found = text.find(version, at);
    if (found < text.find("Stage{", at + 1)) {
      stage.version = std::stoi(text.substr(found + version.size()));
    }
  }
  return all;
}

}  // namespace atelier::fixtures
