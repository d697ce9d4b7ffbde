#include "pipeline/sealing/content_credentials.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/error.h"
#include "core/seal/raw_signature.h"
#include "pipeline/sealing/cbor_items.h"
#include "pipeline/sealing/cose_signature.h"
#include "pipeline/sealing/jumbf_box.h"
#include "pipeline/sealing/signer_certificate.h"

namespace atelier {
namespace {

using Json = nlohmann::json;

constexpr std::string_view kStatementLabel = "org.atelier.render";
constexpr std::string_view kActionsLabel = "c2pa.actions.v2";
constexpr std::string_view kMarkLabel = "c2pa.soft-binding";
constexpr std::string_view kDataHash = "c2pa.hash.data";
constexpr std::string_view kBoxesHash = "c2pa.hash.bmff.v2";
constexpr std::string_view kMarkAlgorithm = "org.atelier.mark.1";
constexpr std::string_view kSourceTypes = "http://cv.iptc.org/newscodes/digitalsourcetype/";
constexpr std::string_view kAssertions = "self#jumbf=c2pa.assertions/";
constexpr std::size_t kBoxStart = 8;

Json binary(Bytes bytes) {
  return Json::binary({bytes.begin(), bytes.end()});
}

std::string cbor(const Json& json) {
  const std::vector<std::uint8_t> bytes = Json::to_cbor(json);
  return {bytes.begin(), bytes.end()};
}

/// An assertion's superbox.
struct Assertion {
  std::string label;
  std::string bytes;
};

Assertion cbor_assertion(std::string_view label, const Json& json) {
  return {std::string(label),
          superbox_bytes("cbor", std::string(label), box_bytes("cbor", cbor(json)))};
}

Json binding_json(const ContentBinding& binding) {
  Json json = {{"alg", "sha256"}, {"name", "jumbf manifest"}, {"hash", binary(binding.digest)}};
  if (!binding.is_boxes) {
    json["exclusions"] = {{{"start", binding.left_out_from}, {"length", binding.left_out}}};
    json["pad"] = binary({});
    return json;
  }
  static constexpr std::array<std::uint8_t, 16> kCredentialsBox = {
      0xD8, 0xFE, 0xC3, 0xD6, 0x1B, 0x0E, 0x48, 0x3C,
      0x92, 0x97, 0x58, 0x28, 0x87, 0x7E, 0xC4, 0x81};
  const Json of_c2pa = Json::array({{{"offset", 8}, {"value", binary(kCredentialsBox)}}});
  json["exclusions"] = Json::array(
      {{{"xpath", "/uuid"}, {"data", of_c2pa}}, {{"xpath", "/ftyp"}}, {{"xpath", "/mfra"}}});
  return json;
}

/// Bytes of a mark, the highest first.
std::array<std::uint8_t, 8> mark_bytes(std::uint64_t mark) {
  std::array<std::uint8_t, 8> bytes;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<std::uint8_t>(mark >> (56 - 8 * i));
  }
  return bytes;
}

std::vector<Assertion> assertions_of(const RenderStatement& statement,
                                     const ContentBinding& binding) {
  const std::string source =
      std::string(kSourceTypes) +
      (statement.drawn == kDrawnByNetworks ? "trainedAlgorithmicMedia" : "algorithmicMedia");
  const Json created = {{"action", "c2pa.created"},
                        {"digitalSourceType", source},
                        {"softwareAgent", {{"name", statement.tool}}},
                        {"description", "synthetic likeness, drawn by " + statement.drawn}};
  const Json marked = {
      {"alg", kMarkAlgorithm},
      {"pad", binary({})},
      {"blocks", Json::array({{{"scope", Json::object()},
                               {"value", binary(mark_bytes(mark_of(statement)))}}})}};
  return {cbor_assertion(binding.is_boxes ? kBoxesHash : kDataHash, binding_json(binding)),
          cbor_assertion(kActionsLabel, {{"actions", Json::array({created})}}),
          cbor_assertion(kMarkLabel, marked),
          {std::string(kStatementLabel),
           superbox_bytes("json", std::string(kStatementLabel),
                          box_bytes("json", render_statement_text(statement)))}};
}

/// 36 characters, made of a digest.
std::string uuid_text(const Digest& digest) {
  std::string text = hex(digest).substr(0, 32);
  text[12] = '4';
  text[16] = '8';
  for (const std::size_t at : {8, 13, 18, 23}) {
    text.insert(at, 1, '-');
  }
  return text;
}

std::uint64_t whole_number(const Json& of, const char* name) {
  const auto found = of.find(name);
  return found != of.end() && found->is_number_unsigned() ? found->get<std::uint64_t>() : 0;
}

std::string words_of(const Json& of, const char* name) {
  if (!of.is_object()) {
    return "";
  }
  const auto found = of.find(name);
  return found != of.end() && found->is_string() ? found->get<std::string>() : "";
}

/// A field of a map; null where there is none.
const Json& field_of(const Json& of, const char* name) {
  static const Json none;
  if (!of.is_object()) {
    return none;
  }
  const auto found = of.find(name);
  return found != of.end() ? *found : none;
}

std::optional<Digest> digest_of(const Json& json) {
  if (!json.is_binary() || json.get_binary().size() != std::tuple_size_v<Digest>) {
    return std::nullopt;
  }
  Digest digest{};
  std::copy(json.get_binary().begin(), json.get_binary().end(), digest.begin());
  return digest;
}

/// A box's CBOR; discarded where it is none. Items that lie deep would fill the stack of the reader
/// of the library: they are refused first.
Json cbor_of(const JumbfBox* box, const std::string& file) {
  const JumbfBox* content = box != nullptr ? find_box(box->boxes, "cbor") : nullptr;
  if (content == nullptr) {
    return Json(Json::value_t::discarded);
  }
  CborItems(content->content, file).skip();
  return Json::from_cbor(content->content.begin(), content->content.end(), true, false,
                         Json::cbor_tag_handler_t::ignore);
}

std::optional<ContentBinding> read_binding(const std::vector<JumbfBox>& assertions,
                                           const std::string& file) {
  const JumbfBox* data = find_box(assertions, kDataHash);
  const JumbfBox* boxes = find_box(assertions, kBoxesHash);
  const Json json = cbor_of(data != nullptr ? data : boxes, file);
  const auto digest = digest_of(field_of(json, "hash"));
  if (!digest || words_of(json, "alg") != "sha256") {
    return std::nullopt;
  }
  ContentBinding binding{.digest = *digest, .is_boxes = data == nullptr};
  const Json& left_out = field_of(json, "exclusions");
  if (!binding.is_boxes) {
    if (!left_out.is_array() || left_out.size() != 1 || !left_out[0].is_object()) {
      return std::nullopt;
    }
    binding.left_out_from = whole_number(left_out[0], "start");
    binding.left_out = whole_number(left_out[0], "length");
  }
  return binding;
}

/// What of the claim's assertions are not as it has them; "" where all are.
std::string changed_assertion(const Json& claim, const std::vector<JumbfBox>& assertions) {
  const Json& created =
      field_of(claim, field_of(claim, "created_assertions").is_array() ? "created_assertions"
                                                                       : "assertions");
  if (!created.is_array() || created.empty()) {
    return "its claim has no assertions";
  }
  for (const Json& one : created) {
    const std::string url = words_of(one, "url");
    const std::size_t slash = url.rfind('/');
    const std::string label = slash == std::string::npos ? url : url.substr(slash + 1);
    const JumbfBox* box = find_box(assertions, label);
    const auto digest = digest_of(field_of(one, "hash"));
    if (box == nullptr || !digest || sha256(box->content) != *digest) {
      return "its assertion '" + label + "' was changed or taken out";
    }
  }
  return "";
}

/// Whether an assertion is one of those that the claim has signed.
bool is_claimed(const Json& claim, std::string_view label) {
  for (const char* list : {"created_assertions", "assertions"}) {
    for (const Json& one : field_of(claim, list)) {
      if (words_of(one, "url").ends_with("/" + std::string(label))) {
        return true;
      }
    }
  }
  return false;
}

/// The IPTC's word for how the file came about.
std::string source_type_of(const std::vector<JumbfBox>& assertions, const std::string& file) {
  for (const char* label : {"c2pa.actions.v2", "c2pa.actions"}) {
    const Json actions = cbor_of(find_box(assertions, label), file);
    for (const Json& action : field_of(actions, "actions")) {
      const std::string type = words_of(action, "digitalSourceType");
      if (!type.empty()) {
        return type.substr(type.rfind('/') + 1);
      }
    }
  }
  return "";
}

}  // namespace

