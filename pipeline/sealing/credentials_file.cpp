#include "pipeline/sealing/credentials_file.h"

#include <algorithm>
#include <functional>
#include <vector>

#include "core/error.h"
#include "core/mark/cyclic_checksum.h"

namespace atelier {
namespace {

constexpr std::string_view kPngStart("\x89PNG\r\n\x1A\n", 8);
constexpr std::string_view kJpegStart("\xFF\xD8", 2);
constexpr std::string_view kPngChunk = "caBX";
constexpr std::size_t kPngHeaderEnd = 33;  // behind the signature and IHDR
constexpr std::size_t kChunkFrame = 12;    // size, name and checksum of a chunk
constexpr std::size_t kJpegBoxHeader = 8;  // size and kind of a box
constexpr std::size_t kJpegPacket = 8;     // of a segment: "JP", box number, packet number
/// UUID of boxes with content credentials, C2PA 2.1, "Embedding manifests into BMFF-based assets".
constexpr std::string_view kMp4Uuid(
    "\xD8\xFE\xC3\xD6\x1B\x0E\x48\x3C\x92\x97\x58\x28\x87\x7E\xC4\x81", 16);
constexpr std::string_view kPurpose("\0\0\0\0manifest\0\0\0\0\0\0\0\0\0",
                                    21);  // version, purpose, no fragments

[[noreturn]] void refuse_file(const std::string& file, const char* found) {
  throw DataError(file, "content credentials", found, "a whole PNG, JPEG or MP4");
}

std::uint64_t big_number(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) {
    value = value << 8 | static_cast<std::uint8_t>(byte);
  }
  return value;
}

std::string big_bytes(std::uint64_t value, int size) {
  std::string bytes;
  for (int i = size - 1; i >= 0; --i) {
    bytes += static_cast<char>(value >> (8 * i) & 0xFF);
  }
  return bytes;
}

/// A box of an MP4 at the top.
struct Mp4Box {
  std::string_view type;
  std::uint64_t start = 0;
  std::string_view bytes;    ///< all of it
  std::string_view content;  ///< behind its header
};

std::vector<Mp4Box> mp4_boxes(std::string_view bytes, const std::string& file) {
  std::vector<Mp4Box> boxes;
  std::uint64_t at = 0;
  while (at < bytes.size()) {
    const std::string_view rest = bytes.substr(at);
    if (rest.size() < 8) {
      refuse_file(file, "a box that is cut off");
    }
    std::uint64_t size = big_number(rest.substr(0, 4));
    std::size_t header = 8;
    if (size == 1) {
      header = 16;
      size = rest.size() < header ? 0 : big_number(rest.substr(8, 8));
    } else if (size == 0) {
      size = rest.size();  // to the end
    }
    if (size < header || size > rest.size()) {
      refuse_file(file, "a box that is cut off");
    }
    boxes.push_back(
        {rest.substr(4, 4), at, rest.substr(0, size), rest.substr(header, size - header)});
    at += size;
  }
  return boxes;
}

bool is_mp4(std::string_view bytes) {
  return bytes.size() >= 12 && bytes.substr(4, 4) == "ftyp";
}

bool has_credentials(const Mp4Box& box) {
  return box.type == "uuid" && box.content.starts_with(kMp4Uuid);
}

std::optional<std::string> in_png(std::string_view bytes, const std::string& file) {
  std::size_t at = kPngStart.size();
  while (at < bytes.size()) {
    if (bytes.size() - at < kChunkFrame) {
      refuse_file(file, "a chunk that is cut off");
    }
    const std::uint64_t size = big_number(bytes.substr(at, 4));
    if (size > bytes.size() - at - kChunkFrame) {
      refuse_file(file, "a chunk that is cut off");
    }
    if (bytes.substr(at + 4, 4) == kPngChunk) {
      return std::string(bytes.substr(at + 8, size));
    }
    at += size + kChunkFrame;
  }
  return std::nullopt;
}

/// Of the segments APP11 whose boxes begin one manifest store (JPEG XT, ISO/IEC 18477-3).
std::optional<std::string> in_jpeg(std::string_view bytes, const std::string& file) {
  std::string store;
  std::size_t at = kJpegStart.size();
  while (at + 4 <= bytes.size() && bytes[at] == '\xFF') {
    const char marker = bytes[at + 1];
    if (marker == '\xDA' || marker == '\xD9') {  // the image itself, or the end
      break;
    }
    const std::uint64_t size = big_number(bytes.substr(at + 2, 2));
    if (size < 2 || size > bytes.size() - at - 2) {
      refuse_file(file, "a segment that is cut off");
    }
    const std::string_view content = bytes.substr(at + 4, size - 2);
    if (marker == '\xEB' && content.starts_with("JP") &&
        content.size() >= kJpegPacket + kJpegBoxHeader) {
      store += content.substr(kJpegPacket + (store.empty() ? 0 : kJpegBoxHeader));
    }
    at += 2 + size;
  }
  return store.empty() ? std::nullopt : std::optional(store);
}

/// A manifest store in segments APP11, as `in_jpeg` reads them.
std::string jpeg_segments(const std::string& store) {
  constexpr std::size_t kMostBytes = 65'533 - kJpegPacket - kJpegBoxHeader;
  const std::string header = store.substr(0, kJpegBoxHeader);
  std::string segments;
  std::uint64_t number = 1;
  for (std::size_t at = kJpegBoxHeader; at < store.size(); at += kMostBytes) {
    const std::string content = std::string("JP") + big_bytes(1, 2) + big_bytes(number++, 4) +
                                header + store.substr(at, kMostBytes);
    segments += "\xFF\xEB" + big_bytes(content.size() + 2, 2) + content;
  }
  return segments;
}

/// A file with credentials at one place, which are not over themselves: how many bytes those are
/// depends on how many digits that number has.
std::string with_credentials(std::string_view file, std::size_t from,
                             const RenderStatement& statement, const SigningKey& key,
                             const std::function<std::string(const std::string& store)>& embedded) {
  ContentBinding binding{.digest = sha256(file), .left_out_from = from};
  std::string part;
  do {
    binding.left_out = part.size();
    part = embedded(content_credentials(statement, binding, key));
  } while (part.size() != binding.left_out);
  return std::string(file.substr(0, from)) + part + std::string(file.substr(from));
}

}  // namespace

