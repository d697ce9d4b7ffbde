#include "core/io/mesh_fbx.h"

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/io/fbx_import.h"
#include "core/io/file_bytes.h"
#include "core/io/worker.h"

namespace atelier {

#ifdef ATELIER_HAS_ASSIMP

namespace {

constexpr std::size_t kMaxFindings = 1'000;
constexpr std::size_t kHeadBytes = 1'000;  // in which a text file says that it is FBX

void put_text(std::string_view text, std::vector<std::byte>& reply) {
  const auto size = static_cast<std::uint32_t>(text.size());
  const auto raw = std::as_bytes(std::span(&size, 1));
  const auto view = std::as_bytes(std::span(text.data(), text.size()));
  reply.insert(reply.end(), raw.begin(), raw.end());
  reply.insert(reply.end(), view.begin(), view.end());
}

std::string take_text(ByteReader& reader) {
  return std::string(reader.text(reader.little<std::uint32_t>("length"), "text"));
}

// The scene as a glTF file, behind what glTF has no place for: how skins blend, and the findings.
std::vector<std::byte> reply_of(const GltfScene& scene) {
  std::vector<std::byte> reply;
  const bool dual_quaternions = !scene.skins.empty() && scene.skins[0].dual_quaternions;
  reply.push_back(static_cast<std::byte>(dual_quaternions ? 1 : 0));
  const std::size_t count = std::min(scene.findings.size(), kMaxFindings);
  reply.push_back(static_cast<std::byte>(count & 0xFF));
  reply.push_back(static_cast<std::byte>(count >> 8));
  for (std::size_t i = 0; i < count; ++i) {
    const Finding& finding = scene.findings[i];
    reply.push_back(static_cast<std::byte>(finding.severity == Severity::Note ? 0 : 1));
    for (const std::string* text : {&finding.code, &finding.what, &finding.advice}) {
      put_text(*text, reply);
    }
  }
  const std::string glb = glb_bytes(scene);
  const auto bytes = std::as_bytes(std::span(glb));
  reply.insert(reply.end(), bytes.begin(), bytes.end());
  return reply;
}

bool looks_like_fbx(std::span<const std::byte> bytes) {
  const std::string_view head(reinterpret_cast<const char*>(bytes.data()),
                              std::min(bytes.size(), kHeadBytes));
  return head.starts_with("Kaydara FBX Binary") || head.find("FBX") != std::string_view::npos;
}

}  // namespace

bool reads_fbx() {
  return true;
}

GltfScene read_fbx(std::span<const std::byte> bytes, const std::string& name,
                   const Limits& limits) {
  if (std::cmp_greater(bytes.size(), limits.mesh_file_bytes)) {
    throw DataError(name, "", std::to_string(bytes.size()) + " bytes",
                    "at most " + std::to_string(limits.mesh_file_bytes));
  }
  if (bytes.empty() || !looks_like_fbx(bytes)) {
    throw DataError(name, "", bytes.empty() ? "an empty file" : "no FBX header",
                    "an FBX file, binary or text");
  }
  const std::vector<std::byte> reply =
      run_in_worker([&] { return reply_of(import_fbx(bytes, name, limits)); }, name, limits);
  // The process read a hostile file: what it says is no safer than that.
  ByteReader reader(reply, name);
  const bool dual_quaternions = reader.little<std::uint8_t>("skin") != 0;
  std::vector<Finding> findings;
  for (auto left = reader.little<std::uint16_t>("findings"); left > 0; --left) {
    Finding& finding = findings.emplace_back();
    finding.severity =
        reader.little<std::uint8_t>("severity") == 0 ? Severity::Note : Severity::Warning;
    finding.code = take_text(reader);
    finding.place = name;
    finding.what = take_text(reader);
    finding.advice = take_text(reader);
  }
  GltfScene scene = read_gltf(reader.take(reader.remaining(), "scene"), name, limits);
  scene.findings.insert(scene.findings.begin(), findings.begin(), findings.end());
  for (GltfSkin& skin : scene.skins) {
    skin.dual_quaternions = dual_quaternions;
  }
  return scene;
}

#else

bool reads_fbx() {
  return false;
}

GltfScene read_fbx(std::span<const std::byte>, const std::string& name, const Limits&) {
  throw DataError(name, "", "an FBX scene, and this build is without libassimp, which reads it",
                  "the same scene as .glb: Blender imports FBX and exports glTF 2.0 with its skin "
                  "and shape keys");
}

#endif

GltfScene read_fbx(const std::filesystem::path& path, const Limits& limits) {
  return read_fbx(read_file_bytes(path, limits.mesh_file_bytes), path.string(), limits);
}

}  // namespace atelier
