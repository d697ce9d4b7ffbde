#include "core/io/gltf_asset.h"

#include <nlohmann/json.hpp>
#include <optional>

namespace atelier {
namespace {

constexpr std::size_t kLongest = 4096;  // bytes
constexpr const char* kConsent = "Consent: ";

std::string text_in(const JsonPlace& object, const char* key) {
  const std::optional<JsonPlace> place = object.find(key);
  return place && place->value().is_string() ? place->text().substr(0, kLongest) : "";
}

}  // namespace

std::string gltf_copyright(const std::string& copyright, const std::string& consent) {
  if (consent.empty()) {
    return copyright;
  }
  return (copyright.empty() ? "" : copyright + "; ") + kConsent + consent;
}

void read_gltf_asset(const JsonPlace& asset, GltfScene& scene) {
  const std::optional<JsonPlace> extras = asset.find("extras");
  scene.consent = extras && extras->value().is_object() ? text_in(*extras, "consent") : "";
  scene.copyright = text_in(asset, "copyright");
  const std::string ours = kConsent + scene.consent;
  if (!scene.consent.empty() && scene.copyright.ends_with(ours)) {
    scene.copyright.resize(scene.copyright.size() - ours.size());
    if (scene.copyright.ends_with("; ")) {
      scene.copyright.resize(scene.copyright.size() - 2);
    }
  }
}

}  // namespace atelier
