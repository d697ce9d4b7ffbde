#pragma once

#include <array>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "core/mesh.h"
#include "tests/bodymodel/surface_fit.h"

namespace atelier::fixtures {

/// The average young adult of MakeHuman: base mesh plus a third of each of the three targets of one
/// sex, metres, feet on the ground. Only the skin; quads halved. A measure, never part of the
/// program.
struct MakeHumanAdult {
  Mesh mesh;
  JointHints joints;
};

inline MakeHumanAdult makehuman_adult(const std::filesystem::path& folder, bool male) {
  constexpr int kSkin = 13380;
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<int, 4>> quads;
  std::map<std::string, std::vector<int>> cubes;
  std::ifstream base(folder / "base/base.obj");
  std::string line;
  std::string group;
  while (std::getline(base, line)) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "v") {
      Eigen::Vector3d p;
      words >> p[0] >> p[1] >> p[2];
      points.push_back(p);
    } else if (word == "g") {
      words >> group;
    } else if (word == "f") {
      std::vector<int> corners;
      while (words >> word) {
        corners.push_back(std::stoi(word) - 1);
      }
      if (group == "body") {
        quads.push_back({corners[0], corners[1], corners[2], corners[3]});
      } else if (group.rfind("joint-", 0) == 0) {
        auto& cube = cubes[group.substr(6)];
        cube.insert(cube.end(), corners.begin(), corners.end());
      }
    }
  }
  for (const char* race : {"african", "asian", "caucasian"}) {
    std::ifstream target(folder / "targets/macrodetails" /
                         (std::string(race) + (male ? "-male" : "-female") + "-young.target"));
    while (std::getline(target, line)) {
      std::istringstream words(line);
      int v = 0;
      Eigen::Vector3d d;
      if (words >> v >> d[0] >> d[1] >> d[2]) {
        points[v] += d / 3;
      }
    }
  }
  double ground = std::numeric_limits<double>::infinity();
  for (int v = 0; v < kSkin; ++v) {
    ground = std::min(ground, points[v][1]);
  }
  MakeHumanAdult adult;
  for (Eigen::Vector3d& p : points) {  // decimetres
    p[1] -= ground;
    p *= 0.1;
  }
  adult.mesh.vertices.resize(kSkin, 3);
  for (int v = 0; v < kSkin; ++v) {
    adult.mesh.vertices.row(v) = points[v].transpose();
  }
  adult.mesh.faces.resize(static_cast<Index>(2 * quads.size()), 3);
  for (std::size_t q = 0; q < quads.size(); ++q) {
    const auto& c = quads[q];
    adult.mesh.faces.row(static_cast<Index>(2 * q)) << c[0], c[1], c[2];
    adult.mesh.faces.row(static_cast<Index>(2 * q + 1)) << c[0], c[2], c[3];
  }
  const auto centre = [&](const std::string& name) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    const auto& cube = cubes.at(name);
    for (int v : cube) {
      sum += points[v];
    }
    return Eigen::Vector3d(sum / static_cast<double>(cube.size()));
  };
  const char* fingers[] = {"thumb", "index", "middle", "ring", "pinky"};
  for (const char* side : {"l", "r"}) {
    const std::string theirs = std::string(side) + "-";
    const std::string ours = *side == 'l' ? "left_" : "right_";
    const std::pair<const char*, const char*> names[] = {
        {"upper-leg", "hip"},     {"knee", "knee"},   {"ankle", "ankle"},
        {"shoulder", "shoulder"}, {"elbow", "elbow"}, {"hand", "wrist"}};
    for (const auto& [their_name, our_name] : names) {
      adult.joints[ours + our_name] = centre(theirs + their_name);
    }
    for (int f = 0; f < 5; ++f) {
      for (int i = 1; i <= 3; ++i) {
        adult.joints[ours + fingers[f] + std::to_string(i)] =
            centre(theirs + "finger-" + std::to_string(f + 1) + "-" + std::to_string(i));
      }
    }
  }
  return adult;
}

}  // namespace atelier::fixtures
