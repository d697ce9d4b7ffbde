#include "pipeline/synthesis/synthetic_look.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "bodymodel/human/synthetic_head.h"
#include "bodymodel/kinematics.h"
#include "capture/atlas.h"
#include "core/parallel.h"
#include "core/smooth_step.h"

namespace atelier {
namespace {

using Color = Eigen::Vector3f;

Color mixed(const Color& a, const Color& b, double share) {
  return a + static_cast<float>(std::clamp(share, 0.0, 1.0)) * (b - a);
}

/// Albedos of skin from fair to dark, linear RGB (after measured reflectances of forearms).
Color skin_tone(Random random) {
  const Color fair(0.62F, 0.40F, 0.30F);
  const Color tan(0.45F, 0.26F, 0.17F);
  const Color dark(0.16F, 0.085F, 0.055F);
  const double t = uniform(random);
  return t < 0.55 ? mixed(fair, tan, t / 0.55) : mixed(tan, dark, (t - 0.55) / 0.45);
}

/// Places that a painter of skin knows: of the head, and the girdle's heights.
struct Painter {
  HeadPlaces head;
  double waist = 0, hip = 0, crotch = 0, chest = 0, shoulder = 0, half_width = 0;
  Color tone, cloth, iris;
  bool top = true;
  std::uint64_t seed = 0;

  Color at(const Eigen::Vector3d& p) const {
    const double broad = value_noise(p.x() * 14, p.y() * 14, p.z() * 14, seed + 1);
    const double fine = value_noise(p.x() * 260, p.y() * 260, p.z() * 260, seed + 2);
    const double speck = value_noise(p.x() * 420, p.y() * 420, p.z() * 420, seed + 3);
    Color color = tone * static_cast<float>(1 + 0.07 * broad + 0.02 * fine);
    color.x() *= static_cast<float>(1 + 0.03 * broad);
    if (speck > 0.75) {
      color *= static_cast<float>(1 - 0.9 * (speck - 0.75));  // freckles
    }
    paint_face(color, p);
    // Roots of hair through the scalp, so that the hairline is no edge.
    if (p.y() > head.joint.y() - 0.05) {
      const double root = value_noise(p.x() * 500, p.y() * 120, p.z() * 500, seed + 4);
      const double roots = smooth_step(above_hairline(head, p) + 0.006 * root, 0.000, 0.013);
      color = mixed(color, 0.8F * head.hair, 0.9 * roots);
    }
    // Tight clothing: shorts, and a top for who wears one.
    const bool trunk = std::abs(p.x()) < half_width;
    const bool shorts =
        std::abs(p.x()) < 1.5 * half_width && p.y() < waist - 0.02 && p.y() > crotch - 0.09;
    const double neckline = shoulder - 0.05 - 0.5 * std::abs(p.x());
    const bool shirt = top && trunk && p.y() > waist + 0.09 && p.y() < neckline + 0.05;
    if (shorts || shirt) {
      color = cloth * static_cast<float>(1 + 0.10 * fine + 0.08 * speck);
    }
    return color;
  }

