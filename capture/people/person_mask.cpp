#include "capture/people/person_mask.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "capture/masks/background.h"
#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr int kRadiusOfSmall =
    4;  // px of the filter where it is found; larger images are made smaller

/// The part of an image that a crop covers; its corners may be turned.
cv::Rect covered(const PersonCrop& crop, const ByteImage& image) {
  Eigen::Vector2d low = crop.center;
  Eigen::Vector2d high = crop.center;
  for (const double u : {0.0, 1.0}) {
    for (const double v : {0.0, 1.0}) {
      const Eigen::Vector2d corner = from_crop(crop, {u, v});
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
  }
  const cv::Point begin(saturating_cast<int>(std::floor(low.x())),
                        saturating_cast<int>(std::floor(low.y())));
  const cv::Point end(saturating_cast<int>(std::ceil(high.x())),
                      saturating_cast<int>(std::ceil(high.y())));
  return cv::Rect(begin, end) & cv::Rect(0, 0, image.width, image.height);
}

/// The network's mask at the image's pixels, bilinear; 0 beyond the crop. [h,w] in [0, 1]
cv::Mat mask_in_image(const PersonLandmarks& person, const cv::Rect& part) {
  cv::Mat soft(part.height, part.width, CV_32F, cv::Scalar(0));
  const ByteImage& mask = person.mask;
  for (int y = 0; y < part.height; ++y) {
    auto* row = soft.ptr<float>(y);
    for (int x = 0; x < part.width; ++x) {
      const Eigen::Vector2d at = into_crop(person.crop, {part.x + x + 0.5, part.y + y + 0.5});
      if (at.minCoeff() < 0 || at.maxCoeff() > 1) {
        continue;
      }
      const double u = std::clamp(at.x() * mask.width - 0.5, 0.0, mask.width - 1.0);
      const double v = std::clamp(at.y() * mask.height - 0.5, 0.0, mask.height - 1.0);
      const int u0 = saturating_cast<int>(u);
      const int v0 = saturating_cast<int>(v);
      const int u1 = std::min(u0 + 1, mask.width - 1);
      const int v1 = std::min(v0 + 1, mask.height - 1);
      const double fu = u - u0;
      const double fv = v - v0;
      const double top = (1 - fu) * mask.at(u0, v0, 0) + fu * mask.at(u1, v0, 0);
      const double bottom = (1 - fu) * mask.at(u0, v1, 0) + fu * mask.at(u1, v1, 0);
      row[x] = static_cast<float>(((1 - fv) * top + fv * bottom) / 255);
    }
  }
  return soft;
}

/// The image's own values there. [h,w,3] in [0, 1]
cv::Mat guide_of(const ByteImage& image, const cv::Rect& part) {
  // Nothing is written to it.
  const cv::Mat all(image.height, image.width, CV_8UC(image.channels),
                    const_cast<std::uint8_t*>(image.data.data()));
  cv::Mat guide;
  all(part).convertTo(guide, CV_32F, 1.0 / 255);
  if (image.channels == 1) {
    cv::cvtColor(guide, guide, cv::COLOR_GRAY2RGB);
  }
  return guide;
}

/// `soft` as, around each pixel, the linear function of the guide's three channels that is nearest
/// to it (He et al. 2013, eq. 19 to 21), found on smaller images (He and Sun 2015). OpenCV's own is
/// in a library that loads every codec of images.
cv::Mat guided_filter(const cv::Mat& guide, const cv::Mat& soft, int radius, double epsilon) {
  const int step = std::max(1, radius / kRadiusOfSmall);
  const cv::Size size(std::max(1, guide.cols / step), std::max(1, guide.rows / step));
  cv::Mat small_guide;
  cv::Mat small_soft;
  cv::resize(guide, small_guide, size, 0, 0, cv::INTER_AREA);
  cv::resize(soft, small_soft, size, 0, 0, cv::INTER_AREA);
  const int side = 2 * std::max(1, radius / step) + 1;
  const auto mean = [&](const cv::Mat& of) {
    cv::Mat result;
    cv::blur(of, result, {side, side}, {-1, -1}, cv::BORDER_REFLECT_101);
    return result;
  };
  std::array<cv::Mat, 3> channels;
  cv::split(small_guide, channels.data());
  const cv::Mat mean_guide = mean(small_guide);
  const cv::Mat mean_soft = mean(small_soft);
  std::array<cv::Mat, 3> with_soft;
  std::array<std::array<cv::Mat, 3>, 3> products;
  for (std::size_t i = 0; i < 3; ++i) {
    with_soft[i] = mean(channels[i].mul(small_soft));
    for (std::size_t k = i; k < 3; ++k) {
      products[i][k] = mean(channels[i].mul(channels[k]));
    }
  }
  cv::Mat slopes(size, CV_32FC3);
  cv::Mat offsets(size, CV_32F);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const auto& of_guide = mean_guide.at<cv::Vec3f>(y, x);
      const float of_soft = mean_soft.at<float>(y, x);
      Eigen::Matrix3d covariance = epsilon * Eigen::Matrix3d::Identity();
      Eigen::Vector3d shared;
      for (int i = 0; i < 3; ++i) {
        const auto a = static_cast<std::size_t>(i);
        shared[i] = double{with_soft[a].at<float>(y, x)} - double{of_guide[i]} * of_soft;
        for (int k = i; k < 3; ++k) {
          covariance(i, k) += double{products[a][static_cast<std::size_t>(k)].at<float>(y, x)} -
                              double{of_guide[i]} * of_guide[k];
          covariance(k, i) = covariance(i, k);
        }
      }
      const Eigen::Vector3d slope = covariance.ldlt().solve(shared);
      double offset = of_soft;
      for (int i = 0; i < 3; ++i) {
        slopes.at<cv::Vec3f>(y, x)[i] = static_cast<float>(slope[i]);
        offset -= slope[i] * of_guide[i];
      }
      offsets.at<float>(y, x) = static_cast<float>(offset);
    }
  }
  cv::Mat large_slopes;
  cv::Mat large_offsets;
  cv::resize(mean(slopes), large_slopes, guide.size(), 0, 0, cv::INTER_LINEAR);
  cv::resize(mean(offsets), large_offsets, guide.size(), 0, 0, cv::INTER_LINEAR);
  cv::Mat filtered;
  cv::transform(large_slopes.mul(guide), filtered, cv::Matx13f(1, 1, 1));
  return filtered + large_offsets;
}

}  // namespace

