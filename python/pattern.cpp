#include <optional>

#include "core/topology.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/checks.h"
#include "python/options.h"
#include "python/signals.h"
#include "registration/drafting/draft_pattern.h"
#include "registration/flattening/find_seams.h"
#include "registration/flattening/flat_pattern.h"
#include "registration/flattening/pattern_pieces.h"

ATELIER_OPTIONS(FindSeamsOptions);
ATELIER_OPTIONS(FlattenOptions);
ATELIER_OPTIONS(PatternPieceOptions);

namespace atelier::python {
namespace {

using namespace py::literals;

/// Throws DataError unless there is a flag for each edge of a sound mesh.
void require_flags(const Mesh& mesh, const std::string& where, const std::vector<char>& flags) {
  require_faces(mesh.faces, mesh.vertices.rows());
  const Index edges = topology_of(mesh.faces, mesh.vertices.rows()).edges.rows();
  require_rows(where, static_cast<Index>(flags.size()), edges, "edges of the mesh (edges_of)");
}

FoundSeams found_seams(const Mesh& mesh, const std::vector<char>& given,
                       const FindSeamsOptions& options, const py::object& say) {
  const LongCall released;
  const SeamWatch watch = [&](const std::string& line) {
    const py::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() != 0) {
      throw py::error_already_set();
    }
    if (!say.is_none()) {
      say(line);
    }
  };
  if (!given.empty()) {
    require_flags(mesh, "given", given);
    return find_seams(mesh, given, options, watch);
  }
  require_faces(mesh.faces, mesh.vertices.rows());
  const Index edges = topology_of(mesh.faces, mesh.vertices.rows()).edges.rows();
  return find_seams(mesh, std::vector<char>(static_cast<std::size_t>(edges)), options, watch);
}

void bind_seams(py::module_& module) {
  py::class_<FoundSeams> found(module, "FoundSeams", "Result of the seam search.");
  array_field<&FoundSeams::cut>(found, "cut", "[E] 1 for edges (edges_of) to cut");
  found.def_readonly("reached", &FoundSeams::reached, "within the bound, no panel overlaps itself");
  found.def_readonly("added", &FoundSeams::added);
  found.def_readonly("joined", &FoundSeams::joined);
  module.def("check_flattenable", &check_flattenable, "mesh"_a, "file"_a = "",
             "Raises DataError unless the surface can be cut and laid flat.");
  module.def(
      "find_seams", &found_seams, "mesh"_a, "given"_a = py::none(), "options"_a = py::none(),
      "say"_a = py::none(),
      "Seams and darts for a surface of E edges (edges_of): a search for few cuts that keep the "
      "stretch of the flat panels within the options' bound. `given` [E] has 1 for edges that are "
      "cut anyway; `say` is called with a line after each cut.");
}

void bind_flat(py::module_& module) {
  py::class_<SurfaceCut> cut(module, "SurfaceCut", "The same faces over more vertices, in panels.");
  array_field<&SurfaceCut::faces>(cut, "faces", "[F,3] into the cut vertices");
  array_field<&SurfaceCut::source>(cut, "source", "[C] vertex of the whole surface");
  array_field<&SurfaceCut::panels>(cut, "panels", "[F] panel of each face");
  cut.def_readonly("panel_count", &SurfaceCut::panel_count);
  py::class_<FlatSeam> seam(module, "FlatSeam", "Two runs of the panels' edges, sewn together.");
  seam.def_readonly("name", &FlatSeam::name);
  seam.def_readonly("panel_a", &FlatSeam::panel_a);
  seam.def_readonly("panel_b", &FlatSeam::panel_b);
  array_field<&FlatSeam::a>(seam, "a", "flat vertices");
  array_field<&FlatSeam::b>(seam, "b", "b[i] is sewn to a[i]");
  py::class_<FlatPattern> pattern(module, "FlatPattern",
                                  "A surface in flat panels at true scale, warp along +y.");
  pattern.def_property_readonly(
      "cut", [](FlatPattern& self) -> SurfaceCut& { return self.cut; },
      py::return_value_policy::reference_internal);
  array_field<&FlatPattern::vertices>(pattern, "vertices", "[C,2] m");
  pattern.def_readonly("panel_names", &FlatPattern::panel_names);
  list_of_copies<&FlatPattern::seams>(pattern, "seams");
  array_field<&FlatPattern::overlapping>(pattern, "overlapping", "panels that lie over themselves");
  array_field<&FlatPattern::not_converged>(pattern, "not_converged");
  module.def(
      "flatten_surface",
      [](const Mesh& mesh, const std::vector<char>& flags, const FlattenOptions& options) {
        require_flags(mesh, "cut", flags);
        return flatten_surface(mesh, flags, options);
      },
      "mesh"_a, "cut"_a, "options"_a = py::none(), py::call_guard<LongCall>(),
      "Lays the panels of a cut surface flat, at true scale and with as little stretch as they "
      "allow; `cut` [E] has 1 for edges (edges_of) to cut. Raises DataError for panels that cannot "
      "be laid flat.");
  py::class_<FlatMeasures> measures(module, "FlatMeasures",
                                    "How far a flat pattern is from its surface.");
  array_field<&FlatMeasures::stretches>(measures, "stretches",
                                        "[F,2] principal stretches, curved over flat");
  array_field<&FlatMeasures::strain>(measures, "strain", "[F] the larger of |stretch - 1|");
  measures.def_readonly("strain_p50", &FlatMeasures::strain_p50);
  measures.def_readonly("strain_p95", &FlatMeasures::strain_p95);
  measures.def_readonly("strain_p99", &FlatMeasures::strain_p99);
  measures.def_readonly("strain_max", &FlatMeasures::strain_max);
  measures.def_readonly("area_ratio", &FlatMeasures::area_ratio);
  measures.def_readonly("seam_mismatch", &FlatMeasures::seam_mismatch);
  measures.def_readonly("seam_length", &FlatMeasures::seam_length, "m");
  measures.def_readonly("inverted", &FlatMeasures::inverted, "faces turned over");
  measures.def_readonly("overlaps", &FlatMeasures::overlaps);
  module.def("measure_flat", &measure_flat, "mesh"_a, "pattern"_a, py::call_guard<LongCall>(),
             "Stretch, area, seams and overlaps of a flat pattern beside the surface [V,3] m.");
  module.def(
      "garment_of",
      [](const Mesh& mesh, const FlatPattern& flat) { return garment_of(mesh, flat); }, "mesh"_a,
      "pattern"_a, py::call_guard<LongCall>(),
      "The surface as a garment whose rest shape is the flat pattern.");
}

void bind_pieces(py::module_& module) {
  py::class_<PatternPiece> piece(module, "PatternPiece", "A panel as a pattern maker draws it.");
  piece.def_readonly("name", &PatternPiece::name);
  array_field<&PatternPiece::sew_line>(piece, "sew_line", "[N,2] m, closed");
  array_field<&PatternPiece::cut_line>(piece, "cut_line", "[N,2] m, with seam allowance");
  py::class_<PatternLayout> layout(module, "PatternLayout", "Pieces on a strip of fabric.");
  list_of_copies<&PatternLayout::pieces>(layout, "pieces");
  layout.def_readonly("width", &PatternLayout::width, "m");
  layout.def_readonly("length", &PatternLayout::length, "m that is used");
  layout.def_readonly("seam_mismatch", &PatternLayout::seam_mismatch);
  module.def("lay_out_pattern", &lay_out_pattern, "pattern"_a, "options"_a = py::none(),
             py::call_guard<LongCall>(),
             "Panels with seam allowance, notches and grain lines on a strip of fabric.");
  module.def("pattern_svg", &pattern_svg, "layout"_a, "title"_a, "SVG at true scale.");
  module.def("pattern_dxf", &pattern_dxf, "layout"_a, "title"_a, "ASCII DXF R12, AAMA's layers.");
}

}  // namespace

void bind_pattern(py::module_& module) {
  ATELIER_OPTIONS_CLASS(FindSeamsOptions);
  ATELIER_OPTIONS_CLASS(FlattenOptions);
  ATELIER_OPTIONS_CLASS(PatternPieceOptions);
  bind_seams(module);
  bind_flat(module);
  bind_pieces(module);
}

}  // namespace atelier::python
