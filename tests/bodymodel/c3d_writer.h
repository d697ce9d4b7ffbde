#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "bodymodel/formats/marker_clip.h"

namespace atelier::fixtures {

struct C3dWriteOptions {
  int processor = 84;  ///< 84 Intel, 85 DEC, 86 MIPS
  bool real = true;    ///< coordinates as real numbers; else in tenths of a millimetre
  std::string unit = "mm";
  bool nan = false;  ///< what is unseen is NaN with a residual of 0; else it has a residual of -1
  bool swap_last_offset = false;    ///< bytes of the last parameter's offset
  std::vector<std::string> angles;  ///< POINT:ANGLES
  /// Parameters of one number or two: "POINT:LONG_FRAMES", type 2 or 4, values.
  struct Numbers {
    std::string group, name;
    int type = 2;
    std::vector<double> values;
  };
  std::vector<Numbers> numbers;
  /// Segments of the group ROTATION, as Theia3D writes them: for each frame, `ratio` times, 17
  /// numbers of each (a 4 x 4 matrix column by column in the file's unit, and a residual).
  std::vector<std::string> segments;
  std::vector<std::vector<double>> matrices;
  int ratio = 1;
  double header_rate = 0;  ///< frames a second; 0: the clip's
};

/// A C3D file, written after the format's user guide and not after any library. The header's last
/// frame is what 16 bits hold of it.
class C3dWriter {
 public:
  explicit C3dWriter(C3dWriteOptions options) : options_(std::move(options)) {}

  std::vector<std::byte> file(const MarkerClip& clip) {
    const std::size_t points = clip.markers.size();
    const double metres = options_.unit == "mm" ? 0.001 : 1;
    std::string parameters("\1\120\0", 3);
    parameters += static_cast<char>(options_.processor);
    parameters += group("POINT", 1) + group("TRIAL", 2) + group("ROTATION", 3);
    parameters += numbers("USED", 1, 2, {static_cast<double>(points)});
    parameters += numbers("RATE", 1, 4, {clip.fps});
    for (const C3dWriteOptions::Numbers& more : options_.numbers) {
      parameters += numbers(more.name, id_of(more.group), more.type, more.values);
    }
    if (!options_.angles.empty()) {
      parameters += texts("ANGLES", options_.angles);
    }
    parameters += texts("UNITS", {options_.unit});
    for (std::size_t first = 0; first < points; first += 255) {
      const std::size_t last = std::min(points, first + 255);
      parameters += texts(first == 0 ? "LABELS" : "LABELS" + std::to_string(first / 255 + 1),
                          {clip.markers.begin() + static_cast<std::ptrdiff_t>(first),
                           clip.markers.begin() + static_cast<std::ptrdiff_t>(last)});
    }
    if (!options_.segments.empty()) {
      parameters += texts("LABELS", options_.segments, 3);
      parameters += numbers("USED", 3, 2, {static_cast<double>(options_.segments.size())});
      parameters += numbers("RATIO", 3, 2, {static_cast<double>(options_.ratio)});
      const std::size_t start = parameters.size() + numbers("DATA_START", 3, 2, {0}).size() + 2;
      parameters += numbers("DATA_START", 3, 2, {static_cast<double>((start + 511) / 512 + 2)});
    }
    if (options_.swap_last_offset) {
      std::swap(parameters[last_offset(parameters)], parameters[last_offset(parameters) + 1]);
    }
    parameters += std::string(2, '\0');
    padded(parameters);
    const std::size_t blocks = parameters.size() / 512;
    parameters[2] = static_cast<char>(blocks);

    std::string header("\2\120", 2);
    header += word(static_cast<double>(points)) + word(0) + word(clip.frame_ids.front()) +
              word(clip.frame_ids.back() % 65'536) + word(0) + real(options_.real ? -0.1 : 0.1) +
              word(static_cast<double>(blocks + 2)) + word(0) +
              real(options_.header_rate > 0 ? options_.header_rate : clip.fps);
    padded(header);
    std::string data;
    for (std::size_t f = 0; f < clip.positions.size(); ++f) {
      for (std::size_t m = 0; m < points; ++m) {
        const bool seen = clip.seen[f][m];
        for (int i = 0; i < 3; ++i) {
          const double value = clip.positions[f](static_cast<Index>(m), i) / metres;
          const double shown = seen || !options_.nan ? value : std::nan("");
          data += options_.real ? real(shown) : word(std::round(10 * value));
        }
        const double residual = seen || options_.nan ? 0 : -1;
        data += options_.real ? real(residual) : word(residual);
      }
    }
    for (const std::vector<double>& frame : options_.matrices) {
      for (const double number : frame) {
        data += real(number);
      }
    }
    padded(data);
    const std::string all = header + parameters + data;
    std::vector<std::byte> bytes;
    for (const char c : all) {
      bytes.push_back(static_cast<std::byte>(c));
    }
    return bytes;
  }

 private:
  static void padded(std::string& text) { text.resize((text.size() + 511) / 512 * 512, '\0'); }

  std::string word(double value) const {
    const auto bits = static_cast<std::uint16_t>(static_cast<std::int32_t>(value));
    const char low = static_cast<char>(bits & 0xFF);
    const char high = static_cast<char>(bits >> 8);
    return options_.processor == 86 ? std::string{high, low} : std::string{low, high};
  }

  std::string real(double value) const {
    const auto number = static_cast<float>(options_.processor == 85 ? 4 * value : value);
    const auto bits = std::bit_cast<std::uint32_t>(number);
    const char bytes[4] = {static_cast<char>(bits & 0xFF), static_cast<char>(bits >> 8 & 0xFF),
                           static_cast<char>(bits >> 16 & 0xFF), static_cast<char>(bits >> 24)};
    switch (options_.processor) {
      case 85:
        return {bytes[2], bytes[3], bytes[0], bytes[1]};
      case 86:
        return {bytes[3], bytes[2], bytes[1], bytes[0]};
      default:
        return {bytes[0], bytes[1], bytes[2], bytes[3]};
    }
  }

  std::string record(const std::string& name, int id, const std::string& content) const {
    return std::string{static_cast<char>(name.size()), static_cast<char>(id)} + name +
           word(static_cast<double>(content.size() + 3)) + content + '\0';  // no description
  }
  std::string group(const std::string& name, int id) const { return record(name, -id, ""); }
  static int id_of(const std::string& group) {
    return group == "TRIAL" ? 2 : group == "ROTATION" ? 3 : 1;
  }

  std::string numbers(const std::string& name, int id, int type,
                      const std::vector<double>& values) const {
    std::string content{static_cast<char>(type), 1, static_cast<char>(values.size())};
    for (const double value : values) {
      content += type == 4 ? real(value) : word(value);
    }
    return record(name, id, content);
  }
  std::string texts(const std::string& name, const std::vector<std::string>& all, int id = 1) {
    std::size_t width = 1;
    for (const std::string& text : all) {
      width = std::max(width, text.size());
    }
    std::string content{-1, 2, static_cast<char>(width), static_cast<char>(all.size())};
    for (const std::string& text : all) {
      content += text + std::string(width - text.size(), ' ');
    }
    last_ = content.size() + 3;
    return record(name, id, content);
  }
  std::size_t last_offset(const std::string& parameters) const { return parameters.size() - last_; }

  C3dWriteOptions options_;
  std::size_t last_ = 0;  // from the last record's offset to its end
};

}  // namespace atelier::fixtures
