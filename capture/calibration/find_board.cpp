#include "capture/calibration/find_board.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <opencv2/aruco.hpp>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr int kDictionaries[] = {
    cv::aruco::DICT_4X4_50,        cv::aruco::DICT_4X4_100,        cv::aruco::DICT_4X4_250,
    cv::aruco::DICT_4X4_1000,      cv::aruco::DICT_5X5_50,         cv::aruco::DICT_5X5_100,
    cv::aruco::DICT_5X5_250,       cv::aruco::DICT_5X5_1000,       cv::aruco::DICT_6X6_50,
    cv::aruco::DICT_6X6_100,       cv::aruco::DICT_6X6_250,        cv::aruco::DICT_6X6_1000,
    cv::aruco::DICT_7X7_50,        cv::aruco::DICT_7X7_100,        cv::aruco::DICT_7X7_250,
    cv::aruco::DICT_7X7_1000,      cv::aruco::DICT_ARUCO_ORIGINAL, cv::aruco::DICT_APRILTAG_16h5,
    cv::aruco::DICT_APRILTAG_25h9, cv::aruco::DICT_APRILTAG_36h10, cv::aruco::DICT_APRILTAG_36h11};

cv::Ptr<cv::aruco::Dictionary> dictionary_of(const std::string& name) {
  const auto& names = marker_dictionaries();
  const auto found = std::find(names.begin(), names.end(), name);
  ATELIER_CHECK(found != names.end(), "no dictionary of markers is called '" + name + "'");
  return cv::aruco::getPredefinedDictionary(kDictionaries[found - names.begin()]);
}

cv::Mat grey_of(const ByteImage& image, bool inverted) {
  ATELIER_CHECK(image.channels == 1 || image.channels == 3, "an image of 1 or 3 channels");
  const cv::Mat bytes(image.height, image.width, image.channels == 1 ? CV_8UC1 : CV_8UC3,
                      const_cast<std::uint8_t*>(image.data.data()));
  cv::Mat grey;
  if (image.channels == 3) {
    cv::cvtColor(bytes, grey, cv::COLOR_RGB2GRAY);
  } else {
    grey = bytes.clone();
  }
  if (inverted) {
    cv::bitwise_not(grey, grey);
  }
  return grey;
}

/// Brightness in the middle of the inner square whose corners are (column, row) and the next.
double square_brightness(const cv::Mat& grey, const std::vector<cv::Point2f>& corners, int across,
                         int column, int row) {
  const auto at = [&](int x, int y) { return corners[static_cast<std::size_t>(y * across + x)]; };
  const cv::Point2f middle = 0.25F * (at(column, row) + at(column + 1, row) + at(column, row + 1) +
                                      at(column + 1, row + 1));
  cv::Mat patch;
  cv::getRectSubPix(grey, cv::Size(3, 3), middle, patch);
  return cv::mean(patch)[0];
}

/// Turns the numbering so that the first corner is beside a dark inner square.
void start_at_dark(const cv::Mat& grey, std::vector<cv::Point2f>& corners, int across, int down) {
  double dark = 0;
  for (int row = 0; row + 1 < down; ++row) {
    for (int column = 0; column + 1 < across; ++column) {
      const double value = square_brightness(grey, corners, across, column, row);
      dark += (column + row) % 2 == 0 ? value : -value;
    }
  }
  // One side has an odd number of corners, so that there are as many squares of either colour.
  if (dark > 0) {
    std::reverse(corners.begin(), corners.end());
  }
}

/// Half the side of a window that reaches no neighbouring corner.
int window_of(const std::vector<cv::Point2f>& corners, double share) {
  double nearest = 1e9;
  for (std::size_t i = 1; i < corners.size(); ++i) {
    nearest = std::min(nearest, cv::norm(corners[i] - corners[i - 1]));
  }
  return std::clamp(saturating_cast<int>(share * nearest), 2, 11);
}

void refine(const cv::Mat& grey, std::vector<cv::Point2f>& corners, double share) {
  const int window = window_of(corners, share);
  cv::cornerSubPix(grey, corners, cv::Size(window, window), cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 40, 0.001));
}

std::vector<cv::Point2f> chessboard_corners(const cv::Mat& grey, cv::Size inner) {
  std::vector<cv::Point2f> corners;
  if (cv::findChessboardCorners(
          grey, inner, corners,
          cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK)) {
    refine(grey, corners, 0.3);
    return corners;
  }
  corners.clear();
  if (cv::findChessboardCornersSB(grey, inner, corners, cv::CALIB_CB_NORMALIZE_IMAGE)) {
    return corners;
  }
  return {};
}

FoundBoard of_chessboard(const cv::Mat& grey, const BoardOptions& board) {
  FoundBoard found;
  std::vector<cv::Point2f> corners =
      chessboard_corners(grey, cv::Size(board.columns - 1, board.rows - 1));
  if (corners.empty()) {
    found.rejected = "no board of " + std::to_string(board.columns) + " x " +
                     std::to_string(board.rows) + " squares";
    return found;
  }
  if (!is_symmetric(board)) {
    start_at_dark(grey, corners, board.columns - 1, board.rows - 1);
  }
  found.view.ids.resize(corners.size());
  std::iota(found.view.ids.begin(), found.view.ids.end(), 0);
  found.view.pixels.resize(static_cast<Eigen::Index>(corners.size()), 2);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    found.view.pixels.row(static_cast<Eigen::Index>(i)) << corners[i].x + 0.5, corners[i].y + 0.5;
  }
  return found;
}

struct Markers {
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  std::vector<std::vector<cv::Point2f>> rejected;
};

