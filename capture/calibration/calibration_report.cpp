#include "capture/calibration/calibration_report.h"

#include <cstdarg>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

namespace atelier {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kLensNames[] = {"fx", "fy", "cx", "cy"};

__attribute__((format(printf, 1, 2))) std::string text_of(const char* format, ...) {
  char text[512];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
}

Json json_of(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

const char* model_name(Distortion model) {
  return model == Distortion::Brown ? "brown" : model == Distortion::Fisheye ? "fisheye" : "none";
}

/// Reasons with the numbers taken out, so that alike ones are counted together.
std::string kind_of(const std::string& why) {
  std::string kind;
  for (const char c : why) {
    const bool digit = (c >= '0' && c <= '9') || c == '.';
    if (!digit) {
      kind += c;
    } else if (kind.empty() || kind.back() != '#') {
      kind += '#';
    }
  }
  return kind;
}

}  // namespace

std::string calibration_text(const Calibration& calibration) {
  std::string text;
  for (std::size_t c = 0; c < calibration.cameras.size(); ++c) {
    const Camera& camera = calibration.cameras[c];
    const CameraQuality& q = calibration.quality[c];
    if (!q.in_rig) {
      text += text_of("%-12s not in the rig; the board in %d images\n", camera.id.c_str(),
                      q.views_seen);
      continue;
    }
    text += text_of(
        "%-12s %-8s fx %.2f +- %.2f  fy %.2f +- %.2f  cx %.2f +- %.2f  cy %.2f +- %.2f\n",
        camera.id.c_str(), q.lens.c_str(), camera.fx, q.lens_deviation[0], camera.fy,
        q.lens_deviation[1], camera.cx, q.lens_deviation[2], camera.cy, q.lens_deviation[3]);
    text +=
        text_of("%-12s %d of %d views, %d %s: rms %.3f px, p95 %.3f px; coverage %.0f%%", "",
                q.views_used, q.views_seen, q.corners,
                calibration.points > 0 ? "keypoints" : "corners", q.rms, q.p95, 100 * q.coverage);
    const Eigen::Vector3d centre = camera_center(camera);
    text += calibration.lenses_alone
                ? std::string("\n")
                : text_of("; at (%.3f, %.3f, %.3f) m +- %.1f mm, %.3f mrad\n", centre.x(),
                          centre.y(), centre.z(), 1e3 * q.centre_deviation.norm(),
                          1e3 * q.rotation_deviation.norm());
  }
  text += text_of("all: rms %.3f px, p95 %.3f px", calibration.rms, calibration.p95);
  if (calibration.points > 0) {
    text += text_of(" over %d places", calibration.points);
  } else if (!calibration.lenses_alone) {
    text += text_of(" over %zu boards", calibration.world_from_board.size());
  }
  text += calibration.converged ? "\n" : "; it did NOT converge\n";
  std::map<std::string, std::map<std::string, int>> reasons;
  for (const RejectedView& view : calibration.rejected) {
    reasons[kind_of(view.why)][view.camera_id] += 1;
  }
  for (const auto& [why, cameras] : reasons) {
    text += "left out: " + why + ":";
    for (const auto& [camera, count] : cameras) {
      text += " " + camera + " " + std::to_string(count);
    }
    text += "\n";
  }
  for (const Finding& finding : calibration.findings) {
    text += to_string(finding) + "\n";
  }
  return text;
}

std::string calibration_json(const Calibration& calibration) {
  Json root = {{"schema", "atelier-calibration"},
               {"version", 1},
               {"rms_px", calibration.rms},
               {"p95_px", calibration.p95},
               {"sigma_px", calibration.sigma},
               {"converged", calibration.converged},
               {"lenses_alone", calibration.lenses_alone},
               {"boards", calibration.world_from_board.size()},
               {"points", calibration.points}};
  Json cameras = Json::array();
  for (std::size_t c = 0; c < calibration.cameras.size(); ++c) {
    const Camera& camera = calibration.cameras[c];
    const CameraQuality& q = calibration.quality[c];
    Json one = {{"id", camera.id},
                {"in_rig", q.in_rig},
                {"views_seen", q.views_seen},
                {"views_used", q.views_used},
                {"corners", q.corners},
                {"lens", q.lens}};
    if (q.in_rig) {
      one["rms_px"] = q.rms;
      one["p95_px"] = q.p95;
      one["coverage"] = q.coverage;
      const LensNumbers lens = lens_of(camera);
      for (int i = 0; i < 4; ++i) {
        one["intrinsics"][kLensNames[i]] = {{"value", lens[i]}, {"deviation", q.lens_deviation[i]}};
      }
      one["distortion_model"] = model_name(camera.distortion_model);
      one["distortion"] = Json::array();
      for (int i = 4; i < 12; ++i) {
        one["distortion"].push_back({{"value", lens[i]}, {"deviation", q.lens_deviation[i]}});
      }
      one["centre_m"] = json_of(camera_center(camera));
      one["centre_deviation_m"] = json_of(q.centre_deviation);
      one["rotation_deviation_rad"] = json_of(q.rotation_deviation);
    }
    if (!q.candidates.empty()) {
      one["information_criterion"] = q.candidates;
    }
    cameras.push_back(one);
  }
  root["cameras"] = cameras;
  root["rejected"] = Json::array();
  for (const RejectedView& view : calibration.rejected) {
    root["rejected"].push_back(
        {{"camera", view.camera_id}, {"frame", view.frame_id}, {"why", view.why}});
  }
  root["findings"] = Json::array();
  for (const Finding& finding : calibration.findings) {
    root["findings"].push_back({{"severity", severity_name(finding.severity)},
                                {"code", finding.code},
                                {"place", finding.place},
                                {"what", finding.what},
                                {"advice", finding.advice},
                                {"setting", finding.setting}});
  }
  return root.dump(1);
}

}  // namespace atelier
