#include "capture/masks/background.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr float kGamma = 1 / 2.2F;  // noise is then nearly even over brightness

float coded(float value) {
  return std::pow(std::clamp(value, 0.0F, 1.0F), kGamma);
}

std::array<float, 3> coded_pixel(const Image& image, std::size_t pixel) {
  const float* at = image.data.data() + pixel * static_cast<std::size_t>(image.channels);
  if (image.channels == 1) {
    const float value = coded(at[0]);
    return {value, value, value};
  }
  return {coded(at[0]), coded(at[1]), coded(at[2])};
}

float distance(const std::array<float, 3>& a, const std::array<float, 3>& b) {
  return std::sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                   (a[2] - b[2]) * (a[2] - b[2]));
}

void check_sizes(const std::vector<Image>& images) {
  for (const Image& image : images) {
    if (image.width != images.front().width || image.height != images.front().height) {
      throw DataError("", "",
                      std::to_string(image.width) + " x " + std::to_string(image.height) +
                          " pixels beside " + std::to_string(images.front().width) + " x " +
                          std::to_string(images.front().height),
                      "images of one size");
    }
  }
}

float median_of(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Deviation of gamma-coded noise that an image shows: neighbours' second differences (Immerkaer
/// 1996), by their median.
float noise_of(const Image& image) {
  std::vector<float> differences;
  for (int y = 1; y + 1 < image.height; y += 2) {
    for (int x = 1; x + 1 < image.width; x += 2) {
      const int green = image.channels > 1 ? 1 : 0;
      const auto at = [&](int dx, int dy) { return coded(image.at(x + dx, y + dy, green)); };
      const float laplacian = at(-1, -1) + at(1, -1) + at(-1, 1) + at(1, 1) + 4 * at(0, 0) -
                              2 * (at(-1, 0) + at(1, 0) + at(0, -1) + at(0, 1));
      differences.push_back(std::abs(laplacian) / 6);
    }
  }
  return differences.empty() ? 0.01F : 1.4826F * median_of(differences);
}

/// Median and spread (by median deviation) of each pixel over pictures.
EmptyStage medians(const std::vector<Image>& images) {
  const Image& first = images.front();
  EmptyStage background;
  background.mean = Image(first.width, first.height, 3);
  background.spread = Image(first.width, first.height, 1);
  std::vector<float> values(images.size());
  for (std::size_t p = 0; p < background.spread.data.size(); ++p) {
    for (int c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < images.size(); ++i) {
        const int channels = images[i].channels;
        values[i] = images[i].data[p * static_cast<std::size_t>(channels) +
                                   static_cast<std::size_t>(channels == 1 ? 0 : c)];
      }
      background.mean.data[3 * p + static_cast<std::size_t>(c)] = median_of(values);
    }
    const std::array<float, 3> middle = coded_pixel(background.mean, p);
    for (std::size_t i = 0; i < images.size(); ++i) {
      values[i] = distance(coded_pixel(images[i], p), middle);
    }
    // The length of three even deviations has its median at 1.54 of one.
    background.spread.data[p] = median_of(values) / 1.54F;
  }
  return background;
}

float luminance(const float* rgb) {
  return 0.2126F * rgb[0] + 0.7152F * rgb[1] + 0.0722F * rgb[2];
}

/// The background's colour with less light: how much, or nothing.
bool is_shadow(const Image& image, std::size_t p, const EmptyStage& background,
               const MaskOptions& options) {
  if (options.shadow_darkest >= 1 || image.channels != 3) {
    return false;
  }
  const float* now = image.data.data() + 3 * p;
  const float* then = background.mean.data.data() + 3 * p;
  const float light_now = now[0] + now[1] + now[2];
  const float light_then = then[0] + then[1] + then[2];
  const float ratio = light_now / std::max(light_then, 1e-6F);
  if (ratio < static_cast<float>(options.shadow_darkest) || ratio > 1) {
    return false;
  }
  for (int c = 0; c < 3; ++c) {
    const float hue = now[c] / std::max(light_now, 1e-6F) - then[c] / std::max(light_then, 1e-6F);
    if (std::abs(hue) > static_cast<float>(options.shadow_hue)) {
      return false;
    }
  }
  return true;
}

