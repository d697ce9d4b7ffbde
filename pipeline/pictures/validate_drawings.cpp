#include "pipeline/pictures/validate_drawings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <span>
#include <string_view>

#include "capture/skeleton_lines.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/median.h"
#include "pipeline/pictures/report_page.h"

namespace atelier {
namespace {

constexpr const char* kGood = "#3b7a57";
constexpr const char* kWarn = "#d08a00";
constexpr const char* kBad = "#c0392b";
constexpr const char* kInkName = "#333";

template <class... Values>
std::string formatted(const char* format, Values... values) {
  char buffer[512];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

/// The colour of the worst finding of a camera.
const char* colour_of(const std::string& camera, const std::vector<Finding>& findings) {
  const char* colour = kGood;
  for (const Finding& finding : findings) {
    if (finding.place == camera || finding.place.starts_with(camera + " ")) {
      if (finding.severity == Severity::Error) {
        return kBad;
      }
      colour = finding.severity == Severity::Warning ? kWarn : colour;
    }
  }
  return colour;
}

std::string label(double x, double y, const std::string& words, const char* anchor = "start",
                  const char* colour = kInkName) {
  return formatted("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\" fill=\"%s\">", x, y, anchor,
                   colour) +
         html_text(words) + "</text>\n";
}

std::string line(double x1, double y1, double x2, double y2, const char* colour, double width) {
  return formatted(
      "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"%s\" "
      "stroke-width=\"%.2f\"/>\n",
      x1, y1, x2, y2, colour, width);
}

std::string svg(double width, double height, const std::string& content) {
  return formatted(
             "<svg viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" xmlns=\"http://www.w3.org/2000/svg\" "
             "font-size=\"11\" font-family=\"system-ui, sans-serif\">\n",
             width, height, width) +
         content + "</svg>\n";
}

/// By the side that a point is on.
const char* side_colour(std::string_view point) {
  return point.starts_with("left") ? "#1f77d0" : point.starts_with("right") ? "#e0562b" : "#555";
}

/// A view of the stage along one axis: which world axes go right and up on paper.
struct View {
  const char* name;
  int right;
  int up;
  double up_sign;
};

std::string layout_view(const Dataset& dataset, const KeypointCheck& keypoints,
                        const std::vector<Finding>& findings, const View& view, double size) {
  std::vector<Eigen::Vector2d> ends;
  const auto flat = [&](const Eigen::Vector3d& p) {
    return Eigen::Vector2d(p[view.right], view.up_sign * p[view.up]);
  };
  double reach = 0;  // how far a camera's cone is drawn
  std::vector<double> distances;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Camera& camera : dataset.cameras) {
    middle += camera_center(camera) / static_cast<double>(dataset.cameras.size());
  }
  for (const Camera& camera : dataset.cameras) {
    distances.push_back((camera_center(camera) - middle).norm());
    ends.push_back(flat(camera_center(camera)));
  }
  reach = 0.3 * std::max(median(distances), 1e-6);
  ends.push_back(flat(Eigen::Vector3d::Zero()));
  const SpacePose* pose = nullptr;
  if (!keypoints.found.frames.empty() && keypoints.calibration_fits) {
    pose = &keypoints.found.frames[keypoints.found.frames.size() / 2];
    for (const SpacePoint& point : pose->points) {
      if (point.confidence > 0) {
        ends.push_back(flat(point.place));
      }
    }
  }
  Eigen::Vector2d low = ends.front();
  Eigen::Vector2d high = ends.front();
  for (const Eigen::Vector2d& end : ends) {
    low = low.cwiseMin(end);
    high = high.cwiseMax(end);
  }
  low.array() -= 1.3 * reach;
  high.array() += 1.3 * reach;
  const double extent = std::max({high.x() - low.x(), high.y() - low.y(), 1e-6});
  const double scale = size / extent;
  const Eigen::Vector2d centre = 0.5 * (low + high);
  const auto paper = [&](const Eigen::Vector2d& p) {
    return Eigen::Vector2d(size / 2 + scale * (p.x() - centre.x()),
                           size / 2 - scale * (p.y() - centre.y()));
  };
  std::string content =
      formatted("<rect width=\"%.0f\" height=\"%.0f\" fill=\"#fafafa\"/>\n", size, size);
  // The grid: lines a metre, or ten, ... apart, so that there are some and not hundreds.
  double step = 1;
  while (extent / step > 24) {
    step *= 10;
  }
  while (extent / step < 2.4) {
    step /= 10;
  }
  for (double x = std::ceil((centre.x() - extent / 2) / step) * step; x < centre.x() + extent / 2;
       x += step) {
    const double at = paper({x, 0}).x();
    content += line(at, 0, at, size, std::abs(x) < step / 2 ? "#bbb" : "#e6e6e6", 1);
  }
  for (double y = std::ceil((centre.y() - extent / 2) / step) * step; y < centre.y() + extent / 2;
       y += step) {
    const double at = paper({0, y}).y();
    content += line(0, at, size, at, std::abs(y) < step / 2 ? "#bbb" : "#e6e6e6", 1);
  }
  if (pose != nullptr) {
    const KeypointSchema& schema = keypoint_schema(dataset.info.keypoint_schema);
    for (const auto& [a, b] : skeleton_lines(schema, SkeletonDetail::Limbs)) {
      const SpacePoint& begin = pose->points[static_cast<std::size_t>(a)];
      const SpacePoint& end = pose->points[static_cast<std::size_t>(b)];
      if (begin.confidence <= 0 || end.confidence <= 0) {
        continue;
      }
      const Eigen::Vector2d from = paper(flat(begin.place));
      const Eigen::Vector2d to = paper(flat(end.place));
      content += line(from.x(), from.y(), to.x(), to.y(),
                      side_colour(schema.points[static_cast<std::size_t>(b)]), 2);
    }
  }
  for (const Camera& camera : dataset.cameras) {
    const char* colour = colour_of(camera.id, findings);
    const Eigen::Vector2d at = paper(flat(camera_center(camera)));
    std::string points = formatted("%.1f,%.1f", at.x(), at.y());
    const double w = camera.width;
    const double h = camera.height;
    const std::array<Eigen::Vector2d, 2> rim =
        view.up == 1 ? std::array<Eigen::Vector2d, 2>{{{w / 2, 0}, {w / 2, h}}}
                     : std::array<Eigen::Vector2d, 2>{{{0, h / 2}, {w, h / 2}}};
    for (const Eigen::Vector2d& pixel : rim) {
      Eigen::Vector3d ray = camera.camera_from_world_rotation.transpose() *
                            Eigen::Vector3d((pixel.x() - camera.cx) / camera.fx,
                                            (pixel.y() - camera.cy) / camera.fy, 1);
      const Eigen::Vector2d end = paper(flat(camera_center(camera) + reach * ray));
      points += formatted(" %.1f,%.1f", end.x(), end.y());
    }
    content += "<polygon points=\"" + points + "\" fill=\"" + colour +
               "\" fill-opacity=\"0.15\" stroke=\"" + colour + "\" stroke-width=\"1.2\"/>\n";
    content += formatted("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"3.5\" fill=\"%s\"/>\n", at.x(),
                         at.y(), colour);
    const Eigen::Vector2d out = at - paper(flat(middle));
    const Eigen::Vector2d beside =
        at + (out.norm() > 1 ? Eigen::Vector2d(12 * out.normalized()) : Eigen::Vector2d(0, -10));
    content += label(beside.x(), beside.y() + 4, camera.id, "middle", colour);
  }
  content += label(8, 16, view.name);
  content += label(8, size - 8, formatted("grid: %g m", step));
  return svg(size, size, content);
}

/// Errors of each camera in each frame and joint, px at 1000 rows.
struct Errors {
  std::vector<std::vector<std::vector<double>>> of;  ///< [camera][frame] of its joints
  std::vector<std::vector<double>> of_joint;
};

Errors errors_of(const Dataset& dataset, const KeypointCheck& keypoints) {
  Errors errors;
  errors.of.assign(dataset.cameras.size(),
                   std::vector<std::vector<double>>(keypoints.found.frames.size()));
  errors.of_joint.resize(keypoint_schema(dataset.info.keypoint_schema).points.size());
  for (std::size_t f = 0; f < keypoints.found.frames.size(); ++f) {
    for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
      const Keypoints2d& rows = keypoints.detections[f][c];
      for (Index k = 0; k < rows.rows(); ++k) {
        const SpacePoint& point = keypoints.found.frames[f].points[static_cast<std::size_t>(k)];
        if (rows(k, 2) < 0.3 || point.confidence <= 0 || point.bridged) {
          continue;
        }
        if (const auto pixel = project(dataset.cameras[c], point.place)) {
          const double off = (*pixel - rows.row(k).head<2>().transpose()).norm() * 1000 /
                             dataset.cameras[c].height;
          errors.of[c][f].push_back(off);
          errors.of_joint[static_cast<std::size_t>(k)].push_back(off);
        }
      }
    }
  }
  return errors;
}

const char* error_colour(double error) {
  return error < 6 ? kGood : error < 12 ? kWarn : kBad;
}

struct Bar {
  std::string name;
  std::optional<double> value;  ///< px
};

/// Median of errors; nothing of none, which is no error of 0.
std::optional<double> median_error(std::vector<double> errors) {
  return errors.empty() ? std::nullopt : std::optional(median(std::move(errors)));
}

std::string bars(const std::string& title, const std::vector<Bar>& all) {
  constexpr double kRow = 17;
  constexpr double kLeft = 120;
  constexpr double kWidth = 300;
  double most = 6;
  for (const Bar& bar : all) {
    most = std::max(most, std::min(bar.value.value_or(0), 60.0));
  }
  std::string content = label(0, 13, title);
  double y = 24;
  for (const Bar& bar : all) {
    content += label(kLeft - 8, y + 11, bar.name, "end");
    if (!bar.value) {
      content += label(kLeft + 2, y + 11, "no 3D keypoint to compare it with");
      y += kRow;
      continue;
    }
    const double length = kWidth * std::min(*bar.value, most) / most;
    content += formatted(
        "<rect x=\"%.0f\" y=\"%.1f\" width=\"%.1f\" height=\"12\" rx=\"2\" fill=\"%s\"/>\n", kLeft,
        y + 1, std::max(length, 1.0), error_colour(*bar.value));
    content += label(
        kLeft + length + 6, y + 11,
        *bar.value > 999 ? std::string("beside the image") : formatted("%.1f px", *bar.value));
    y += kRow;
  }
  return svg(kLeft + kWidth + 110, y + 8, content);
}

/// An image a few hundred pixels wide, with the outline of a mask.
ByteImage thumbnail(const ByteImage& image, const std::optional<ByteImage>& mask, int width) {
  const int step = std::max(1, image.width / width);
  ByteImage small(std::max(1, image.width / step), std::max(1, image.height / step), 3);
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        int sum = 0;
        for (int j = 0; j < step; ++j) {
          for (int i = 0; i < step; ++i) {
            sum += image.at(x * step + i, y * step + j, image.channels >= 3 ? c : 0);
          }
        }
        small.at(x, y, c) = static_cast<std::uint8_t>(sum / (step * step));
      }
    }
  }
  if (!mask || mask->width != image.width || mask->height != image.height) {
    return small;
  }
  const auto set = [&](int x, int y) {
    return mask->at(std::clamp(x, 0, small.width - 1) * step,
                    std::clamp(y, 0, small.height - 1) * step) != 0;
  };
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      if (set(x, y) && (!set(x - 1, y) || !set(x + 1, y) || !set(x, y - 1) || !set(x, y + 1))) {
        small.at(x, y, 0) = 255;
        small.at(x, y, 1) = 220;
        small.at(x, y, 2) = 0;
      } else if (!set(x, y)) {
        for (int c = 0; c < 3; ++c) {
          small.at(x, y, c) = static_cast<std::uint8_t>(small.at(x, y, c) * 3 / 4);
        }
      }
    }
  }
  return small;
}

