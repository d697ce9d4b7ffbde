#include <map>
#include <string>
#include <vector>

#include "bodymodel/body_archive.h"
#include "core/io/npz.h"
#include "core/io/safetensors.h"
#include "fuzz/reader.h"

namespace {

/// An npz itself, or the numbers of a safetensors file with the names that such a file cannot hold:
/// an npz has checksums, behind which damage seldom comes as far as the reader of the arrays.
atelier::Npz archive_of(std::span<const std::byte> bytes) {
  if (bytes.size() >= 2 && bytes[0] == std::byte{'P'} && bytes[1] == std::byte{'K'}) {
    return atelier::Npz({bytes.begin(), bytes.end()}, "body.npz");
  }
  std::map<std::string, atelier::Tensor> arrays =
      atelier::parse_safetensors(bytes, "body.npz").tensors;
  const auto text = [&](const char* name, std::vector<std::string> words) {
    atelier::Tensor tensor{
        atelier::ElementType::Text, {static_cast<std::int64_t>(words.size())}, {}, {}};
    tensor.strings = std::move(words);
    arrays.try_emplace(name, std::move(tensor));
  };
  text("schema", {arrays.contains("fps") ? "atelier-motion-1" : "atelier-body-1"});
  text("name", {"small"});
  text("unit", {"m"});
  text("up", {"y"});
  text("joint_names", {"hips", "chest"});
  text("shape_names", {"stature"});
  text("shape_units", {"m"});
  text("group_names", {"front"});
  return atelier::Npz(atelier::npz_bytes(arrays, false), "body.npz");
}

}  // namespace

/// Atelier's own bodies and motions; what is read can be written.
ATELIER_FUZZ_READER(body_archive) {
  const atelier::Npz npz = archive_of(bytes);
  if (atelier::archive_schema(npz) == "atelier-motion-1") {
    atelier::motion_arrays(atelier::motion_of_arrays(npz));
  } else {
    atelier::body_arrays(atelier::body_of_arrays(npz));
  }
}
