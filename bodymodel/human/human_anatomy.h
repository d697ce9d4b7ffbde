#pragma once

#include <array>
#include <vector>

#include "core/vec.h"

namespace atelier {

/// Cross-section of a tube of the body: centre and half-widths in four directions, joined by
/// superellipse quadrants |u/U|^n + |v/V|^n = 1 that meet with one tangent.
struct HumanSection {
  double s;       ///< along the tube's axis
  double cu, cv;  ///< centre of the section
  double pu, mu;  ///< half-widths towards +u and -u
  double pv, mv;  ///< half-widths towards +v and -v
  double np, nm;  ///< exponents of the +v and the -v side: 2 is an ellipse, more is boxier
};

/// A straight axis with cross-sections along it, metres. The trunk and neck, one leg, one arm.
struct HumanTube {
  Vec3d origin, axis, u, v;            ///< right-handed or not: only u, v orthogonal to axis matter
  std::vector<HumanSection> sections;  ///< s increasing
};

/// A soft swelling (or, with negative height, a groove) of the trunk's front or back, metres.
struct HumanBump {
  double x, y;              ///< centre; mirrored to -x
  double sx, above, below;  ///< widths of the Gaussian: sideways, above and below the centre
  double height;            ///< towards the front, or the back
  bool front;
};

/// Segment of a finger, toe or other blob: a cone with round ends.
struct HumanCone {
  Vec3d a, b;
  double ra, rb;
};

/// Where the joints of the left half and the middle are, metres, neutral A-pose, ground at y = 0.
struct HumanJoints {
  Vec3d pelvis, spine1, spine2, spine3, neck, head, jaw, eye;
  Vec3d hip, knee, ankle, toes;
  Vec3d collar, shoulder, elbow, wrist;
  std::array<std::array<Vec3d, 4>, 5> fingers;  ///< thumb, index, middle, ring, little: three
                                                ///< joints and the tip
};

/// How a build differs from average proportions: factors on lengths and half-widths, 1 is average.
struct HumanBuild {
  double male = 0.5;     ///< 0 female tables, 1 male tables, between: mixed
  double stature = 1.7;  ///< metres; what every table is a share of
  double leg = 1, torso = 1, neck_length = 1, arm = 1;  ///< lengths
  double shoulder = 1;                                  ///< breadth between the shoulder joints
  double neck = 1, chest = 1, waist = 1, hip = 1, thigh = 1, upper_arm = 1;  ///< half-widths
  double fullness = 1;  ///< half-widths where no girth is taken: calf, forearm, between the girths
};

/// A body's anatomy: everything that its surface is made from.
struct HumanAnatomy {
  HumanBuild build;
  HumanJoints joints;
  HumanTube trunk, leg, arm;
  std::vector<HumanBump> bumps;
};

/// The anatomy of a build. Source of each table: see the .cpp.
HumanAnatomy human_anatomy(const HumanBuild& build);

/// Section of a tube at station coordinate `tau` in [0, stations - 1] (cubic between stations,
/// constant slope outside).
HumanSection section_at(const HumanTube& tube, double tau);

/// Station coordinate of the place `s` along the axis.
double station_at(const HumanTube& tube, double s);

/// Distance from the section's centre to its outline at the angle `phi` from u towards v.
double section_radius(const HumanSection& section, double cos_phi, double sin_phi);

/// Height of all bumps of one side at a point of the trunk.
double bump_height(const HumanAnatomy& anatomy, double x, double y, bool front);

}  // namespace atelier
