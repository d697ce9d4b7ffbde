#include "pipeline/sealing/jumbf_box.h"

#include <algorithm>
#include <limits>

#include "core/error.h"

namespace atelier {
namespace {

constexpr std::size_t kBoxHeader = 8;
constexpr std::size_t kUuid = 16;
constexpr std::string_view kUuidEnd("\x00\x11\x00\x10\x80\x00\x00\xAA\x00\x38\x9B\x71", 12);
constexpr int kDeepest = 6;
constexpr char kLabelled = 3;  // toggles: may be asked for, has a label

std::uint32_t box_size_at(std::string_view bytes) {
  std::uint32_t size = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    size = size << 8 | static_cast<std::uint8_t>(bytes[i]);
  }
  return size;
}

/// Kind and label of a superbox from its description.
void describe_superbox(JumbfBox& box, const std::string& file) {
  if (box.boxes.empty() || box.boxes[0].type != "jumd" || box.boxes[0].content.size() < kUuid + 1) {
    throw DataError(file, "content credentials", "a superbox without a description",
                    "one that JUMBF allows");
  }
  const std::string_view description = box.boxes[0].content;
  box.kind = description.substr(0, 4);
  if ((description[kUuid] & 2) != 0) {
    const std::string_view rest = description.substr(kUuid + 1);
    box.label = rest.substr(0, rest.find('\0'));
  }
  box.boxes.erase(box.boxes.begin());
}

std::vector<JumbfBox> boxes_of(std::string_view bytes, int depth, const std::string& file) {
  const auto refuse = [&](const char* found) {
    throw DataError(file, "content credentials", found, "boxes that C2PA allows");
  };
  if (depth > kDeepest) {
    refuse("boxes that lie too deep");
  }
  std::vector<JumbfBox> boxes;
  while (!bytes.empty()) {
    if (bytes.size() < kBoxHeader) {
      refuse("a box that is cut off");
    }
    const std::size_t size = box_size_at(bytes);
    if (size < kBoxHeader || size > bytes.size()) {
      refuse("a box that is cut off or has another kind of size");
    }
    JumbfBox box;
    box.type = bytes.substr(4, 4);
    box.content = bytes.substr(kBoxHeader, size - kBoxHeader);
    if (box.type == "jumb") {
      box.boxes = boxes_of(box.content, depth + 1, file);
      describe_superbox(box, file);
    }
    boxes.push_back(std::move(box));
    bytes.remove_prefix(size);
  }
  return boxes;
}

}  // namespace

std::string box_bytes(std::string_view type, std::string_view content) {
  ATELIER_CHECK(type.size() == 4, "a box has a type of four letters");
  ATELIER_CHECK(content.size() < std::numeric_limits<std::uint32_t>::max() - kBoxHeader,
                "a box of 4 GiB");
  const auto size = static_cast<std::uint32_t>(content.size() + kBoxHeader);
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) {
    bytes += static_cast<char>(size >> shift & 0xFF);
  }
  return bytes.append(type).append(content);
}

std::string superbox_bytes(std::string_view kind, const std::string& label,
                           std::string_view boxes) {
  const std::string description = std::string(kind).append(kUuidEnd) + kLabelled + label + '\0';
  return box_bytes("jumb", box_bytes("jumd", description).append(boxes));
}

std::vector<JumbfBox> parse_jumbf(std::string_view bytes, const std::string& file) {
  return boxes_of(bytes, 0, file);
}

const JumbfBox* find_box(const std::vector<JumbfBox>& boxes, std::string_view label_or_type) {
  const auto found = std::find_if(boxes.begin(), boxes.end(), [&](const JumbfBox& box) {
    return box.type == "jumb" ? box.label == label_or_type : box.type == label_or_type;
  });
  return found == boxes.end() ? nullptr : &*found;
}

}  // namespace atelier
