#include "pipeline/view/view_beside.h"

#include <utility>

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// A place as it is told from others: without links, "." and "..", or a slash at its end.
fs::path whole(const fs::path& place) {
  const fs::path path = fs::absolute(place).lexically_normal();
  return path.has_filename() ? path : path.parent_path();
}

}  // namespace

std::array<std::string, 2> names_apart(const fs::path& first, const fs::path& second) {
  fs::path a = whole(first);
  fs::path b = whole(second);
  if (a == b) {
    return {a.filename().string() + " (1)", a.filename().string() + " (2)"};
  }
  std::array<fs::path, 2> names = {a.filename(), b.filename()};
  while (names[0] == names[1]) {
    a = a.parent_path();
    b = b.parent_path();
    names = {a.filename() / names[0], b.filename() / names[1]};
  }
  return {names[0].string(), names[1].string()};
}

void put_beside(ViewScene& scene, ViewScene other, const std::array<std::string, 2>& names) {
  for (ViewTimeline& timeline : scene.timelines) {
    timeline.name = names[0] + ": " + timeline.name;
  }
  scene.beside = scene.timelines.size();
  for (ViewTimeline& timeline : other.timelines) {
    timeline.name = names[1] + ": " + timeline.name;
    scene.timelines.push_back(std::move(timeline));
  }
  scene.notes.insert(scene.notes.end(), other.notes.begin(), other.notes.end());
  scene.title = names[0] + " and " + names[1];
}

}  // namespace atelier
