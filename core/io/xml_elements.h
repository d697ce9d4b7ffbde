#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/limits.h"

namespace atelier {

/// One element of an XML text, in the order in which elements begin.
struct XmlElement {
  std::string name;
  std::map<std::string, std::string> attributes;
  int depth = 0;          ///< 0: the root
  std::int64_t line = 0;  ///< where it begins
  std::string text;       ///< what stands in it before its first child, without blanks at its ends
};

/// The elements of an XML text with their attributes and texts; comments, CDATA and text behind a
/// child are passed over, as is a DOCTYPE that declares nothing itself. Throws DataError, with the
/// line, for what is not well-formed: tags that do not match, attributes twice, without quotes or
/// without a blank between them, more than one root, "--" in comments, <?xml?> in the middle, bytes
/// that are no UTF-8 where no other encoding is named; for declarations in a DOCTYPE, entities
/// other than the five of XML and characters by their number (`&#181;`), deeper nesting than
/// `limits.text_depth`, more elements and attributes than `limits.text_values`, and values longer
/// than `limits.text_string_bytes`. Name spaces are not looked into: a prefix may be bound to
/// nothing.
std::vector<XmlElement> parse_xml_elements(std::string_view text, const std::string& file = "",
                                           const Limits& limits = {});

}  // namespace atelier
