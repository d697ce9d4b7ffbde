#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/seal/minisign.h"
#include "pipeline/sealing/content_credentials.h"

namespace atelier {

/// A PNG with content credentials behind its header (chunk caBX), over all of its other bytes.
/// Throws DataError for what is no PNG.
std::string png_with_credentials(std::string_view png, const RenderStatement& statement,
                                 const SigningKey& key);

/// A JPEG with content credentials behind its first segment (JFIF; segments APP11), over all of its
/// other bytes. Throws DataError for what is no JPEG.
std::string jpeg_with_credentials(std::string_view jpeg, const RenderStatement& statement,
                                  const SigningKey& key);

/// What is to be appended to an MP4: a box of content credentials over all of its other boxes but
/// ftyp and mfra. Throws DataError for what is no MP4.
std::string mp4_credentials(std::string_view mp4, const RenderStatement& statement,
                            const SigningKey& key);

/// The manifest store in the bytes of a PNG, JPEG or MP4; nothing where there is none. Throws
/// DataError for a file whose parts do not fit together.
std::optional<std::string> stored_credentials(std::string_view bytes, const std::string& file);

/// SHA-256 of what a binding binds of a file. Throws DataError as above.
Digest bound_content(std::string_view bytes, const ContentBinding& binding,
                     const std::string& file);

}  // namespace atelier