std::string png_with_credentials(std::string_view png, const RenderStatement& statement,
                                 const SigningKey& key) {
  if (!png.starts_with(kPngStart) || png.size() < kPngHeaderEnd) {
    refuse_file("a PNG", "none");
  }
  return with_credentials(png, kPngHeaderEnd, statement, key, [](const std::string& store) {
    const std::string named = std::string(kPngChunk) + store;
    return big_bytes(store.size(), 4) + named + big_bytes(cyclic_checksum(named), 4);
  });
}

std::string jpeg_with_credentials(std::string_view jpeg, const RenderStatement& statement,
                                  const SigningKey& key) {
  std::size_t from = kJpegStart.size();
  if (jpeg.substr(from, 2) == "\xFF\xE0" && jpeg.size() >= from + 4) {  // JFIF's, always the first
    from += 2 + big_number(jpeg.substr(from + 2, 2));
  }
  if (!jpeg.starts_with(kJpegStart) || from > jpeg.size()) {
    refuse_file("a JPEG", "none");
  }
  return with_credentials(jpeg, from, statement, key, jpeg_segments);
}

std::string mp4_credentials(std::string_view mp4, const RenderStatement& statement,
                            const SigningKey& key) {
  ContentBinding binding{.is_boxes = true};
  binding.digest = bound_content(mp4, binding, "an MP4");
  const std::string content =
      std::string(kMp4Uuid).append(kPurpose) + content_credentials(statement, binding, key);
  return big_bytes(content.size() + 8, 4) + "uuid" + content;
}

std::optional<std::string> stored_credentials(std::string_view bytes, const std::string& file) {
  if (bytes.starts_with(kPngStart)) {
    return in_png(bytes, file);
  }
  if (bytes.starts_with(kJpegStart)) {
    return in_jpeg(bytes, file);
  }
  if (is_mp4(bytes)) {
    const std::vector<Mp4Box> boxes = mp4_boxes(bytes, file);
    const auto found = std::find_if(boxes.begin(), boxes.end(), has_credentials);
    if (found != boxes.end() && found->content.size() > kMp4Uuid.size() + kPurpose.size()) {
      return std::string(found->content.substr(kMp4Uuid.size() + kPurpose.size()));
    }
  }
  return std::nullopt;
}

Digest bound_content(std::string_view bytes, const ContentBinding& binding,
                     const std::string& file) {
  Sha256 hash;
  if (!binding.is_boxes) {
    const std::size_t from = std::min<std::uint64_t>(binding.left_out_from, bytes.size());
    const std::size_t count = std::min<std::uint64_t>(binding.left_out, bytes.size() - from);
    hash.update(bytes.substr(0, from));
    hash.update(bytes.substr(from + count));
    return hash.finish();
  }
  if (!is_mp4(bytes)) {
    refuse_file(file, "no MP4");
  }
  for (const Mp4Box& box : mp4_boxes(bytes, file)) {
    if (box.type != "ftyp" && box.type != "mfra" && !has_credentials(box)) {
      hash.update(big_bytes(box.start, 8));  // so that boxes cannot change places
      hash.update(box.bytes);
    }
  }
  return hash.finish();
}

}  // namespace atelier
