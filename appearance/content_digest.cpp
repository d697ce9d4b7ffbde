#include "appearance/content_digest.h"

#include "core/error.h"
#include "core/sha256.h"

namespace atelier {
namespace {

/// With its length before it, so that no two lists of texts hash as one.
void add_text(Sha256& hash, std::string_view text) {
  const std::uint64_t size = text.size();
  hash.update(&size, sizeof(size));
  hash.update(text);
}

}  // namespace

std::string content_digest(const std::map<std::string, Tensor>& tensors,
                           const std::map<std::string, std::string>& texts) {
  Sha256 hash;
  for (const auto& [name, tensor] : tensors) {
    add_text(hash, name);
    add_text(hash, element_type_name(tensor.type));
    add_text(hash, shape_text(tensor.shape));
    add_text(hash, {reinterpret_cast<const char*>(tensor.data.data()), tensor.data.size()});
    for (const std::string& text : tensor.strings) {
      add_text(hash, text);
    }
  }
  for (const auto& [name, text] : texts) {
    if (name != kDigestText) {
      add_text(hash, name);
      add_text(hash, text);
    }
  }
  return hex(hash.finish());
}

void require_digest(const std::map<std::string, Tensor>& tensors,
                    const std::map<std::string, std::string>& texts, const std::string& file,
                    const std::string& advice) {
  const auto found = texts.find(kDigestText);
  if (found != texts.end() && found->second != content_digest(tensors, texts)) {
    throw DataError(file, "digest", "another than that of its contents: the file is damaged",
                    "the contents that were written; " + advice);
  }
}

}  // namespace atelier
