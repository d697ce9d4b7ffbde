#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/finding.h"
#include "core/limits.h"

namespace atelier {

/// Metadata of an SVG drawing; of its content only the numbers are checked.
struct SvgDrawing {
  std::string width;             ///< as it stands there, "210mm"; "" where it is not said
  std::string height;            ///< the same
  std::vector<double> view_box;  ///< left, top, width, height in its own units; empty if not said
  std::int64_t elements = 0;     ///< the root counted
  std::vector<Finding> findings;
};

/// Reads an SVG whole, as XML (core/io/xml_elements.h). Throws DataError, with the line, for what
/// is no well-formed XML with the root `<svg>`, for sizes that are no finite lengths of 0 or more,
/// and for a viewBox of other than four finite numbers, width and height 0 or more
/// (SVG 1.1, 7.2, 7.7). Findings: a root that is not in SVG's name space, which browsers do not
/// draw, and numbers of shapes that are not finite, behind which programs draw no further.
SvgDrawing parse_svg(std::string_view text, const std::string& file = "",
                     const Limits& limits = {});

/// Metadata of a DXF drawing.
struct DxfDrawing {
  std::string version;  ///< "AC1009"; "" where it is not said
  std::string unit;     ///< "mm"; "" where it is not said
  std::vector<std::string> sections;
  std::map<std::string, std::int64_t> entities;  ///< how many of each type are drawn
};

/// Reads a text DXF whole (AutoCAD's reference, "ASCII DXF files"): pairs of a group code and a
/// value, a line each; sections from "0 SECTION" and their name to "0 ENDSEC"; "0 EOF" at the end.
/// Throws DataError, with the line, for anything else, for binary DXF, for codes outside of -5 to
/// 1071, and for values that are no finite number where their code says that they are numbers.
DxfDrawing parse_dxf(std::string_view text, const std::string& file = "",
                     const Limits& limits = {});

}  // namespace atelier
