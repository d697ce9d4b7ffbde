#include "core/seal/base64.h"

#include <sodium.h>

namespace atelier {
namespace {

int variant(Base64 kind) {
  return kind == Base64::Padded ? sodium_base64_VARIANT_ORIGINAL
                                : sodium_base64_VARIANT_ORIGINAL_NO_PADDING;
}

}  // namespace

std::string base64_text(Bytes bytes, Base64 kind) {
  start_sodium();
  std::string text(sodium_base64_encoded_len(bytes.size(), variant(kind)), '\0');
  sodium_bin2base64(text.data(), text.size(), bytes.data(), bytes.size(), variant(kind));
  text.pop_back();  // the zero behind it
  return text;
}

std::optional<std::vector<std::uint8_t>> base64_bytes(std::string_view text, Base64 kind) {
  start_sodium();
  std::vector<std::uint8_t> bytes(text.size() / 4 * 3 + 3);
  std::size_t size = 0;
  const char* end = nullptr;
  if (sodium_base642bin(bytes.data(), bytes.size(), text.data(), text.size(), nullptr, &size, &end,
                        variant(kind)) != 0 ||
      end != text.data() + text.size()) {
    return std::nullopt;
  }
  bytes.resize(size);
  if (base64_text(bytes, kind) != text) {  // libsodium takes some letters beyond ASCII for others
    return std::nullopt;
  }
  return bytes;
}

}  // namespace atelier