OptionTable describe(PeopleMaskOptions& options) {
  OptionTable table;
  table.add("threshold", options.threshold, 0.01, 0.99, "",
            "Probability of a person from which a pixel is in the mask");
  table.add("reach", options.reach, 0, 16, "px",
            "Distance over which borders move to the image's own, in pixels of the network's mask, "
            "of 256 across a person's crop; 0: none");
  table.add("edge", options.edge, 1e-4, 1, "",
            "Difference of gamma-coded values that is a border of the image");
  table.add("min_part", options.min_part, 0, 1, "",
            "Minimum area of a part of the mask, as a share of the largest");
  return table;
}

ByteImage people_mask(const PeopleInImage& people, const ByteImage& image,
                      const PeopleMaskOptions& options) {
  ATELIER_CHECK((image.channels == 1 || image.channels == 3) && !image.data.empty(),
                "an image of 1 or 3 channels");
  ByteImage mask(image.width, image.height, 1);
  for (const PersonLandmarks& person : people) {
    const cv::Rect part = covered(person.crop, image);
    if (part.empty() || person.mask.data.empty()) {
      continue;
    }
    cv::Mat soft = mask_in_image(person, part);
    const int radius =
        saturating_cast<int>(std::round(options.reach * person.crop.side / person.mask.width));
    if (radius > 0) {
      soft = guided_filter(guide_of(image, part), soft, radius, options.edge * options.edge);
    }
    for (int y = 0; y < part.height; ++y) {
      const auto* row = soft.ptr<float>(y);
      for (int x = 0; x < part.width; ++x) {
        if (row[x] >= options.threshold) {
          mask.at(part.x + x, part.y + y, 0) = 255;
        }
      }
    }
  }
  MaskOptions cleaning;
  cleaning.opening = cleaning.closing = 0;
  cleaning.min_part = options.min_part;
  return clean_mask(mask, cleaning);
}

}  // namespace atelier