std::string content_credentials(const RenderStatement& statement, const ContentBinding& binding,
                                const SigningKey& key) {
  const std::vector<Assertion> assertions = assertions_of(statement, binding);
  Json references = Json::array();
  std::string boxes;
  for (const Assertion& assertion : assertions) {
    const Digest digest = sha256(std::string_view(assertion.bytes).substr(kBoxStart));
    references.push_back(
        {{"url", std::string(kAssertions) + assertion.label}, {"hash", binary(digest)}});
    boxes += assertion.bytes;
  }
  const std::string id = uuid_text(sha256(boxes));
  const std::string claim = cbor({{"alg", "sha256"},
                                  {"instanceID", "xmp:iid:" + id},
                                  {"claim_generator_info", {{"name", statement.tool}}},
                                  {"signature", "self#jumbf=c2pa.signature"},
                                  {"created_assertions", references}});
  const std::string manifest =
      superbox_bytes("c2as", "c2pa.assertions", boxes) +
      superbox_bytes("c2cl", "c2pa.claim.v2", box_bytes("cbor", claim)) +
      superbox_bytes("c2cs", "c2pa.signature", box_bytes("cbor", cose_signature(claim, key)));
  return superbox_bytes("c2pa", "c2pa", superbox_bytes("c2ma", "urn:c2pa:" + id, manifest));
}

