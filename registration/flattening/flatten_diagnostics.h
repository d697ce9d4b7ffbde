#pragma once

#include <optional>
#include <string>

#include "core/finding.h"
#include "core/io/mesh_file.h"
#include "registration/flattening/pattern_pieces.h"

namespace atelier {

/// The warning "unit-unknown" (`unit_finding`), else "size-unlikely" where the mesh is more than 5
/// m or less than 5 cm large, which no garment is: our choice. @param name  the file
std::optional<Finding> garment_size_finding(const MeshFile& file, const std::string& name);

/// The warning "body-open" where a body's surface has edges of one triangle: cloth has no side to
/// lie on there. Vertices in one place count as one. @param name  the file
std::optional<Finding> open_body_finding(const Mesh& body, const std::string& name);

/// The warning "seams-unequal" where the two sides of a seam differ by more than 0.3%, the target
/// of `flatten.seam_mismatch`. @param mismatch  the largest, share; @param name  of the garment
std::optional<Finding> seam_finding(double mismatch, const std::string& name);

/// The warning "fabric-narrow" where a piece is wider than the fabric, so that the layout is, too.
/// @param fabric_width  m, as asked for; @param name  of the garment
std::optional<Finding> fabric_finding(const PatternLayout& layout, double fabric_width,
                                      const std::string& name);

}  // namespace atelier