  void paint_face(Color& color, const Eigen::Vector3d& p) const {
    const double unit = head.eye_distance / 2;
    const Eigen::Vector3d q = (p - head.eyes) / unit;  // x left, y up; eyes at (+-1, 0)
    if (std::abs(q.x()) > 3 || std::abs(q.y()) > 4 || p.z() < head.eyes.z() - 0.02) {
      return;
    }
    const double x = std::abs(q.x());
    // Cheeks and the tip of the nose are redder.
    const double cheek =
        std::exp(-(std::pow((x - 1.25) / 0.7, 2) + std::pow((q.y() + 1.2) / 0.6, 2)));
    const double tip = std::exp(-(std::pow(q.x() / 0.35, 2) + std::pow((q.y() + 1.25) / 0.35, 2)));
    color = mixed(color, color.cwiseProduct(Color(1.12F, 0.82F, 0.80F)), 0.55 * cheek + 0.5 * tip);
    // Lips.
    const double lip_y = (q.y() + 2.05) / (q.y() > -2.05 ? 0.24 : 0.36);
    const double lip = 1 - std::pow(q.x() / 0.82, 2) - std::pow(lip_y, 2);
    if (lip > 0) {
      color = mixed(color, Color(0.8F * tone.x(), 0.42F * tone.y(), 0.45F * tone.z()),
                    smooth_step(lip, 0, 0.25));
      color *= static_cast<float>(1 - 0.45 * std::exp(-std::pow((q.y() + 2.05) / 0.05, 2)));
    }
    // Brows.
    const double arch = 0.66 + 0.14 * std::sin(std::numbers::pi * (x - 0.35) / 1.5);
    if (x > 0.38 && x < 1.75) {
      const double thin = 0.11 * (1 - 0.5 * (x - 0.38) / 1.4);
      const double brow = 1 - std::abs(q.y() - arch) / thin;
      color = mixed(color, 0.55F * head.hair, 0.85 * smooth_step(brow, 0, 0.6));
    }
    // Eyes: a lid line, white, iris, pupil.
    const double ex = (x - 1) / 0.47;
    const double ey = q.y() / (q.y() > 0 ? 0.21 : 0.17);
    const double eye = 1 - ex * ex - std::abs(ey);
    if (eye > -0.25) {
      const Color lid = 0.25F * tone;
      color = mixed(color, lid, 0.8 * smooth_step(eye, -0.25, 0.0));
    }
    if (eye > 0) {
      const double r = std::hypot(x - 1, q.y() - 0.02);
      Color ball(0.62F, 0.60F, 0.58F);
      if (r < 0.19) {
        ball = r < 0.085 ? Color(0.01F, 0.01F, 0.01F) : iris;
      }
      if (std::hypot(x - 1.06, q.y() - 0.09) < 0.035) {
        ball = Color(0.9F, 0.9F, 0.9F);
      }
      color = mixed(color, ball, smooth_step(eye, 0.0, 0.12));
    }
  }
};

Painter painter_of(const BodyModel& body, std::uint64_t seed) {
  Painter painter;
  painter.head = head_places(body, seed);
  painter.seed = seed;
  Random random{seed, 77};
  painter.tone = skin_tone(random);
  const Points& v = body.mesh.vertices;
  const double height = v.col(1).maxCoeff() - v.col(1).minCoeff();
  const Points joints = rest_positions(body.skeleton);
  const auto y = [&](const char* name, double share) {
    const int joint = find_joint(body.skeleton, name);
    return joint >= 0 ? joints(joint, 1) : share * height;
  };
  painter.hip = y("left_hip", 0.53);
  painter.crotch = painter.hip - 0.04 * height;
  painter.waist = painter.hip + 0.10 * height;
  painter.shoulder = y("left_shoulder", 0.81);
  painter.half_width = 0.118 * height;
  random.counter = 40;
  painter.cloth = uniform(random) < 0.5 ? Color(0.035F, 0.04F, 0.05F) : Color(0.20F, 0.21F, 0.23F);
  painter.iris = uniform(random) < 0.6 ? Color(0.07F, 0.035F, 0.015F) : Color(0.08F, 0.16F, 0.22F);
  return painter;
}

}  // namespace

Look skin_look(const BodyModel& body, Mesh& mesh, int resolution, std::uint64_t seed) {
  const Painter painter = painter_of(body, seed);
  Look look;
  look.color = Color(1, 1, 1);
  look.roughness = 0.48F;
  look.specular = 0.42F;
  if (body.mesh.uvs.rows() == 0) {
    mesh.colors.resize(body.mesh.vertices.rows(), 3);
    for (Index v = 0; v < mesh.colors.rows(); ++v) {
      mesh.colors.row(v) = painter.at(body.mesh.vertices.row(v).transpose()).transpose();
    }
    mesh.colors = mesh.colors.cwiseMax(0.0F).cwiseMin(1.0F);
    return look;
  }
  Atlas atlas = mesh_atlas(body.mesh, resolution);
  Image albedo = std::move(atlas.position);
  parallel_for(resolution, 8, [&](Index begin, Index end) {
    for (Index y = begin; y < end; ++y) {
      for (int x = 0; x < resolution; ++x) {
        const auto row = static_cast<int>(y);
        const Color color =
            painter.at({albedo.at(x, row, 0), albedo.at(x, row, 1), albedo.at(x, row, 2)});
        for (int c = 0; c < 3; ++c) {
          albedo.at(x, row, c) = std::clamp(color[c], 0.005F, 0.95F);
        }
      }
    }
  });
  look.texture = std::make_shared<const Image>(std::move(albedo));
  return look;
}

Look cloth_look(const Image& albedo, FabricKind kind) {
  Look look;
  look.color = Color(1, 1, 1);
  look.texture = std::make_shared<const Image>(albedo);
  look.roughness = 0.8F;
  look.specular = 0.25F;
  look.sheen = kind == FabricKind::Coded ? 0.05F : 0.2F;
  return look;
}

}  // namespace atelier
