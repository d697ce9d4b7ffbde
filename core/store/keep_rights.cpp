#include "core/store/keep_rights.h"

#include <filesystem>

#include "core/io/lower_extension.h"
#include "core/store/consent_file.h"

namespace atelier {
namespace {

/// Texts one behind the other, each once.
void add_right(std::string& all, const std::string& more) {
  if (!more.empty() && all.find(more) == std::string::npos) {
    all += (all.empty() ? "" : "; ") + more;
  }
}

}  // namespace

void keep_rights(const std::vector<std::string>& sources, GltfScene& scene) {
  for (const std::string& source : sources) {
    std::error_code none;
    if (source.empty() || !std::filesystem::exists(source, none)) {
      continue;
    }
    const std::vector<Consent> consent = read_consent(source);
    add_right(scene.consent, consent.empty() ? "" : to_string(consent));
    const std::string extension = lower_extension(source);
    if (extension == ".glb" || extension == ".gltf") {
      const GltfScene read = read_gltf(source);
      add_right(scene.copyright, read.copyright);
      add_right(scene.consent, read.consent);
    }
  }
}

}  // namespace atelier
