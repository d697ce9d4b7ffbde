#include "capture/surface/check_masks.h"

#include <algorithm>
#include <cstdint>

#include "capture/stereo/choose_sources.h"
#include "core/error.h"
#include "core/parallel.h"

namespace atelier {
namespace {

constexpr int kCells = 48;               // along each side of the cube
constexpr int kMinOthers = 3;            // of whom three quarters can agree
constexpr double kAgree = 0.75;          // of the others
constexpr int kMinCells = 20;            // to judge a mask by
constexpr double kShown = 0.5;           // of the cells, by a mask that is right
constexpr double kBorder = 0.5;          // of the picture's border, by a mask that is inverted
constexpr double kInvertedBorder = 0.6;  // the same where nothing else speaks against it
constexpr double kSomebody = 0.002;      // of the image, the least that a person covers

constexpr std::int8_t kSilent = -1;  // of a cell that is not in the image

/// Verdict of each mask on each cell: 1 subject, 0 background, or kSilent.
std::vector<std::int8_t> asked(const std::vector<Camera>& cameras,
                               const std::vector<ByteImage>& masks, double reach) {
  const double cell = 2 * reach / kCells;
  const Eigen::Vector3d low = looked_at(cameras) - Eigen::Vector3d::Constant(reach);
  std::vector<std::int8_t> said(cameras.size() * kCells * kCells * kCells, kSilent);
  parallel_for(kCells, 1, [&](Index begin, Index end) {
    std::size_t at = static_cast<std::size_t>(begin) * kCells * kCells * cameras.size();
    for (Index z = begin; z < end; ++z) {
      for (int xy = 0; xy < kCells * kCells; ++xy) {
        const int x = xy % kCells;
        const int y = (xy - x) / kCells;
        const Eigen::Vector3d place =
            low + cell * Eigen::Vector3d(x + 0.5, y + 0.5, static_cast<double>(z) + 0.5);
        for (std::size_t c = 0; c < cameras.size(); ++c, ++at) {
          const auto pixel = project(cameras[c], place);
          if (pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() < cameras[c].width &&
              pixel->y() < cameras[c].height && !masks[c].data.empty()) {
            const auto column = static_cast<int>(pixel->x());
            const auto row = static_cast<int>(pixel->y());
            said[at] = masks[c].at(column, row) != 0 ? 1 : 0;
          }
        }
      }
    }
  });
  return said;
}

/// Agreement of a mask with the others, over the cells that they agree on.
struct Shown {
  int cells = 0;
  int inside = 0;
};

std::vector<Shown> compared(const std::vector<std::int8_t>& said, std::size_t views) {
  std::vector<Shown> shown(views);
  for (std::size_t cell = 0; cell < said.size(); cell += views) {
    int seen = 0;
    int inside = 0;
    for (std::size_t c = 0; c < views; ++c) {
      seen += said[cell + c] != kSilent ? 1 : 0;
      inside += said[cell + c] == 1 ? 1 : 0;
    }
    for (std::size_t c = 0; c < views && seen > kMinOthers; ++c) {
      const std::int8_t own = said[cell + c];
      const int here = own == 1 ? 1 : 0;
      if (own != kSilent && inside - here >= kAgree * (seen - 1)) {
        ++shown[c].cells;
        shown[c].inside += here;
      }
    }
  }
  return shown;
}

/// Of the pixels along the edges of the image, the share that is set.
double border_share(const ByteImage& mask) {
  int set = 0;
  for (int x = 0; x < mask.width; ++x) {
    set += (mask.at(x, 0) != 0 ? 1 : 0) + (mask.at(x, mask.height - 1) != 0 ? 1 : 0);
  }
  for (int y = 0; y < mask.height; ++y) {
    set += (mask.at(0, y) != 0 ? 1 : 0) + (mask.at(mask.width - 1, y) != 0 ? 1 : 0);
  }
  return set / (2.0 * (mask.width + mask.height));
}

/// Of all pixels, the share that is not set.
double unset_share(const ByteImage& mask) {
  return static_cast<double>(std::count(mask.data.begin(), mask.data.end(), std::uint8_t{0})) /
         static_cast<double>(mask.data.size());
}

}  // namespace

std::vector<MaskFit> check_masks(const std::vector<Camera>& cameras,
                                 const std::vector<ByteImage>& masks, double reach) {
  ATELIER_CHECK(cameras.size() == masks.size(), "a mask for each camera");
  for (std::size_t c = 0; c < masks.size(); ++c) {
    ATELIER_CHECK(masks[c].data.empty() ||
                      (masks[c].width == cameras[c].width && masks[c].height == cameras[c].height),
                  "a mask of another size than its camera's");
  }
  std::vector<MaskFit> fits(masks.size(), MaskFit::Good);
  // A mask that is set round most of the image is of the background, and all may be. A mask
  // that is set nearly everywhere says nothing, and stays.
  for (std::size_t c = 0; c < masks.size(); ++c) {
    if (!masks[c].data.empty() && border_share(masks[c]) > kInvertedBorder &&
        unset_share(masks[c]) > kSomebody) {
      fits[c] = MaskFit::Inverted;
    }
  }
  if (cameras.size() <= kMinOthers) {
    return fits;
  }
  // One at a time, the one that contradicts most: it may have been what made others look wrong.
  std::vector<std::int8_t> said = asked(cameras, masks, reach);
  for (std::size_t at = 0; at < said.size(); ++at) {
    if (said[at] != kSilent && fits[at % masks.size()] == MaskFit::Inverted) {
      said[at] = static_cast<std::int8_t>(1 - said[at]);
    }
  }
  for (std::size_t round = 0; round < masks.size() / 2; ++round) {
    const std::vector<Shown> shown = compared(said, masks.size());
    std::size_t worst = masks.size();
    int most = 0;
    for (std::size_t c = 0; c < masks.size(); ++c) {
      const int hidden = shown[c].cells - shown[c].inside;
      if (shown[c].cells >= kMinCells && shown[c].inside < kShown * shown[c].cells &&
          hidden > most && fits[c] == MaskFit::Good) {
        worst = c;
        most = hidden;
      }
    }
    if (worst == masks.size()) {
      break;
    }
    const bool inverted = border_share(masks[worst]) > kBorder;
    fits[worst] = inverted ? MaskFit::Inverted : MaskFit::Off;
    for (std::size_t at = worst; at < said.size(); at += masks.size()) {
      if (said[at] != kSilent) {
        said[at] = inverted ? static_cast<std::int8_t>(1 - said[at]) : kSilent;
      }
    }
  }
  return fits;
}

}  // namespace atelier
