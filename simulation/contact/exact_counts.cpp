#include "simulation/contact/exact_counts.h"

#include "core/depths_inside.h"
#include "simulation/contact/crossings.h"
#include "simulation/contact/min_gap.h"

namespace atelier {

FrameReport with_exact_counts(FrameReport report, const CountedCloth& cloth,
                              const Points& positions, const Control& control) {
  report.crossings = count_crossings(positions, cloth.faces);
  if (cloth.self_thickness > 0) {
    report.self_gap = report.crossings > 0 ? 0
                                           : min_gap(positions, cloth.faces, cloth.self_thickness,
                                                     {&cloth.rest_positions, &cloth.layer});
  }
  if (control.body_end.rows() > 0 && cloth.body_faces.rows() > 0) {
    report.body_crossings =
        count_crossings(positions, cloth.faces, control.body_end, cloth.body_faces);
    const Eigen::VectorXd depths =
        depths_inside(positions, control.body_end, cloth.body_faces, cloth.thickness);
    report.inside = static_cast<int>((depths.array() > 0).count());
    report.inside_depth = depths.maxCoeff();
    if (cloth.thickness > 0) {
      report.body_gap = report.inside > 0 || report.body_crossings > 0
                            ? 0
                            : min_gap(positions, cloth.faces, control.body_end, cloth.body_faces,
                                      cloth.thickness);
    }
  }
  return report;
}

}  // namespace atelier
