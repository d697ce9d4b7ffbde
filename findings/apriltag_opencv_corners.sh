#!/usr/bin/env bash
# libapriltag 3.3.0 and OpenCV 4.6.0 (contrib aruco), Debian 12: the same picture of a tag 36h11.
# Guess: both give the same four corners, up to the order.
# Seen: the first corner is another: apriltag begins bottom left of its own picture of the tag and
#   goes on counterclockwise; OpenCV holds the same pattern turned by 180 degrees, begins bottom
#   right and goes clockwise. And apriltag counts from the pixel's edge: on a tag whose edges lie at
#   pixel edges 80 and 240 it says 79.8 to 240.2 where OpenCV's subpixel corners say 79.6 and
#   239.4 from pixel centres. OpenCV's own CORNER_REFINE_APRILTAG says 80 and 240 all the same.
# For users of Atelier: lists of corners of the two cannot be exchanged without turning and
#   reversing them, and principal points differ by half a pixel; keep one detector and one
#   refinement a calibration.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
debian_packages libapriltag-dev=3.3.0-1+b1 libopencv-contrib-dev=4.6.0+dfsg-12

# Valid: the tag as libapriltag draws it, 20 px a cell, white around; both report its number.
cat > seen.cpp <<'CC'
extern "C" {
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
}
#include <cstdio>
#include <opencv2/aruco.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

int main() {
  apriltag_family_t* family = tag36h11_create();
  apriltag_detector_t* detector = apriltag_detector_create();
  apriltag_detector_add_family(detector, family);
  detector->quad_decimate = 1;
  image_u8_t* drawn = apriltag_to_image(family, 7);
  cv::Mat picture;
  cv::resize(cv::Mat(drawn->height, drawn->width, CV_8U, drawn->buf, drawn->stride), picture,
             cv::Size(), 20, 20, cv::INTER_NEAREST);
  cv::copyMakeBorder(picture, picture, 60, 60, 60, 60, cv::BORDER_CONSTANT, 255);
  image_u8_t view = {picture.cols, picture.rows, static_cast<int32_t>(picture.step), picture.data};
  zarray_t* found = apriltag_detector_detect(detector, &view);
  apriltag_detection_t* tag;
  zarray_get(found, 0, &tag);
  std::printf("apriltag %d:", tag->id);
  for (const auto& p : tag->p) {
    std::printf(" (%.0f %.0f)", p[0], p[1]);
  }
  std::printf("\n");
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
  for (int refine : {cv::aruco::CORNER_REFINE_SUBPIX, cv::aruco::CORNER_REFINE_APRILTAG}) {
    auto parameters = cv::aruco::DetectorParameters::create();
    parameters->cornerRefinementMethod = refine;
    std::vector<std::vector<cv::Point2f>> corners;
    std::vector<int> ids;
    cv::aruco::detectMarkers(picture, dictionary, corners, ids, parameters);
    std::printf("OpenCV %s %d:", refine == cv::aruco::CORNER_REFINE_SUBPIX ? "SUBPIX" : "APRILTAG",
                ids.at(0));
    for (const auto& p : corners.at(0)) {
      std::printf(" (%.1f %.1f)", p.x, p.y);
    }
    std::printf("\n");
  }
  cv::Mat marker, turned;
  cv::aruco::drawMarker(dictionary, 7, 160, marker, 1);
  cv::rotate(marker, turned, cv::ROTATE_180);
  const cv::Mat own = picture(cv::Rect(80, 80, 160, 160));
  std::printf("drawn alike: %d, after half a turn: %d\n", cv::countNonZero(marker != own) == 0,
              cv::countNonZero(turned != own) == 0);
}
CC
g++ -std=c++17 -o seen seen.cpp -isystem /usr/include/opencv4 -lopencv_aruco -lopencv_imgproc \
  -lopencv_core -lapriltag
seen=$(./seen)
printf '%s\n' "$seen"
expected='apriltag 7: (80 240) (240 240) (240 80) (80 80)
OpenCV SUBPIX 7: (239.4 239.4) (79.6 239.4) (79.6 79.6) (239.4 79.6)
OpenCV APRILTAG 7: (240.0 240.0) (80.0 240.0) (80.0 80.0) (240.0 80.0)
drawn alike: 0, after half a turn: 1'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: the two detectors place corners otherwise than recorded"
  exit 1
fi