/// Replaces a pixel's background by the value that most frames come within `reach` of. How many.
std::size_t take_most_frequent(const std::vector<Image>& images, std::size_t p, float reach,
                               EmptyStage& background) {
  std::vector<std::array<float, 3>> values;
  values.reserve(images.size());
  for (const Image& image : images) {
    values.push_back(coded_pixel(image, p));
  }
  std::size_t best = 0;
  std::size_t most = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto near = static_cast<std::size_t>(std::count_if(
        values.begin(), values.end(),
        [&](const std::array<float, 3>& value) { return distance(values[i], value) <= reach; }));
    if (near > most) {
      most = near;
      best = i;
    }
  }
  std::array<std::vector<float>, 3> linear;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (distance(values[best], values[i]) <= reach) {
      const auto channels = static_cast<std::size_t>(images[i].channels);
      for (std::size_t c = 0; c < 3; ++c) {
        linear[c].push_back(images[i].data[p * channels + (channels == 1 ? 0 : c)]);
      }
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    background.mean.data[3 * p + c] = median_of(linear[c]);
  }
  return most;
}

/// Numbers, from 1, of the parts outside of a mask that do not reach the image's border.
cv::Mat holes_of(const ByteImage& mask) {
  cv::Mat outside(mask.height, mask.width, CV_8UC1);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      outside.at<std::uint8_t>(y, x) = mask.at(x, y) != 0 ? 0 : 255;
    }
  }
  cv::Mat parts;
  const int count = cv::connectedComponents(outside, parts, 4);
  std::vector<bool> open(static_cast<std::size_t>(count), false);
  open[0] = true;  // the mask
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (x == 0 || y == 0 || x == mask.width - 1 || y == mask.height - 1) {
        open[static_cast<std::size_t>(parts.at<int>(y, x))] = true;
      }
    }
  }
  std::vector<int> number(static_cast<std::size_t>(count), 0);
  int next = 0;
  for (std::size_t i = 0; i < number.size(); ++i) {
    number[i] = open[i] ? 0 : ++next;
  }
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      int& part = parts.at<int>(y, x);
      part = number[static_cast<std::size_t>(part)];
    }
  }
  return parts;
}

/// Whether most of a hole is background: seen in the open in other frames, or of a colour that the
/// background has around the hole, where it was seen in the open.
bool shows_background(const cv::Mat& hole, const MovingBackground& moving) {
  constexpr int kLevels = 24;  // of each gamma-coded channel
  const auto level_of = [&](int x, int y) {
    const std::size_t p = static_cast<std::size_t>(y) * static_cast<std::size_t>(hole.cols) +
                          static_cast<std::size_t>(x);
    const std::array<float, 3> value = coded_pixel(moving.background.mean, p);
    std::array<int, 3> level{};
    for (std::size_t c = 0; c < 3; ++c) {
      level[c] = std::clamp(saturating_cast<int>(value[c] * kLevels), 0, kLevels - 1);
    }
    return level;
  };
  const auto at = [](const std::array<int, 3>& level) {
    return static_cast<std::size_t>((level[0] * kLevels + level[1]) * kLevels + level[2]);
  };
  const cv::Rect box = cv::boundingRect(hole);
  const int reach = std::max({box.width, box.height, hole.rows / 20});
  const cv::Rect around =
      cv::Rect(box.x - reach, box.y - reach, box.width + 2 * reach, box.height + 2 * reach) &
      cv::Rect(0, 0, hole.cols, hole.rows);
  std::vector<int> colours(static_cast<std::size_t>(kLevels * kLevels * kLevels), 0);
  int open = 0;
  for (int y = around.y; y < around.y + around.height; ++y) {
    for (int x = around.x; x < around.x + around.width; ++x) {
      if (moving.seen_open.at(x, y) != 0 && hole.at<std::uint8_t>(y, x) == 0) {
        ++colours[at(level_of(x, y))];
        ++open;
      }
    }
  }
  const auto is_around = [&](const std::array<int, 3>& level) {
    int count = 0;
    for (int dr = -1; dr <= 1; ++dr) {
      for (int dg = -1; dg <= 1; ++dg) {
        for (int db = -1; db <= 1; ++db) {
          const std::array<int, 3> other = {level[0] + dr, level[1] + dg, level[2] + db};
          if (std::all_of(other.begin(), other.end(),
                          [](int value) { return value >= 0 && value < kLevels; })) {
            count += colours[at(other)];
          }
        }
      }
    }
    constexpr double kShare = 0.01;  // of what is open around: no single pixels
    return count > kShare * open;
  };
  int area = 0;
  int background = 0;
  for (int y = box.y; y < box.y + box.height; ++y) {
    for (int x = box.x; x < box.x + box.width; ++x) {
      if (hole.at<std::uint8_t>(y, x) != 0) {
        ++area;
        background += moving.seen_open.at(x, y) != 0 || is_around(level_of(x, y)) ? 1 : 0;
      }
    }
  }
  return 2 * background > area;
}