CredentialsFound read_credentials(std::string_view store, const std::string& file) {
  const std::vector<JumbfBox> top = parse_jumbf(store, file);
  if (top.size() != 1 || top[0].kind != "c2pa" || top[0].boxes.empty()) {
    throw DataError(file, "content credentials", "no manifest store", "one of C2PA");
  }
  const std::vector<JumbfBox>& manifest = top[0].boxes.back().boxes;
  const JumbfBox* claim_box = find_box(manifest, "c2pa.claim.v2");
  claim_box = claim_box != nullptr ? claim_box : find_box(manifest, "c2pa.claim");
  const JumbfBox* store_box = find_box(manifest, "c2pa.assertions");
  const JumbfBox* signature_box = find_box(manifest, "c2pa.signature");
  const Json claim = cbor_of(claim_box, file);
  CredentialsFound found;
  if (!claim.is_object() || store_box == nullptr || signature_box == nullptr) {
    found.problem = "its claim, assertions or signature are missing";
    return found;
  }
  found.generator = words_of(field_of(claim, "claim_generator_info"), "name");
  if (found.generator.empty()) {
    found.generator = words_of(claim, "claim_generator");
  }
  found.problem = changed_assertion(claim, store_box->boxes);
  const JumbfBox* signature = find_box(signature_box->boxes, "cbor");
  const JumbfBox* signed_claim = find_box(claim_box->boxes, "cbor");
  const CoseSignature cose =
      read_cose_signature(signature != nullptr ? signature->content : std::string_view(), file);
  found.signer = cose.is_ed25519 ? key_of_certificate(cose.certificate) : std::nullopt;
  if (found.signer && found.problem.empty() &&
      !is_signature(bytes_of(cose.signature),
                    bytes_of(cose_signed_text(cose.header, signed_claim->content)),
                    found.signer->key)) {
    found.problem = "its signature is of another text";
  }
  found.source_type = source_type_of(store_box->boxes, file);
  found.binding = read_binding(store_box->boxes, file);
  const JumbfBox* statement = find_box(store_box->boxes, kStatementLabel);
  const JumbfBox* text = statement != nullptr ? find_box(statement->boxes, "json") : nullptr;
  if (text != nullptr && is_claimed(claim, kStatementLabel)) {
    found.statement = parse_render_statement(text->content, file);
  }
  return found;
}

}  // namespace atelier
