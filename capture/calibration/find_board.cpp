#include "capture/calibration/find_board.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/calibration/charuco.h"
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

std::string size_text(const BoardOptions& board) {
  return std::to_string(board.columns) + " x " + std::to_string(board.rows) + " squares";
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

/// Rows run clockwise from columns, as the board is printed; the first corner is beside a dark
/// inner square. The two detectors of OpenCV start at different ends of one board.
void put_in_order(const cv::Mat& grey, std::vector<cv::Point2f>& corners,
                  const BoardOptions& board) {
  const int across = board.columns - 1;
  const int down = board.rows - 1;
  const cv::Point2f along_row = corners[static_cast<std::size_t>(across - 1)] - corners[0];
  const cv::Point2f along_column =
      corners[static_cast<std::size_t>((down - 1) * across)] - corners[0];
  if (along_row.cross(along_column) < 0) {
    for (auto row = corners.begin(); row != corners.end(); row += across) {
      std::reverse(row, row + across);
    }
  }
  if (is_symmetric(board)) {
    return;  // either end is the first
  }
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

/// OpenCV's cornerSubPix in windows of this half side, px.
void refine_within(const cv::Mat& grey, std::vector<cv::Point2f>& corners, int window) {
  cv::cornerSubPix(grey, corners, cv::Size(window, window), cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 40, 0.001));
}

void refine(const cv::Mat& grey, std::vector<cv::Point2f>& corners, double share) {
  refine_within(grey, corners, window_of(corners, share));
}

std::vector<cv::Point2f> chessboard_corners(const cv::Mat& grey, cv::Size inner,
                                            ChessboardDetector detector) {
  std::vector<cv::Point2f> corners;
  if (detector != ChessboardDetector::Sectors &&
      cv::findChessboardCorners(
          grey, inner, corners,
          cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK)) {
    refine(grey, corners, 0.3);
    return corners;
  }
  corners.clear();
  if (detector != ChessboardDetector::Quads &&
      cv::findChessboardCornersSB(grey, inner, corners, cv::CALIB_CB_NORMALIZE_IMAGE)) {
    return corners;
  }
  return {};
}

FoundBoard of_chessboard(const cv::Mat& grey, const BoardOptions& board,
                         ChessboardDetector detector) {
  FoundBoard found;
  std::vector<cv::Point2f> corners =
      chessboard_corners(grey, cv::Size(board.columns - 1, board.rows - 1), detector);
  if (corners.empty()) {
    found.rejected = "no board of " + size_text(board);
    return found;
  }
  put_in_order(grey, corners, board);
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

std::vector<SeenMarker> seen_markers(const Markers& markers) {
  std::vector<SeenMarker> seen;
  for (std::size_t i = 0; i < markers.ids.size(); ++i) {
    SeenMarker marker;
    marker.id = markers.ids[i];
    for (int k = 0; k < 4; ++k) {
      const cv::Point2f& corner = markers.corners[i][static_cast<std::size_t>(k)];
      marker.corners.row(k) << corner.x, corner.y;
    }
    seen.push_back(marker);
  }
  return seen;
}

/// The markers in the plane of the board, for OpenCV, whose own boards have today's pattern alone.
cv::Ptr<cv::aruco::Board> marker_board(const BoardOptions& board, const CharucoPattern& pattern,
                                       int count) {
  std::vector<std::vector<cv::Point3f>> corners;
  std::vector<int> ids(static_cast<std::size_t>(count));
  std::iota(ids.begin(), ids.end(), 0);
  const auto side = static_cast<float>(board.marker);
  for (const int id : ids) {
    const MarkerSquare square = marker_square(id, pattern);
    const float x = static_cast<float>(square.column) + 0.5F * (1 - side);
    const float y = static_cast<float>(square.row) + 0.5F * (1 - side);
    corners.push_back({{x, y, 0}, {x + side, y, 0}, {x + side, y + side, 0}, {x, y + side, 0}});
  }
  return cv::aruco::Board::create(corners, dictionary_of(board.dictionary), ids);
}

/// Takes away markers that the board does not have: mistakes of the detector, unless there are
/// many. What is wrong, or "".
std::string without_strangers(const BoardOptions& board, int count, Markers& markers) {
  const int known = static_cast<int>(
      std::count_if(markers.ids.begin(), markers.ids.end(), [&](int id) { return id < count; }));
  const auto stranger =
      std::find_if(markers.ids.begin(), markers.ids.end(), [&](int id) { return id >= count; });
  if (stranger != markers.ids.end() && 2 * known <= static_cast<int>(markers.ids.size())) {
    return "marker " + std::to_string(*stranger) + " is on no board of " + size_text(board) +
           ", which has " + std::to_string(count) + " markers";
  }
  for (std::size_t i = markers.ids.size(); i-- > 0;) {
    if (markers.ids[i] >= count) {
      markers.ids.erase(markers.ids.begin() + static_cast<std::ptrdiff_t>(i));
      markers.corners.erase(markers.corners.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  return "";
}

/// The inner corner between two markers to a fraction of a pixel; the window ends before them.
cv::Point2f refined_corner(const cv::Mat& grey, const FacingCorners& facing) {
  // Upright, the markers are nearest along a row; their corners are the root of 2 further off.
  const int window = std::clamp(static_cast<int>(0.8 * std::sqrt(0.5) * facing.distance), 2, 11);
  std::vector<cv::Point2f> corner = {
      {static_cast<float>(facing.middle.x()), static_cast<float>(facing.middle.y())}};
  refine_within(grey, corner, window);
  return corner[0];
}

FoundBoard of_charuco(const cv::Mat& grey, const BoardOptions& board) {
  FoundBoard found;
  Markers markers = markers_in(grey, board.dictionary, false);
  if (markers.ids.empty()) {
    found.rejected = "no marker of the dictionary " + board.dictionary;
    return found;
  }
  const int count = board.columns * board.rows / 2;
  found.rejected = without_strangers(board, count, markers);
  if (!found.rejected.empty()) {
    return found;
  }
  const PatternFit fit = fitting_pattern(seen_markers(markers), board.columns);
  if (fit.all > 0 && !fit.fits) {
    found.rejected = "the markers do not lie as on a board of " + size_text(board);
    return found;
  }
  cv::aruco::refineDetectedMarkers(grey, marker_board(board, fit.pattern, count), markers.corners,
                                   markers.ids, markers.rejected);
  found.legacy = fit.pattern.legacy;
  std::map<int, cv::Point2f> corners;
  for (const FacingCorners& facing : facing_corners(seen_markers(markers), fit.pattern)) {
    if (facing.fits && facing.row < board.rows) {
      corners[(facing.row - 1) * (board.columns - 1) + facing.column - 1] =
          refined_corner(grey, facing);
    }
  }
  if (corners.size() < 4) {
    found.rejected = std::to_string(corners.size()) + " corners of 4 that are needed";
    return found;
  }
  found.view.pixels.resize(static_cast<Eigen::Index>(corners.size()), 2);
  for (const auto& [id, corner] : corners) {
    found.view.pixels.row(static_cast<Eigen::Index>(found.view.ids.size())) << corner.x + 0.5,
        corner.y + 0.5;
    found.view.ids.push_back(id);
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

void add_setting(const std::string& setting, NearbyBoard& nearby) {
  nearby.setting += (nearby.setting.empty() ? "" : " ") + setting;
}

/// A chessboard of nearly as many squares, or of the given number without the markers asked for.
std::optional<NearbyBoard> nearby_chessboard(const cv::Mat& grey, const BoardOptions& board) {
  // One square more or less on a side is the usual mistake; the largest that fits is the board.
  constexpr std::array<std::array<int, 2>, 10> kTries = {
      {{0, 0}, {1, 1}, {1, 0}, {0, 1}, {-1, 1}, {1, -1}, {-1, 0}, {0, -1}, {-1, -1}, {-2, -2}}};
  for (const auto& [more_columns, more_rows] : kTries) {
    BoardOptions other = board;
    other.columns += more_columns;
    other.rows += more_rows;
    if (other.columns < 4 || other.rows < 4 ||
        chessboard_corners(grey, cv::Size(other.columns - 1, other.rows - 1),
                           ChessboardDetector::Either)
            .empty()) {
      continue;
    }
    NearbyBoard nearby;
    nearby.what = "a chessboard of " + size_text(other);
    nearby.advice =
        "the board as it was printed; columns and rows count squares, not inner corners";
    if (board.kind != BoardKind::Chessboard) {
      nearby.what += " without markers";
      add_setting("--board.kind chessboard", nearby);
    }
    if (other.columns != board.columns) {
      add_setting("--board.columns " + std::to_string(other.columns), nearby);
    }
    if (other.rows != board.rows) {
      add_setting("--board.rows " + std::to_string(other.rows), nearby);
    }
    return nearby;
  }
  return std::nullopt;
}

/// A ChArUco board of any dictionary and number of squares across.
std::optional<NearbyBoard> nearby_charuco(const cv::Mat& grey, const BoardOptions& board) {
  PatternFit best;
  std::string dictionary;
  for (const std::string& name : marker_dictionaries()) {
    const std::vector<SeenMarker> markers = seen_markers(markers_in(grey, name, false));
    for (int columns = 3; columns <= 64 && markers.size() > 2; ++columns) {
      const PatternFit fit = fitting_pattern(markers, columns);
      // The given dictionary is kept where another one has the same markers.
      const bool better =
          fit.fitting > best.fitting || (fit.fitting == best.fitting && name == board.dictionary &&
                                         dictionary != board.dictionary);
      if (fit.fits && better) {
        best = fit;
        dictionary = name;
      }
    }
  }
  constexpr int kSure = 3;
  if (best.fitting < kSure) {
    return std::nullopt;
  }
  NearbyBoard nearby;
  nearby.what = "a ChArUco board of " + std::to_string(best.pattern.columns) +
                " squares across, with markers of the dictionary " + dictionary;
  nearby.advice = "the board as it was printed";
  if (board.kind != BoardKind::Charuco) {
    add_setting("--board.kind charuco", nearby);
  }
  if (dictionary != board.dictionary) {
    add_setting("--board.dictionary " + dictionary, nearby);
  }
  if (best.pattern.columns != board.columns) {
    add_setting("--board.columns " + std::to_string(best.pattern.columns), nearby);
  }
  return nearby;
}

}  // namespace

FoundBoard find_board(const ByteImage& image, const BoardOptions& board,
                      ChessboardDetector detector) {
  const cv::Mat grey = grey_of(image, board.inverted);
  switch (board.kind) {
    case BoardKind::Chessboard:
      return of_chessboard(grey, board, detector);
    case BoardKind::Charuco:
      return of_charuco(grey, board);
    case BoardKind::Marker:
      break;
  }
  return of_marker(grey, board);
}

std::optional<NearbyBoard> nearby_board(const ByteImage& image, const BoardOptions& board) {
  if (board.kind == BoardKind::Marker) {
    return std::nullopt;
  }
  // Markers first: a detector of chessboards may take a ChArUco board for one.
  for (const bool inverted : {board.inverted, !board.inverted}) {
    std::optional<NearbyBoard> nearby = nearby_charuco(grey_of(image, inverted), board);
    if (nearby && inverted != board.inverted) {
      nearby->what += inverted ? ", printed with black and white exchanged"
                               : ", not printed with black and white exchanged";
      add_setting(inverted ? "--board.inverted" : "--board.inverted=false", *nearby);
    }
    if (nearby) {  // the very board that was asked for, too little of it: nothing to say
      return nearby->setting.empty() ? std::nullopt : nearby;
    }
  }
  return nearby_chessboard(grey_of(image, board.inverted), board);
}

}  // namespace atelier
