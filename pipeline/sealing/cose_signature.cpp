#include "pipeline/sealing/cose_signature.h"

#include "core/seal/raw_signature.h"
#include "pipeline/sealing/cbor_items.h"
#include "pipeline/sealing/signer_certificate.h"

namespace atelier {
namespace {

constexpr std::uint64_t kAlgorithm = 1;  // labels of COSE's headers
constexpr std::uint64_t kCertificates = 33;
constexpr std::uint64_t kEdDsa = 7;  // -8, as CBOR has it: -1 - 7
constexpr std::uint64_t kSign1 = 18;
constexpr std::uint64_t kNull = 22;

std::string string_item(CborType type, std::string_view content) {
  return cbor_head(type, content.size()).append(content);
}

/// Algorithm and first certificate of a header.
void read_header(CborItems items, CoseSignature& signature) {
  const CborHead map = items.next();
  if (map.type != CborType::Map) {
    items.refuse("a header that is no map");
  }
  for (std::uint64_t i = 0; i < map.value; ++i) {
    CborItems label = items;
    const CborHead name = label.next();
    const std::string_view word =
        name.type == CborType::Text ? label.content(name.value) : std::string_view();
    items.skip();
    CborItems value = items;
    items.skip();
    const bool is_number = name.type == CborType::Unsigned;
    if (is_number && name.value == kAlgorithm) {
      const CborHead algorithm = value.next();
      signature.is_ed25519 = algorithm.type == CborType::Negative && algorithm.value == kEdDsa;
    } else if ((is_number && name.value == kCertificates) || word == "x5chain") {
      CborItems list = value;
      const CborHead chain = list.next();
      if (chain.type == CborType::Array && chain.value > 0) {
        signature.certificate = list.bytes_item();
      } else if (chain.type == CborType::Bytes) {
        signature.certificate = value.bytes_item();
      }
    }
  }
}

}  // namespace

std::string cose_signed_text(std::string_view header, std::string_view text) {
  return cbor_head(CborType::Array, 4) + string_item(CborType::Text, "Signature1") +
         string_item(CborType::Bytes, header) + string_item(CborType::Bytes, "") +
         string_item(CborType::Bytes, text);
}

std::string cose_signature(std::string_view text, const SigningKey& key) {
  const std::string header =
      cbor_head(CborType::Map, 2) + cbor_head(CborType::Unsigned, kAlgorithm) +
      cbor_head(CborType::Negative, kEdDsa) + cbor_head(CborType::Unsigned, kCertificates) +
      cbor_head(CborType::Array, 1) + string_item(CborType::Bytes, signer_certificate(key));
  const auto signature = sign_bytes(bytes_of(cose_signed_text(header, text)), key);
  return cbor_head(CborType::Tag, kSign1) + cbor_head(CborType::Array, 4) +
         string_item(CborType::Bytes, header) + cbor_head(CborType::Map, 0) +
         cbor_head(CborType::Simple, kNull) +
         string_item(CborType::Bytes, std::string(signature.begin(), signature.end()));
}

CoseSignature read_cose_signature(std::string_view bytes, const std::string& file) {
  CborItems items(bytes, file);
  CborHead list = items.next();
  if (list.type == CborType::Tag && list.value == kSign1) {
    list = items.next();
  }
  if (list.type != CborType::Array || list.value != 4) {
    items.refuse("no signature: a list of four");
  }
  CoseSignature signature;
  signature.header = items.bytes_item();
  read_header(CborItems(signature.header, file), signature);
  const CborItems open = items;
  items.skip();
  if (signature.certificate.empty()) {
    read_header(open, signature);
  }
  items.skip();  // the text, which is elsewhere
  signature.signature = items.bytes_item();
  return signature;
}

}  // namespace atelier
