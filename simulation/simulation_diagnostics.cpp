#include "simulation/simulation_diagnostics.h"

#include <algorithm>
#include <cstdio>

namespace atelier {

std::vector<std::string> simulation_diagnostics(const std::vector<FrameReport>& reports,
                                                bool self_contact, const HelpfulOptions& named) {
  std::vector<std::string> diagnostics;
  if (reports.empty()) {
    return diagnostics;
  }
  const auto worst = [&](auto member) -> const FrameReport& {
    return *std::max_element(
        reports.begin(), reports.end(),
        [&](const FrameReport& a, const FrameReport& b) { return a.*member < b.*member; });
  };
  const auto flag = [&](const char* field) {
    return solver_flag(field, named.section, named.solver);
  };
  char text[320];
  constexpr double kStretched = 0.15;
  if (const FrameReport& r = worst(&FrameReport::strain_p95); r.strain_p95 > kStretched) {
    std::snprintf(
        text, sizeof text,
        "the cloth is stretched by %.0f%% (95th percentile, frame %lld), more than any fabric: its "
        "steps have not converged (more %s, a slower motion), or the body pinches it (less "
        "%s)",
        100 * r.strain_p95, static_cast<long long>(r.frame), flag("substeps").c_str(),
        named.thickness.c_str());
    diagnostics.emplace_back(text);
  }
  constexpr double kTorn = 1;  // twice as long
  if (const FrameReport& r = worst(&FrameReport::strain_max); r.strain_max > kTorn) {
    std::snprintf(text, sizeof text,
                  "an edge of the cloth is stretched by %.0f%% (frame %lld): it is caught on "
                  "something, or far softer than a fabric",
                  100 * r.strain_max, static_cast<long long>(r.frame));
    diagnostics.emplace_back(text);
  }
  constexpr double kDeep = 0.001;  // m
  if (const FrameReport& r = worst(&FrameReport::inside_depth); r.inside_depth > kDeep) {
    std::snprintf(text, sizeof text, "%d vertices are inside the body, up to %.1f mm (frame %lld)",
                  r.inside, 1e3 * r.inside_depth, static_cast<long long>(r.frame));
    diagnostics.emplace_back(text);
  }
  if (const FrameReport& r = worst(&FrameReport::body_crossings); r.body_crossings > 0) {
    std::snprintf(text, sizeof text,
                  "cloth and body pass through each other at %d edges (frame %lld), since only "
                  "vertices of the cloth collide with the body: try a finer garment or more %s",
                  r.body_crossings, static_cast<long long>(r.frame), named.thickness.c_str());
    const std::string edges = flag("body_edges");
    diagnostics.push_back(
        text + (edges.empty() ? "" : ", or " + edges + " true where the body has sharp features"));
  }
  if (const FrameReport& r = worst(&FrameReport::crossings); r.crossings > 0) {
    std::snprintf(text, sizeof text, "cloth goes through cloth at %d edges (frame %lld)",
                  r.crossings, static_cast<long long>(r.frame));
    diagnostics.emplace_back(
        text + (self_contact ? "" : ": " + flag("self_contact") + " true prevents it"));
  }
  return diagnostics;
}

}  // namespace atelier
