#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

namespace atelier::fixtures {

/// What a page of files shows: its scene.js.
inline nlohmann::json page_scene(const std::filesystem::path& page) {
  std::ifstream file(page / "scene.js");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::size_t begin = text.find('{');
  return nlohmann::json::parse(text.substr(begin, text.rfind('}') + 1 - begin));
}

/// "name: role" of the layers of its first timeline, each followed by a blank.
inline std::string layers_of(const std::filesystem::path& page) {
  const nlohmann::json scene = page_scene(page);
  std::string layers;
  for (const nlohmann::json& layer : scene.at("timelines").at(0).at("layers")) {
    layers +=
        layer.at("name").get<std::string>() + ": " + layer.at("role").get<std::string>() + " ";
  }
  return layers;
}

}  // namespace atelier::fixtures