Markers markers_in(const cv::Mat& grey, const std::string& dictionary, bool refine) {
  Markers markers;
  const auto parameters = cv::aruco::DetectorParameters::create();
  if (refine) {
    parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  }
  cv::aruco::detectMarkers(grey, dictionary_of(dictionary), markers.corners, markers.ids,
                           parameters, markers.rejected);
  return markers;
}

FoundBoard of_charuco(const cv::Mat& grey, const BoardOptions& board) {
  FoundBoard found;
  Markers markers = markers_in(grey, board.dictionary, false);
  if (markers.ids.empty()) {
    found.rejected = "no marker of the dictionary " + board.dictionary;
    return found;
  }
  const auto charuco = cv::aruco::CharucoBoard::create(
      board.columns, board.rows, static_cast<float>(board.square),
      static_cast<float>(board.square * board.marker), dictionary_of(board.dictionary));
  const int most = static_cast<int>(charuco->ids.size());
  // A marker that is not the board's is a mistake of the detector, unless there are many.
  const int known = static_cast<int>(
      std::count_if(markers.ids.begin(), markers.ids.end(), [&](int id) { return id < most; }));
  const auto stranger =
      std::find_if(markers.ids.begin(), markers.ids.end(), [&](int id) { return id >= most; });
  if (stranger != markers.ids.end() && 2 * known <= static_cast<int>(markers.ids.size())) {
    found.rejected = "marker " + std::to_string(*stranger) + " is on no board of " +
                     std::to_string(board.columns) + " x " + std::to_string(board.rows) +
                     " squares, which has " + std::to_string(most) + " markers";
    return found;
  }
  for (std::size_t i = markers.ids.size(); i-- > 0;) {
    if (markers.ids[i] >= most) {
      markers.ids.erase(markers.ids.begin() + static_cast<std::ptrdiff_t>(i));
      markers.corners.erase(markers.corners.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  cv::aruco::refineDetectedMarkers(grey, charuco, markers.corners, markers.ids, markers.rejected);
  std::vector<cv::Point2f> corners;
  std::vector<int> ids;
  cv::aruco::interpolateCornersCharuco(markers.corners, markers.ids, grey, charuco, corners, ids);
  if (ids.size() < 4) {
    found.rejected = std::to_string(ids.size()) + " corners of 4 that are needed";
    return found;
  }
  // OpenCV 4.6 gives these corners half a pixel off; refined by themselves they are where they are.
  // The window ends before the markers.
  refine(grey, corners, 0.8 * (1 - board.marker) / 2);
  std::vector<std::size_t> order(ids.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return ids[a] < ids[b]; });
  found.view.pixels.resize(static_cast<Eigen::Index>(ids.size()), 2);
  for (std::size_t i = 0; i < order.size(); ++i) {
    found.view.ids.push_back(ids[order[i]]);
    found.view.pixels.row(static_cast<Eigen::Index>(i)) << corners[order[i]].x + 0.5,
        corners[order[i]].y + 0.5;
  }
  const int across = board.columns - 1;
  const bool one_row = std::all_of(found.view.ids.begin(), found.view.ids.end(), [&](int id) {
    return id / across == found.view.ids.front() / across;
  });
  const bool one_column = std::all_of(found.view.ids.begin(), found.view.ids.end(), [&](int id) {
    return id % across == found.view.ids.front() % across;
  });
  if (one_row || one_column) {
    found.rejected = "corners of one line alone";
  }
  return found;
}

FoundBoard of_marker(const cv::Mat& grey, const BoardOptions& board) {
  FoundBoard found;
  const Markers markers = markers_in(grey, board.dictionary, true);
  std::vector<std::size_t> wanted;
  for (std::size_t i = 0; i < markers.ids.size(); ++i) {
    if (board.marker_id < 0 || markers.ids[i] == board.marker_id) {
      wanted.push_back(i);
    }
  }
  if (wanted.size() != 1) {
    found.rejected =
        wanted.empty()
            ? "no marker of the dictionary " + board.dictionary +
                  (board.marker_id < 0 ? std::string()
                                       : " with the number " + std::to_string(board.marker_id))
            : std::to_string(wanted.size()) + " markers: say which by its number";
    return found;
  }
  found.view.ids = {0, 1, 2, 3};
  found.view.pixels.resize(4, 2);
  for (int i = 0; i < 4; ++i) {
    const cv::Point2f& corner = markers.corners[wanted[0]][static_cast<std::size_t>(i)];
    found.view.pixels.row(i) << corner.x + 0.5, corner.y + 0.5;
  }
  return found;
}

}  // namespace

FoundBoard find_board(const ByteImage& image, const BoardOptions& board) {
  const cv::Mat grey = grey_of(image, board.inverted);
  switch (board.kind) {
    case BoardKind::Chessboard:
      return of_chessboard(grey, board);
    case BoardKind::Charuco:
      return of_charuco(grey, board);
    case BoardKind::Marker:
      break;
  }
  return of_marker(grey, board);
}

std::string nearby_board(const ByteImage& image, const BoardOptions& board) {
  if (board.kind != BoardKind::Chessboard) {
    return "";
  }
  const cv::Mat grey = grey_of(image, board.inverted);
  // One square more or less on a side is the usual mistake; the largest that fits is the board.
  constexpr std::array<std::array<int, 2>, 9> kTries = {
      {{1, 1}, {1, 0}, {0, 1}, {-1, 1}, {1, -1}, {-1, 0}, {0, -1}, {-1, -1}, {-2, -2}}};
  for (const auto& [more_columns, more_rows] : kTries) {
    const int columns = board.columns + more_columns;
    const int rows = board.rows + more_rows;
    if (columns < 4 || rows < 4) {
      continue;
    }
    if (!chessboard_corners(grey, cv::Size(columns - 1, rows - 1)).empty()) {
      return std::to_string(columns) + " x " + std::to_string(rows);
    }
  }
  return "";
}

}  // namespace atelier
