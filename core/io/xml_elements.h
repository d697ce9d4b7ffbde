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
};

/// The elements of an XML text with their attributes; what stands between tags is passed over, as
/// is a DOCTYPE that declares nothing itself. Throws DataError, with the line, for tags that do not
/// match, attributes twice or without quotes, more than one root, declarations in a DOCTYPE,
/// entities other than the five of XML and characters by their number (`&#181;`), deeper nesting
/// than `limits.text_depth`, more elements than `limits.text_values`, and values longer than
/// `limits.text_string_bytes`.
std::vector<XmlElement> parse_xml_elements(std::string_view text, const std::string& file = "",
                                           const Limits& limits = {});

}  // namespace atelier
