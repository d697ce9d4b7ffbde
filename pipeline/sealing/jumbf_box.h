#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace atelier {

/// A box of JUMBF (ISO/IEC 19566-5), the container of C2PA manifests: a superbox has a label and
/// boxes, any other has content.
struct JumbfBox {
  std::string type;          ///< four letters: "jumb", "cbor", "json"
  std::string kind;          ///< of a superbox: the four letters that its UUID begins with
  std::string label;         ///< of a superbox
  std::string_view content;  ///< without the header of 8 bytes, also of a superbox
  std::vector<JumbfBox> boxes;
};

/// Bytes of a box. Throws LogicError for more than 4 GiB.
std::string box_bytes(std::string_view type, std::string_view content);

/// Bytes of a superbox of boxes that are bytes already. @param kind  four letters; the rest of the
/// UUID is -0011-0010-8000-00AA00389B71
std::string superbox_bytes(std::string_view kind, const std::string& label, std::string_view boxes);

/// The boxes of a text, which has to outlive them. Throws DataError for a box that is cut off, has
/// a size of 64 bits, or lies deeper than C2PA's do.
std::vector<JumbfBox> parse_jumbf(std::string_view bytes, const std::string& file);

/// The first box with a label (of a superbox) or a type; nothing where there is none.
const JumbfBox* find_box(const std::vector<JumbfBox>& boxes, std::string_view label_or_type);

}  // namespace atelier
