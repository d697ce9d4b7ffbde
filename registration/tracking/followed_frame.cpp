#include "registration/tracking/followed_frame.h"

#include <cmath>

#include "core/archive_arrays.h"
#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr int kVersion = 1;
constexpr int kMaxLevels = 16;

double number_at(const Archive& archive, const std::string& name, const std::string& file) {
  const auto found = archive.numbers.find(name);
  if (found == archive.numbers.end() || !std::isfinite(found->second)) {
    throw DataError(file, name, "none", "a number");
  }
  return found->second;
}

/// A count, at most `most`.
int count_at(const Archive& archive, const std::string& name, int most, const std::string& file) {
  const double value = number_at(archive, name, file);
  if (!(value >= 0 && value <= most) || value != std::floor(value)) {
    throw DataError(file, name, std::to_string(value),
                    "a whole number up to " + std::to_string(most));
  }
  return saturating_cast<int>(value);
}

TextureGain gain_of(const Archive& archive, Index samples, const std::string& file) {
  TextureGain gain;
  gain.levels = count_at(archive, "gain_levels", kMaxLevels, file);
  gain.channels = count_at(archive, "gain_channels", 3, file);
  const Tensor* rows = find_array(archive, "gain_samples");
  if (rows == nullptr) {
    return gain;
  }
  gain.samples = indices_of(*rows, samples, file, "gain_samples");
  for (std::size_t i = 1; i < gain.samples.size(); ++i) {
    if (gain.samples[i] <= gain.samples[i - 1]) {
      throw DataError(file, "gain_samples", "not in order", "increasing numbers");
    }
  }
  const std::span<const float> values = floats_at(
      archive, "gain_values",
      {static_cast<std::int64_t>(gain.samples.size()), gain.levels * gain.channels}, file);
  gain.values.assign(values.begin(), values.end());
  return gain;
}

}  // namespace

TextureGain texture_gain(const GarmentTexture& before, const GarmentTexture& after) {
  TextureGain gain;
  gain.levels = static_cast<int>(after.levels.size());
  gain.channels = after.channels;
  const auto channels = static_cast<std::size_t>(after.channels);
  for (std::size_t s = 0; s < after.known.size(); ++s) {
    if (after.known[s] == 0 || (!before.known.empty() && before.known[s] != 0)) {
      continue;
    }
    gain.samples.push_back(static_cast<int>(s));
    for (const std::vector<float>& level : after.levels) {
      const auto at = level.begin() + static_cast<std::ptrdiff_t>(s * channels);
      gain.values.insert(gain.values.end(), at, at + after.channels);
    }
  }
  return gain;
}

void add_gain(GarmentTexture& texture, const TextureGain& gain, std::size_t samples) {
  if (gain.levels == 0) {
    return;
  }
  const auto levels = static_cast<std::size_t>(gain.levels);
  const auto channels = static_cast<std::size_t>(gain.channels);
  if (texture.levels.empty()) {
    texture.channels = gain.channels;
    texture.levels.assign(levels, std::vector<float>(samples * channels));
    texture.known.assign(samples, 0);
  }
  if (texture.levels.size() != levels || texture.channels != gain.channels ||
      texture.known.size() != samples) {
    throw DataError("", "gain", "a texture of other sizes or channels than the frames before it",
                    "frames that were followed together: remove the kept ones (--force)");
  }
  auto value = gain.values.begin();
  for (const int sample : gain.samples) {
    const auto s = static_cast<std::size_t>(sample);
    texture.known[s] = 1;
    for (std::vector<float>& level : texture.levels) {
      std::copy(value, value + gain.channels,
                level.begin() + static_cast<std::ptrdiff_t>(s * channels));
      value += gain.channels;
    }
  }
}

Archive archive_of(const FollowedFrame& frame, const std::string& made_of) {
  const RegisteredGarment& garment = frame.garment;
  Archive archive;
  archive.schema = kFollowedFrameSchema;
  archive.version = kVersion;
  archive.texts["made_of"] = made_of;
  archive.numbers = {{"scan_rms", garment.scan_rms},
                     {"support", garment.support},
                     {"correlation", garment.correlation},
                     {"seen", garment.seen},
                     {"picture_steps", garment.picture_steps},
                     {"code_read", garment.code_read},
                     {"code_contradicted", garment.code_contradicted},
                     {"strain_p95", garment.strain_p95},
                     {"inverted", garment.inverted},
                     {"inside", garment.contact.inside},
                     {"inside_depth", garment.contact.depth},
                     {"body_crossings", garment.contact.crossings},
                     {"gain_levels", frame.gain.levels},
                     {"gain_channels", frame.gain.channels}};
  put_array(archive, "vertices", tensor_of(garment.vertices));
  put_array(archive, "confidence", tensor_of(garment.confidence));
  put_array(archive, "told", tensor_of(garment.vertex_correlation));
  put_array(archive, "drift", tensor_of(frame.drift));
  put_array(archive, "gain_samples", tensor_of(frame.gain.samples));
  put_array(archive, "gain_values",
            tensor_of(frame.gain.values, {static_cast<std::int64_t>(frame.gain.samples.size()),
                                          frame.gain.levels * frame.gain.channels}));
  return archive;
}

FollowedFrame followed_frame_of(const Archive& archive, const std::string& made_of, Index vertices,
                                Index samples, const std::string& file) {
  const auto name = archive.texts.find("made_of");
  if (name == archive.texts.end() || name->second != made_of) {
    throw DataError(file, "made_of",
                    name == archive.texts.end() ? "nothing" : "'" + name->second + "'",
                    "'" + made_of + "'");
  }
  FollowedFrame frame;
  RegisteredGarment& garment = frame.garment;
  garment.vertices = rows_at<Points>(archive, "vertices", 3, vertices, file);
  const std::span<const float> confidence = floats_at(archive, "confidence", {vertices}, file);
  garment.confidence = Eigen::Map<const Eigen::VectorXf>(confidence.data(), vertices);
  if (const Tensor* told = find_array(archive, "told")) {
    const std::vector<double> values = doubles_of(*told, file, "told");
    check_finite(*told, file, "told");
    if (static_cast<Index>(values.size()) != vertices) {
      throw DataError(file, "told", std::to_string(values.size()), std::to_string(vertices));
    }
    garment.vertex_correlation = Eigen::Map<const Eigen::VectorXd>(values.data(), vertices);
  }
  if (find_array(archive, "drift") != nullptr) {
    frame.drift = rows_at<Points>(archive, "drift", 3, vertices, file);
  }
  constexpr int kMost = 1'000'000'000;
  garment.scan_rms = number_at(archive, "scan_rms", file);
  garment.support = number_at(archive, "support", file);
  garment.correlation = number_at(archive, "correlation", file);
  garment.seen = number_at(archive, "seen", file);
  garment.picture_steps = count_at(archive, "picture_steps", kMost, file);
  garment.code_read = count_at(archive, "code_read", kMost, file);
  garment.code_contradicted = count_at(archive, "code_contradicted", kMost, file);
  garment.strain_p95 = number_at(archive, "strain_p95", file);
  garment.inverted = count_at(archive, "inverted", kMost, file);
  garment.contact.inside = number_at(archive, "inside", file);
  garment.contact.depth = number_at(archive, "inside_depth", file);
  garment.contact.crossings = count_at(archive, "body_crossings", kMost, file);
  frame.gain = gain_of(archive, samples, file);
  return frame;
}

}  // namespace atelier
