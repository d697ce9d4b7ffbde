#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/store/manifest.h"
#include "fuzz/reader.h"

namespace {

/// What is read can be written, and read again to the same text.
void read_and_write(std::string_view text) {
  const atelier::Manifest manifest = atelier::parse_manifest(text, "manifest");
  const std::string written = atelier::manifest_text(manifest);
  ATELIER_CHECK(atelier::manifest_text(atelier::parse_manifest(written)) == written,
                "the manifest does not round-trip");
  for (const atelier::ManifestOutput& output : manifest.outputs) {
    ATELIER_CHECK(atelier::is_safe_output_path(output.path), "an unsafe path was read");
  }
}

}  // namespace

ATELIER_FUZZ_READER(manifest) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  // A damaged manifest is caught by its own digest. With that made right, the rest has to hold.
  nlohmann::json json = nlohmann::json::parse(
      text, [](int depth, auto, auto&) { return depth < 64; }, false);
  if (json.is_object() && json.contains("manifest_sha256")) {
    json.erase("manifest_sha256");
    const std::string rest = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    json["manifest_sha256"] = atelier::hex(atelier::sha256(rest));
    read_and_write(json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  }
  read_and_write(text);
}
