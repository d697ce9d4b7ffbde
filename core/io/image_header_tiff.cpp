#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <vector>

#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/io/image_codec.h"

namespace atelier {
namespace {

constexpr int kSubfileType = 254;
constexpr int kWidth = 256;
constexpr int kHeight = 257;
constexpr int kBits = 258;
constexpr int kCompression = 259;
constexpr int kPhotometric = 262;
constexpr int kOrientation = 274;
constexpr int kChannels = 277;
constexpr int kPlanar = 284;
constexpr int kTileWidth = 322;
constexpr int kTileHeight = 323;
constexpr int kSampleFormat = 339;

struct Entry {
  int tag = 0;
  std::vector<std::uint32_t> values;  ///< of type BYTE, SHORT or LONG, at most 8
};

/// A directory of a TIFF file: the first one, or the one at an offset. The format: TIFF 6.0,
/// section 2.
class TiffDirectory {
 public:
  TiffDirectory(std::span<const std::byte> bytes, const std::string& name, std::uint32_t offset = 0)
      : reader_(bytes, name) {
    big_ = reader_.text(2, "byte order") == "MM";
    reader_.skip(2, "TIFF version");
    const auto first = number<std::uint32_t>("offset of the directory");
    reader_.seek(offset != 0 ? offset : first, "directory");
    const auto count = number<std::uint16_t>("number of entries");
    reader_.paid(count, 12, "entries");
    for (int i = 0; i < count; ++i) {
      entries_.push_back(read_entry());
    }
    next_ = reader_.remaining() >= 4 ? number<std::uint32_t>("offset of the next directory") : 0;
  }

  /// Offset of the next directory, 0 if this is the last one.
  std::uint32_t next() const { return next_; }

  std::optional<std::uint32_t> value(int tag) const {
    const Entry* found = entry(tag);
    return found != nullptr && !found->values.empty()
               ? std::optional<std::uint32_t>(found->values.front())
               : std::nullopt;
  }
  const Entry* entry(int tag) const {
    const auto found = std::find_if(entries_.begin(), entries_.end(),
                                    [tag](const Entry& one) { return one.tag == tag; });
    return found == entries_.end() ? nullptr : &*found;
  }
  const ByteReader& reader() const { return reader_; }

 private:
  template <class T>
  T number(std::string_view what) {
    return big_ ? reader_.big<T>(what) : reader_.little<T>(what);
  }

  Entry read_entry() {
    Entry entry;
    entry.tag = number<std::uint16_t>("tag");
    const auto type = number<std::uint16_t>("type");
    const auto count = number<std::uint32_t>("count");
    const std::size_t behind = reader_.position() + 4;
    const std::size_t size = type == 1 ? 1 : type == 3 ? 2 : type == 4 ? 4 : 0;
    if (size > 0 && count > 0 && count <= 8) {
      if (size * count > 4) {
        reader_.seek(number<std::uint32_t>("offset of values"), "values");
      }
      for (std::uint32_t i = 0; i < count; ++i) {
        entry.values.push_back(size == 1   ? number<std::uint8_t>("value")
                               : size == 2 ? number<std::uint16_t>("value")
                                           : number<std::uint32_t>("value"));
      }
    }
    reader_.seek(behind, "entry");
    return entry;
  }