std::string polyline(const std::vector<Eigen::Vector2d>& points, const char* colour, double width) {
  std::string list;
  for (const Eigen::Vector2d& point : points) {
    list += formatted("%.1f,%.1f ", point.x(), point.y());
  }
  return "<polyline points=\"" + list + "\" fill=\"none\" stroke=\"" + colour +
         formatted("\" stroke-width=\"%.2f\" stroke-dasharray=\"%.1f %.1f\"/>\n", width, 4 * width,
                   3 * width);
}

/// The ray of a pixel of one camera, as another sees it.
std::vector<Eigen::Vector2d> epipolar_line(const Camera& from, const Eigen::Vector2d& pixel,
                                           const Camera& to) {
  std::vector<Eigen::Vector2d> points;
  const auto ray = ray_direction(from, pixel);
  constexpr int kSteps = 60;
  for (int i = 1; ray && i <= kSteps; ++i) {
    const double depth = 0.2 * std::pow(1.1, i);
    const auto seen = project(to, camera_center(from) + depth * *ray);
    if (seen && seen->x() > -to.width && seen->x() < 2 * to.width && seen->y() > -to.height &&
        seen->y() < 2 * to.height) {
      points.push_back(*seen);
    }
  }
  return points;
}

}  // namespace

std::string camera_layout_svg(const Dataset& dataset, const KeypointCheck& keypoints,
                              const std::vector<Finding>& findings) {
  if (!dataset.calibrated || dataset.cameras.empty()) {
    return "";
  }
  return layout_view(dataset, keypoints, findings, {"from above (x right, z down)", 0, 2, -1},
                     460) +
         layout_view(dataset, keypoints, findings, {"from the side (x right, y up)", 0, 1, 1}, 460);
}

