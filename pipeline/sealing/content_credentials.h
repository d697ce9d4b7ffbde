#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/seal/minisign.h"
#include "core/sha256.h"
#include "pipeline/sealing/render_statement.h"

namespace atelier {

/// How a file is bound to its content credentials: by the SHA-256 of all of it but a stretch (PNG),
/// or of its boxes but those that hold credentials (MP4).
struct ContentBinding {
  Digest digest{};
  std::uint64_t left_out_from = 0;  ///< PNG: where the stretch begins
  std::uint64_t left_out = 0;       ///< PNG: its bytes
  bool is_boxes = false;            ///< MP4
};

/// A manifest store of C2PA 2.1 (https://c2pa.org/specifications): one manifest that says that the
/// file is made by trained networks, with the statement as its assertion `org.atelier.render` and
/// the mark as a soft binding, signed with EdDSA. Its size depends on neither digest nor key.
std::string content_credentials(const RenderStatement& statement, const ContentBinding& binding,
                                const SigningKey& key);

/// Contents of a manifest store, and which of its claims hold.
struct CredentialsFound {
  std::string generator;    ///< program that made the claim
  std::string source_type;  ///< end of its digitalSourceType: "trainedAlgorithmicMedia"
  std::optional<RenderStatement> statement;
  std::optional<ContentBinding> binding;  ///< to be compared with the file
  std::optional<SignatureKey> signer;     ///< none: of another kind than Ed25519
  std::string problem;                    ///< why the manifest is not what was signed; "": it is
};

/// Reads the last manifest of a store and compares hashes and signature. Of other programs'
/// manifests it tells the same, but for what they say in assertions of their own. Throws DataError
/// for what is no manifest store.
CredentialsFound read_credentials(std::string_view store, const std::string& file);

}  // namespace atelier
