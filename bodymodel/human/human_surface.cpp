#include "bodymodel/human/human_surface.h"

#include <algorithm>
#include <cmath>

#include "bodymodel/human/human_head.h"

namespace atelier {
namespace {

constexpr auto kHeadPart = static_cast<std::size_t>(HumanPart::Head);

const HumanTube& tube_of(const HumanAnatomy& anatomy, std::size_t part) {
  return part == 0 ? anatomy.trunk : part == 1 ? anatomy.leg : anatomy.arm;
}

// The joint that carries a rigid block and the block's size.
Vec3d block_origin(const HumanAnatomy& anatomy, std::size_t part) {
  const HumanJoints& j = anatomy.joints;
  return part == 3 ? j.head : part == 4 ? j.wrist : Vec3d{j.ankle.x, 0, j.ankle.z};
}

double block_size(const HumanAnatomy& anatomy, std::size_t part) {
  return anatomy.build.stature * (part == 4 ? std::sqrt(anatomy.build.arm) : 1.0);
}

// Averages the shares over neighbours, so that one part gives way to the next smoothly.
void diffuse(const HumanTemplate& body, std::vector<std::array<double, kHumanParts>>& shares) {
  std::vector<std::array<double, kHumanParts>> sum(shares.size());
  std::vector<double> count(shares.size(), 0);
  for (auto& row : sum) {
    row.fill(0);
  }
  for (const auto& face : body.faces) {
    for (std::size_t c = 0; c < 3; ++c) {
      const auto a = static_cast<std::size_t>(face[c]);
      for (std::size_t other = 1; other < 3; ++other) {
        const auto b = static_cast<std::size_t>(face[(c + other) % 3]);
        for (std::size_t part = 0; part < kHumanParts; ++part) {
          sum[a][part] += shares[b][part];
        }
        ++count[a];
      }
    }
  }
  for (std::size_t v = 0; v < shares.size(); ++v) {
    for (std::size_t part = 0; part < kHumanParts; ++part) {
      shares[v][part] = 0.5 * shares[v][part] + 0.5 * sum[v][part] / count[v];
    }
  }
}

}  // namespace

HumanCoordinates human_coordinates(const HumanTemplate& body) {
  const HumanField field = human_field(human_anatomy({}));
  const HumanAnatomy& anatomy = field.anatomy;
  const std::size_t n = body.points.size();
  std::vector<std::array<double, kHumanParts>> shares(n);
  for (std::size_t v = 0; v < n; ++v) {
    const std::array<double, kHumanParts> d = part_distances(field, body.points[v]);
    const double nearest = *std::min_element(d.begin(), d.end());
    double sum = 0;
    for (std::size_t part = 0; part < kHumanParts; ++part) {
      shares[v][part] = std::exp(-(d[part] - nearest) / 0.008);
      sum += shares[v][part];
    }
    for (double& share : shares[v]) {
      share /= sum;
    }
  }
  for (int round = 0; round < 10; ++round) {
    diffuse(body, shares);
  }
  HumanCoordinates coordinates;
  coordinates.vertices.resize(n);
  for (std::size_t v = 0; v < n; ++v) {
    double sum = 0;
    for (double& share : shares[v]) {
      share = std::max(0.0, share - 0.01);
      sum += share;
    }
    for (std::size_t part = 0; part < kHumanParts; ++part) {
      HumanCoordinates::InPart& in = coordinates.vertices[v][part];
      in.weight = shares[v][part] / sum;
      if (in.weight == 0) {
        continue;
      }
      if (part >= 3) {
        in.local = body.points[v] - block_origin(anatomy, part);
        continue;
      }
      const HumanTube& tube = tube_of(anatomy, part);
      const Vec3d p = part == 0 ? with_bumps(anatomy, body.points[v], -1) : body.points[v];
      const Vec3d q = p - tube.origin;
      in.station = station_at(tube, dot(q, tube.axis));
      const HumanSection section = section_at(
          tube, std::clamp(in.station, 0.0, static_cast<double>(tube.sections.size() - 1)));
      const double a = dot(q, tube.u) - section.cu;
      const double b = dot(q, tube.v) - section.cv;
      const double r = std::hypot(a, b);
      in.cos_phi = r > 1e-9 ? a / r : 1;
      in.sin_phi = r > 1e-9 ? b / r : 0;
      in.ratio = r / section_radius(section, in.cos_phi, in.sin_phi);
    }
  }
  return coordinates;
}

std::vector<Vec3d> human_surface(const HumanTemplate& body, const HumanCoordinates& coordinates,
                                 const HumanAnatomy& anatomy) {
  const HumanAnatomy middle = human_anatomy({});
  const double middle_stature = middle.build.stature;
  std::vector<Vec3d> points(body.points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    Vec3d p = {0, 0, 0};
    for (std::size_t part = 0; part < kHumanParts; ++part) {
      const HumanCoordinates::InPart& in = coordinates.vertices[v][part];
      if (in.weight == 0) {
        continue;
      }
      if (part == kHeadPart) {
        const double k = middle_stature / 1000;
        const Vec3d at = (1 / k) * (in.local + middle.joints.head);
        const Vec3d local = k * head_of_sex(at, anatomy.build.male) - middle.joints.head;
        p += in.weight *
             (anatomy.joints.head + (block_size(anatomy, part) / middle_stature) * local);
        continue;
      }
      if (part >= 3) {
        p += in.weight * (block_origin(anatomy, part) +
                          (block_size(anatomy, part) / middle_stature) * in.local);
        continue;
      }
      const HumanTube& tube = tube_of(anatomy, part);
      const double last = static_cast<double>(tube.sections.size() - 1);
      HumanSection section = section_at(tube, std::clamp(in.station, 0.0, last));
      if (in.station < 0 || in.station > last) {
        section.s = section_at(tube, in.station).s;
      }
      const double r = in.ratio * section_radius(section, in.cos_phi, in.sin_phi);
      Vec3d q = tube.origin + section.s * tube.axis + (section.cu + r * in.cos_phi) * tube.u +
                (section.cv + r * in.sin_phi) * tube.v;
      if (part == 0) {
        q = with_bumps(anatomy, q, 1);
      }
      p += in.weight * q;
    }
    p.x = static_cast<int>(v) < body.middle ? 0 : std::max(p.x, 1e-4);
    points[v] = p;
  }
  return points;
}

}  // namespace atelier
