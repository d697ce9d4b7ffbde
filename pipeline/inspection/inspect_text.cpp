// Texts that other programs open and Atelier writes.

#include <algorithm>
#include <limits>

#include "core/error.h"
#include "core/io/drawing_text.h"
#include "core/io/file_bytes.h"
#include "core/io/page_text.h"
#include "core/io/table_text.h"
#include "core/io/text_scanner.h"
#include "core/io/usd_stage.h"
#include "core/io/usd_text.h"
#include "core/limits.h"
#include "pipeline/inspection/inspection.h"

namespace atelier {
namespace {

void add_if_said(const char* name, const std::string& value, Inspection& inspection) {
  if (!value.empty()) {
    inspection.add(name, value);
  }
}

void add_if_said(const char* name, const std::optional<double>& value, const char* unit,
                 Inspection& inspection) {
  if (value) {
    inspection.add(name, *value, unit);
  }
}

}  // namespace

void inspect_svg(const std::filesystem::path& path, Inspection& inspection) {
  const SvgDrawing drawing =
      parse_svg(read_file_text(path, Limits{}.text_file_bytes), path.string());
  inspection.add("kind", "drawing, SVG");
  add_if_said("width", drawing.width, inspection);
  add_if_said("height", drawing.height, inspection);
  if (!drawing.view_box.empty()) {
    inspection.add("view box", drawing.view_box);
  }
  inspection.add("elements", drawing.elements);
  inspection.findings = drawing.findings;
}

void inspect_dxf(const std::filesystem::path& path, Inspection& inspection) {
  const DxfDrawing drawing =
      parse_dxf(read_file_text(path, Limits{}.motion_file_bytes), path.string());
  inspection.add("kind", "drawing, DXF");
  add_if_said("version", drawing.version, inspection);
  inspection.add("unit", drawing.unit.empty() ? "the file does not say" : drawing.unit);
  inspection.add("sections", drawing.sections);
  for (const auto& [type, count] : drawing.entities) {
    inspection.add_member(type, count);
  }
}

namespace {

// What the meshes are that a layer has, beside what is said of it already.
void add_meshes_of_layer(const std::filesystem::path& path, Inspection& inspection) {
  Inspection meshes;
  try {
    inspect_usd_mesh(path, meshes);
  } catch (const DataError& error) {  // a layer may be sound and hold none to be seen
    inspection.findings.push_back(
        {Severity::Warning, "usd-mesh", error.where, error.found, error.expected});
    return;
  }
  for (Inspection::Fact& fact : meshes.facts) {
    const bool known = std::any_of(inspection.facts.begin(), inspection.facts.end(),
                                   [&](const auto& one) { return one.name == fact.name; });
    if (!known) {
      inspection.facts.push_back(std::move(fact));
    }
  }
  inspection.findings.insert(inspection.findings.end(), meshes.findings.begin(),
                             meshes.findings.end());
}

}  // namespace

void inspect_usda(const std::filesystem::path& path, Inspection& inspection) {
  const std::string text = read_file_text(path, Limits{}.mesh_file_bytes);
  const UsdLayer layer = parse_usda(text, path.string());
  inspection.add("kind", "scene, USD text");
  if (layer.metres_per_unit) {
    inspection.add("metres per unit", *layer.metres_per_unit);
  } else {
    inspection.add("metres per unit", "0.01: the file does not say, and USD means so");
  }
  inspection.add("up axis", layer.up_axis.empty() ? "Y: the file does not say, and USD means so"
                                                  : layer.up_axis);
  add_if_said("fps", layer.fps, "1/s", inspection);
  add_if_said("first frame", layer.first_frame, "", inspection);
  add_if_said("last frame", layer.last_frame, "", inspection);
  inspection.add("prims", layer.prims);
  inspection.findings = layer.findings;
  const std::vector<UsdPrim> prims = read_usda_stage(text, path.string()).prims;
  if (std::any_of(prims.begin(), prims.end(), [](const UsdPrim& prim) {
        return prim.type == "Mesh" && prim.attributes.contains("points");
      })) {
    add_meshes_of_layer(path, inspection);
  }
}

void inspect_usd(const std::filesystem::path& path, Inspection& inspection) {
  constexpr std::string_view kText = "#usda";
  const FileStart start =
      read_file_start(path, kText.size(), std::numeric_limits<std::int64_t>::max());
  if (as_text(start.bytes) == kText) {
    inspect_usda(path, inspection);
  } else {
    inspect_usd_mesh(path, inspection);
  }
}

void inspect_page(const std::filesystem::path& path, Inspection& inspection) {
  const HtmlPage page = parse_html(read_file_text(path, Limits{}.motion_file_bytes), path.string());
  inspection.add("kind", "page, HTML");
  add_if_said("title", page.title, inspection);
}

void inspect_table(const std::filesystem::path& path, Inspection& inspection) {
  const CsvTable table = parse_csv(read_file_text(path, Limits{}.text_file_bytes), path.string());
  inspection.add("kind", "table, CSV");
  inspection.add("rows", table.rows);
  inspection.add("columns", table.columns);
  inspection.findings = table.findings;
}

void inspect_json_lines(const std::filesystem::path& path, Inspection& inspection) {
  const JsonLines lines =
      parse_json_lines(read_file_text(path, Limits{}.text_file_bytes), path.string());
  inspection.add("kind", "JSON, a value each line");
  inspection.add("lines", lines.lines);
  inspection.findings = lines.findings;
}

}  // namespace atelier