/// What differs from the background, not cleaned.
ByteImage differing(const Image& image, const EmptyStage& background, const MaskOptions& options) {
  ATELIER_CHECK(image.width == background.mean.width && image.height == background.mean.height,
                "an image of another size than its background");
  ByteImage mask(image.width, image.height, 1);
  for (std::size_t p = 0; p < mask.data.size(); ++p) {
    const float difference = distance(coded_pixel(image, p), coded_pixel(background.mean, p));
    const float allowed =
        std::max(static_cast<float>(options.min_difference),
                 static_cast<float>(options.threshold) * background.spread.data[p]);
    mask.data[p] = difference > allowed && !is_shadow(image, p, background, options) ? 255 : 0;
  }
  return mask;
}

/// Pixels within some rows and columns that are not 0 in a mask.
cv::Mat counts_around(const ByteImage& mask, int reach) {
  cv::Mat ones(mask.height, mask.width, CV_32F);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      ones.at<float>(y, x) = mask.at(x, y) != 0 ? 1 : 0;
    }
  }
  cv::boxFilter(ones, ones, -1, cv::Size(2 * reach + 1, 2 * reach + 1), cv::Point(-1, -1), false,
                cv::BORDER_CONSTANT);
  return ones;
}

/// mask_from_background where the background is known; elsewhere as most of the surroundings that
/// tell.
ByteImage mask_with_surroundings(const Image& image, const MovingBackground& moving,
                                 const MaskOptions& options) {
  ByteImage mask = differing(image, moving.background, options);
  ByteImage tells = mask;  // differs, or is as a background that is known
  for (std::size_t p = 0; p < tells.data.size(); ++p) {
    tells.data[p] = mask.data[p] != 0 || moving.covered.data[p] == 0 ? 255 : 0;
  }
  constexpr double kReach = 8;  // px of an image 1000 rows high
  const int reach = std::max(1, saturating_cast<int>(std::round(kReach * mask.height / 1000)));
  const cv::Mat differ = counts_around(mask, reach);
  const cv::Mat known = counts_around(tells, reach);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (tells.at(x, y) == 0 &&
          2 * differ.at<float>(y, x) >= std::max(1.0F, known.at<float>(y, x))) {
        mask.at(x, y) = 255;
      }
    }
  }
  return clean_mask(mask, options);
}

cv::Mat disc(double radius) {
  const int r = saturating_cast<int>(std::round(radius));
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, cv::Size(2 * r + 1, 2 * r + 1));
}

}  // namespace