std::string camera_error_svg(const Dataset& dataset, const KeypointCheck& keypoints) {
  if (keypoints.found.frames.empty()) {
    return "";
  }
  const Errors errors = errors_of(dataset, keypoints);
  std::vector<Bar> all;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    std::vector<double> values;
    for (const auto& frame : errors.of[c]) {
      values.insert(values.end(), frame.begin(), frame.end());
    }
    all.push_back({dataset.cameras[c].id, median_error(std::move(values))});
  }
  return bars("median error of each camera", all);
}

std::string joint_error_svg(const Dataset& dataset, const KeypointCheck& keypoints) {
  if (keypoints.found.frames.empty()) {
    return "";
  }
  const KeypointSchema& schema = keypoint_schema(dataset.info.keypoint_schema);
  const Errors errors = errors_of(dataset, keypoints);
  std::vector<Bar> all;
  constexpr std::size_t kBody = 26;  // of 133 points, those of hands and face would fill a page
  for (std::size_t k = 0; k < std::min(schema.points.size(), kBody); ++k) {
    std::string name = schema.points[k];
    std::replace(name.begin(), name.end(), '_', ' ');
    all.push_back({name, median_error(errors.of_joint[k])});
  }
  return bars("median error of each joint", all);
}

std::string frame_error_svg(const Dataset& dataset, const KeypointCheck& keypoints) {
  if (keypoints.found.frames.empty()) {
    return "";
  }
  const Errors errors = errors_of(dataset, keypoints);
  const std::size_t frames = keypoints.found.frames.size();
  constexpr double kLeft = 120;
  constexpr double kRow = 17;
  const std::size_t columns = std::min<std::size_t>(frames, 240);
  const double cell = std::min(24.0, 780.0 / static_cast<double>(columns));
  std::string content =
      label(0, 13, "median error of each camera in each frame (grey: nothing to compare)");
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const double y = 24 + kRow * static_cast<double>(c);
    content += label(kLeft - 8, y + 12, dataset.cameras[c].id, "end");
    for (std::size_t i = 0; i < columns; ++i) {
      std::vector<double> values;
      for (std::size_t f = i * frames / columns; f < (i + 1) * frames / columns; ++f) {
        values.insert(values.end(), errors.of[c][f].begin(), errors.of[c][f].end());
      }
      const double error = median(values);
      const double share = std::clamp(error / 20, 0.0, 1.0);
      const std::string colour =
          values.empty() ? "#ddd" : formatted("hsl(%.0f 60%% 45%%)", 140 * (1 - share));
      content += formatted("<rect x=\"%.1f\" y=\"%.1f\" width=\"%.2f\" height=\"15\" fill=\"%s\">",
                           kLeft + cell * static_cast<double>(i), y, cell, colour.c_str()) +
                 "<title>" + html_text(dataset.cameras[c].id) +
                 formatted(" frame %d: %.1f px</title></rect>\n",
                           keypoints.frame_ids[i * frames / columns], error);
    }
  }
  const double bottom = 24 + kRow * static_cast<double>(dataset.cameras.size());
  content += label(kLeft, bottom + 14, "frame " + std::to_string(keypoints.frame_ids.front()));
  content += label(kLeft + cell * static_cast<double>(columns), bottom + 14,
                   std::to_string(keypoints.frame_ids.back()), "end");
  constexpr double kTitle = 480;  // of few frames the title is wider than the table
  return svg(std::max(kTitle, kLeft + cell * static_cast<double>(columns) + 10), bottom + 22,
             content);
}

