#include "pipeline/view/view_data.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <limits>

#include <zlib.h>

#include "core/error.h"
#include "core/io/json_text.h"
#include "core/printable.h"
#include "core/saturating_cast.h"
#include "pipeline/pictures/report_page.h"

namespace atelier {
namespace {

/// zlib's form, which browsers read as "deflate". Level 1: a third of the time of the usual one for
/// a tenth more bytes, and a server makes files while somebody waits.
std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::string out(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(out.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uLong>(bytes.size()),
                Z_BEST_SPEED) != Z_OK) {
    throw LogicError("zlib refuses to deflate");
  }
  out.resize(size);
  return out;
}

}  // namespace

void ViewData::add_bytes(std::string_view name, std::string_view type, std::size_t count,
                         std::span<const std::byte> bytes) {
  bytes_.resize((bytes_.size() + 3) / 4 * 4);
  header["arrays"].push_back(
      {{"name", name}, {"type", type}, {"offset", bytes_.size()}, {"count", count}});
  bytes_.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

std::string ViewData::script(const std::string& key) const {
  const std::string packed = bytes_.empty() ? "" : deflated(bytes_);
  return "atelierData(" + json_text(nlohmann::json(key)) + "," + json_text(header) + ",\"" +
         base64_text(std::as_bytes(std::span(packed))) + "\");\n";
}

QuantizedFrames quantize(std::span<const Points> frames) {
  QuantizedFrames quantized;
  quantized.frames = frames.size();
  if (frames.empty() || frames.front().rows() == 0) {
    return quantized;
  }
  Eigen::Vector3d low = frames.front().row(0).transpose();
  Eigen::Vector3d high = low;
  for (const Points& frame : frames) {
    if (frame.rows() != frames.front().rows() || !frame.allFinite()) {
      throw LogicError("frames that are quantized together have the same finite vertices");
    }
    low = low.cwiseMin(frame.colwise().minCoeff().transpose());
    high = high.cwiseMax(frame.colwise().maxCoeff().transpose());
  }
  constexpr double kSteps = std::numeric_limits<std::uint16_t>::max();
  quantized.low = low;
  quantized.step = std::max((high - low).maxCoeff(), 1e-6) / kSteps;
  quantized.values.reserve(frames.size() * static_cast<std::size_t>(frames.front().size()));
  for (const Points& frame : frames) {
    for (Index v = 0; v < frame.rows(); ++v) {
      for (Index k = 0; k < 3; ++k) {
        const double value = std::round((frame(v, k) - low[k]) / quantized.step);
        quantized.values.push_back(saturating_cast<std::uint16_t>(value));
      }
    }
  }
  return quantized;
}

void add_vertices(ViewData& data, const QuantizedFrames& frames) {
  const std::size_t count = frames.values.size();
  const std::size_t stride = frames.frames == 0 ? 0 : count / frames.frames;
  std::vector<std::uint8_t> small(count);
  std::vector<std::uint8_t> large(count);
  const auto motion = [&](std::size_t i) {
    return frames.values[i] - (i < stride ? 0 : frames.values[i - stride]);
  };
  for (std::size_t i = 0; i < count; ++i) {
    const int beside = i % stride < 3 ? 0 : motion(i - 3);
    const auto difference = static_cast<std::int16_t>(motion(i) - beside);
    const auto coded = static_cast<std::uint16_t>((static_cast<std::uint16_t>(difference) << 1U) ^
                                                  (difference < 0 ? 0xffffU : 0U));
    small[i] = static_cast<std::uint8_t>(coded & 0xffU);
    large[i] = static_cast<std::uint8_t>(coded >> 8U);
  }
  data.header["low"] = {frames.low.x(), frames.low.y(), frames.low.z()};
  data.header["step"] = frames.step;
  data.add<std::uint8_t>("small", small);
  data.add<std::uint8_t>("large", large);
}

std::vector<float> inverse_rest_edges(const Points& vertices, const Triangles& faces) {
  std::vector<float> inverse(static_cast<std::size_t>(4 * faces.rows()));
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3d a = (vertices.row(faces(f, 1)) - vertices.row(faces(f, 0))).transpose();
    const Eigen::Vector3d b = (vertices.row(faces(f, 2)) - vertices.row(faces(f, 0))).transpose();
    const double length = a.norm();
    const double height = length > 0 ? a.cross(b).norm() / length : 0;
    if (!(length > 1e-9) || !(height > 1e-9)) {
      continue;
    }
    // Of the upper triangular matrix [length, along; 0, height].
    const double along = a.dot(b) / length;
    float* row = &inverse[static_cast<std::size_t>(4 * f)];
    row[0] = static_cast<float>(1 / length);
    row[1] = static_cast<float>(-along / (length * height));
    row[3] = static_cast<float>(1 / height);
  }
  return inverse;
}

std::optional<std::string> problem_of(const std::function<void()>& work) {
  const auto name = [](const std::string& place) {
    return std::filesystem::path(place).filename().string();
  };
  try {
    work();
  } catch (const DataError& error) {
    return printable(DataError(name(error.file), error.where, error.found, error.expected).what());
  } catch (const EnvironmentError& error) {
    return printable(EnvironmentError(name(error.place), error.reason).what());
  }
  return std::nullopt;
}

std::string without_folders(std::string text, std::span<const std::string> roots) {
  const auto begins = [&](std::size_t at) {  // a place, not the middle of one, and no "m/s"
    return at == 0 || (std::isalnum(static_cast<unsigned char>(text[at - 1])) == 0 &&
                       std::string_view("/._-:").find(text[at - 1]) == std::string_view::npos);
  };
  std::vector<std::string> longest_first(roots.begin(), roots.end());
  std::sort(longest_first.begin(), longest_first.end(),
            [](const auto& a, const auto& b) { return a.size() > b.size(); });
  for (std::string root : longest_first) {
    if (root.find_first_not_of('/') == std::string::npos) {
      continue;
    }
    root += root.ends_with('/') ? "" : "/";
    for (std::size_t at = 0; (at = text.find(root, at)) != std::string::npos;) {
      if (begins(at)) {
        text.erase(at, root.size());
      } else {
        ++at;
      }
    }
  }
  for (std::size_t at = 0; (at = text.find('/', at)) != std::string::npos; ++at) {
    if (begins(at)) {
      const std::size_t end = std::min(text.find_first_of(" \t\n\"'`()[]{}<>,;", at), text.size());
      const std::size_t last = text.find_last_not_of("/:.", end - 1);  // of "/a/b/:"
      const std::size_t name = text.rfind('/', last) + 1;
      if (last != std::string::npos && last >= at && name > at) {
        text.erase(at, name - at);
      }
    }
  }
  return text;
}

std::vector<std::uint8_t> to_bytes(std::span<const double> values, double low, double high) {
  std::vector<std::uint8_t> bytes(values.size());
  std::transform(values.begin(), values.end(), bytes.begin(), [&](double value) {
    const double share = std::clamp((value - low) / (high - low), 0.0, 1.0);
    return saturating_cast<std::uint8_t>(std::round(255 * share));
  });
  return bytes;
}

}  // namespace atelier