OptionTable describe(MaskOptions& options) {
  OptionTable table;
  table.add("threshold", options.threshold, 1, 100, "",
            "Distance from the background, in standard deviations, above which a pixel is "
            "foreground; raise it where noise gets in");
  table.add("min_difference", options.min_difference, 0, 1, "",
            "Minimum difference of gamma-coded values from the background at which a pixel is "
            "foreground");
  table.add("shadow_darkest", options.shadow_darkest, 0.01, 1, "",
            "Minimum fraction of the background's light at which a pixel of its colour is a "
            "shadow; 1: shadows are foreground");
  table.add("shadow_hue", options.shadow_hue, 0, 1, "",
            "Maximum deviation of a shadow's chromaticity from the background's; lower where "
            "clothes are grey");
  table.add("opening", options.opening, 0, 50, "px",
            "Radius of the morphological opening in an image 1000 rows high, which removes specks "
            "and threads thinner than twice this; 0: single pixels stay");
  table.add("closing", options.closing, 0, 50, "px",
            "Radius of the morphological closing in an image 1000 rows high, which fills gaps "
            "narrower than twice this");
  table.add("min_part", options.min_part, 0, 1, "",
            "Minimum size of a connected component that is kept, as a fraction of the largest; "
            "smaller than filled holes it goes too");
  table.add("max_hole", options.max_hole, 0, 1, "",
            "Maximum size of a hole that is filled, as a fraction of the image");
  return table;
}

OptionTable describe(ChromaOptions& options) {
  OptionTable table;
  table.add("key", options.key, 0, 1, "",
            "Linear RGB of the screen; [0, 0, 0]: estimated from the image borders");
  table.add("tolerance", options.tolerance, 1e-3, 1, "",
            "Maximum deviation from the screen's chromaticity; raise it for uneven light");
  table.add("darkest", options.darkest, 0, 1, "", "Luminance below which a pixel has no hue");
  return table;
}

EmptyStage background_of_plates(const std::vector<Image>& plates) {
  if (plates.empty()) {
    throw DataError("", "plates", "none", "an image of the empty stage");
  }
  check_sizes(plates);
  EmptyStage background = medians(plates);
  float noise = 0;
  for (const Image& plate : plates) {
    noise = std::max(noise, noise_of(plate));
  }
  constexpr std::size_t kEnough = 8;  // fewer say too little about a pixel's spread
  for (float& spread : background.spread.data) {
    spread = plates.size() < kEnough ? noise : std::max(spread, 0.5F * noise);
  }
  return background;
}

MovingBackground background_over_time(const std::vector<Image>& frames,
                                      const MaskOptions& options) {
  constexpr std::size_t kLeast = 5;
  if (frames.size() < kLeast) {
    throw DataError("", "frames", std::to_string(frames.size()), "5 at least, or clean plates");
  }
  check_sizes(frames);
  MovingBackground moving;
  moving.background = medians(frames);
  // Where the person stays, values fall apart: the spread is far above the picture's noise.
  std::vector<float> spreads = moving.background.spread.data;
  const float usual = std::max(median_of(spreads), 1e-3F);
  const auto apart = std::count_if(spreads.begin(), spreads.end(),
                                   [&](float spread) { return spread > 8 * usual; });
  moving.still_share = static_cast<double>(apart) / static_cast<double>(spreads.size());
  moving.covered = ByteImage(frames.front().width, frames.front().height, 1);
  for (std::size_t p = 0; p < spreads.size(); ++p) {
    if (moving.background.spread.data[p] > 2 * usual) {
      const std::size_t agree = take_most_frequent(frames, p, 4 * usual, moving.background);
      moving.covered.data[p] = 3 * agree < frames.size() ? 255 : 0;
    }
  }
  for (float& spread : moving.background.spread.data) {
    spread = std::clamp(spread, 0.5F * usual, 2 * usual);
  }
  const Image& first = frames.front();
  std::vector<std::size_t> open(spreads.size(), 0);
  for (const Image& frame : frames) {
    const ByteImage mask = mask_with_surroundings(frame, moving, options);
    const cv::Mat holes = holes_of(mask);
    for (int y = 0; y < first.height; ++y) {
      for (int x = 0; x < first.width; ++x) {
        const bool seen = mask.at(x, y) == 0 && holes.at<int>(y, x) == 0;
        open[static_cast<std::size_t>(y) * static_cast<std::size_t>(first.width) +
             static_cast<std::size_t>(x)] += seen ? 1 : 0;
      }
    }
  }
  const std::size_t often = std::max<std::size_t>(2, frames.size() / 10);
  moving.seen_open = ByteImage(first.width, first.height, 1);
  for (std::size_t p = 0; p < open.size(); ++p) {
    moving.seen_open.data[p] = open[p] >= often ? 255 : 0;
  }
  return moving;
}