std::string contact_sheet_html(FrameReader& reader, const KeypointCheck& keypoints, int frame_id,
                               const std::vector<Finding>& findings) {
  const Dataset& dataset = reader.dataset();
  const auto at = std::find(keypoints.frame_ids.begin(), keypoints.frame_ids.end(), frame_id);
  const auto f = static_cast<std::size_t>(at - keypoints.frame_ids.begin());
  const bool seen = f < keypoints.detections.size();
  const bool placed = seen && f < keypoints.found.frames.size();
  const KeypointSchema* schema = seen ? &keypoint_schema(dataset.info.keypoint_schema) : nullptr;
  const int nose = schema == nullptr ? -1 : find_keypoint(*schema, "nose");
  std::optional<std::size_t> source;  // of the epipolar lines
  for (std::size_t c = 0; seen && nose >= 0 && c < dataset.cameras.size() && !source; ++c) {
    const Keypoints2d& rows = keypoints.detections[f][c];
    if (rows.rows() > nose && rows(nose, 2) > 0.5) {
      source = c;
    }
  }
  std::string html;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const Camera& camera = dataset.cameras[c];
    const auto index = static_cast<Index>(c);
    std::string picture;
    try {
      const std::optional<ByteImage> image = reader.byte_image(index, frame_id);
      std::optional<ByteImage> mask;
      try {
        mask = reader.mask(index, frame_id);
      } catch (const DataError&) {
        mask.reset();  // the findings say so
      }
      if (image) {
        const std::string bytes =
            image_bytes(thumbnail(*image, mask, 320), ImageFormat::Jpeg, {.quality = 75});
        picture = formatted(
                      "<image width=\"%d\" height=\"%d\" preserveAspectRatio=\"none\" "
                      "href=\"data:image/jpeg;base64,",
                      camera.width, camera.height) +
                  base64_text(std::as_bytes(std::span(bytes))) + "\"/>\n";
      }
    } catch (const DataError& error) {
      picture = label(camera.width * 0.5, camera.height * 0.5, "damaged", "middle", "#fff");
    }
    const double unit = std::max(camera.width, camera.height) / 320.0;  // px of the page
    std::string marks;
    if (seen && dataset.calibrated && source && *source != c) {
      const Keypoints2d& rows = keypoints.detections[f][*source];
      marks += polyline(
          epipolar_line(dataset.cameras[*source], rows.row(nose).head<2>().transpose(), camera),
          "#ffffff", 0.9 * unit);
    }
    if (placed) {
      const SpacePose& pose = keypoints.found.frames[f];
      for (const auto& [a, b] : skeleton_lines(*schema, SkeletonDetail::Limbs)) {
        const SpacePoint& begin = pose.points[static_cast<std::size_t>(a)];
        const SpacePoint& end = pose.points[static_cast<std::size_t>(b)];
        if (begin.confidence <= 0 || end.confidence <= 0) {
          continue;
        }
        const auto from = project(camera, begin.place);
        const auto to = project(camera, end.place);
        if (from && to) {
          marks += line(from->x(), from->y(), to->x(), to->y(),
                        side_colour(schema->points[static_cast<std::size_t>(b)]), 1.8 * unit);
        }
      }
    }
    if (seen) {
      const Keypoints2d& rows = keypoints.detections[f][c];
      for (Index k = 0; k < rows.rows(); ++k) {
        if (rows(k, 2) > 0.3) {
          marks += formatted(
              "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%.2f\" fill=\"none\" stroke=\"#3dff8b\" "
              "stroke-width=\"%.2f\"/>\n",
              rows(k, 0), rows(k, 1), 2.6 * unit, 1.1 * unit);
        }
      }
    }
    html += "<figure class=\"view\">";
    html += formatted(
        "<svg viewBox=\"0 0 %d %d\" xmlns=\"http://www.w3.org/2000/svg\">"
        "<rect width=\"100%%\" height=\"100%%\" fill=\"#444\"/>\n",
        std::max(camera.width, 1), std::max(camera.height, 1));
    html += picture;
    html += marks;
    html += "</svg><figcaption style=\"color:";
    html += colour_of(camera.id, findings);
    html += "\">";
    html += html_text(camera.id);
    html += picture.empty() ? " (no image)" : "";
    html += "</figcaption></figure>\n";
  }
  return html;
}

}  // namespace atelier
