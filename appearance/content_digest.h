#pragma once

#include <map>
#include <string>

#include "core/tensor.h"

namespace atelier {

/// The text of a file that holds the digest of all its others.
inline constexpr const char* kDigestText = "digest";

/// SHA-256, as 64 digits, of named tensors (name, type, shape, elements) and of texts but for
/// kDigestText, in the order of their names. Text tensors count with their strings.
std::string content_digest(const std::map<std::string, Tensor>& tensors,
                           const std::map<std::string, std::string>& texts);

/// Throws DataError where texts have a digest that is not that of the contents: a bit has flipped
/// since. Files written before there were digests have none, and are taken as they are.
/// @param advice  what to do about it, for the error: "run it again"
void require_digest(const std::map<std::string, Tensor>& tensors,
                    const std::map<std::string, std::string>& texts, const std::string& file,
                    const std::string& advice);

}  // namespace atelier