ByteImage mask_from_background(const Image& image, const EmptyStage& background,
                               const MaskOptions& options) {
  return clean_mask(differing(image, background, options), options);
}

ByteImage mask_over_time(const Image& image, const MovingBackground& moving,
                         const MaskOptions& options) {
  ByteImage mask = mask_with_surroundings(image, moving, options);
  const cv::Mat holes = holes_of(mask);
  double count = 0;
  cv::minMaxLoc(holes, nullptr, &count);
  for (int hole = 1; hole <= saturating_cast<int>(count); ++hole) {
    const cv::Mat inside = holes == hole;
    if (!shows_background(inside, moving)) {
      for (int y = 0; y < mask.height; ++y) {
        for (int x = 0; x < mask.width; ++x) {
          mask.at(x, y) = inside.at<std::uint8_t>(y, x) != 0 ? 255 : mask.at(x, y);
        }
      }
    }
  }
  return mask;
}

double outline_without_edge(const Image& image, const ByteImage& mask, const EmptyStage& background,
                            const MaskOptions& options) {
  ATELIER_CHECK(image.width == mask.width && image.height == mask.height &&
                    image.width == background.mean.width && image.height == background.mean.height,
                "an image of another size than its mask or background");
  std::size_t outline = 0;
  std::size_t alike = 0;
  const auto at = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
           static_cast<std::size_t>(x);
  };
  // Between two neighbours, of which one is in the mask; edges are blurred by a pixel to each side.
  for (int y = 1; y + 2 < image.height; ++y) {
    for (int x = 1; x + 2 < image.width; ++x) {
      for (const auto& [dx, dy] : {std::pair(1, 0), std::pair(0, 1)}) {
        if ((mask.at(x, y) != 0) == (mask.at(x + dx, y + dy) != 0)) {
          continue;
        }
        const std::size_t before = at(x - dx, y - dy);
        const std::size_t behind = at(x + 2 * dx, y + 2 * dy);
        const float allowed =
            std::max(static_cast<float>(options.min_difference),
                     static_cast<float>(options.threshold) * background.spread.data[before]);
        ++outline;
        alike +=
            distance(coded_pixel(image, before), coded_pixel(image, behind)) <= allowed ? 1 : 0;
      }
    }
  }
  return outline == 0 ? 0 : static_cast<double>(alike) / static_cast<double>(outline);
}

