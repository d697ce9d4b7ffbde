#pragma once

#include <array>
#include <string>
#include <vector>

#include "bodymodel/human/human_field.h"

namespace atelier {

/// The left half of the default human's surface at the middle build: what `polygonise_human` made
/// once and for all, so that every build of the program has the same vertices and triangles.
/// Vertices of the middle plane (x = 0) come first.
struct HumanTemplate {
  int middle = 0;                         ///< vertices with x = 0
  std::vector<Vec3d> points;              ///< metres
  std::vector<std::array<int, 3>> faces;  ///< counter-clockwise from outside
};

/// The committed template. Cost: 5 ms.
HumanTemplate human_template();

/// The template with the skin round triangles that cross smoothed until none does, as in the crease
/// between two toes, where triangles are larger than the gap. Throws LogicError if 100 rounds are
/// not enough.
HumanTemplate without_crossings(HumanTemplate body);

/// Computes the template from the field (about a minute). The committed file is its output, written
/// by `human_template_source`; scripts/human-template does both.
HumanTemplate make_human_template();

/// SHA-256, in hexadecimal digits, of the template that the same code makes of the same field with
/// much larger triangles, in half a second: another one as soon as anatomy, field, edge lengths or
/// polygoniser are others. The committed template keeps that of the sources that made it.
std::string human_template_draft();

/// The text of bodymodel/human/human_template_data.cpp for a template and the draft that belongs to
/// it.
std::string human_template_source(const HumanTemplate& body, const std::string& draft);

/// The committed numbers (see human_template_data.cpp): vertices in steps of 20 micrometres, faces
/// as differences to the corner before.
struct HumanTemplateData {
  int middle;
  int vertices;
  int faces;
  const int* points;   ///< [3 vertices]
  const int* corners;  ///< [3 faces]
  const char* draft;   ///< human_template_draft() when it was made
};
HumanTemplateData human_template_data();

}  // namespace atelier