  ByteReader reader_;
  bool big_ = false;
  std::uint32_t next_ = 0;
  std::vector<Entry> entries_;
};

/// Whether one of the directories from `next` on is a page, which would be passed over without a
/// word. Thumbnails (1) and masks (4) are none, nor is what cannot be read.
bool has_second_page(std::span<const std::byte> bytes, const std::string& name,
                     std::uint32_t next) {
  constexpr int kMaxThumbnails = 10;
  try {
    for (int i = 0; next != 0 && i < kMaxThumbnails; ++i) {
      const TiffDirectory other(bytes, name, next);
      if ((other.value(kSubfileType).value_or(0) & 5) == 0) {
        return true;
      }
      next = other.next();
    }
  } catch (const DataError&) {
    return false;
  }
  return false;
}

}  // namespace

int exif_orientation(std::span<const std::byte> exif) {
  try {
    const std::uint32_t orientation = TiffDirectory(exif, "EXIF").value(kOrientation).value_or(1);
    return orientation >= 1 && orientation <= 8 ? static_cast<int>(orientation) : 1;
  } catch (const DataError&) {
    return 1;  // a broken note about an image is no reason to refuse the image
  }
}

ImageHeader read_tiff_header(std::span<const std::byte> bytes, const std::string& name,
                             const Limits& limits) {
  const TiffDirectory directory(bytes, name);
  const auto needed = [&](int tag, const char* what) {
    const std::optional<std::uint32_t> value = directory.value(tag);
    if (!value) {
      directory.reader().fail(std::string("no ") + what, "every baseline field");
    }
    return *value;
  };
  const auto one_of = [&](std::uint32_t value, std::initializer_list<std::uint32_t> known,
                          const char* what, const char* expected) {
    if (std::find(known.begin(), known.end(), value) == known.end()) {
      directory.reader().fail(std::string(what) + " " + std::to_string(value), expected);
    }
  };
  const std::uint32_t width = needed(kWidth, "width");
  const std::uint32_t height = needed(kHeight, "height");
  const std::uint32_t compression = directory.value(kCompression).value_or(1);
  const std::uint32_t photometric = needed(kPhotometric, "photometric interpretation");
  const std::uint32_t channels = directory.value(kChannels).value_or(1);
  one_of(compression, {1, 5, 8, 32773, 32946}, "compression", "none, PackBits, LZW or deflate");
  one_of(photometric, {0, 1, 2, 3}, "photometric interpretation", "grey, RGB or palette");
  one_of(directory.value(kPlanar).value_or(1), {1}, "planar configuration", "1, interleaved");
  one_of(channels, {1, 2, 3, 4}, "samples a pixel", "1 to 4");
  const Entry* bits = directory.entry(kBits);
  const std::uint32_t depth = bits != nullptr && !bits->values.empty() ? bits->values[0] : 1;
  one_of(depth, {1, 4, 8, 16}, "bits a sample", "1, 4, 8 or 16");
  if (bits != nullptr && std::any_of(bits->values.begin(), bits->values.end(),
                                     [depth](std::uint32_t b) { return b != depth; })) {
    directory.reader().fail("samples of different sizes", "one size");
  }
  one_of(directory.value(kSampleFormat).value_or(1), {1}, "sample format", "1, unsigned");
  if (width > static_cast<std::uint64_t>(limits.image_side) ||
      height > static_cast<std::uint64_t>(limits.image_side)) {
    directory.reader().fail(std::to_string(width) + " x " + std::to_string(height) + " pixels",
                            "at most " + std::to_string(limits.image_side) + " a side");
  }
  // A decoder takes memory for a whole tile, whatever the image's size.
  for (const auto& [tag, side] : {std::pair(kTileWidth, width), std::pair(kTileHeight, height)}) {
    const std::uint32_t tile = directory.value(tag).value_or(1);
    if (tile == 0 || tile > std::max(side, 1024u)) {
      directory.reader().fail("a tile side of " + std::to_string(tile),
                              "1 to the image's side (or 1024)");
    }
  }
  if (has_second_page(bytes, name, directory.next())) {
    directory.reader().fail("a second page", "one image a file");
  }
  const bool color = photometric >= 2;
  const int decoded =
      photometric == 2 ? static_cast<int>(channels) : (color ? 3 : static_cast<int>(channels));
  if (photometric == 2 && channels < 3) {
    directory.reader().fail("RGB of " + std::to_string(channels) + " samples", "3 or 4");
  }
  const std::uint32_t orientation = directory.value(kOrientation).value_or(1);
  return {.format = ImageFormat::Tiff,
          .width = static_cast<int>(width),
          .height = static_cast<int>(height),
          .channels = decoded,
          .bit_depth = static_cast<int>(depth),
          .palette = photometric == 3,
          .orientation = orientation >= 1 && orientation <= 8 ? static_cast<int>(orientation) : 1};
}

}  // namespace atelier