ByteImage mask_by_chroma(const Image& image, const ChromaOptions& chroma,
                         const MaskOptions& options) {
  ATELIER_CHECK(image.channels == 3, "a chroma key of an image without colours");
  ATELIER_CHECK(chroma.key.size() == 3, "a key of three numbers");
  std::array<float, 3> key{};
  for (std::size_t c = 0; c < 3; ++c) {
    key[c] = static_cast<float>(chroma.key[c]);
  }
  if (key[0] + key[1] + key[2] <= 0) {
    // Most of a picture's borders is screen: their median.
    std::array<std::vector<float>, 3> borders;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        if (x == 0 || x == image.width - 1 || y == 0) {
          for (int c = 0; c < 3; ++c) {
            borders[static_cast<std::size_t>(c)].push_back(image.at(x, y, c));
          }
        }
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      key[c] = median_of(borders[c]);
    }
  }
  const float sum = key[0] + key[1] + key[2];
  const float strongest = *std::max_element(key.begin(), key.end()) / std::max(sum, 1e-6F);
  if (strongest < 0.42F) {
    throw DataError("", "key", "a screen that is nearly grey", "a coloured one, or clean plates");
  }
  ByteImage mask(image.width, image.height, 1);
  for (std::size_t p = 0; p < mask.data.size(); ++p) {
    const float* rgb = image.data.data() + 3 * p;
    const float light = rgb[0] + rgb[1] + rgb[2];
    float off = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      off = std::max(off, std::abs(rgb[c] / std::max(light, 1e-6F) - key[c] / sum));
    }
    const bool dark = luminance(rgb) < static_cast<float>(chroma.darkest);
    mask.data[p] = dark || off > static_cast<float>(chroma.tolerance) ? 255 : 0;
  }
  return clean_mask(mask, options);
}

ByteImage clean_mask(const ByteImage& mask, const MaskOptions& options) {
  if (mask.data.empty()) {
    return mask;
  }
  ATELIER_CHECK(mask.channels == 1, "a mask of one channel");
  const double scale = mask.height / 1000.0;
  cv::Mat bits(mask.height, mask.width, CV_8UC1);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      bits.at<std::uint8_t>(y, x) = mask.at(x, y) != 0 ? 255 : 0;
    }
  }
  if (options.opening > 0) {
    cv::morphologyEx(bits, bits, cv::MORPH_OPEN, disc(std::max(1.0, scale * options.opening)));
  }
  if (scale * options.closing >= 0.5) {
    cv::morphologyEx(bits, bits, cv::MORPH_CLOSE, disc(scale * options.closing));
  }
  const auto each_part = [](const cv::Mat& of, const auto& keep) {
    cv::Mat numbers;
    cv::Mat statistics;
    cv::Mat centres;
    const int count = cv::connectedComponentsWithStats(of, numbers, statistics, centres, 8);
    int largest = 0;
    for (int i = 1; i < count; ++i) {
      largest = std::max(largest, statistics.at<int>(i, cv::CC_STAT_AREA));
    }
    cv::Mat result = cv::Mat::zeros(of.size(), CV_8UC1);
    for (int y = 0; y < of.rows; ++y) {
      for (int x = 0; x < of.cols; ++x) {
        const int i = numbers.at<int>(y, x);
        if (i > 0 && keep(statistics.at<int>(i, cv::CC_STAT_AREA), largest)) {
          result.at<std::uint8_t>(y, x) = 255;
        }
      }
    }
    return result;
  };
  const double hole = options.max_hole * mask.width * mask.height;
  bits = each_part(bits, [&](int area, int largest) {
    return area >= std::max(options.min_part * largest, hole);
  });
  cv::Mat around;
  cv::bitwise_not(bits, around);
  around = each_part(around, [&](int area, int) { return area >= hole; });
  ByteImage clean(mask.width, mask.height, 1);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      clean.at(x, y) = around.at<std::uint8_t>(y, x) != 0 ? 0 : 255;
    }
  }
  return clean;
}

double mask_iou(const ByteImage& a, const ByteImage& b) {
  ATELIER_CHECK(a.width == b.width && a.height == b.height && a.channels == 1 && b.channels == 1,
                "masks of two sizes");
  std::size_t both = 0;
  std::size_t either = 0;
  for (std::size_t p = 0; p < a.data.size(); ++p) {
    both += a.data[p] != 0 && b.data[p] != 0 ? 1 : 0;
    either += a.data[p] != 0 || b.data[p] != 0 ? 1 : 0;
  }
  return either == 0 ? 1 : static_cast<double>(both) / static_cast<double>(either);
}

}  // namespace atelier
