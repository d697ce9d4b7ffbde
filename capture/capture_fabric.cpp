#include "capture/capture_fabric.h"

#include <nlohmann/json.hpp>

#include "core/io/json.h"
#include "core/io/json_place.h"

namespace atelier {

std::string capture_fabric(const std::filesystem::path& capture) {
  const std::filesystem::path file = capture / "synthesis.json";
  if (!std::filesystem::exists(file)) {
    return "";
  }
  const nlohmann::json json = read_json(file);
  const auto options = JsonPlace(json, file.string()).find("options");
  return options ? options->text_or("fabric.kind", "") : "";
}

}  // namespace atelier
